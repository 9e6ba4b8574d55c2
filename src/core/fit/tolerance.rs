//! As few segments as a tolerance allows.

use super::coarsen::coarsen;
use super::data::Data;
use super::measure::measure;
use super::reduced::deficiency;
use super::refine::refine;
use super::spline::Ordered;
use super::{Ends, Fit};
use crate::core::basis::Basis;
use crate::core::curve::{Bases, Curve, Piecewise};
use crate::core::error::{At, Error, Fault, at_most};
use crate::core::least_squares::Deficient;
use crate::core::limits;
use crate::core::point::magnitude;

/// Roundings of the largest coordinate that the way from points to control points and back may leave.
const ROUNDINGS: f64 = 64.0;

/// A C2 piecewise cubic that comes within the tolerance of every point.
///
/// Guaranteed: the tolerance holds on the curve as it is returned, measured afresh. Where
/// `locally_minimal` is true, no single joint can be left out of it; with other joints altogether,
/// fewer segments may still do. O(points) per trial, a bounded number of trials.
pub(super) fn fit<const D: usize>(data: &Data<D>, parameters: Vec<f64>, basis: Basis, tolerance: f64) -> Result<Fit<D>, Error> {
    let condition = basis.way_back(3).at("basis").at("solve")?.condition;
    let target = reachable(data, tolerance, condition).at("solve")?;
    let ordered = Ordered::new(data, &parameters);
    let places = ordered.places.len();
    let deficient = |deficient: Deficient| {
        let inner = places - if data.ends == Ends::Interpolate { 2 } else { 0 };
        deficiency(deficient, inner, "coefficients of a cubic", "give more points with different parameters").at("points")
    };
    let (spline, iterations) = refine(&ordered, target).map_err(|unsolved| unsolved.explained(deficient))?;
    if spline.error() > target {
        return Err(not_met(tolerance, spline.error(), spline.segments()));
    }
    check_size(spline.segments()).at("tolerance").at("solve")?;
    let (spline, minimal) = coarsen(&ordered, spline, target)?;
    let (curve, _) = Piecewise::from_composite(Bases::Common(basis), 3, &spline.composite()?, false).at("solve")?;
    let curve = Curve::Piecewise(curve);
    let error = measure(&curve, &data.points, &parameters)?;
    if error.max > tolerance || error.max.is_nan() {
        return Err(not_met(tolerance, error.max, spline.segments()));
    }
    Ok(Fit { curve, error, parameters, iterations, converged: true, at_bound: false, locally_minimal: Some(minimal) })
}

/// Refuses a spline of more segments than a curve may have, also where some could be left out again: the limits bound the work as well.
fn check_size(segments: usize) -> Result<(), Fault> {
    const ADVICE: &str = "Raise the tolerance, or fit the points in parts";
    at_most("segments on the way to this tolerance", segments, limits::effective().segments, ADVICE)?;
    at_most("control points on the way to this tolerance", 3 * segments + 1, limits::effective().control_points, ADVICE)
}

/// What the spline must hold, so that the tolerance still holds after rounding to control points.
fn reachable<const D: usize>(data: &Data<D>, tolerance: f64, condition: f64) -> Result<f64, Error> {
    if !(tolerance > 0.0 && tolerance.is_finite()) {
        let allowed = "a finite tolerance > 0".into();
        return Err(Fault::OutOfRange { what: "tolerance", value: tolerance, allowed }.at("tolerance"));
    }
    let slack = ROUNDINGS * f64::EPSILON * magnitude(&data.points) * condition;
    if tolerance <= 2.0 * slack {
        return Err(Fault::ToleranceTooSmall { tolerance, least: 3.0 * slack }.at("tolerance"));
    }
    Ok(tolerance - slack)
}

fn not_met(tolerance: f64, best: f64, segments: usize) -> Error {
    let advice =
        "Points that share a parameter cannot all be met: give different parameters, drop repeated ones, or use a larger tolerance";
    Fault::ToleranceNotMet { tolerance, best, segments, advice }.at("tolerance").at("solve")
}
