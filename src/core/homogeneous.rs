//! Homogeneous coordinates: a point `P` of weight `w` is `(w P, w)`, one dimension up, where
//! rational curves and surfaces are polynomial (Farin 2002 chapter 13).
//!
//! Stable Rust cannot say `H = D + 1` in a type; a wrong pair does not compile.

use super::bezier_form::binomials;
use super::point::Point;

/// The point of this weight, one dimension up.
pub(crate) fn lifted<const D: usize, const H: usize>(p: Point<D>, weight: f64) -> Point<H> {
    const { assert!(H == D + 1) };
    Point(std::array::from_fn(|k| if k < D { p[k] * weight } else { weight }))
}

/// The weight.
#[inline]
pub(crate) fn weight<const H: usize>(h: Point<H>) -> f64 {
    h[H - 1]
}

/// `w P`, without the weight.
#[inline]
pub(crate) fn numerator<const D: usize, const H: usize>(h: Point<H>) -> Point<D> {
    const { assert!(H == D + 1) };
    Point(std::array::from_fn(|k| h[k]))
}

/// The point itself.
#[inline]
pub(crate) fn projected<const D: usize, const H: usize>(h: Point<H>) -> Point<D> {
    let w = weight(h);
    // All coordinates at once: one instruction.
    numerator(h.map(|x| x / w))
}

/// The `k`-th derivative of a rational curve, from those of `(A, w)` and its own lower ones.
///
/// With `E = A - C(t) w`, which vanishes at `t`, the quotient rule is `C^(k) = (E^(k) - sum of
/// binomial(k, i) w^(i) C^(k - i) for 0 < i < k) / w`: what is subtracted first is as large as the
/// curve is away from the origin, so the origin should be near.
#[inline]
pub(crate) fn derivative<const D: usize, const H: usize>(
    binomials: &[f64],
    lifted: impl Fn(usize) -> Point<H>,
    own: impl Fn(usize) -> Point<D>,
) -> Point<D> {
    let k = binomials.len() - 1;
    let first = numerator::<D, H>(lifted(k)) - own(0) * weight(lifted(k));
    let term = |i: usize| own(k - i) * (binomials[i] * weight(lifted(i)));
    let w = weight(lifted(0));
    (1..k).fold(first, |sum, i| sum - term(i)).map(|x| x / w)
}

/// The point and the derivatives of a rational curve at one parameter.
pub(crate) fn project_jet<const D: usize, const H: usize, const N: usize>(
    jet: [Point<H>; N],
) -> [Point<D>; N] {
    let mut found = [Point::ZERO; N];
    found[0] = projected(jet[0]);
    for k in 1..N {
        found[k] = derivative(binomials(k), |i| jet[i], |i| found[i]);
    }
    found
}

/// A bound for the distance of a rational Bezier curve with positive weights from its chord, and of
/// the chord from the curve: the largest distance of a control point from the chord.
///
/// The curve stays in the convex hull of its control points (Farin 2002 section 13.3), and the
/// distance from a segment is convex. The curve leads from end to end of the chord, so each place of
/// the chord is the foot of a place of the curve.
pub(crate) fn chord_error<const D: usize, const H: usize>(
    points: impl Iterator<Item = Point<H>> + Clone,
) -> f64 {
    let mut ends = points.clone().map(projected::<D, H>);
    let Some(first) = ends.next() else { return 0.0 };
    let last = ends.last().unwrap_or(first);
    let distance = |h: Point<H>| from_segment(projected(h), first, last);
    points.map(distance).fold(0.0, super::point::larger)
}

/// The distance of a point from a segment.
fn from_segment<const D: usize>(p: Point<D>, a: Point<D>, b: Point<D>) -> f64 {
    let (along, to) = (b - a, p - a);
    let square = along.dot(along);
    let u = if square > 0.0 { (to.dot(along) / square).clamp(0.0, 1.0) } else { 0.0 };
    (to - along * u).norm()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// `(t, t^2) / (1 + t)`, whose derivatives are known.
    #[test]
    fn the_quotient_rule_gives_known_derivatives() {
        let t = 0.75;
        let jet = [[t, t * t, 1.0 + t], [1.0, 2.0 * t, 1.0], [0.0, 2.0, 0.0], [0.0; 3]].map(Point);
        let found = project_jet::<2, 3, 4>(jet);
        // x = 1 - 1 / s and y = s - 2 + 1 / s with s = 1 + t.
        let s: f64 = 1.0 + t;
        let expected = [
            [1.0 - 1.0 / s, s - 2.0 + 1.0 / s],
            [s.powi(-2), 1.0 - s.powi(-2)],
            [-2.0 * s.powi(-3), 2.0 * s.powi(-3)],
            [6.0 * s.powi(-4), -6.0 * s.powi(-4)],
        ];
        for (p, q) in found.iter().zip(expected.map(Point)) {
            assert!(p.distance(q) <= 4.0 * f64::EPSILON * q.norm(), "{p:?} {q:?}");
        }
    }

    /// A quarter of a circle is `1 - 1 / sqrt(2)` from its chord; its control point bounds that.
    #[test]
    fn the_chord_error_bounds_a_circle() {
        let points = [([1.0, 0.0], 1.0), ([1.0, 1.0], 0.5_f64.sqrt()), ([0.0, 1.0], 1.0)];
        let lifted = points.map(|(p, w)| lifted::<2, 3>(Point(p), w));
        let bound = chord_error::<2, 3>(lifted.into_iter());
        assert!(bound >= 1.0 - 0.5_f64.sqrt(), "{bound}");
        assert!((bound - 0.5_f64.sqrt()).abs() < 1e-15, "{bound}");
    }

    #[test]
    fn beyond_its_ends_a_segment_is_as_far_as_its_end() {
        let (a, b) = (Point([0.0, 0.0]), Point([2.0, 0.0]));
        assert_eq!(from_segment(Point([5.0, 4.0]), a, b), 5.0);
        assert_eq!(from_segment(Point([1.0, 4.0]), a, b), 4.0);
        assert_eq!(from_segment(Point([3.0, 4.0]), a, a), 5.0);
    }
}
