//! Tensor-product surfaces: one basis for each direction. Li 2014 eq. (15) is the alpha-beta case.
//! With weights they are rational (Piegl and Tiller 1997, section 4.4).

mod evaluate;
mod patch;
mod rational;
mod subdivide;
mod tessellate;

pub use evaluate::{Places, SurfaceQuantities, SurfaceSamples, check_orders, evaluate};
pub use patch::{Direction, Patch};
pub use rational::{RationalPatch, Shape, net_weights};
pub use subdivide::{PatchPiece, Pieces, subdivide};
pub use tessellate::{Mesh, tessellate};

use super::argument::Argument;
use super::basis::Basis;
use super::check::{at_least, at_most};
use super::curve::finite_points;
use super::domain::Domain;
use super::error::{Error, Locate};
use super::fault::Fault;
use super::homogeneous;
use super::local::localized;
use super::point::Point;
use super::weights::Weights;
use crate::core::context::Context;

/// A control net with a basis for each direction. `u` runs along the columns of points (from row to
/// row of the net), `v` along its rows; each over the native domain of its basis.
#[derive(Debug, Clone, PartialEq)]
pub struct Surface {
    bases: [Basis; 2],
    columns: usize,
    /// Row after row.
    points: Vec<Point<3>>,
    /// As the points are; none where all are the same.
    weights: Option<Weights>,
}

impl Surface {
    /// Joins two bases and a control net of `order_u + 1` rows of `order_v + 1` points.
    ///
    /// # Errors
    /// At `control_net`: rows of different lengths, fewer than 2 rows or columns, too many points;
    /// at `u` or `v`: a basis that does not suit its order.
    pub fn new(
        context: &Context,
        u: Basis,
        v: Basis,
        net: Vec<Vec<Point<3>>>,
    ) -> Result<Self, Error> {
        at_least("rows of control points", net.len(), 2).at(Argument::ControlNet)?;
        let columns = net[0].len();
        at_least("control points in a row", columns, 2).at(0).at(Argument::ControlNet)?;
        at_most(
            "control points",
            net.len().saturating_mul(columns),
            context.limits.control_points,
            "Send the surface in parts",
        )
        .at(Argument::ControlNet)?;
        for (i, row) in net.iter().enumerate() {
            if row.len() != columns {
                let rule = "every row of a control net has as many points as the first";
                return Err(Fault::WrongCount {
                    what: "control points",
                    count: row.len(),
                    expected: columns,
                    rule,
                }
                .at(i)
                .at(Argument::ControlNet));
            }
            finite_points(row).at(i).at(Argument::ControlNet)?;
        }
        u.degree(context, net.len() - 1).at(Argument::U)?;
        v.degree(context, columns - 1).at(Argument::V)?;
        Ok(Surface { bases: [u, v], columns, points: net.concat(), weights: None })
    }

    /// The surface with a weight for each point of its net, row after row; where all are the same
    /// they mean nothing, and the surface has none.
    ///
    /// # Errors
    /// At `weights`: another count than points; weights whose sum in the denominator is not shown
    /// to be positive, as basis functions are negative somewhere.
    pub fn with_weights(self, weights: Weights) -> Result<Self, Error> {
        let (count, expected) = (weights.as_slice().len(), self.points.len());
        if count != expected {
            let (what, rule) = ("weights", "one weight per control point");
            return Err(Fault::WrongCount { what, count, expected, rule }.at(Argument::Weights));
        }
        if weights.are_equal() {
            return Ok(Surface { weights: None, ..self });
        }
        let surface = Surface { weights: Some(weights), ..self };
        match surface.shape() {
            Shape::Rational(rational) if !rational.has_positive_weights() => {
                let why = "with these weights the Bezier form of the surface has a weight that is \
                           not positive, as a basis is negative somewhere; use weights that differ \
                           less, or another basis";
                Err(Fault::UnsuitableBasis(why.into()).at(Argument::Weights))
            }
            _ => Ok(surface),
        }
    }

    /// The bases of `u` and `v`.
    pub fn bases(&self) -> &[Basis; 2] {
        &self.bases
    }

    /// One less than rows and columns of the net.
    pub fn orders(&self) -> [usize; 2] {
        [self.points.len() / self.columns - 1, self.columns - 1]
    }

    /// The ranges of `u` and `v`.
    pub fn domain(&self) -> [(f64, f64); 2] {
        [(0.0, self.bases[0].length()), (0.0, self.bases[1].length())]
    }

    /// The rows of the control net.
    pub fn rows(&self) -> impl ExactSizeIterator<Item = &[Point<3>]> {
        self.points.chunks_exact(self.columns)
    }

    /// The rows of weights, if the surface is rational.
    pub fn weights(&self) -> Option<impl ExactSizeIterator<Item = &[f64]>> {
        self.weights.as_ref().map(|weights| weights.as_slice().chunks_exact(self.columns))
    }

    /// The same surface in Bezier form.
    pub fn shape(&self) -> Shape {
        let Some(weights) = &self.weights else {
            return Shape::Polynomial(self.patch(&self.points));
        };
        let unit = weights.unit();
        let (origin, points) = localized(&self.points);
        let pairs = points.iter().zip(weights.as_slice());
        let lifted: Vec<_> = pairs.map(|(&p, w)| homogeneous::lifted(p, w * unit)).collect();
        Shape::Rational(RationalPatch { patch: self.patch(&lifted), origin, unit })
    }

    /// The Bezier patch of a net: `Q = M_u P M_v^T`.
    fn patch<const D: usize>(&self, net: &[Point<D>]) -> Patch<D> {
        let [order_u, order_v] = self.orders();
        let by_v = self.bases[1].shape_matrix(order_v);
        let rows: Vec<_> = net.chunks_exact(self.columns).map(|row| by_v.apply(row)).collect();
        let by_u = self.bases[0].shape_matrix(order_u);
        let columns: Vec<Vec<Point<D>>> =
            (0..=by_v.degree()).map(|j| by_u.apply(&column(&rows, j))).collect();
        let rows =
            (0..=by_u.degree()).flat_map(|i| columns.iter().map(move |column| column[i])).collect();
        Patch::new([by_u.degree(), by_v.degree()], self.domain(), rows)
    }
}

/// The ranges of a surface's parameters.
fn domains(ends: [(f64, f64); 2]) -> [Domain<'static>; 2] {
    let [u, v] = ends;
    [Domain { ends: u, name: "u", of: "surface" }, Domain { ends: v, name: "v", of: "surface" }]
}

fn column<const D: usize>(rows: &[Vec<Point<D>>], j: usize) -> Vec<Point<D>> {
    rows.iter().map(|row| row[j]).collect()
}
