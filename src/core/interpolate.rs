//! Composite cubics through points.

use super::argument::Argument;
use super::basis::{Basis, Bezier, WayBack};
use super::check::{at_least, at_most};
use super::continuity::{Report, Tolerance, piecewise_continuity};
use super::curve::{Bases, PerSegment, Piecewise, finite_points};
use super::error::{Error, Locate};
use super::fault::Fault;
use super::knots::Breaks;
use super::parameterization::Parameterization;
use super::point::Point;
use crate::core::context::Context;

/// What holds at one end of an open curve.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub enum End<const D: usize> {
    /// The second derivative vanishes.
    #[default]
    Natural,
    /// The two segments nearest to the end are one cubic.
    NotAKnot,
    /// The first derivative is given.
    Derivative(Point<D>),
}

/// Whether the curve returns to its first point, and if not, what holds at its ends.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum EndConditions<const D: usize> {
    /// C2 also where it closes.
    Closed,
    /// With a condition at the start and one at the end.
    Open(End<D>, End<D>),
}

/// A composite cubic through points.
#[derive(Debug, Clone, PartialEq)]
pub struct Interpolant<const D: usize> {
    /// The curve, of order 3, one segment between neighbouring points.
    pub curve: Piecewise<D>,
    /// Its continuity, measured on the curve returned.
    pub continuity: Report,
    /// The largest 2-norm condition number of the bases.
    pub condition: f64,
}

/// The C2 cubic through the points in turn, its segments written in the bases given. O(points).
///
/// The curve does not depend on the shape parameters: there is one C2 composite cubic through the
/// points for these knots and end conditions, and the bases only change its control points. So the
/// spline is solved once for its derivatives at the points, a tridiagonal system that is well
/// conditioned whatever the bases.
///
/// # Errors
/// At `points`: fewer than 2 (closed: 3), more than
/// [`DATA_POINTS`](crate::core::limits::DATA_POINTS), neighbours that coincide where distances make
/// the knots. At `parameterization`: knots that do not fit. At `start` or `end`: a not-a-knot
/// condition with too few points. At `basis` or `bases`: not a cubic basis with a way back to
/// control points.
///
/// ```
/// use springline::core::basis::{Basis, Bezier};
/// use springline::core::context::Context;
/// use springline::core::curve::Bases;
/// use springline::core::interpolate::{End, EndConditions, interpolate};
/// use springline::core::parameterization::Parameterization;
/// use springline::core::point::Point;
///
/// let points = [[0.0, 0.0], [3.0, 1.0], [6.0, 0.0]].map(Point);
/// let ends = EndConditions::Open(End::Natural, End::Natural);
/// let bases = Bases::Common(Basis::Bezier(Bezier));
/// let rule = Parameterization::Uniform;
/// let found = interpolate(&Context::default(), &points, ends, bases, &rule)?;
/// // Two cubics; every third control point is one of the points.
/// assert_eq!(found.curve.control_points().len(), 7);
/// assert_eq!(found.curve.control_points()[3], points[1]);
/// # Ok::<_, springline::core::error::Error>(())
/// ```
pub fn interpolate<const D: usize>(
    context: &Context,
    points: &[Point<D>],
    shape: EndConditions<D>,
    bases: Bases,
    parameterization: &Parameterization,
) -> Result<Interpolant<D>, Error> {
    check(context, points, shape)?;
    let closed = shape == EndConditions::Closed;
    let segments = points.len() - usize::from(!closed);
    let ways = ways_back(context, &bases, segments)?;
    let breaks = parameterization.knots(context, points, closed)?;
    let derivatives = match shape {
        EndConditions::Closed => closed_derivatives(points, &breaks),
        EndConditions::Open(start, end) => open_derivatives(points, breaks.as_slice(), start, end),
    };
    // Solving takes a few milliseconds for the most points allowed.
    context.checkpoint()?;
    let (curve, condition) =
        written_in(context, bases, &ways, closed, hermite(points, &derivatives, &breaks), breaks)
            .map_err(overflow)?;
    let continuity = piecewise_continuity(context, &curve, Tolerance::default())?;
    Ok(Interpolant { curve, continuity, condition })
}

/// The curve with these joined Bezier points in other bases, and the largest condition number of
/// those.
fn written_in<const D: usize>(
    context: &Context,
    bases: Bases,
    ways: &PerSegment<WayBack>,
    closed: bool,
    bezier: Vec<Point<D>>,
    breaks: Breaks,
) -> Result<(Piecewise<D>, f64), Error> {
    if bases.are_identity() {
        return Ok((Piecewise::new(context, bases, 3, breaks, closed, bezier)?, 1.0));
    }
    let curve =
        Piecewise::new(context, Bases::Common(Basis::Bezier(Bezier)), 3, breaks, closed, bezier)?;
    Piecewise::by_ways(context, bases, ways, 3, &curve.composite(context)?, closed)
}

/// No point of the client's is at fault where a result is too large.
fn overflow(error: Error) -> Error {
    let error = error.of_result();
    if error.fault == Fault::Overflow { Fault::Overflow.into() } else { error }
}

fn check<const D: usize>(
    context: &Context,
    points: &[Point<D>],
    shape: EndConditions<D>,
) -> Result<(), Error> {
    let in_points = |fault: Fault| fault.at(Argument::Points);
    at_least("points", points.len(), if shape == EndConditions::Closed { 3 } else { 2 })
        .map_err(in_points)?;
    at_most("points", points.len(), context.limits.data_points, "Interpolate them in parts")
        .map_err(in_points)?;
    let segments = points.len() - usize::from(shape != EndConditions::Closed);
    at_most("segments", segments, context.limits.segments, "Interpolate the points in parts")
        .map_err(in_points)?;
    let control_points = 3 * segments + 1;
    at_most(
        "control points in the answer",
        control_points,
        context.limits.control_points,
        "Interpolate the points in parts",
    )
    .map_err(in_points)?;
    finite_points(points).at(Argument::Points)?;
    if let EndConditions::Open(start, end) = shape {
        let both = start == End::NotAKnot && end == End::NotAKnot;
        let least = if both { 4 } else { 3 };
        for (name, condition) in [(Argument::Start, start), (Argument::End, end)] {
            if condition == End::NotAKnot && points.len() < least {
                let what = if both {
                    "points with not-a-knot at both ends"
                } else {
                    "points with not-a-knot at one end"
                };
                return Err(Fault::TooFew { what, count: points.len(), least }.at(name));
            }
        }
    }
    Ok(())
}

/// How control points are found; refuses a basis that cannot write every cubic, at `basis` or at
/// its place in `bases`.
fn ways_back(
    context: &Context,
    bases: &Bases,
    segments: usize,
) -> Result<PerSegment<WayBack>, Error> {
    bases.check_count(segments).at(Argument::Bases)?;
    bases.map(context, |i, basis| {
        let way =
            basis.way_back(context, 3).and_then(|way| basis.joinable(context, 3).map(|()| way));
        match bases {
            Bases::Common(_) => way.at(Argument::Basis),
            Bases::PerSegment(_) => way.at(i).at(Argument::Bases),
        }
    })
}

/// Bezier points of all segments, joined, from points and derivatives.
fn hermite<const D: usize>(
    points: &[Point<D>],
    derivatives: &[Point<D>],
    breaks: &Breaks,
) -> Vec<Point<D>> {
    let mut bezier = Vec::with_capacity(3 * breaks.segments() + 1);
    bezier.push(points[0]);
    for i in 0..breaks.segments() {
        let (a, b) = breaks.interval(i);
        let third = (b - a) / 3.0;
        let next = if i + 1 < points.len() { i + 1 } else { 0 };
        bezier.extend([
            points[i] + derivatives[i] * third,
            points[next] - derivatives[next] * third,
            points[next],
        ]);
    }
    bezier
}

/// One row of the tridiagonal system for the derivatives at the points.
#[derive(Debug, Clone, Copy)]
struct Row<const D: usize> {
    before: f64,
    diagonal: f64,
    after: f64,
    right: Point<D>,
}

/// C2 at the point between intervals of lengths `h` and `k` with mean slopes `s` and `t` (de Boor
/// 1978, IV (7)), divided by `h + k` so that its size does not depend on theirs.
fn inner_row<const D: usize>(h: f64, s: Point<D>, k: f64, t: Point<D>) -> Row<D> {
    let part = 1.0 / (h + k);
    let (w, x) = (k * part, h * part);
    Row { before: w, diagonal: 2.0, after: x, right: (s * w + t * x) * 3.0 }
}

/// The condition at an end whose interval has length `h` and mean slope `s`; the next one `k` and
/// `t`. Given for the start; at the end the roles of `before` and `after` change.
fn end_row<const D: usize>(end: End<D>, h: f64, s: Point<D>, k: f64, t: Point<D>) -> Row<D> {
    match end {
        End::Natural => Row { before: 0.0, diagonal: 2.0, after: 1.0, right: s * 3.0 },
        End::Derivative(vector) => Row { before: 0.0, diagonal: 1.0, after: 0.0, right: vector },
        // de Boor 1978, IV (10), divided by h + k.
        End::NotAKnot => {
            let (w, x) = (k / (h + k), h / (h + k));
            Row { before: 0.0, diagonal: w, after: 1.0, right: s * (w * (2.0 + x)) + t * (x * x) }
        }
    }
}

/// Lengths and mean slopes of the intervals.
fn slopes<const D: usize>(points: &[Point<D>], knots: &[f64]) -> (Vec<f64>, Vec<Point<D>>) {
    let lengths: Vec<f64> = knots.windows(2).map(|t| t[1] - t[0]).collect();
    let ends = points.iter().zip(points[1..].iter().chain(points.first()));
    let slopes = ends.zip(&lengths).map(|((&p, &q), &h)| (q - p).map(|x| x / h)).collect();
    (lengths, slopes)
}

/// The derivatives at the points of the C2 cubic through them with this condition at both ends.
/// O(points).
pub(crate) fn derivatives<const D: usize>(
    points: &[Point<D>],
    knots: &[f64],
    ends: End<D>,
) -> Vec<Point<D>> {
    open_derivatives(points, knots, ends, ends)
}

fn open_derivatives<const D: usize>(
    points: &[Point<D>],
    knots: &[f64],
    start: End<D>,
    end: End<D>,
) -> Vec<Point<D>> {
    let (h, s) = slopes(points, knots);
    let last = h.len() - 1;
    let inner = (0..last).map(|i| inner_row(h[i], s[i], h[i + 1], s[i + 1]));
    let second = 1.min(last);
    let first_row = end_row(start, h[0], s[0], h[second], s[second]);
    let next = last.saturating_sub(1);
    let last_row = end_row(end, h[last], s[last], h[next], s[next]);
    let mirrored = Row { before: last_row.after, after: last_row.before, ..last_row };
    tridiagonal(
        std::iter::once(first_row).chain(inner).chain(std::iter::once(mirrored)),
        points.len(),
    )
}

/// Gaussian elimination without pivoting: the rows are diagonally dominant, but for a not-a-knot
/// row at an end, after whose elimination the rest is.
fn tridiagonal<const D: usize>(rows: impl Iterator<Item = Row<D>>, count: usize) -> Vec<Point<D>> {
    let mut upper = Vec::with_capacity(count);
    let mut solution = Vec::with_capacity(count);
    let (mut up, mut before) = (0.0, Point::ZERO);
    rows.for_each(|row| {
        // Entries are of size 1, and no pivot is smaller than a part of that.
        let share = 1.0 / (row.diagonal - row.before * up);
        (up, before) = (row.after * share, (row.right - before * row.before) * share);
        upper.push(up);
        solution.push(before);
    });
    for i in (1..solution.len()).rev() {
        solution[i - 1] = solution[i - 1] - solution[i] * upper[i - 1];
    }
    solution
}

/// The cyclic system, by taking the last derivative `m` as known: the others are `x - m y` with two
/// tridiagonal solutions, and the last row then gives `m`.
fn closed_derivatives<const D: usize>(points: &[Point<D>], breaks: &Breaks) -> Vec<Point<D>> {
    let (h, s) = slopes(points, breaks.as_slice());
    let n = h.len();
    let row = |i: usize| {
        let before = (i + n - 1) % n;
        inner_row(h[before], s[before], h[i], s[i])
    };
    let x = tridiagonal((0..n - 1).map(row), n - 1);
    let unit = |i: usize| {
        let row = row(i);
        let first = if i == 0 { row.before } else { 0.0 };
        let right = if i == n - 2 { first + row.after } else { first };
        Row { before: row.before, diagonal: row.diagonal, after: row.after, right: Point([right]) }
    };
    let y = tridiagonal((0..n - 1).map(unit), n - 1);
    let last = row(n - 1);
    let right = last.right - x[n - 2] * last.before - x[0] * last.after;
    let pivot = last.diagonal - y[n - 2][0] * last.before - y[0][0] * last.after;
    let m = right.map(|x| x / pivot);
    x.iter().zip(&y).map(|(&x, y)| x - m * y[0]).chain(std::iter::once(m)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn through(
        points: &[[f64; 2]],
        shape: EndConditions<2>,
        rule: &Parameterization,
    ) -> Result<Interpolant<2>, Error> {
        let points: Vec<_> = points.iter().map(|&p| Point(p)).collect();
        let bases = Bases::Common(Basis::Bezier(Bezier));
        interpolate(&Context::default(), &points, shape, bases, rule)
    }

    /// `y = (3 t - t^3) / 2` and its mirror image.
    #[test]
    fn the_natural_spline_through_three_points_is_known() {
        let natural = EndConditions::Open(End::Natural, End::Natural);
        let points = [[0.0, 0.0], [3.0, 1.0], [6.0, 0.0]];
        let found = through(&points, natural, &Parameterization::Uniform).unwrap();
        let heights = [0.0, 0.5, 1.0, 1.0, 1.0, 0.5, 0.0];
        let points = heights.iter().enumerate().map(|(i, &y)| Point([i as f64, y]));
        assert_eq!(found.curve.control_points(), points.collect::<Vec<_>>());
    }

    #[test]
    fn two_points_with_derivatives_are_the_cubic_of_hermite() {
        let ends = [Point([3.0, 6.0]), Point([6.0, -3.0])];
        let shape = EndConditions::Open(End::Derivative(ends[0]), End::Derivative(ends[1]));
        let found = through(&[[0.0, 0.0], [4.0, 1.0]], shape, &Parameterization::Uniform).unwrap();
        let expected = [[0.0, 0.0], [1.0, 2.0], [2.0, 2.0], [4.0, 1.0]].map(Point);
        assert_eq!(found.curve.control_points(), expected);
    }

    /// The corners of a square: the derivative at each is three quarters of the chord between its
    /// neighbours, as the cyclic system `d1 + 4 d2 + d3 = 3 (p3 - p1)` says with `d3 = -d1`.
    #[test]
    fn the_closed_spline_through_a_square_is_known() {
        let square = [[1.0, 0.0], [0.0, 1.0], [-1.0, 0.0], [0.0, -1.0]].map(Point);
        let breaks = Breaks::new(&Context::default(), vec![0.0, 1.0, 2.0, 3.0, 4.0]).unwrap();
        let found = closed_derivatives(&square, &breaks);
        for (i, derivative) in found.into_iter().enumerate() {
            let expected = (square[(i + 1) % 4] - square[(i + 3) % 4]) * 0.75;
            assert!(derivative.distance(expected) <= 2.0 * f64::EPSILON, "{i}: {derivative:?}");
        }
    }

    #[test]
    fn refused_points_and_ends_are_placed() {
        let place = |points: &[[f64; 2]], shape| {
            through(points, shape, &Parameterization::ChordLength).unwrap_err().place.to_string()
        };
        let natural = EndConditions::Open(End::Natural, End::Natural);
        assert_eq!(place(&[[0.0, 0.0]], natural), "/points");
        assert_eq!(place(&[[0.0, 0.0], [1.0, 0.0], [1.0, 0.0]], natural), "/points/2");
        let ends = EndConditions::Open(End::Natural, End::NotAKnot);
        assert_eq!(place(&[[0.0, 0.0], [1.0, 0.0]], ends), "/end");
    }
}
