//! Whether shape parameters move a curve at all.

use crate::core::argument::Argument;
use crate::core::error::Error;
use crate::core::fault::Fault;
use crate::core::point::{Point, magnitude};

/// Below this, differences between the curves of two shapes are rounding.
pub(super) fn rounding<const D: usize>(norm: f64, polygon: &[Point<D>]) -> f64 {
    64.0 * f64::EPSILON * norm * magnitude(polygon)
}

/// The error where the shape parameter does not move the curve at any data parameter.
pub(super) fn no_influence(parameter: &str) -> Error {
    let why = format!(
        "{parameter} has no influence on the curve of this control polygon at the data's parameters, so the data cannot determine it; \
         use other control points, or seek the control points instead"
    );
    Fault::RankDeficient(why).at(Argument::ControlPoints).at(Argument::Solve)
}
