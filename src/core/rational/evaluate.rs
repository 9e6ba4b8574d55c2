//! Points, derivatives and the moving frame of a rational curve.

use super::Rational;
use crate::core::argument::Argument;
use crate::core::context::Context;
use crate::core::error::{Error, Locate};
use crate::core::evaluate::{
    Quantities, Samples, Sampling, check, check_size, frames, jets, parameters,
};
use crate::core::homogeneous::{project_jet, weight};
use crate::core::local::placed;
use crate::core::point::{Point, magnitude};

/// Samples a rational curve: as [`evaluate`](crate::core::evaluate::evaluate), and each derivative
/// by the quotient rule from those in homogeneous coordinates.
///
/// # Errors
/// As [`evaluate`](crate::core::evaluate::evaluate).
pub fn evaluate<const D: usize, const H: usize>(
    context: &Context,
    curve: &Rational<D, H>,
    sampling: &Sampling,
    derivatives: usize,
    quantities: Quantities,
) -> Result<Samples<D>, Error> {
    check::<D>(context, sampling, derivatives, quantities)?;
    let homogeneous = curve.homogeneous(context).at(Argument::Curve)?;
    let composite = homogeneous.curve.composite(context).at(Argument::Curve)?;
    let parameters = parameters(context, &composite, sampling, &homogeneous.metric())?;
    check_size(context, parameters.len(), derivatives, quantities)?;
    let highest = derivatives.max(quantities.highest_derivative());
    let lifted = jets(context, &composite, &parameters, highest)?;
    let jets = projected::<D, H>(context, &lifted)?;
    // Rounding errors of the homogeneous derivatives, led through the quotient rule.
    let gains = [composite.gains(1), composite.gains(2)];
    let mut segment = 0;
    let mut size = magnitude(composite.local(0).points);
    let rounding = |index: usize| {
        let next = composite.breaks().segment_near(segment, parameters[index]);
        if next != segment {
            (segment, size) = (next, magnitude(composite.local(next).points));
        }
        let of = |k: usize| 8.0 * f64::EPSILON * size * gains[k][segment];
        let (w, reach) = (weight(lifted[0][index]), 1.0 + jets[0][index].max_abs());
        let first = of(0) * reach / w;
        let [slope, speed] = match lifted.get(1) {
            Some(list) => [weight(list[index]).abs(), jets[1][index].max_abs()],
            None => [0.0; 2],
        };
        [first, (of(1) * reach + 2.0 * (slope * first + of(0) * speed)) / w]
    };
    let frames = frames(context, &jets, quantities, rounding)?;
    let placed = |p: Point<D>| placed(homogeneous.origin, p);
    let points = context.collect(jets[0].iter().map(|&p| placed(p)))?;
    let jets = std::iter::once(points).chain(jets.into_iter().skip(1)).collect();
    Ok(Samples::new(composite.breaks().domain(), parameters, jets, derivatives, frames))
}

/// Each sample's jet, from an origin; `lists[k]` are the `k`-th derivatives.
fn projected<const D: usize, const H: usize>(
    context: &Context,
    lists: &[Vec<Point<H>>],
) -> Result<Vec<Vec<Point<D>>>, Error> {
    let count = lists[0].len();
    let mut found: Vec<Vec<Point<D>>> = lists.iter().map(|_| Vec::with_capacity(count)).collect();
    let mut pace = context.pace();
    let mut jet = Vec::with_capacity(lists.len());
    for i in 0..count {
        pace.step()?;
        jet.clear();
        jet.extend(lists.iter().map(|list| list[i]));
        let derivatives = project_jet::<D, H>(&jet);
        found.iter_mut().zip(derivatives).for_each(|(list, p)| list.push(p));
    }
    Ok(found)
}

/// Points of the curve in order, joined by lines within a tolerance of it.
///
/// # Errors
/// As [`evaluate`].
pub fn polyline<const D: usize, const H: usize>(
    context: &Context,
    curve: &Rational<D, H>,
    tolerance: f64,
) -> Result<Vec<Point<D>>, Error> {
    let sampling = Sampling::Tolerance(tolerance);
    Ok(evaluate(context, curve, &sampling, 0, Quantities::default())?.points)
}
