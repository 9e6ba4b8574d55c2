//! Control points and shape matrix in turn.

use super::data::Data;
use super::freedom::Freedom;
use super::parameters::distinct;
use super::quasi::{best_matrix, centre, quasi_basis};
use super::reduced::{Reduced, deficiency, solve_for_control_points};
use super::shape::check_degree;
use super::unsolved::Unsolved;
use super::{Ends, Family, Solved, Solver};
use crate::core::argument::Argument;
use crate::core::basis::ShapeMatrix;
use crate::core::check::within_degrees;
use crate::core::context::Context;
use crate::core::curve::Single;
use crate::core::error::{Error, Locate};
use crate::core::fault::Fault;
use crate::core::point::{Point, magnitude};

/// The most rounds of alternation.
const ROUNDS: usize = 100;
/// A round that lowers the error by less than this part of it is the last.
const PROGRESS: f64 = 1e-6;

/// Alternates the best control points for a matrix and the best matrix for control points.
pub(super) struct Both {
    degree: usize,
    order: usize,
}

impl Both {
    /// Only a degree above the order leaves the data something to say about the shape.
    ///
    /// # Errors
    /// At `family`, `order` or `degree`.
    pub(super) fn new(context: &Context, family: Family, order: usize) -> Result<Self, Error> {
        let Family::Quasi { degree } = family else {
            return Err(
                undetermined("bezier, beta-bezier and alpha-beta-bezier").at(Argument::Family)
            );
        };
        within_degrees(context, "order", order).at(Argument::Order)?;
        check_degree(context, degree, order).at(Argument::Degree)?;
        if degree == order {
            return Err(undetermined("quasi-bezier with degree = order").at(Argument::Degree));
        }
        Ok(Both { degree, order })
    }
}

fn undetermined(families: &str) -> Fault {
    Fault::RankDeficient(format!(
        "the curves of {families} are all polynomials of their degree, for every regular value of the shape parameters; so with \
         control points sought too, the data cannot determine the shape. Use the kind \"control-points\" with a basis you choose, \
         or quasi-bezier with a degree above the order"
    ))
}

/// What alternation works on: data reduced to the Bezier points of the degree, counted from
/// `origin`.
struct Alternation<const D: usize> {
    reduced: Reduced<D>,
    fixed: Option<(Point<D>, Point<D>)>,
    degree: usize,
    ends: Ends,
}

/// A matrix, a polygon and their error.
struct State<const D: usize> {
    matrix: ShapeMatrix,
    polygon: Vec<Point<D>>,
    error: f64,
}

impl<const D: usize> Solver<D> for Both {
    fn solve(
        &self,
        context: &Context,
        data: &Data<D>,
        parameters: &[f64],
    ) -> Result<Solved<D>, Error> {
        let origin = centre(&data.points);
        let fixed = data.fixed_ends().map(|(first, last)| (first - origin, last - origin));
        let reduced = Reduced::new(context, data, parameters, self.degree, origin)?;
        let alternation = Alternation { reduced, fixed, degree: self.degree, ends: data.ends };
        let start = ShapeMatrix::elevation(self.degree, self.order);
        let first = alternation.best_polygon(context, start).map_err(|unsolved| {
            unsolved.explained(|deficient| {
                let inner = |t: &f64| data.ends == Ends::Free || (*t > 0.0 && *t < 1.0);
                let count = distinct(parameters.iter().copied().filter(inner));
                deficiency(deficient, count, "control points", "give more points, or a lower order")
                    .at(Argument::Order)
                    .at(Argument::Solve)
            })
        })?;
        let rounding = f64::EPSILON * alternation.reduced.norm() * magnitude(&data.points);
        let (best, iterations, converged) = alternation.descend(context, first, rounding)?;
        let mut points: Vec<_> = best.polygon.iter().map(|&p| p + origin).collect();
        if let Some((start, end)) = data.fixed_ends() {
            (points[0], points[self.order]) = (start, end);
        }
        let curve = Single::new(context, quasi_basis(context, &best.matrix)?, points)
            .map_err(|error| Error::from(error.of_result().fault).at(Argument::Points))?;
        Ok(Solved { curve, iterations, converged, at_bound: false })
    }

    fn is_exact(&self) -> bool {
        false
    }

    fn freedom(&self, curve: &Single<D>, _: &Data<D>) -> Freedom<D> {
        Freedom::of_motions(curve.bezier_points().len() - 1, Vec::new())
    }
}

impl<const D: usize> Alternation<D> {
    fn best_polygon(&self, context: &Context, matrix: ShapeMatrix) -> Result<State<D>, Unsolved> {
        let polygon =
            solve_for_control_points(context, self.reduced.blocks(), &matrix, self.fixed)?;
        let error = self.reduced.error(&matrix.apply(&polygon));
        Ok(State { matrix, polygon, error })
    }

    /// Rounds of both steps, while the error falls; a round that loses the rank of the matrix or
    /// the polygon is dropped. Also how many rounds there were, and whether progress ended them.
    fn descend(
        &self,
        context: &Context,
        first: State<D>,
        rounding: f64,
    ) -> Result<(State<D>, usize, bool), Error> {
        let mut best = first;
        for round in 1..=ROUNDS {
            if best.error <= rounding {
                return Ok((best, round, true));
            }
            let next = best_matrix(context, &self.reduced, &best.polygon, self.degree, self.ends)
                .and_then(|matrix| self.best_polygon(context, matrix))
                .ok()
                .filter(|next| {
                    next.error < best.error && quasi_basis(context, &next.matrix).is_ok()
                });
            // A round that was stopped is none that failed.
            context.checkpoint()?;
            let Some(next) = next else { return Ok((best, round, true)) };
            let little = best.error - next.error <= PROGRESS * best.error;
            best = next;
            if little {
                return Ok((best, round, true));
            }
        }
        Ok((best, ROUNDS, false))
    }
}
