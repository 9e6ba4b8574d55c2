//! Points, derivatives and the moving frame along a curve.

mod frame;

use super::argument::Argument;
use super::bezier_form::split;
use super::check::{at_least, at_most};
use super::curve::{Composite, Curve, Segment};
use super::domain::Domain;
use super::error::{Error, Locate};
use super::fault::Fault;
use super::metric::{Affine, Metric};
use super::point::{Point, magnitude};
use crate::core::context::Context;
use crate::core::linear::lanes::uniform;
use frame::MovingFrame;
pub use frame::{Degenerate, Frames};

/// Where to sample.
#[derive(Debug, Clone, PartialEq)]
pub enum Sampling {
    /// This many parameters at equal distances, both ends of the domain included; at least 2.
    Count(usize),
    /// At these parameters, each inside the domain.
    Parameters(Vec<f64>),
    /// At as many parameters as it takes for the polyline to stay this close to the curve.
    Tolerance(f64),
}

/// What to compute besides points and derivatives.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Quantities {
    /// The unit tangent.
    pub tangent: bool,
    /// The unit normal: in the plane the tangent turned left by 90 degrees, in space the principal
    /// normal.
    pub normal: bool,
    /// The curvature: in the plane positive where the curve turns left, in space never negative.
    pub curvature: bool,
    /// The torsion, in space only.
    pub torsion: bool,
    /// The length of the first derivative.
    pub speed: bool,
}

/// Samples of a curve; every list has one entry for each parameter.
#[derive(Debug, Clone, PartialEq)]
pub struct Samples<const D: usize> {
    /// First and last parameter of the curve.
    pub domain: (f64, f64),
    /// The parameters sampled.
    pub parameters: Vec<f64>,
    /// The points there.
    pub points: Vec<Point<D>>,
    /// `derivatives[k - 1]`: the `k`-th derivatives with respect to the curve's own parameter, from
    /// the right at a joint.
    pub derivatives: Vec<Vec<Point<D>>>,
    /// The quantities asked for.
    pub frames: Frames<D>,
}

/// Samples a curve. O(samples * (derivatives + 1) * degree) after O(segments * degree).
///
/// # Errors
/// At `sampling`: a count below 2, a parameter outside the domain, a tolerance that is not positive
/// or below rounding; more samples than [`SAMPLES`](crate::core::limits::SAMPLES). At
/// `derivatives`: more than [`DEGREE`](crate::core::limits::DEGREE). At `quantities`: the torsion
/// of a plane curve. At `curve`: a tolerance for a B-spline that jumps.
///
/// ```
/// use springline::core::basis::{Basis, Bezier};
/// use springline::core::context::Context;
/// use springline::core::curve::{Curve, Single};
/// use springline::core::evaluate::{Quantities, Sampling, evaluate};
/// use springline::core::point::Point;
///
/// let context = Context::default();
/// let points = [[0.0, 0.0], [1.0, 2.0], [2.0, 0.0]].map(Point).to_vec();
/// let parabola = Curve::Single(Single::new(&context, Basis::Bezier(Bezier), points)?);
/// let curvature = Quantities { curvature: true, ..Quantities::default() };
/// let middle = Sampling::Parameters(vec![0.5]);
/// let samples = evaluate(&context, &parabola, &middle, 1, curvature)?;
/// assert_eq!(samples.points, [Point([1.0, 1.0])]);
/// assert_eq!(samples.derivatives[0], [Point([2.0, 0.0])]);
/// // It turns right, around a circle of radius 1/2.
/// assert_eq!(samples.frames.curvatures, [-2.0]);
///
/// let outside = Sampling::Parameters(vec![0.5, 1.5]);
/// let error = evaluate(&context, &parabola, &outside, 0, curvature).unwrap_err();
/// assert_eq!(error.place.to_string(), "/sampling/parameters/1");
/// # Ok::<_, springline::core::error::Error>(())
/// ```
pub fn evaluate<const D: usize>(
    context: &Context,
    curve: &Curve<D>,
    sampling: &Sampling,
    derivatives: usize,
    quantities: Quantities,
) -> Result<Samples<D>, Error> {
    check::<D>(context, sampling, derivatives, quantities)?;
    let composite = curve.composite(context).at(Argument::Curve)?;
    let parameters = parameters(context, &composite, sampling, &Affine)?;
    check_size(context, parameters.len(), derivatives, quantities)?;
    let highest = derivatives.max(quantities.highest_derivative());
    let jets = jets(context, &composite, &parameters, highest)?;
    let mut roundings = roundings(&composite);
    let frames = frames(context, &jets, quantities, |i| roundings(parameters[i]))?;
    Ok(Samples::new(composite.breaks().domain(), parameters, jets, derivatives, frames))
}

/// The rounding errors of the first two derivatives at parameters in turn. Derivatives are as exact
/// as differences of the control points are: they round in units of their own size.
pub(crate) fn roundings<const D: usize>(
    composite: &Composite<D>,
) -> impl FnMut(f64) -> [f64; 2] + '_ {
    let gains = [composite.gains(1), composite.gains(2)];
    let mut segment = 0;
    let mut size = magnitude(composite.local(0).points);
    move |t| {
        let next = composite.breaks().segment_near(segment, t);
        if next != segment {
            (segment, size) = (next, magnitude(composite.local(next).points));
        }
        [0, 1].map(|k| 8.0 * f64::EPSILON * size * gains[k][segment])
    }
}

/// Refuses what no curve of this dimension has.
pub(crate) fn check<const D: usize>(
    context: &Context,
    sampling: &Sampling,
    derivatives: usize,
    quantities: Quantities,
) -> Result<(), Error> {
    check_orders(context, derivatives).at(Argument::Derivatives)?;
    sampling.check(context).at(Argument::Sampling)?;
    if quantities.torsion && D != 3 {
        let why = "a curve in the plane has no torsion; ask for it with 3D control points, or leave it out";
        return Err(Fault::UnsuitableCurve(why.into()).at(Argument::Quantities));
    }
    Ok(())
}

/// Refuses an answer beyond the limit.
pub(crate) fn check_size(
    context: &Context,
    samples: usize,
    derivatives: usize,
    quantities: Quantities,
) -> Result<(), Fault> {
    let asked = 1 + derivatives + usize::from(quantities.tangent) + usize::from(quantities.normal);
    at_most(
        "points and vectors in the answer",
        samples * asked,
        context.limits.answer_points,
        "Ask for fewer samples or derivatives",
    )
}

impl<const D: usize> Samples<D> {
    /// `jets[k]` are the `k`-th derivatives, of which some may be for the frames only.
    pub(crate) fn new(
        domain: (f64, f64),
        parameters: Vec<f64>,
        jets: Vec<Vec<Point<D>>>,
        derivatives: usize,
        frames: Frames<D>,
    ) -> Self {
        let mut lists = jets.into_iter();
        let points = lists.next().unwrap_or_default();
        let derivatives = lists.take(derivatives).collect();
        Samples { domain, parameters, points, derivatives, frames }
    }
}

/// Refuses more orders of derivatives than any curve has.
///
/// # Errors
/// [`Fault::TooLarge`].
pub fn check_orders(context: &Context, derivatives: usize) -> Result<(), Fault> {
    at_most(
        "orders of derivatives",
        derivatives,
        context.limits.degree,
        "Higher derivatives of these polynomials are zero",
    )
}

impl Sampling {
    /// What can be wrong with it whatever the curve.
    ///
    /// # Errors
    /// Counts out of range, a tolerance that is no distance, each at its field.
    pub fn check(&self, context: &Context) -> Result<(), Error> {
        let few =
            |count| at_most("samples", count, context.limits.samples, "Sample the curve in parts");
        match self {
            Sampling::Count(count) => {
                at_least("samples", *count, 2).and_then(|()| few(*count)).at(Argument::Count)
            }
            Sampling::Parameters(values) => at_least("parameters", values.len(), 1)
                .and_then(|()| few(values.len()))
                .at(Argument::Parameters),
            Sampling::Tolerance(tolerance) => check_distance(*tolerance).at(Argument::Tolerance),
        }
    }
}

impl Quantities {
    pub(crate) fn highest_derivative(self) -> usize {
        match self {
            Quantities { torsion: true, .. } => 3,
            Quantities { normal: true, .. } | Quantities { curvature: true, .. } => 2,
            Quantities { tangent: true, .. } | Quantities { speed: true, .. } => 1,
            _ => 0,
        }
    }
}

/// `lists[k][i]`: the `k`-th derivative at parameter `i`.
pub(crate) fn jets<const D: usize>(
    context: &Context,
    composite: &Composite<D>,
    parameters: &[f64],
    highest: usize,
) -> Result<Vec<Vec<Point<D>>>, Error> {
    let sample = |curve: &Composite<D>| curve.evaluator(context)?.sample(context, parameters);
    let mut lists = vec![sample(composite)?];
    let mut derivative = None;
    for _ in 0..highest {
        let next = derivative.as_ref().unwrap_or(composite).derivative(context)?;
        lists.push(sample(derivative.insert(next))?);
    }
    Ok(lists)
}

pub(crate) fn parameters<const D: usize>(
    context: &Context,
    composite: &Composite<D>,
    sampling: &Sampling,
    metric: &impl Metric<D>,
) -> Result<Vec<f64>, Error> {
    let (a, b) = composite.breaks().domain();
    match sampling {
        Sampling::Count(count) => Ok(uniform(a, b, *count as u32)),
        Sampling::Parameters(values) => Domain { ends: (a, b), name: "t", of: "curve" }
            .settle_all(values)
            .at(Argument::Parameters)
            .at(Argument::Sampling),
        Sampling::Tolerance(tolerance) => {
            check_tolerance(*tolerance, composite.magnitude_in(metric))
                .at(Argument::Tolerance)
                .at(Argument::Sampling)?;
            composite.check_joined(metric).at(Argument::Curve)?;
            let most = context.limits.samples - 1;
            let pieces = flat_pieces(context, composite, *tolerance, most, metric)
                .at(Argument::Tolerance)
                .at(Argument::Sampling)?;
            Ok(std::iter::once(a).chain(pieces.into_iter().map(|piece| piece.end)).collect())
        }
    }
}

/// Refuses a tolerance that is not positive.
///
/// # Errors
/// [`Fault::OutOfRange`].
pub fn check_distance(tolerance: f64) -> Result<(), Fault> {
    if tolerance > 0.0 && tolerance.is_finite() {
        return Ok(());
    }
    let allowed = "a positive distance, in the unit of the coordinates".into();
    Err(Fault::OutOfRange { what: "tolerance", value: tolerance, allowed })
}

/// Refuses a tolerance that is not positive, or that rounding errors of coordinates this large
/// exceed.
pub(crate) fn check_tolerance(tolerance: f64, magnitude: f64) -> Result<(), Error> {
    check_distance(tolerance)?;
    let least = 64.0 * f64::EPSILON * magnitude;
    if tolerance < least {
        Err(Fault::ToleranceTooSmall { tolerance, least }.into())
    } else {
        Ok(())
    }
}

/// A piece of one segment that its chord represents within a tolerance.
#[derive(Debug, Clone)]
pub(crate) struct Piece<const D: usize> {
    /// The segment it is of.
    pub segment: usize,
    /// Its last parameter; it starts where the one before ends.
    pub end: f64,
    /// Its Bezier points, from the origin of the segment.
    pub points: Vec<Point<D>>,
}

/// Halves segments until every piece is within the tolerance of its chord, by the bound of
/// the metric: proved, not sampled. Pieces come in order.
pub(crate) fn flat_pieces<const D: usize>(
    context: &Context,
    composite: &Composite<D>,
    tolerance: f64,
    most: usize,
    metric: &impl Metric<D>,
) -> Result<Vec<Piece<D>>, Error> {
    let mut pieces = Vec::new();
    let mut pace = context.pace();
    for (segment, Segment { origin, points }) in composite.locals().enumerate() {
        let (a, b) = composite.breaks().interval(segment);
        let mut stack = vec![(a, b, points.to_vec())];
        while let Some((start, end, points)) = stack.pop() {
            pace.step()?;
            let middle = start + 0.5 * (end - start);
            // An interval without a double inside cannot be halved; its chord is as good as it
            // gets.
            let error = metric.chord_error(origin, &points);
            if error <= tolerance || middle <= start || middle >= end {
                pieces.push(Piece { segment, end, points });
            } else {
                let (left, right) = split(&points, 0.5);
                stack.push((middle, end, right));
                stack.push((start, middle, left));
            }
            let least = pieces.len() + stack.len();
            at_most(
                "pieces that this tolerance needs at the least",
                least,
                most,
                "Raise the tolerance, or take the curve in parts",
            )?;
        }
    }
    Ok(pieces)
}

/// The frames of jets, given the rounding errors of the first two derivatives at each parameter in
/// turn.
pub(crate) fn frames<const D: usize>(
    context: &Context,
    jets: &[Vec<Point<D>>],
    wanted: Quantities,
    mut rounding: impl FnMut(usize) -> [f64; 2],
) -> Result<Frames<D>, Error> {
    let mut frames = Frames::default();
    if wanted == Quantities::default() {
        return Ok(frames);
    }
    let mut pace = context.pace();
    for index in 0..jets[0].len() {
        pace.step()?;
        let jet = |k: usize| jets.get(k).map_or(Point::ZERO, |list| list[index]);
        let frame = MovingFrame::new([jet(1), jet(2), jet(3)], rounding(index));
        frames.push(index, frame, wanted);
    }
    Ok(frames)
}

#[cfg(test)]
mod tests;
