//! A rational curve in another basis.

use super::Rational;
use crate::core::argument::Argument;
use crate::core::basis::Basis;
use crate::core::context::Context;
use crate::core::convert::{Converted, convert as homogeneous_convert};
use crate::core::error::{Error, Locate};

/// Writes a rational curve in another basis, exactly: as
/// [`convert`](crate::core::convert::convert), in homogeneous coordinates.
///
/// # Errors
/// As [`convert`](crate::core::convert::convert). At the basis: a weight that would not be positive
/// there.
pub fn convert<const D: usize, const H: usize>(
    context: &Context,
    curve: &Rational<D, H>,
    to: Basis,
    order: Option<usize>,
) -> Result<Converted<Rational<D, H>, D>, Error> {
    let lifted = curve.homogeneous(context).at(Argument::Curve)?;
    let found = homogeneous_convert(context, &lifted.curve, to, order)?;
    let curve =
        lifted.back(context, &found.curve).map_err(|error| error.fault.at(Argument::Basis))?;
    Ok(Converted { curve, condition: found.condition, construction: Vec::new() })
}
