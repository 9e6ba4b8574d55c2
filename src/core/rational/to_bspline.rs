//! A rational curve as a NURBS curve.

use super::Rational;
use crate::core::argument::Argument;
use crate::core::context::Context;
use crate::core::curve::{Composite, Curve};
use crate::core::error::{Error, Locate};
use crate::core::homogeneous::{projected, weight};
use crate::core::point::{Point, larger};
use crate::core::to_bspline::{Conversion, KnotStyle, to_bspline as homogeneous_to_bspline};

/// Converts a rational curve: as [`to_bspline`](crate::core::to_bspline::to_bspline), in homogeneous
/// coordinates. So a joint keeps the knots that the homogeneous curve needs there, which may be more
/// than the curve itself would.
///
/// # Errors
/// As [`to_bspline`](crate::core::to_bspline::to_bspline). At `knots`: a weight that would not be
/// positive.
pub fn to_bspline<const D: usize, const H: usize>(
    context: &Context,
    curve: &Rational<D, H>,
    style: KnotStyle,
    tolerance: f64,
) -> Result<Conversion<Rational<D, H>>, Error> {
    let lifted = curve.homogeneous(context).at(Argument::Curve)?;
    let found = homogeneous_to_bspline(context, &lifted.curve, style, tolerance)?;
    let converted = lifted
        .back(context, &Curve::BSpline(found.curve))
        .map_err(|error| error.fault.at(Argument::Knots))?;
    let before = lifted.curve.composite(context).at(Argument::Curve)?;
    let deviation = found.deviation * stretch::<D, H>(&before, found.deviation);
    Ok(Conversion { curve: converted, joints: found.joints, deviation, tolerance })
}

/// By how much a distance in homogeneous coordinates may grow when it is projected: where `(A, w)`
/// is off by at most `d`, `A / w` is off by at most `d (1 + |C|) / (w - d)`, as `A' / w' - A / w =
/// ((A' - A) - C (w' - w)) / w'`.
fn stretch<const D: usize, const H: usize>(composite: &Composite<H>, off: f64) -> f64 {
    let points = || composite.locals().flat_map(|segment| segment.absolute().collect::<Vec<_>>());
    let norm = |h: Point<H>| projected::<D, H>(h).norm();
    let reach = points().map(norm).fold(0.0, larger);
    let least = points().map(weight).fold(f64::INFINITY, f64::min);
    (1.0 + reach) / (least - off).max(f64::MIN_POSITIVE)
}
