//! As few segments as a tolerance allows.

use super::Fit;
use super::data::Data;
use super::fewest::fewest;
use super::measure::measure;
use super::ordered::Ordered;
use super::problem::Problem;
use super::refine::refine;
use super::spline::CubicSpline;
use super::through::lowest;
use crate::core::argument::Argument;
use crate::core::basis::Basis;
use crate::core::context::Context;
use crate::core::curve::{Bases, Curve, Piecewise};
use crate::core::error::{Error, Locate};
use crate::core::fault::Fault;
use crate::core::point::magnitude;

/// Roundings of the largest coordinate that the way from points to control points and back may
/// leave.
const ROUNDINGS: f64 = 64.0;

/// A C2 piecewise cubic that comes within the tolerance of every point and stays near them in
/// between.
///
/// Guaranteed: the tolerance holds on the curve as it is returned, measured afresh; and no stretch
/// between two neighbouring places strays ([`Near`](super::near::Near)). Where `locally_minimal` is
/// true, no single joint can be left out of it; with other joints altogether, fewer segments may
/// still do. O(points) per trial, a bounded number of trials.
pub(super) fn fit<const D: usize>(
    context: &Context,
    data: &Data<D>,
    parameters: Vec<f64>,
    basis: Basis,
    tolerance: f64,
) -> Result<Fit<D>, Error> {
    let condition = basis.way_back(context, 3).at(Argument::Basis).at(Argument::Solve)?.condition;
    let target = reachable(data, tolerance, condition).at(Argument::Solve)?;
    let problem = Problem::new(context, Ordered::new(data, &parameters), target)?;
    let (spline, iterations, minimal) = found(context, &problem)?;
    let (curve, _) =
        Piecewise::from_composite(context, Bases::Common(basis), 3, &spline.composite, false)
            .at(Argument::Solve)?;
    let curve = Curve::Piecewise(curve);
    let error = measure(context, &curve, &data.points, &parameters)?;
    if error.max > tolerance || error.max.is_nan() {
        return Err(not_met(tolerance, error.max, spline.segments()));
    }
    Ok(Fit {
        curve,
        error,
        between: f64::NAN,
        parameters,
        iterations,
        converged: true,
        at_bound: false,
        ordered: true,
        gradient: None,
        gradient_tolerance: None,
        locally_minimal: Some(minimal),
    })
}

/// A spline that holds, after how many trials, and whether no joint of it can be left out.
fn found<const D: usize>(
    context: &Context,
    problem: &Problem<D>,
) -> Result<(CubicSpline<D>, usize, bool), Error> {
    let (ordered, tolerance) = (&problem.ordered, problem.tolerance);
    if let Some(lowest) = lowest(context, ordered)? {
        let spline = CubicSpline::of(context, lowest, ordered.data, ordered.parameters)?;
        if problem.near.strays_through(context, ordered, &spline.composite)?.is_empty() {
            return Ok((spline, 1, true));
        }
    }
    let (spline, rounds) = refine(context, problem)?;
    if spline.error() > tolerance {
        return Err(not_met(tolerance, spline.error(), spline.segments()));
    }
    let (spline, minimal) = fewest(context, problem, spline)?;
    Ok((spline, rounds, minimal))
}
/// What the spline must hold, so that the tolerance still holds after rounding to control points.
fn reachable<const D: usize>(data: &Data<D>, tolerance: f64, condition: f64) -> Result<f64, Error> {
    if !(tolerance > 0.0 && tolerance.is_finite()) {
        let allowed = "a finite tolerance > 0".into();
        return Err(Fault::OutOfRange { what: "tolerance", value: tolerance, allowed }
            .at(Argument::Tolerance));
    }
    let slack = ROUNDINGS * f64::EPSILON * magnitude(&data.points) * condition;
    if tolerance <= 2.0 * slack {
        return Err(
            Fault::ToleranceTooSmall { tolerance, least: 3.0 * slack }.at(Argument::Tolerance)
        );
    }
    Ok(tolerance - slack)
}

fn not_met(tolerance: f64, best: f64, segments: usize) -> Error {
    let advice = "Points that share a parameter cannot all be met: give different parameters, drop repeated ones, or use a larger tolerance";
    Fault::ToleranceNotMet { tolerance, best, segments, advice }
        .at(Argument::Tolerance)
        .at(Argument::Solve)
}
