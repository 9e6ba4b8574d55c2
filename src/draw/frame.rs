//! From the units of the client to pixels.

use crate::core::bezier_form::split;
use crate::core::error::Error;
use crate::core::fault::Fault;
use crate::core::point::Point;
use crate::draw::view::{Box3, project};

/// The extent of what is drawn.
#[derive(Debug, Clone, Copy)]
pub struct Bounds {
    low: Point<2>,
    high: Point<2>,
}

impl Bounds {
    /// Nothing in it yet.
    pub const EMPTY: Self =
        Bounds { low: Point([f64::INFINITY; 2]), high: Point([f64::NEG_INFINITY; 2]) };

    /// Grows to hold the points.
    pub fn add(&mut self, points: &[Point<2>]) {
        for p in points {
            for k in 0..2 {
                self.low[k] = self.low[k].min(p[k]);
                self.high[k] = self.high[k].max(p[k]);
            }
        }
    }

    /// Grows to hold a Bezier segment: its Bezier points after three halvings, which are close to
    /// it.
    pub fn add_curve(&mut self, bezier: &[Point<2>]) {
        self.add_halved(bezier, if bezier.len() > 2 { 3 } else { 0 });
    }

    fn add_halved(&mut self, bezier: &[Point<2>], depth: usize) {
        if depth == 0 {
            return self.add(bezier);
        }
        let (left, right) = split(bezier, 0.5);
        self.add_halved(&left, depth - 1);
        self.add_halved(&right, depth - 1);
    }

    /// The same with the axes of a box in space.
    pub fn with_box(mut self, space: Option<&Box3>) -> Self {
        let edges = space.map(Box3::edges).into_iter().flatten();
        edges.for_each(|edge| self.add(&edge.map(project)));
        self
    }

    /// The larger of width and height.
    pub fn size(&self) -> f64 {
        (self.high - self.low).max_abs()
    }
}

/// The part of the page inside margins, axis numbers and legend; in pixels, y down.
#[derive(Debug, Clone, Copy)]
pub struct Plot {
    /// Left and top.
    pub low: Point<2>,
    /// Right and bottom.
    pub high: Point<2>,
}

const MARGIN: f64 = 24.0;

impl Plot {
    /// What is left of a page.
    pub fn inside(size: [usize; 2], axes: bool, legend: f64) -> Self {
        let [left, bottom] = if axes { [52.0, 40.0] } else { [MARGIN; 2] };
        let [width, height] = size.map(|pixels| pixels as f64);
        Plot { low: Point([left, MARGIN]), high: Point([width - MARGIN - legend, height - bottom]) }
    }
}

/// The map from the plane to the page: aspect ratio kept, y up.
#[derive(Debug, Clone, Copy)]
pub struct Frame {
    centre: Point<2>,
    /// How much one pixel is.
    unit: f64,
    middle: Point<2>,
}

impl Frame {
    /// Fits the extent into the middle of the plot.
    ///
    /// # Errors
    /// [`Fault::Overflow`] where the extent is beyond double precision.
    pub fn fit(bounds: &Bounds, plot: &Plot) -> Result<Self, Error> {
        let centre = bounds.low * 0.5 + bounds.high * 0.5;
        let (extent, room) = (bounds.high - bounds.low, plot.high - plot.low);
        if !extent.is_finite() || !centre.is_finite() {
            return Err(Fault::Overflow.into());
        }
        let tight = f64::max(extent[0] / room[0], extent[1] / room[1]);
        // A point has no size, and rounding is none worth showing: such a picture is scaled by
        // where it is.
        let least = f64::max(centre.max_abs() * 1e-13, 1e-300) / room.max_abs();
        let unit =
            if tight > least { tight } else { f64::max(centre.max_abs(), 1.0) / room.max_abs() };
        Ok(Frame { centre, unit, middle: plot.low * 0.5 + plot.high * 0.5 })
    }

    /// Where a point is on the page.
    pub fn place(&self, p: Point<2>) -> Point<2> {
        let from_centre = p - self.centre;
        Point([
            self.middle[0] + from_centre[0] / self.unit,
            self.middle[1] - from_centre[1] / self.unit,
        ])
    }

    /// What is at a place of the page.
    pub fn world(&self, pixel: Point<2>) -> Point<2> {
        let from_middle = pixel - self.middle;
        Point([
            self.centre[0] + from_middle[0] * self.unit,
            self.centre[1] - from_middle[1] * self.unit,
        ])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn fitted(points: &[Point<2>]) -> Frame {
        let mut bounds = Bounds::EMPTY;
        bounds.add(points);
        Frame::fit(&bounds, &Plot::inside([448, 248], false, 0.0)).unwrap()
    }

    #[test]
    fn the_aspect_ratio_is_kept_and_y_is_up() {
        let frame = fitted(&[Point([0.0, 0.0]), Point([4.0, 1.0])]);
        assert_eq!(frame.place(Point([0.0, 0.0])), Point([24.0, 174.0]));
        assert_eq!(frame.place(Point([4.0, 1.0])), Point([424.0, 74.0]));
    }

    #[test]
    fn points_and_lines_have_a_place_too() {
        for x in [0.0, 5e-324, 1e-200, 3.0, 1e20, 1e300] {
            assert_eq!(
                fitted(&[Point([x, -x])]).place(Point([x, -x])),
                Point([224.0, 124.0]),
                "{x}"
            );
        }
        let frame = fitted(&[Point([2.0, 7.0]), Point([2.0, 9.0])]);
        assert_eq!(frame.place(Point([2.0, 9.0])), Point([224.0, 24.0]));
    }

    #[test]
    fn an_extent_beyond_doubles_is_refused() {
        let mut bounds = Bounds::EMPTY;
        bounds.add(&[Point([-1.7e308, 0.0]), Point([1.7e308, 0.0])]);
        assert!(Frame::fit(&bounds, &Plot::inside([400, 400], false, 0.0)).is_err());
    }
}
