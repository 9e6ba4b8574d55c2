//! A curve as the picture plane sees it.

use crate::core::context::Context;
use crate::core::curve::Curve;
use crate::core::error::Error;
use crate::core::point::Point;
use crate::draw::comb::{Tooth, teeth};

/// A curve in the plane of the picture.
#[derive(Debug, Clone)]
pub struct Sketch {
    /// The Bezier points of each segment.
    pub segments: Vec<Vec<Point<2>>>,
    /// The control points.
    pub polygon: Vec<Point<2>>,
    /// The curvature comb, where it is wanted.
    pub teeth: Vec<Tooth>,
}

impl Sketch {
    /// Projects a curve.
    ///
    /// # Errors
    /// A B-spline with too many spans.
    pub fn of<const D: usize>(
        context: &Context,
        curve: &Curve<D>,
        view: fn(Point<D>) -> Point<2>,
        comb: bool,
    ) -> Result<Self, Error> {
        let composite = curve.composite(context)?;
        Ok(Sketch {
            segments: context.collect(
                composite.locals().map(|segment| segment.absolute().map(view).collect()),
            )?,
            polygon: curve.control_points().iter().copied().map(view).collect(),
            teeth: if comb { teeth(context, &composite, view)? } else { Vec::new() },
        })
    }

    /// Where segments start and end, each place once where neighbours meet.
    pub fn joints(&self) -> Vec<Point<2>> {
        let mut joints: Vec<Point<2>> = Vec::with_capacity(self.segments.len() + 1);
        for segment in &self.segments {
            let ends = [segment[0], segment[segment.len() - 1]];
            ends.into_iter().for_each(|end| {
                if joints.last() != Some(&end) {
                    joints.push(end);
                }
            });
        }
        if joints.len() > 1 && joints.first() == joints.last() {
            joints.pop();
        }
        joints
    }
}
