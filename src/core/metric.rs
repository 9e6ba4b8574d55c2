//! Distances of what the coordinates of a composite stand for.

use super::bezier_form;
use super::homogeneous::{self, projected};
use super::point::Point;

/// What lengths and distances mean for a composite: its coordinates may be those of points, or
/// homogeneous ones.
pub(crate) trait Metric<const H: usize> {
    /// A bound for the distance of a Bezier segment, its points given from an origin, from its
    /// chord, and of the chord from the segment.
    fn chord_error(&self, origin: Point<H>, points: &[Point<H>]) -> f64;

    /// The largest absolute coordinate of a point.
    fn magnitude(&self, point: Point<H>) -> f64;

    /// How far apart two points are.
    fn distance(&self, a: Point<H>, b: Point<H>) -> f64;
}

/// Coordinates are those of points.
pub(crate) struct Affine;

impl<const D: usize> Metric<D> for Affine {
    fn chord_error(&self, _: Point<D>, points: &[Point<D>]) -> f64 {
        bezier_form::chord_error(points)
    }

    fn magnitude(&self, point: Point<D>) -> f64 {
        point.max_abs()
    }

    fn distance(&self, a: Point<D>, b: Point<D>) -> f64 {
        a.distance(b)
    }
}

/// Coordinates are homogeneous, of points from this origin.
pub(crate) struct Projective<const D: usize>(pub(crate) Point<D>);

impl<const D: usize, const H: usize> Metric<H> for Projective<D> {
    fn chord_error(&self, origin: Point<H>, points: &[Point<H>]) -> f64 {
        homogeneous::chord_error::<D, H>(points.iter().map(|&p| origin + p))
    }

    fn magnitude(&self, point: Point<H>) -> f64 {
        (self.0 + projected::<D, H>(point)).max_abs()
    }

    fn distance(&self, a: Point<H>, b: Point<H>) -> f64 {
        projected::<D, H>(a).distance(projected(b))
    }
}
