//! The Bezier form of a surface.

use crate::core::bezier_form::{bernstein, hodograph, split_between};
use crate::core::point::{Point, magnitude};

/// One of the two parameter directions.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Direction {
    /// From row to row of the net.
    U,
    /// Along a row.
    V,
}

/// A Bezier patch over a rectangle of parameters: of space, or one dimension up.
#[derive(Debug, Clone, PartialEq)]
pub struct Patch<const D: usize> {
    degrees: [usize; 2],
    domain: [(f64, f64); 2],
    /// `degrees[0] + 1` rows of `degrees[1] + 1` points.
    points: Vec<Point<D>>,
}

impl<const D: usize> Patch<D> {
    /// From its rows, one after the other.
    pub(super) fn new(degrees: [usize; 2], domain: [(f64, f64); 2], points: Vec<Point<D>>) -> Self {
        debug_assert_eq!(points.len(), (degrees[0] + 1) * (degrees[1] + 1));
        Patch { degrees, domain, points }
    }

    /// The degrees in `u` and `v`.
    pub fn degrees(&self) -> [usize; 2] {
        self.degrees
    }

    /// The ranges of `u` and `v`.
    pub fn domain(&self) -> [(f64, f64); 2] {
        self.domain
    }

    /// The rows of Bezier points.
    pub fn rows(&self) -> impl ExactSizeIterator<Item = &[Point<D>]> {
        self.points.chunks_exact(self.degrees[1] + 1)
    }

    /// The largest absolute coordinate: the unit of rounding errors.
    pub fn magnitude(&self) -> f64 {
        magnitude(&self.points)
    }

    /// The largest length of a Bezier point taken as a vector: a bound for the patch, by its convex
    /// hull.
    pub fn largest_norm(&self) -> f64 {
        self.points.iter().map(|p| p.norm()).fold(0.0, f64::max)
    }

    /// Rows and columns exchanged.
    fn transposed(&self) -> Self {
        let columns = self.degrees[1] + 1;
        let points = (0..columns).flat_map(|j| self.rows().map(move |row| row[j])).collect();
        Patch::new([self.degrees[1], self.degrees[0]], [self.domain[1], self.domain[0]], points)
    }

    /// The partial derivative with respect to the surface's own parameter.
    pub fn derivative(&self, direction: Direction) -> Self {
        match direction {
            Direction::U => self.transposed().derivative(Direction::V).transposed(),
            Direction::V => {
                let (a, b) = self.domain[1];
                let points = self.rows().flat_map(|row| hodograph(row, b - a)).collect();
                Patch::new(
                    [self.degrees[0], self.degrees[1].saturating_sub(1)],
                    self.domain,
                    points,
                )
            }
        }
    }

    /// The two parts before and after a parameter inside the domain.
    pub fn split(&self, direction: Direction, t: f64) -> (Self, Self) {
        let (a, b) = self.domain[direction as usize];
        let u = (t - a) / (b - a);
        self.split_between(direction, t, u, 1.0 - u)
    }

    /// The same for a parameter close to an end, where both shares keep their digits.
    pub(super) fn split_near(&self, direction: Direction, t: f64) -> (Self, Self) {
        let (a, b) = self.domain[direction as usize];
        self.split_between(direction, t, (t - a) / (b - a), (b - t) / (b - a))
    }

    fn split_between(&self, direction: Direction, t: f64, u: f64, v: f64) -> (Self, Self) {
        if direction == Direction::U {
            let (first, second) = self.transposed().split_between(Direction::V, t, u, v);
            return (first.transposed(), second.transposed());
        }
        let (a, b) = self.domain[1];
        let halves: Vec<_> = self.rows().map(|row| split_between(row, u, v)).collect();
        let part = |range, points: Vec<Point<D>>| {
            Patch::new(self.degrees, [self.domain[0], range], points)
        };
        let first = halves.iter().flat_map(|(left, _)| left.iter().copied()).collect();
        let second = halves.iter().flat_map(|(_, right)| right.iter().copied()).collect();
        (part((a, t), first), part((t, b), second))
    }

    /// The Bernstein polynomials of one direction at a parameter, to be used with
    /// [`Patch::combine`].
    pub(super) fn weights(&self, direction: Direction, t: f64) -> Vec<f64> {
        let (a, b) = self.domain[direction as usize];
        bernstein(self.degrees[direction as usize], (t - a) / (b - a), (b - t) / (b - a))
    }

    /// The point with these weights in `u` and `v`. Exact at the corners.
    pub(super) fn combine(&self, u: &[f64], v: &[f64]) -> Point<D> {
        let along =
            |row: &[Point<D>]| row.iter().zip(v).fold(Point::ZERO, |sum, (&p, &w)| sum + p * w);
        self.rows().zip(u).fold(Point::ZERO, |sum, (row, &w)| sum + along(row) * w)
    }

    /// The point at parameters inside the domain.
    pub fn at(&self, u: f64, v: f64) -> Point<D> {
        self.combine(&self.weights(Direction::U, u), &self.weights(Direction::V, v))
    }
}
