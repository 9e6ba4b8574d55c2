//! Points, derivatives and the moving frame of a rational curve.

use super::Rational;
use crate::core::argument::Argument;
use crate::core::bezier_form::binomials;
use crate::core::context::Context;
use crate::core::error::{Error, Locate};
use crate::core::evaluate::{
    Frames, Quantities, Samples, Sampling, check, check_size, frames, jets, parameters, roundings,
};
use crate::core::homogeneous::{self, numerator, weight};
use crate::core::local::placed;
use crate::core::point::Point;

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
    let source = curve.homogeneous(context).at(Argument::Curve)?;
    let composite = source.curve.composite(context).at(Argument::Curve)?;
    let parameters = parameters(context, &composite, sampling, &source.metric())?;
    check_size(context, parameters.len(), derivatives, quantities)?;
    let highest = derivatives.max(quantities.highest_derivative());
    let lifted = jets(context, &composite, &parameters, highest)?;
    if let ([points], 0) = (&lifted[..], highest) {
        let point = |&h: &Point<H>| placed(source.origin, homogeneous::projected(h));
        let points = vec![points.iter().map(point).collect()];
        let domain = composite.breaks().domain();
        return Ok(Samples::new(domain, parameters, points, 0, Frames::default()));
    }
    let jets = projected::<D, H>(context, &lifted)?;
    // Rounding errors of the homogeneous derivatives, led through the quotient rule.
    let mut roundings = roundings(&composite);
    let rounding = |index: usize| {
        let of = roundings(parameters[index]);
        let (w, reach) = (weight(lifted[0][index]), 1.0 + jets[0][index].max_abs());
        let first = of[0] * reach / w;
        let [slope, speed] = match lifted.get(1) {
            Some(list) => [weight(list[index]).abs(), jets[1][index].max_abs()],
            None => [0.0; 2],
        };
        [first, (of[1] * reach + 2.0 * (slope * first + of[0] * speed)) / w]
    };
    let frames = frames(context, &jets, quantities, rounding)?;
    let mut jets = jets;
    jets[0].iter_mut().for_each(|p| *p = placed(source.origin, *p));
    Ok(Samples::new(composite.breaks().domain(), parameters, jets, derivatives, frames))
}

/// The points and derivatives of the curve, from those in homogeneous coordinates; `lists[k]` are
/// the `k`-th derivatives. As [`derivative`](homogeneous::derivative), order by order, so that many
/// parameters go through each step together.
fn projected<const D: usize, const H: usize>(
    context: &Context,
    lists: &[Vec<Point<H>>],
) -> Result<Vec<Vec<Point<D>>>, Error> {
    context.checkpoint()?;
    let points: Vec<Point<D>> = lists[0].iter().map(|&h| homogeneous::projected(h)).collect();
    let mut found = vec![points];
    for k in 1..lists.len() {
        context.checkpoint()?;
        let first = |(&h, &p): (&Point<H>, &Point<D>)| numerator::<D, H>(h) - p * weight(h);
        let mut list: Vec<Point<D>> = lists[k].iter().zip(&found[0]).map(first).collect();
        for i in 1..k {
            let binomial = binomials(k)[i];
            for ((sum, &p), &h) in list.iter_mut().zip(&found[k - i]).zip(&lists[i]) {
                *sum = *sum - p * (binomial * weight(h));
            }
        }
        for (sum, &h) in list.iter_mut().zip(&lists[0]) {
            *sum = sum.map(|x| x / weight(h));
        }
        found.push(list);
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
