//! Surfaces with weights: a patch one dimension up, and how it comes back.

use super::{Patch, Surface};
use crate::core::basis::Basis;
use crate::core::bezier_form::binomials;
use crate::core::context::Context;
use crate::core::error::{Error, Locate, Step, every};
use crate::core::fault::Fault;
use crate::core::homogeneous::{numerator, projected, weight};
use crate::core::local::placed;
use crate::core::point::{Point, larger};
use crate::core::weights::Weights;

/// A surface in Bezier form.
#[derive(Debug, Clone, PartialEq)]
pub enum Shape {
    /// Without weights.
    Polynomial(Patch<3>),
    /// With weights.
    Rational(RationalPatch),
}

impl Shape {
    /// The ranges of `u` and `v`.
    pub fn domain(&self) -> [(f64, f64); 2] {
        match self {
            Shape::Polynomial(patch) => patch.domain(),
            Shape::Rational(rational) => rational.patch.domain(),
        }
    }

    /// The point at parameters inside the domain.
    pub fn at(&self, u: f64, v: f64) -> Point<3> {
        match self {
            Shape::Polynomial(patch) => patch.at(u, v),
            Shape::Rational(rational) => rational.placed(rational.patch.at(u, v)),
        }
    }

    /// The Bezier points; the surface lies in their convex hull.
    pub fn hull(&self) -> Vec<Point<3>> {
        match self {
            Shape::Polynomial(patch) => patch.rows().flatten().copied().collect(),
            Shape::Rational(rational) => {
                rational.patch.rows().flatten().map(|&h| rational.placed(h)).collect()
            }
        }
    }
}

/// A rational Bezier patch with positive weights.
#[derive(Debug, Clone, PartialEq)]
pub struct RationalPatch {
    /// Homogeneous points, relative to the origin; every weight in it is this much larger.
    pub(super) patch: Patch<4>,
    pub(super) origin: Point<3>,
    pub(super) unit: f64,
}

impl RationalPatch {
    pub(super) fn has_positive_weights(&self) -> bool {
        self.patch.rows().flatten().all(|&h| weight(h) > 0.0)
    }

    /// A homogeneous point where it lies in space.
    pub(super) fn placed(&self, h: Point<4>) -> Point<3> {
        placed(self.origin, projected(h))
    }

    /// How large what `A - S w` is made of can be, derivatives aside: its rounding errors, and so
    /// those of derivatives times the weight, are measured in it.
    pub(super) fn magnitude(&self) -> f64 {
        let points = || self.patch.rows().flatten().copied();
        let most = |size: fn(Point<4>) -> f64| points().map(size).fold(0.0, larger);
        let point = most(|h| projected::<3, 4>(h).max_abs());
        most(|h| numerator::<3, 4>(h).max_abs()) + point * most(weight)
    }

    /// The surface in these bases whose homogeneous net this is.
    pub(super) fn surface(
        &self,
        context: &Context,
        [u, v]: [Basis; 2],
        net: &[Vec<Point<4>>],
    ) -> Result<Surface, Fault> {
        let unsuitable = || {
            let why = "a piece would have a weight that is not positive, or too small beside the \
                       others; ask for the form bezier or auto, or cut elsewhere";
            Fault::UnsuitableBasis(why.into())
        };
        let weights: Vec<f64> = net.iter().flatten().map(|&h| weight(h) / self.unit).collect();
        let count = weights.len();
        let weights = Weights::new(weights, count).map_err(|_| unsuitable())?;
        let points = net.iter().map(|row| row.iter().map(|&h| self.placed(h)).collect()).collect();
        let surface =
            Surface::new(context, u, v, points).map_err(|error| error.of_result().fault)?;
        surface.with_weights(weights).map_err(|_| unsuitable())
    }
}

/// The orders in `u` and `v` of the partial derivatives in a list.
const ORDERS: [(usize, usize); 6] = [(0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)];

/// The point and the partial derivatives, as many as are given, from those in homogeneous
/// coordinates, in the order itself, u, v, uu, uv, vv.
///
/// The quotient rule for two variables (Piegl and Tiller 1997, eq. 4.20), with `E = A - S w`
/// at this point instead of `A`, so that less cancels: `S^(k,l) w = E^(k,l) - sum of binomial(k, i)
/// binomial(l, j) w^(i,j) S^(k-i,l-j)` over all `(i, j)` but the first and the last.
pub(super) fn project_partials(partials: &[Point<4>]) -> [Point<3>; 6] {
    let (w, mut found) = (weight(partials[0]), [Point::ZERO; 6]);
    found[0] = projected(partials[0]);
    for (at, &h) in partials.iter().enumerate().skip(1) {
        let (k, l) = ORDERS[at];
        let mut sum = numerator::<3, 4>(h) - found[0] * weight(h);
        for (&(i, j), &other) in ORDERS[..at].iter().zip(partials).skip(1) {
            if i > k || j > l {
                continue;
            }
            let rest = ORDERS[..at].iter().position(|&order| order == (k - i, l - j));
            let factor = binomials(k)[i] * binomials(l)[j] * weight(other);
            sum = sum - found[rest.unwrap_or(0)] * factor;
        }
        found[at] = sum.map(|x| x / w);
    }
    found
}

/// The weights of a net of so many rows and columns, row after row.
///
/// # Errors
/// Another count; at a row and a column: see [`Weights::new`].
pub fn net_weights(weights: Vec<Vec<f64>>, rows: usize, columns: usize) -> Result<Weights, Error> {
    let counted = |what, count, expected, rule| {
        if count == expected {
            return Ok(());
        }
        Err(Fault::WrongCount { what, count, expected, rule })
    };
    let rule = "as many rows of weights as of control points";
    counted("rows of weights", weights.len(), rows, rule)?;
    let rule = "one weight per control point";
    let row = |(i, row): (usize, &Vec<f64>)| counted("weights", row.len(), columns, rule).at(i);
    every(weights.iter().enumerate().map(row))?;
    Weights::new(weights.concat(), rows * columns).map_err(|error| {
        let in_rows = |error: Error| {
            let step = error.place.steps().next().copied();
            match step {
                Some(Step::Index(i)) => error.fault.at(i % columns).at(i / columns),
                _ => error,
            }
        };
        let all = error.each().into_iter().map(in_rows);
        all.reduce(Error::and).unwrap_or_else(|| Fault::Cancelled.into())
    })
}
