//! Any curve as one B-spline.
//!
//! A B-spline keeps its knots and, but for the ends, its control points. Of other curves the Bezier
//! points are control points, if each joint is a knot of full multiplicity. In both, knots lose the
//! copies that the continuity measured there makes superfluous, each on its own (`removal`); then
//! the ends get the knots asked for. No step continues a segment over its neighbours, which would
//! lose digits with the power of the ratio of their lengths.

mod removal;
mod smooth;
mod spline;

use super::argument::Argument;
use super::bezier_form::split;
use super::check::at_most;
use super::curve::{BSpline, Composite, Curve, Segment};
use super::error::{Error, Locate};
use super::fault::Fault;
use super::point::Point;
use crate::core::context::Context;
use smooth::Knot;
use spline::Spline;

/// The kind of knot vector wanted.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum KnotStyle {
    /// End knots of multiplicity degree + 1: the curve starts and ends at control points.
    #[default]
    Clamped,
    /// Equally spaced simple knots, also beyond the ends (Cheng et al. 2021 eq. (26) for one
    /// cubic). A closed curve becomes periodic.
    Uniform,
    /// For closed curves: the knots of one period repeat, and so do the first `degree` control
    /// points.
    Periodic,
}

/// A former joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FormerJoint {
    /// Its parameter.
    pub parameter: f64,
    /// How many derivatives agree there; -1 where not even the points do. At most the degree.
    pub continuity: i32,
    /// The multiplicity of its knot.
    pub multiplicity: usize,
}

/// A curve as a B-spline.
#[derive(Debug, Clone, PartialEq)]
pub struct Conversion<C> {
    /// The same curve over the same domain.
    pub curve: C,
    /// Each former joint, with the continuity of a rational curve measured in homogeneous
    /// coordinates; for a closed curve the last is the seam.
    pub joints: Vec<FormerJoint>,
    /// How far apart the two curves can be at equal parameters: a bound, measured on the result.
    pub deviation: f64,
    /// The relative tolerance used to measure continuity.
    pub tolerance: f64,
}

/// Refuses a tolerance that is no fraction.
///
/// # Errors
/// [`Fault::OutOfRange`].
pub fn check_tolerance(tolerance: f64) -> Result<(), Fault> {
    if tolerance > 0.0 && tolerance < 1.0 {
        return Ok(());
    }
    let allowed = "0 < tolerance < 1, relative to the derivatives compared".into();
    Err(Fault::OutOfRange { what: "tolerance", value: tolerance, allowed })
}

/// Converts a curve: degree that of its segments, each joint a knot of the lowest multiplicity,
/// `degree - k`, that its measured continuity `C^k` allows; where the segments are one polynomial,
/// no knot at all. A knot of a B-spline is measured likewise, and so stays as it is unless the
/// curve is smoother there than its multiplicity promises. A copy that can be removed only by more
/// than a small part of the tolerance stays. O(segments * degree^2).
///
/// # Errors
/// At `tolerance`: not positive or 1 and more. At `knots`: uniform or periodic knots that the curve
/// does not allow.
///
/// ```
/// use springline::core::basis::{Basis, Bezier};
/// use springline::core::context::Context;
/// use springline::core::curve::{Bases, Curve, Piecewise};
/// use springline::core::knots::Breaks;
/// use springline::core::point::Point;
/// use springline::core::to_bspline::{KnotStyle, to_bspline};
///
/// let context = Context::default();
/// // A parabola over [0, 1], and its tangent over [1, 2].
/// let points = [[0.0, 0.0], [0.5, 0.0], [1.0, 1.0], [1.5, 2.0], [2.0, 3.0]].map(Point);
/// let breaks = Breaks::new(&context, vec![0.0, 1.0, 2.0])?;
/// let bases = Bases::Common(Basis::Bezier(Bezier));
/// let curve = Piecewise::new(&context, bases, 2, breaks, false, points.to_vec())?;
/// let found = to_bspline(&context, &Curve::Piecewise(curve), KnotStyle::Clamped, 1e-9)?;
/// // Their joint is C1, so one knot of two and one control point are superfluous.
/// assert_eq!(found.curve.knots().as_slice(), [0.0, 0.0, 0.0, 1.0, 2.0, 2.0, 2.0]);
/// assert_eq!(found.curve.control_points().len(), 4);
/// # Ok::<_, springline::core::error::Error>(())
/// ```
pub fn to_bspline<const D: usize>(
    context: &Context,
    curve: &Curve<D>,
    style: KnotStyle,
    tolerance: f64,
) -> Result<Conversion<BSpline<D>>, Error> {
    check_tolerance(tolerance).at(Argument::Tolerance)?;
    if style == KnotStyle::Periodic && !curve.closed() {
        return Err(unsuitable(
            "periodic knots need a closed curve; mark it \"closed\", or ask for clamped knots",
        )
        .at(Argument::Knots));
    }
    let composite = curve.composite(context).at(Argument::Curve)?;
    let given = match curve {
        Curve::BSpline(spline) => Spline::of_bspline(spline),
        _ => Spline::of_composite(context, &composite)?,
    };
    let found = given.measured(context, tolerance)?;
    let seam = curve.closed().then(|| clamped(given.clone()).seam(tolerance));
    // At one parameter, up to `degree` knots may lose as many copies each.
    let allowed =
        tolerance * composite.magnitude() / ((given.degree + 1) * (given.degree + 1)) as f64;
    let least = usize::from(style == KnotStyle::Uniform);
    let lowered = given.lowered(context, &found, least, allowed)?;
    let converted = match style {
        KnotStyle::Clamped => clamped(lowered),
        KnotStyle::Uniform => uniform(lowered, &composite, &found, seam).at(Argument::Knots)?,
        KnotStyle::Periodic => periodic(lowered, seam.unwrap_or(0)),
    };
    finished(context, converted, curve.closed(), &composite, style, tolerance).map(
        |(curve, deviation)| {
            let joints = joints(&found, seam, &curve);
            Conversion { curve, joints, deviation, tolerance }
        },
    )
}

/// The B-spline, and how far it may be from the curve.
fn finished<const D: usize>(
    context: &Context,
    spline: Spline<D>,
    closed: bool,
    composite: &Composite<D>,
    style: KnotStyle,
    tolerance: f64,
) -> Result<(BSpline<D>, f64), Error> {
    let Spline { degree, knots, points } = spline;
    at_most(
        "control points in the answer",
        points.len(),
        context.limits.control_points,
        "Convert the curve in parts",
    )?;
    let curve = BSpline::new(context, degree, knots, points, closed)
        .map_err(|error| error.of_result().fault.at(Argument::Curve))?;
    let deviation = deviation(context, composite, &curve.composite(context)?)?;
    if style != KnotStyle::Clamped {
        check_deviation(deviation, tolerance, composite).at(Argument::Knots)?;
    }
    Ok((curve, deviation))
}

fn joints<const D: usize>(
    found: &[Knot],
    seam: Option<i32>,
    curve: &BSpline<D>,
) -> Vec<FormerJoint> {
    let knots = curve.knots().as_slice();
    let multiplicity =
        |t: f64| knots.partition_point(|&knot| knot <= t) - knots.partition_point(|&knot| knot < t);
    let joint = |(parameter, continuity)| FormerJoint {
        parameter,
        continuity,
        multiplicity: multiplicity(parameter),
    };
    let inner = found.iter().map(|knot| (knot.parameter, knot.continuity));
    inner.chain(seam.map(|seam| (curve.knots().domain().1, seam))).map(joint).collect()
}

fn unsuitable(why: &str) -> Fault {
    Fault::UnsuitableCurve(why.into())
}

/// With end knots of multiplicity `degree + 1`.
fn clamped<const D: usize>(spline: Spline<D>) -> Spline<D> {
    let (a, b) = spline.domain();
    let copies = spline.degree + 1;
    spline.with_ends(&vec![a; copies], &vec![b; copies])
}

/// With knots that repeat after one period, of which the first is the seam, and the same control
/// points at both ends.
fn periodic<const D: usize>(spline: Spline<D>, seam: i32) -> Spline<D> {
    let degree = spline.degree;
    let (a, b) = spline.domain();
    let seam_copies = (degree as i32 - seam).clamp(1, degree as i32) as usize;
    let one: Vec<f64> =
        std::iter::repeat_n(a, seam_copies).chain(spline.inner().iter().copied()).collect();
    let count = one.len() as i64;
    // Knot number `degree` is the last copy of `a`, so that the domain starts there.
    let knot = |j: i64| {
        let i = j - degree as i64 + seam_copies as i64 - 1;
        let (turns, i) = (i.div_euclid(count), i.rem_euclid(count) as usize);
        if turns == 1 && one[i] == a { b } else { one[i] + turns as f64 * (b - a) }
    };
    let knots: Vec<f64> = (0..count + 2 * degree as i64 + 1).map(knot).collect();
    repeated(spline, knots, count as usize, degree + seam_copies - 1)
}

/// With these knots, whose domain ends so many places before the last of them, and the same control
/// points after each `count` of them.
fn repeated<const D: usize>(
    spline: Spline<D>,
    knots: Vec<f64>,
    count: usize,
    end: usize,
) -> Spline<D> {
    let (degree, (a, b)) = (spline.degree, spline.domain());
    let end = knots.len() - 1 - end;
    let with_ends = spline.with_ends(&knots[..=degree], &knots[end..=end + degree]);
    // A control point is as good as its knots are inside the domain: of those that must be equal
    // the best is taken.
    let outside = |i: usize| knots[i + 1..=i + degree].iter().filter(|&&t| t < a || t > b).count();
    let best = |i: usize| (i % count..end).step_by(count).min_by_key(|&i| outside(i)).unwrap_or(i);
    let points = (0..count + degree).map(|i| with_ends.points[best(i)]).collect();
    Spline { degree, knots, points }
}

/// With simple knots at equal distances; every joint becomes one, however smooth.
fn uniform<const D: usize>(
    spline: Spline<D>,
    composite: &Composite<D>,
    found: &[Knot],
    seam: Option<i32>,
) -> Result<Spline<D>, Fault> {
    let degree = spline.degree;
    let breaks = composite.breaks();
    let (a, b) = breaks.domain();
    let (joints, segments) = (breaks.as_slice(), breaks.segments());
    let step = (b - a) / segments as f64;
    let even = |i: i64| a + i as f64 * step;
    if let Some(i) = (0..=segments).find(|&i| (joints[i] - even(i as i64)).abs() > 1e-12 * (b - a))
    {
        let (t, expected) = (joints[i], even(i as i64));
        let why = format!(
            "uniform knots need segments of equal length, but the joint {t:?} is not at {expected:?}; ask for clamped knots"
        );
        return Err(Fault::UnsuitableCurve(why));
    }
    let mut measured =
        found.iter().map(|knot| (knot.parameter, knot.continuity)).chain(seam.map(|k| (b, k)));
    if let Some((t, k)) = measured.find(|(_, k)| *k < degree as i32 - 1) {
        let needed = degree - 1;
        let why = format!(
            "simple knots need C{needed} joints, but the curve is C{k} at {t:?}; ask for clamped knots"
        );
        return Err(Fault::UnsuitableCurve(why));
    }
    if let Some(pair) = spline.inner().windows(2).find(|pair| pair[0] == pair[1]) {
        let t = pair[0];
        let why = format!(
            "the joint {t:?} cannot become a simple knot without moving the curve; ask for clamped knots"
        );
        return Err(Fault::UnsuitableCurve(why));
    }
    // Joints as they are given, not as they round.
    let inside = |i: i64| usize::try_from(i).ok().and_then(|i| joints.get(i).copied());
    let knot = |j: i64| inside(j - degree as i64).unwrap_or_else(|| even(j - degree as i64));
    let knots: Vec<f64> = (0..(segments + 2 * degree + 1) as i64).map(knot).collect();
    if seam.is_some() {
        return Ok(repeated(spline, knots, segments, degree));
    }
    let end = knots.len() - degree - 1;
    Ok(spline.with_ends(&knots[..=degree], &knots[end..]))
}

/// The largest distance between Bezier points of the two curves on the intervals of the first: as a
/// curve is in the hull of its Bezier points, so is the difference of two.
fn deviation<const D: usize>(
    context: &Context,
    original: &Composite<D>,
    result: &Composite<D>,
) -> Result<f64, Error> {
    let on_interval = |i: usize| {
        let (a, b) = original.breaks().interval(i);
        let holder = result.breaks().segment_at(a + 0.5 * (b - a));
        let (start, end) = (result.breaks().local(holder, a).0, result.breaks().local(holder, b).0);
        let Segment { origin, points } = result.local(holder);
        let piece = if start <= 0.0 && end >= 1.0 {
            points.to_vec()
        } else {
            restricted(points, start.max(0.0), end.min(1.0))
        };
        let original = original.local(i);
        let between = origin - original.origin;
        original
            .points
            .iter()
            .zip(piece)
            .map(|(&p, q)| (between + (q - p)).norm())
            .fold(0.0, f64::max)
    };
    Ok(context
        .collect((0..original.breaks().segments()).map(on_interval))?
        .into_iter()
        .fold(0.0, f64::max))
}

/// The Bezier points over `[u, v]`, a part of `[0, 1]`.
fn restricted<const D: usize>(points: &[Point<D>], u: f64, v: f64) -> Vec<Point<D>> {
    let (left, _) = split(points, v);
    split(&left, if v > 0.0 { u / v } else { 0.0 }).1
}

/// Refuses a result that lost the curve: control points beyond the ends amplify rounding errors
/// with the degree.
fn check_deviation<const D: usize>(
    deviation: f64,
    tolerance: f64,
    composite: &Composite<D>,
) -> Result<(), Fault> {
    if deviation <= tolerance.max(1e-9) * composite.magnitude() {
        return Ok(());
    }
    let degree = composite.degree();
    let why = format!(
        "these knots put control points so far beyond the ends of a curve of degree {degree} that rounding moves it by {deviation:.1e}; \
         ask for clamped knots"
    );
    Err(Fault::UnsuitableCurve(why))
}

#[cfg(test)]
mod tests;
