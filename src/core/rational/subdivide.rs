//! Cutting a rational curve.

use super::Rational;
use crate::core::argument::Argument;
use crate::core::context::Context;
use crate::core::curve::Curve;
use crate::core::error::{Error, Locate};
use crate::core::homogeneous;
use crate::core::local::placed;
use crate::core::point::Point;
use crate::core::subdivide::{Cuts, Form, Subdivision, subdivide_by};

/// Cuts a rational curve: as [`subdivide`](crate::core::subdivide::subdivide). Where a weight would
/// not be positive in the curve's own family, the form `auto` gives Bezier pieces.
///
/// # Errors
/// As [`subdivide`](crate::core::subdivide::subdivide). At `form`: the family form where a weight
/// would not be positive.
pub fn subdivide<const D: usize, const H: usize>(
    context: &Context,
    curve: &Rational<D, H>,
    cuts: &Cuts,
    form: Form,
) -> Result<Subdivision<Rational<D, H>, D>, Error> {
    let lifted = curve.homogeneous(context).at(Argument::Curve)?;
    let found = subdivide_by(context, &lifted.curve, cuts, form, &lifted.metric())?;
    let curve_found = match lifted.back(context, &Curve::Piecewise(found.curve)) {
        Ok(curve) => curve,
        Err(_) if found.in_family && form == Form::Auto => {
            context.checkpoint()?;
            return subdivide(context, curve, cuts, Form::Bezier);
        }
        Err(error) if found.in_family => {
            return Err(Error::from(error.fault).at(Argument::Form));
        }
        Err(error) => return Err(Error::from(error.fault).at(Argument::Curve)),
    };
    let point = |h: &Point<H>| placed(lifted.origin, homogeneous::projected(*h));
    Ok(Subdivision {
        curve: curve_found,
        split_parameters: found.split_parameters,
        split_points: context.collect(found.split_points.iter().map(point))?,
        in_family: found.in_family,
        condition: found.condition,
    })
}
