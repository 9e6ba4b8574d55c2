//! Shape parameters of a segment whose control polygon is given.

use super::alpha_beta::AlphaBetaShape;
use super::beta::BetaShape;
use super::data::Data;
use super::quasi::ShapeFit;
use super::{Family, Solver};
use crate::core::argument::Argument;
use crate::core::basis::{AlphaBeta, Basis};
use crate::core::check::at_most;
use crate::core::check::within_degrees;
use crate::core::context::Context;
use crate::core::curve::valid_points;
use crate::core::error::{Error, Locate};
use crate::core::fault::Fault;
use crate::core::point::Point;

/// The solver for the shape of this family.
///
/// # Errors
/// At `solve/family`, `solve/degree`, `solve/control_points` or `ends`.
pub(super) fn solver<const D: usize>(
    context: &Context,
    family: Family,
    polygon: Vec<Point<D>>,
    data: &Data<D>,
) -> Result<Box<dyn Solver<D>>, Error> {
    check_polygon(context, &polygon, data)?;
    Ok(match family {
        Family::Bezier => {
            let why = "bezier curves have no shape parameter to seek; use the kind \"control-points\", or a family with shape parameters";
            return Err(Fault::UnsuitableBasis(why.into())
                .at(Argument::Family)
                .at(Argument::Solve));
        }
        Family::Beta => Box::new(BetaShape::new(polygon)),
        Family::AlphaBeta => {
            let basis = Basis::AlphaBeta(AlphaBeta::new(1.0, 3.0)?);
            basis
                .degree(context, polygon.len() - 1)
                .at(Argument::ControlPoints)
                .at(Argument::Solve)?;
            Box::new(AlphaBetaShape::new(polygon))
        }
        Family::Quasi { degree } => {
            check_degree(context, degree, polygon.len() - 1)
                .at(Argument::Degree)
                .at(Argument::Solve)?;
            Box::new(ShapeFit::new(degree, polygon))
        }
    })
}

/// A polygon a segment may have, that ends where the curve must end.
fn check_polygon<const D: usize>(
    context: &Context,
    polygon: &[Point<D>],
    data: &Data<D>,
) -> Result<(), Error> {
    valid_points(context, polygon, 2)
        .and_then(|()| {
            Ok(at_most(
                "control points",
                polygon.len(),
                context.limits.degree + 1,
                "Use several segments of lower order",
            )?)
        })
        .at(Argument::ControlPoints)
        .at(Argument::Solve)?;
    let ends = Some((polygon[0], polygon[polygon.len() - 1]));
    if data.fixed_ends().is_some_and(|fixed| Some(fixed) != ends) {
        let why = "the control polygon does not start at the first point and end at the last, so no shape makes its curve do so; \
                   use ends \"free\"";
        return Err(Fault::Contradiction(why.into()).at(Argument::Ends));
    }
    Ok(())
}

/// Degrees a quasi-bezier curve of this order may have (Chen 2013 Note 3).
pub(super) fn check_degree(context: &Context, degree: usize, order: usize) -> Result<(), Fault> {
    within_degrees(context, "degree", degree)?;
    if degree >= order {
        return Ok(());
    }
    let allowed = format!("degree >= order = {order}");
    Err(Fault::OutOfRange { what: "degree", value: degree as f64, allowed })
}
