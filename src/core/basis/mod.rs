//! The families of basis functions, and the one enum through which the rest of the code meets them.
//!
//! To add a family: a file here that implements `Family`, a variant of [`Basis`], an arm of
//! `Basis::family`, and a variant on the wire.

mod alpha_beta;
mod beta;
mod bezier;
mod quasi;
mod shape_matrix;

pub use alpha_beta::AlphaBeta;
pub use beta::Beta;
pub use bezier::Bezier;
pub use quasi::{Quasi, ShapeParameters};
pub use shape_matrix::{Properties, ShapeMatrix};

use super::check::within_degrees;
use super::fault::Fault;
use super::limits;
use crate::core::context::Context;

/// What a family of curves is: how its shape parameters make the shape matrix.
trait Family {
    /// The name on the wire.
    fn name(&self) -> &'static str;

    /// The degree of the curve for a control polygon of this order, or why there is none.
    fn degree(&self, order: usize) -> Result<usize, Fault>;

    /// The length of the native parameter domain, which starts at 0.
    fn length(&self) -> f64 {
        1.0
    }

    /// The lowest order the family has with these parameters, if not any.
    fn own_order(&self) -> Option<usize> {
        None
    }

    /// `M` for an order that [`Family::degree`] accepts.
    fn shape_matrix(&self, order: usize) -> ShapeMatrix;

    /// Whether `M` is the identity, so that Bezier points are control points.
    fn is_identity(&self) -> bool {
        false
    }

    /// `M^-1` where `M` is square and regular. A family with a closed form overrides this.
    fn inverse(&self, order: usize) -> Option<ShapeMatrix> {
        inverse_by_elimination(&self.shape_matrix(order))
    }

    /// Why [`Family::inverse`] is `None`.
    fn no_inverse_because(&self) -> String {
        format!(
            "the shape matrix of this {} basis is singular; ask for the bezier form",
            self.name()
        )
    }
}

/// A basis: a family with its shape parameters, each within its range.
///
/// ```
/// use springline::core::basis::{Basis, Beta};
///
/// let basis = Basis::Beta(Beta::from_beta(1.0)?);
/// // Bezier point 1 of a cubic is (7 P0 + 6 P1 + 3 P2 + 2 P3) / 18.
/// let matrix = basis.shape_matrix(3);
/// let expected = [7.0, 6.0, 3.0, 2.0].map(|x| x / 18.0);
/// assert!(matrix.row(1).iter().zip(expected).all(|(x, y)| (x - y).abs() < 1e-15));
///
/// // A parameter out of its range makes no basis. The error says which, and what is allowed.
/// let Err(error) = Beta::from_beta(-1.0) else { panic!("beta is negative") };
/// assert_eq!(error.place.to_string(), "/beta");
/// assert!(error.fault.to_string().contains("beta >= 0"));
/// # Ok::<_, springline::core::error::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub enum Basis {
    /// Bernstein polynomials.
    Bezier(Bezier),
    /// Cheng et al. 2021.
    Beta(Beta),
    /// Li 2014.
    AlphaBeta(AlphaBeta),
    /// Chen 2013.
    Quasi(Quasi),
}

/// A way back from Bezier points to control points, with what it costs in accuracy.
#[derive(Debug, Clone)]
pub struct WayBack {
    inverse: Option<ShapeMatrix>,
    /// The 2-norm condition number of the shape matrix: the factor by which it may amplify relative
    /// errors.
    pub condition: f64,
}

impl Basis {
    fn family(&self) -> &dyn Family {
        match self {
            Basis::Bezier(family) => family,
            Basis::Beta(family) => family,
            Basis::AlphaBeta(family) => family,
            Basis::Quasi(family) => family,
        }
    }

    /// The name of the family on the wire.
    pub fn name(&self) -> &'static str {
        self.family().name()
    }

    /// The degree of a curve whose control polygon has this order (one less than its points).
    ///
    /// # Errors
    /// The order does not suit the family, or order or degree exceed [`limits::DEGREE`].
    pub fn degree(&self, context: &Context, order: usize) -> Result<usize, Fault> {
        within_degrees(context, "order", order)?;
        let degree = self.family().degree(order)?;
        within_degrees(context, "degree", degree)?;
        Ok(degree)
    }

    /// The length of the native parameter domain, which starts at 0: `alpha` for alpha-beta-Bezier,
    /// else 1.
    pub fn length(&self) -> f64 {
        self.family().length()
    }

    /// The lowest order the basis serves, for families that do not serve any.
    pub fn own_order(&self) -> Option<usize> {
        self.family().own_order()
    }

    /// The shape matrix for an order that [`Basis::degree`] accepts. O(n^3) for Beta-Bezier, else
    /// O(d n).
    pub fn shape_matrix(&self, order: usize) -> ShapeMatrix {
        self.family().shape_matrix(order)
    }

    /// Whether Bezier points are control points.
    pub fn is_identity(&self) -> bool {
        self.family().is_identity()
    }

    /// Whether curves of this basis start and end at their first and last control points.
    pub fn interpolates_end_points(&self, order: usize) -> bool {
        self.is_identity() || self.shape_matrix(order).interpolates_end_points()
    }

    /// Whether segments of this basis and order meet in a shared control point.
    ///
    /// # Errors
    /// An order that does not suit the family; a basis that does not start and end at its control
    /// points.
    pub fn joinable(&self, context: &Context, order: usize) -> Result<(), Fault> {
        self.degree(context, order)?;
        if self.interpolates_end_points(order) {
            return Ok(());
        }
        Err(Fault::UnsuitableBasis(
            "the segments of a piecewise curve share control points, so each basis must start and end at its first and last one: \
             the first and last row of its shape matrix are unit rows (Chen 2013 Proposition 6)"
                .into(),
        ))
    }

    /// The way back from Bezier points to the control points of this basis.
    ///
    /// # Errors
    /// The degree exceeds the order, the matrix is singular, or its condition number is above
    /// [`limits::CONDITION`], so that fewer than 8 digits would be right.
    pub fn way_back(&self, context: &Context, order: usize) -> Result<WayBack, Fault> {
        let degree = self.degree(context, order)?;
        if self.is_identity() {
            return Ok(WayBack { inverse: None, condition: 1.0 });
        }
        if degree != order {
            return Err(Fault::UnsuitableBasis(format!(
                "a {} basis of order {order} and degree {degree} has no way back to its control points: {} Bezier points, {} control points; \
                 use a basis whose degree is its order, or the bezier form",
                self.name(),
                degree + 1,
                order + 1
            )));
        }
        let condition = self.shape_matrix(order).condition();
        let Some(inverse) = self.family().inverse(order) else {
            return Err(Fault::UnsuitableBasis(self.family().no_inverse_because()));
        };
        if condition > limits::CONDITION || condition.is_nan() {
            return Err(Fault::IllConditioned { condition });
        }
        Ok(WayBack { inverse: Some(inverse), condition })
    }
}

impl WayBack {
    /// Whether Bezier points are control points.
    pub fn is_identity(&self) -> bool {
        self.inverse.is_none()
    }

    /// The control points of these Bezier points.
    pub fn control_points<const D: usize>(
        &self,
        bezier: &[super::point::Point<D>],
    ) -> Vec<super::point::Point<D>> {
        match &self.inverse {
            Some(inverse) => inverse.apply(bezier),
            None => bezier.to_vec(),
        }
    }
}

/// `M^-1` by LU decomposition with partial pivoting; `None` where `M` is not square or is singular.
fn inverse_by_elimination(matrix: &ShapeMatrix) -> Option<ShapeMatrix> {
    if matrix.degree() != matrix.order() {
        return None;
    }
    let inverse = matrix.dense().try_inverse()?;
    Some(ShapeMatrix::from_fn(inverse.nrows(), inverse.ncols(), |i, j| inverse[(i, j)]))
}
