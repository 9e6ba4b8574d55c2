//! The Bezier form of one polynomial segment: `d + 1` control points over `[0, 1]`.
//!
//! Every family ends here, so evaluation, derivatives, splitting, elevation and blossoms are
//! written once. All functions take the control points as a slice of at least one point.

use super::limits::DEGREE;
use super::point::Point;

/// The triangle of Pascal, correctly rounded; its sums fit 64 bits.
static BINOMIALS: [[f64; DEGREE + 1]; DEGREE + 1] = {
    let mut rows = [[0.0; DEGREE + 1]; DEGREE + 1];
    let mut row = [0u64; DEGREE + 1];
    let mut n = 0;
    while n <= DEGREE {
        let mut i = n;
        row[n] = 1;
        while i > 1 {
            i -= 1;
            row[i] += row[i - 1];
        }
        while i <= n {
            rows[n][i] = row[i] as f64;
            i += 1;
        }
        rows[n][0] = 1.0;
        n += 1;
    }
    rows
};

/// The binomial coefficients `C(n, 0) .. C(n, n)`, correctly rounded; `n <= 64`.
pub fn binomials(n: usize) -> &'static [f64] {
    &BINOMIALS[n][..=n]
}

/// The values at `u` (with `v = 1 - u`) of the `d + 1` Bernstein polynomials of degree `d`.
///
/// All terms are products of non-negative numbers: relative error O(d) units in the last place.
pub fn bernstein(degree: usize, u: f64, v: f64) -> Vec<f64> {
    let mut values = binomials(degree).to_vec();
    let (mut up, mut down) = (1.0, 1.0);
    for i in 1..=degree {
        up *= u;
        values[i] *= up;
        down *= v;
        values[degree - i] *= down;
    }
    values
}

/// One step of Horner's scheme: the sum so far and the last power of `u`, with the next control
/// point.
#[inline(always)]
pub(crate) fn step<const D: usize>(
    (sum, power): (Point<D>, f64),
    next: Point<D>,
    u: f64,
    v: f64,
) -> (Point<D>, f64) {
    let power = power * u;
    (sum * v + next * power, power)
}

/// The point at `u`, with `v = 1 - u` given by the caller, who may know it to more digits, of a
/// segment whose control points were multiplied by their binomial coefficients beforehand.
///
/// Horner's scheme in Bernstein form (Farin 2002, routine `hornbez`):
/// O(d), and as all factors are non-negative it is stable. Exact at `u = 0` and at `v = 0`.
pub fn horner<const D: usize>(scaled: &[Point<D>], u: f64, v: f64) -> Point<D> {
    scaled[1..].iter().fold((scaled[0], 1.0), |here, &next| step(here, next, u, v)).0
}

/// The point at `u` of one segment. For many points of one curve make an
/// [`Evaluator`](super::curve::Evaluator) instead.
pub fn evaluate<const D: usize>(points: &[Point<D>], u: f64) -> Point<D> {
    let unit = unit_of(super::point::magnitude(points));
    let scaled: Vec<_> = scaled(points, binomials(points.len() - 1), unit).collect();
    horner(&scaled, u, 1.0 - u) * unit
}

/// The unit in which to scale control points whose largest coordinate is this: 1, or a power of two
/// where it would overflow.
pub(crate) fn unit_of(magnitude: f64) -> f64 {
    // Horner's sums are at most 2^64 times the largest coordinate.
    if magnitude > 1e288 { 2f64.powi(66) } else { 1.0 }
}

/// The control points of a segment, times their binomial coefficients, in a unit.
pub(crate) fn scaled<const D: usize>(
    points: &[Point<D>],
    binomials: &[f64],
    unit: f64,
) -> impl Iterator<Item = Point<D>> {
    points.iter().zip(binomials).map(move |(&p, &b)| p * (1.0 / unit) * b)
}

/// The control points of the derivative with respect to the parameter of an interval of this
/// length: `d / length * (Q[i + 1] - Q[i])`. The derivative of a single point is zero.
pub fn hodograph<const D: usize>(points: &[Point<D>], length: f64) -> Vec<Point<D>> {
    if points.len() < 2 {
        return vec![Point::ZERO];
    }
    points.windows(2).map(|q| difference(q[0], q[1], points.len() - 1, length)).collect()
}

/// One control vector of the derivative.
#[inline]
pub(crate) fn difference<const D: usize>(
    p: Point<D>,
    q: Point<D>,
    degree: usize,
    length: f64,
) -> Point<D> {
    let factor = degree as f64 / length;
    // A factor may overflow where the quotient does not.
    (q - p).map(|x| if factor.is_finite() { x * factor } else { x * degree as f64 / length })
}

/// Splits at `u` by de Casteljau's algorithm: the control points of `[0, u]` and of `[u, 1]`.
/// The last point of the first half is the first of the second.
pub fn split<const D: usize>(points: &[Point<D>], u: f64) -> (Vec<Point<D>>, Vec<Point<D>>) {
    split_between(points, u, 1.0 - u)
}

/// The same with `v = 1 - u` given by the caller, who may know it to more digits.
pub(crate) fn split_between<const D: usize>(
    points: &[Point<D>],
    u: f64,
    v: f64,
) -> (Vec<Point<D>>, Vec<Point<D>>) {
    let mut right = points.to_vec();
    let mut left = Vec::with_capacity(points.len());
    for last in (0..points.len()).rev() {
        left.push(right[0]);
        for i in 0..last {
            right[i] = right[i] * v + right[i + 1] * u;
        }
    }
    (left, right)
}

/// The control points of the same curve one degree higher, as often as asked for.
pub fn elevate<const D: usize>(points: &[Point<D>], degree: usize) -> Vec<Point<D>> {
    let mut points = points.to_vec();
    while points.len() <= degree {
        let n = points.len() as f64;
        let mut higher = Vec::with_capacity(points.len() + 1);
        higher.push(points[0]);
        higher.extend(
            points.windows(2).enumerate().map(|(i, q)| q[1].lerp(q[0], (i + 1) as f64 / n)),
        );
        higher.push(points[points.len() - 1]);
        points = higher;
    }
    points
}

/// The blossom (polar form) of the segment at `d` arguments, in the segment's own parameter:
/// de Casteljau's algorithm with another argument at each step. Ramshaw 1987.
pub fn blossom<const D: usize>(
    points: &[Point<D>],
    arguments: impl IntoIterator<Item = f64>,
) -> Point<D> {
    let mut points = points.to_vec();
    for u in arguments {
        for i in 1..points.len() {
            points[i - 1] = points[i - 1].lerp(points[i], u);
        }
        if points.len() > 1 {
            points.pop();
        }
    }
    points[0]
}

/// A bound on the distance between the curve and its chord at equal parameters.
///
/// Their difference is a Bezier curve whose control points are `e_i = Q_i - (chord at i/d)`. Its
/// end points are zero, so it is at most `(1 - u^d - v^d) max |e_i|`, and so at most
/// `(1 - 2^(1-d)) max |e_i|`. Exact for degree 2.
pub fn chord_error<const D: usize>(points: &[Point<D>]) -> f64 {
    let degree = points.len() - 1;
    if degree < 2 {
        return 0.0;
    }
    let (first, last) = (points[0], points[degree]);
    let off_chord =
        |(i, &q): (usize, &Point<D>)| q.distance(first.lerp(last, i as f64 / degree as f64));
    let most = points.iter().enumerate().map(off_chord).fold(0.0, f64::max);
    most * (1.0 - 0.5f64.powi(degree as i32 - 1))
}

/// `size d! / (d - k)! (2 / length)^k`: how large a `k`-th derivative can be for points of this
/// size. Rounding errors of derivatives are measured in it. Overflows only where its value does.
#[inline]
pub(crate) fn derivative_size(size: f64, degree: usize, k: usize, length: f64) -> f64 {
    (0..k).fold(size, |size, i| size * degree.saturating_sub(i) as f64 * 2.0 / length)
}

#[cfg(test)]
mod tests {
    use super::*;

    const CUBIC: [Point<2>; 4] =
        [Point([0.0, 0.0]), Point([1.0, 3.0]), Point([4.0, 3.0]), Point([5.0, -1.0])];

    /// The cubic in its power form, written out by hand.
    fn by_hand(t: f64) -> Point<2> {
        Point([t * (3.0 + t * (6.0 - 4.0 * t)), t * (9.0 + t * (-9.0 - t))])
    }

    #[test]
    fn evaluation_agrees_with_the_power_form() {
        for i in 0..=64 {
            let t = i as f64 / 64.0;
            assert!(evaluate(&CUBIC, t).distance(by_hand(t)) < 1e-14, "t = {t}");
        }
        assert_eq!(evaluate(&CUBIC, 0.0), CUBIC[0]);
        assert_eq!(evaluate(&CUBIC, 1.0), CUBIC[3]);
    }

    #[test]
    fn hodograph_is_the_derivative_by_hand() {
        let first = hodograph(&CUBIC, 1.0);
        let t = 0.3;
        let expected = Point([3.0 + 12.0 * t - 12.0 * t * t, 9.0 - 18.0 * t - 3.0 * t * t]);
        assert!(evaluate(&first, t).distance(expected) < 1e-13);
        assert_eq!(hodograph(&CUBIC[..1], 1.0), [Point::ZERO]);
    }

    #[test]
    fn the_halves_of_a_split_run_over_the_same_curve() {
        let (left, right) = split(&CUBIC, 0.25);
        assert_eq!(left[3], right[0]);
        assert!(evaluate(&left, 0.5).distance(by_hand(0.125)) < 1e-14);
        assert!(evaluate(&right, 0.5).distance(by_hand(0.625)) < 1e-14);
    }

    #[test]
    fn elevation_keeps_the_curve() {
        let high = elevate(&CUBIC, 7);
        assert_eq!(high.len(), 8);
        assert!(evaluate(&high, 0.7).distance(by_hand(0.7)) < 1e-14);
    }

    #[test]
    fn the_blossom_is_symmetric_and_has_the_curve_on_its_diagonal() {
        assert!(blossom(&CUBIC, [0.3; 3]).distance(by_hand(0.3)) < 1e-14);
        assert!(
            blossom(&CUBIC, [0.1, 0.9, -1.0]).distance(blossom(&CUBIC, [-1.0, 0.1, 0.9])) < 1e-13
        );
    }

    #[test]
    fn chord_error_is_exact_for_parabolas_and_a_bound_for_cubics() {
        let parabola = [Point([0.0, 0.0]), Point([1.0, 2.0]), Point([2.0, 0.0])];
        assert_eq!(chord_error(&parabola), 1.0);
        let bound = chord_error(&CUBIC);
        let worst = (0..=1000)
            .map(|i| i as f64 / 1000.0)
            .map(|t| by_hand(t).distance(CUBIC[0].lerp(CUBIC[3], t)))
            .fold(0.0, f64::max);
        assert!(worst <= bound && bound < 1.5 * worst, "{worst} {bound}");
    }

    #[test]
    fn binomials_are_exact() {
        assert_eq!(binomials(4), [1.0, 4.0, 6.0, 4.0, 1.0]);
        assert_eq!(binomials(56)[28], 7648690600760440.0);
        assert_eq!(binomials(0), [1.0]);
    }
}
