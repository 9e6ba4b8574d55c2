//! Linear algebra: least squares by orthogonal reflections, and what it needs.

pub(crate) mod householder;
pub(crate) mod lanes;
pub(crate) mod least_change;
pub mod least_squares;
pub(crate) mod quadratic_program;
pub(crate) mod singular_values;
