//! How the curve of a solver may change while the parameters do.

use nalgebra::DMatrix;

use super::Ends;
use crate::core::basis::ShapeMatrix;
use crate::core::point::Point;

/// Directions in which the Bezier points of a segment may move.
#[derive(Debug, Clone)]
pub(super) struct Freedom<const D: usize> {
    /// Bernstein coefficients of functions of the parameter, one in each column.
    pub(super) functions: DMatrix<f64>,
    /// How the functions, times vectors, add up to the motions; none means that every function
    /// moves along every axis by itself.
    pub(super) motions: Option<Vec<Vec<Point<D>>>>,
}

impl<const D: usize> Freedom<D> {
    /// Every control point moves, except those held at the ends. Linear least squares.
    pub(super) fn of_control_points(matrix: &ShapeMatrix, ends: Ends) -> Self {
        let held = usize::from(ends == Ends::Interpolate);
        let count = (matrix.order() + 1).saturating_sub(2 * held);
        let entry = |i: usize, j: usize| matrix.row(i)[j + held];
        let functions = DMatrix::from_fn(matrix.degree() + 1, count, entry);
        Freedom { functions, motions: None }
    }

    /// The Bezier points move together in these ways: each a vector for every Bezier point.
    pub(super) fn of_motions(degree: usize, motions: Vec<Vec<Point<D>>>) -> Self {
        Freedom { functions: DMatrix::identity(degree + 1, degree + 1), motions: Some(motions) }
    }
}
