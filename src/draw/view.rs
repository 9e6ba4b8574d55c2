//! How space is seen: one fixed orthographic projection, so that pictures can be compared.

use crate::core::point::Point;

// The eye looks at the scene from azimuth -60 degrees, 25 degrees above the xy plane; z points up.
const SIN_AZIMUTH: f64 = -0.866_025_403_784_438_6;
const COS_AZIMUTH: f64 = 0.5;
const SIN_ELEVATION: f64 = 0.422_618_261_740_699_4;
const COS_ELEVATION: f64 = 0.906_307_787_036_65;

/// The direction to the eye.
pub const EYE: Point<3> =
    Point([COS_ELEVATION * COS_AZIMUTH, COS_ELEVATION * SIN_AZIMUTH, SIN_ELEVATION]);
const RIGHT: Point<3> = Point([-SIN_AZIMUTH, COS_AZIMUTH, 0.0]);
const UP: Point<3> =
    Point([-SIN_ELEVATION * COS_AZIMUTH, -SIN_ELEVATION * SIN_AZIMUTH, COS_ELEVATION]);

/// The point of the picture plane. Linear, so Bezier points go to Bezier points.
pub fn project(p: Point<3>) -> Point<2> {
    Point([p.dot(RIGHT), p.dot(UP)])
}

/// How near a point is to the eye.
pub fn nearness(p: Point<3>) -> f64 {
    p.dot(EYE)
}

/// A box along the axes.
#[derive(Debug, Clone, Copy)]
pub struct Box3 {
    /// The smallest coordinates.
    pub low: Point<3>,
    /// The largest coordinates.
    pub high: Point<3>,
}

impl Box3 {
    /// Nothing in it yet.
    pub const EMPTY: Self =
        Box3 { low: Point([f64::INFINITY; 3]), high: Point([f64::NEG_INFINITY; 3]) };

    /// Grows to hold the points.
    pub fn add(&mut self, points: impl IntoIterator<Item = Point<3>>) {
        for p in points {
            for k in 0..3 {
                self.low[k] = self.low[k].min(p[k]);
                self.high[k] = self.high[k].max(p[k]);
            }
        }
    }

    /// Whether no point was added.
    pub fn is_empty(&self) -> bool {
        self.low[0] > self.high[0]
    }

    /// The edges along x, y and z that show the axes: those at the outline, seen from the eye.
    pub fn edges(&self) -> [[Point<3>; 2]; 3] {
        let ([a, b, c], [x, y, z]) = (self.low.0, self.high.0);
        [
            [Point([a, b, c]), Point([x, b, c])],
            [Point([x, b, c]), Point([x, y, c])],
            [Point([a, b, c]), Point([a, b, z])],
        ]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn right_up_and_eye_are_orthonormal() {
        let axes = [RIGHT, UP, EYE];
        for (i, a) in axes.iter().enumerate() {
            for (j, b) in axes.iter().enumerate() {
                assert!((a.dot(*b) - f64::from(i == j)).abs() < 1e-15, "{i} {j}");
            }
        }
    }
}
