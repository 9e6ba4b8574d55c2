//! The control points of one segment of a known basis.

use super::data::Data;
use super::freedom::Freedom;
use super::parameters::distinct;
use super::reduced::{blocks, deficiency, solve_for_control_points};
use super::{Ends, Solved, Solver};
use crate::core::argument::Argument;
use crate::core::basis::{Basis, Bezier, ShapeMatrix};
use crate::core::context::Context;
use crate::core::curve::Single;
use crate::core::error::{Error, Locate};
use crate::core::fault::Fault;
use crate::core::point::Point;

/// Linear least squares for the control points.
pub(super) struct ControlPoints {
    basis: Basis,
    order: usize,
    matrix: ShapeMatrix,
}

impl ControlPoints {
    /// Checks that the basis suits the order and the ends.
    ///
    /// # Errors
    /// At `order` or `basis`.
    pub(super) fn new(
        context: &Context,
        basis: Basis,
        order: usize,
        ends: Ends,
    ) -> Result<Self, Error> {
        basis.degree(context, order).at(Argument::Order)?;
        let matrix = basis.shape_matrix(order);
        if ends == Ends::Interpolate && !matrix.interpolates_end_points() {
            let why = "curves of this basis do not start and end at their first and last control points (the first and last row of the \
                       shape matrix are not unit rows), so they cannot be made to pass through the first and last point; \
                       use ends \"free\"";
            return Err(Fault::UnsuitableBasis(why.into()).at(Argument::Basis));
        }
        Ok(ControlPoints { basis, order, matrix })
    }

    /// Why there is more than one solution.
    fn refuse_straight_limit(&self) -> Result<(), Error> {
        match &self.basis {
            Basis::Beta(beta) if beta.beta().is_infinite() && self.order > 1 => Err(Fault::RankDeficient(
                "lambda = 0 (beta = infinity) is the straight limit: the inner control points have no influence on the curve, so the data \
                 cannot determine them; use lambda > 0, or order 1"
                    .into(),
            )
            .at(Argument::Basis)
            .at(Argument::Solve)),
            _ => Ok(()),
        }
    }
}

impl<const D: usize> Solver<D> for ControlPoints {
    fn length(&self) -> f64 {
        self.basis.length()
    }

    fn solve(
        &self,
        context: &Context,
        data: &Data<D>,
        parameters: &[f64],
    ) -> Result<Solved<D>, Error> {
        self.refuse_straight_limit()?;
        let length = self.basis.length();
        let blocks = blocks(data, parameters, length, self.matrix.degree(), Point::ZERO);
        let points = solve_for_control_points(context, blocks, &self.matrix, data.fixed_ends())
            .map_err(|unsolved| {
                unsolved.explained(|deficient| {
                    let inner = |t: &f64| data.ends == Ends::Free || (*t > 0.0 && *t < length);
                    let count = distinct(parameters.iter().copied().filter(inner));
                    deficiency(
                        deficient,
                        count,
                        "control points",
                        "give more points, or a lower order",
                    )
                    .at(Argument::Order)
                    .at(Argument::Solve)
                })
            })?;
        let curve = Single::new(context, self.basis.clone(), points)
            .map_err(|error| Error::from(error.of_result().fault).at(Argument::Points))?;
        Ok(Solved { curve, iterations: 1, converged: true, at_bound: false })
    }

    fn lower(&self) -> Option<Box<dyn Solver<D>>> {
        let all_polynomials = self.matrix.degree() == self.order && self.basis.length() == 1.0;
        let (basis, order) = (Basis::Bezier(Bezier), self.order.checked_sub(1)?);
        let matrix = basis.shape_matrix(order);
        (all_polynomials && order > 1)
            .then(|| Box::new(ControlPoints { basis, order, matrix }) as Box<dyn Solver<D>>)
    }

    fn freedom(&self, _: &Single<D>, data: &Data<D>) -> Freedom<D> {
        Freedom::of_control_points(&self.matrix, data.ends)
    }
}
