//! One segment of one family.

use super::composite::{Composite, single_segment};
use super::valid_points;
use crate::core::argument::Argument;
use crate::core::basis::Basis;
use crate::core::check::at_most;
use crate::core::context::Context;
use crate::core::error::{Error, Locate};
use crate::core::local::{localized, placed};
use crate::core::point::Point;

/// A control polygon and a basis that suits its order. The parameter runs over `[0, 1]`, for
/// alpha-beta-Bezier over `[0, alpha]`.
#[derive(Debug, Clone, PartialEq)]
pub struct Single<const D: usize> {
    basis: Basis,
    points: Vec<Point<D>>,
}

impl<const D: usize> Single<D> {
    /// Joins a basis and a control polygon.
    ///
    /// # Errors
    /// At `control_points`: fewer than 2, more than the basis or the limit allows, not finite.
    pub fn new(context: &Context, basis: Basis, points: Vec<Point<D>>) -> Result<Self, Error> {
        valid_points(context, &points, 2).at(Argument::ControlPoints)?;
        at_most(
            "control points",
            points.len(),
            context.limits.degree + 1,
            "Use several segments of lower degree",
        )
        .at(Argument::ControlPoints)?;
        basis.degree(context, points.len() - 1).at(Argument::ControlPoints)?;
        Ok(Single { basis, points })
    }

    /// The basis.
    pub fn basis(&self) -> &Basis {
        &self.basis
    }

    /// The control polygon.
    pub fn control_points(&self) -> &[Point<D>] {
        &self.points
    }

    /// One less than the number of control points.
    pub fn order(&self) -> usize {
        self.points.len() - 1
    }

    /// The Bezier points of the same curve.
    pub fn bezier_points(&self) -> Vec<Point<D>> {
        let (origin, points) = self.local_bezier_points();
        points.into_iter().map(|p| placed(origin, p)).collect()
    }

    /// The same from an origin.
    fn local_bezier_points(&self) -> (Point<D>, Vec<Point<D>>) {
        let (origin, points) = localized(&self.points);
        (
            origin,
            if self.basis.is_identity() {
                points
            } else {
                self.basis.shape_matrix(self.order()).apply(&points)
            },
        )
    }

    /// The curve as a composite of one segment.
    ///
    /// # Errors
    /// None that a valid curve can cause, as the domain `[0, alpha]` has positive length;
    /// [`Fault::Cancelled`](crate::core::fault::Fault).
    pub fn composite(&self, context: &Context) -> Result<Composite<D>, Error> {
        context.checkpoint()?;
        let (origin, bezier) = self.local_bezier_points();
        single_segment(context, self.basis.length(), origin, bezier)
    }

    /// The parts.
    pub fn into_parts(self) -> (Basis, Vec<Point<D>>) {
        (self.basis, self.points)
    }
}
