//! How far a piece of a curve is from the straight segment between two points.

use crate::core::bezier_form::split;
use crate::core::context::Pace;
use crate::core::error::Error;
use crate::core::point::{Point, is_safe};

/// A bound this close, relative to the distance found, counts as reached.
pub(super) const CLOSE: f64 = 1e-9;
/// Enough pieces for any curve whose distance is above rounding.
const PIECES: usize = 10_000;

/// The straight segment between two points, which may coincide.
#[derive(Debug, Clone, Copy)]
pub(super) struct Chord<const D: usize> {
    pub(super) start: Point<D>,
    pub(super) end: Point<D>,
}

impl<const D: usize> Chord<D> {
    /// The distance of a point from its nearest point of the segment.
    pub(super) fn distance(&self, point: Point<D>) -> f64 {
        let (along, to) = (self.end - self.start, point - self.start);
        let (square, dot) = (along.dot(along), to.dot(along));
        if is_safe(square) && dot.is_finite() {
            return (to - along * (dot / square).clamp(0.0, 1.0)).norm();
        }
        // Squares that overflow or vanish: the same in a unit in which they do not.
        let unit = along.max_abs();
        let (along, scaled) = (along.map(|x| x / unit), to.map(|x| x / unit));
        let share = (scaled.dot(along) / along.dot(along)).clamp(0.0, 1.0);
        if share.is_nan() { to.norm() } else { (scaled - along * share).norm() * unit }
    }

    /// The length.
    pub(super) fn length(&self) -> f64 {
        self.start.distance(self.end)
    }

    /// A bound on the distance of a Bezier curve: that of its control points, as the distance from
    /// a convex set is a convex function.
    pub(super) fn bound(&self, bezier: &[Point<D>]) -> f64 {
        bezier.iter().map(|&p| self.distance(p)).fold(0.0, f64::max)
    }

    /// The largest distance of a Bezier curve from the segment, or `known` if that is larger; exact
    /// to [`CLOSE`], by bisection on the bounds. Ends early once the distance is above `enough`.
    pub(super) fn farthest(
        &self,
        bezier: Vec<Point<D>>,
        known: f64,
        enough: f64,
        pace: &mut Pace<'_>,
    ) -> Result<f64, Error> {
        let mut largest = known;
        let mut pieces = vec![bezier];
        for _ in 0..PIECES {
            let Some(points) = pieces.pop() else { break };
            pace.step()?;
            largest =
                largest.max(self.distance(points[0])).max(self.distance(points[points.len() - 1]));
            if largest > enough {
                break;
            }
            if self.bound(&points) > largest * (1.0 + CLOSE) {
                let (left, right) = split(&points, 0.5);
                pieces.extend([left, right]);
            }
        }
        Ok(largest)
    }
}

/// The Bezier points of the part of a segment between two of its own parameters.
pub(super) fn part<const D: usize>(bezier: &[Point<D>], from: f64, to: f64) -> Vec<Point<D>> {
    let start = if to < 1.0 { split(bezier, to).0 } else { bezier.to_vec() };
    if from > 0.0 { split(&start, from / to).1 } else { start }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::context::Context;

    #[test]
    fn distances_from_a_segment_and_beyond_its_ends() {
        for unit in [1.0, 1e-200, 1e200] {
            let chord = Chord { start: Point([0.0, 0.0]), end: Point([2.0 * unit, 0.0]) };
            let distance = |x: f64, y: f64| chord.distance(Point([x * unit, y * unit])) / unit;
            assert!((distance(1.0, 0.5) - 0.5).abs() < 1e-15, "{unit:e}");
            assert!(
                (distance(5.0, 4.0) - 5.0).abs() < 1e-14
                    && (distance(-3.0, 4.0) - 5.0).abs() < 1e-14
            );
        }
        let point = Chord { start: Point([1.0, 1.0]), end: Point([1.0, 1.0]) };
        assert_eq!(point.distance(Point([4.0, 5.0])), 5.0);
    }

    #[test]
    fn the_farthest_point_of_an_arch_is_its_top() {
        let arch = vec![Point([0.0, 0.0]), Point([0.0, 4.0]), Point([2.0, 4.0]), Point([2.0, 0.0])];
        let chord = Chord { start: arch[0], end: arch[3] };
        let farthest = |known| {
            chord
                .farthest(arch.clone(), known, f64::INFINITY, &mut Context::default().pace())
                .unwrap()
        };
        assert!((farthest(0.0) - 3.0).abs() < 1e-8);
        assert_eq!(farthest(5.0), 5.0);
    }

    #[test]
    fn a_part_runs_over_the_same_curve() {
        let cubic = [Point([0.0, 0.0]), Point([1.0, 3.0]), Point([4.0, 3.0]), Point([5.0, -1.0])];
        let at = |points: &[Point<2>], u| crate::core::bezier_form::evaluate(points, u);
        let middle = part(&cubic, 0.2, 0.7);
        assert!(at(&middle, 0.4).distance(at(&cubic, 0.4)) < 1e-14);
        assert_eq!(part(&cubic, 0.0, 1.0), cubic);
    }
}
