//! The Bernstein basis: the Bezier curve itself.

use super::{Family, ShapeMatrix};
use crate::core::fault::Fault;

/// The basis without a shape parameter: degree = order, `M` = identity.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bezier;

impl Family for Bezier {
    fn name(&self) -> &'static str {
        "bezier"
    }

    fn degree(&self, order: usize) -> Result<usize, Fault> {
        Ok(order)
    }

    fn shape_matrix(&self, order: usize) -> ShapeMatrix {
        ShapeMatrix::from_fn(order + 1, order + 1, |i, j| f64::from(i == j))
    }

    fn is_identity(&self) -> bool {
        true
    }
}
