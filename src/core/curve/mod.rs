//! Curves: one segment, several, or a B-spline, and the Bezier segments they all have in common.

mod bspline;
mod composite;
mod piecewise;
mod single;

pub use bspline::BSpline;
pub use composite::{Composite, Evaluator, Segment};
pub(crate) use piecewise::PerSegment;
pub use piecewise::{Bases, Piecewise};
pub use single::Single;

use bytemuck::TransparentWrapper;

use super::check::{at_least, at_most};
use super::error::Error;
use super::fault::Fault;
use super::point::Point;
use crate::core::context::Context;
use crate::core::linear::lanes::are_finite;

/// Any curve.
///
/// ```
/// use springline::core::basis::{Basis, Bezier};
/// use springline::core::context::Context;
/// use springline::core::curve::{BSpline, Curve, Single};
/// use springline::core::point::Point;
///
/// let context = Context::default();
/// let points = [[0.0, 0.0], [1.0, 2.0], [2.0, 0.0]].map(Point).to_vec();
/// let single = Single::new(&context, Basis::Bezier(Bezier), points.clone())?;
/// let knots = vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0];
/// let spline = BSpline::new(&context, 2, knots, points, false)?;
/// // What all curves have in common is their Bezier segments.
/// let [a, b] = [Curve::Single(single), Curve::BSpline(spline)];
/// assert_eq!(a.composite(&context)?.segment(0), b.composite(&context)?.segment(0));
/// # Ok::<_, springline::core::error::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub enum Curve<const D: usize> {
    /// One segment of one family.
    Single(Single<D>),
    /// Segments joined end to end.
    Piecewise(Piecewise<D>),
    /// A B-spline.
    BSpline(BSpline<D>),
}

impl<const D: usize> Curve<D> {
    /// The curve as Bezier segments over its native domain.
    ///
    /// # Errors
    /// A B-spline with more spans than [`SEGMENTS`](crate::core::limits::SEGMENTS).
    pub fn composite(&self, context: &Context) -> Result<Composite<D>, Error> {
        match self {
            Curve::Single(curve) => curve.composite(context),
            Curve::Piecewise(curve) => curve.composite(context),
            Curve::BSpline(curve) => curve.composite(context),
        }
    }

    /// The control points.
    pub fn control_points(&self) -> &[Point<D>] {
        match self {
            Curve::Single(curve) => curve.control_points(),
            Curve::Piecewise(curve) => curve.control_points(),
            Curve::BSpline(curve) => curve.control_points(),
        }
    }

    /// The curve of the same kind with as many other control points, which may be of another
    /// dimension.
    ///
    /// # Errors
    /// Points that are not finite; of a closed curve, ends that are apart.
    pub(crate) fn with_points<const E: usize>(
        &self,
        context: &Context,
        points: Vec<Point<E>>,
    ) -> Result<Curve<E>, Error> {
        Ok(match self {
            Curve::Single(curve) => {
                Curve::Single(Single::new(context, curve.basis().clone(), points)?)
            }
            Curve::Piecewise(curve) => {
                let (bases, breaks) = (curve.bases().clone(), curve.breaks().clone());
                let (order, closed) = (curve.order(), curve.closed());
                Curve::Piecewise(Piecewise::new(context, bases, order, breaks, closed, points)?)
            }
            Curve::BSpline(curve) => {
                let knots = curve.knots().as_slice().to_vec();
                let (degree, closed) = (curve.degree(), curve.closed());
                Curve::BSpline(BSpline::new(context, degree, knots, points, closed)?)
            }
        })
    }

    /// Whether the curve is declared to end where it starts.
    pub fn closed(&self) -> bool {
        match self {
            Curve::Single(_) => false,
            Curve::Piecewise(curve) => curve.closed(),
            Curve::BSpline(curve) => curve.closed(),
        }
    }
}

/// Checks the number of points and that every coordinate is finite.
pub(crate) fn valid_points<const D: usize>(
    context: &Context,
    points: &[Point<D>],
    least: usize,
) -> Result<(), Error> {
    at_least("control points", points.len(), least)?;
    at_most(
        "control points",
        points.len(),
        context.limits.control_points,
        "Send the curve in parts",
    )?;
    finite_points(points)
}

/// Checks that every coordinate is finite.
pub(crate) fn finite_points<const D: usize>(points: &[Point<D>]) -> Result<(), Error> {
    // All at once before the search for the one to name.
    if are_finite(Point::peel_slice(points).as_flattened()) {
        return Ok(());
    }
    match points.iter().position(|p| !p.is_finite()) {
        Some(i) => Err(Fault::NotFinite.at(i)),
        None => Ok(()),
    }
}
