//! How smooth a B-spline is at a knot.

use super::spline::Spline;
use crate::core::context::Context;
use crate::core::error::Error;
use crate::core::point::{Point, larger};

/// The control vectors of one span, differenced as often as asked.
///
/// Where a knot has multiplicity `s` and the curve is differenced more than `degree - s` times, the
/// outermost vector is the derivative at that knot itself.
struct Vectors<'a, const D: usize> {
    knots: &'a [f64],
    degree: usize,
    /// The span, as the place of the knot it starts at.
    span: usize,
    order: usize,
    vectors: Vec<Point<D>>,
    /// How large each could be for control points of this size.
    sizes: Vec<f64>,
    /// The largest number of roundings in a difference of two knots.
    of_length: f64,
}

impl<'a, const D: usize> Vectors<'a, D> {
    fn new(spline: &'a Spline<D>, span: usize) -> Self {
        let degree = spline.degree;
        let vectors = spline.points[span - degree..=span].to_vec();
        let sizes = vectors.iter().map(|p| p.max_abs()).collect();
        let (a, b) = (spline.knots[span], spline.knots[span + 1]);
        let of_length = a.abs().max(b.abs()) / (b - a);
        Vectors { knots: &spline.knots, degree, span, order: 0, vectors, sizes, of_length }
    }

    /// The derivative of these.
    fn differentiate(&mut self) {
        self.order += 1;
        let degree = self.degree + 1 - self.order;
        for i in 0..degree {
            let first = self.span - self.degree + i;
            let length = self.knots[first + self.degree + 1] - self.knots[first + self.order];
            let factor = degree as f64 / length;
            self.vectors[i] = (self.vectors[i + 1] - self.vectors[i]) * factor;
            self.sizes[i] = (self.sizes[i + 1] + self.sizes[i]) * factor;
        }
        self.vectors.truncate(degree);
        self.sizes.truncate(degree);
    }

    /// The largest of them; of points, their extent.
    fn scale(&self) -> f64 {
        let base = if self.order == 0 { self.vectors[0] } else { Point::ZERO };
        self.vectors.iter().fold(0.0, |m, &v| larger(m, (v - base).max_abs()))
    }

    fn rounding(&self, scale: f64) -> f64 {
        let size = self.sizes.iter().copied().fold(0.0, larger);
        64.0 * f64::EPSILON * (size + scale * self.order as f64 * self.of_length)
    }

    /// Whether the derivatives to both sides agree: within a tolerance relative to the larger of
    /// them, and rounding.
    fn agrees_with(&self, after: &Self, tolerance: f64) -> bool {
        let jump = self.vectors[self.vectors.len() - 1].distance(after.vectors[0]);
        let scale = larger(self.scale(), after.scale());
        let allowed = tolerance * scale + larger(self.rounding(scale), after.rounding(scale));
        // An allowance that overflows says nothing; ends that coincide agree whatever their scale.
        jump == 0.0 || (allowed.is_finite() && jump <= allowed)
    }
}

/// A knot inside the domain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Knot {
    pub(super) parameter: f64,
    /// The places of the first and the last of its copies.
    pub(super) first: usize,
    pub(super) last: usize,
    /// How many derivatives agree there; -1 where not even the points do.
    pub(super) continuity: i32,
}

impl<const D: usize> Spline<D> {
    /// The knots inside the domain, with what is found there. O(knots * degree^2).
    pub(super) fn measured(&self, context: &Context, tolerance: f64) -> Result<Vec<Knot>, Error> {
        let mut knots = Vec::new();
        let (mut first, mut pace) = (self.degree + 1, context.pace());
        for copies in self.inner().chunk_by(|a, b| a == b) {
            pace.step()?;
            let last = first + copies.len() - 1;
            // That much the knots promise.
            let known = self.degree as i32 - copies.len() as i32;
            let continuity = self.agreeing(first - 1, last, known, tolerance);
            knots.push(Knot { parameter: copies[0], first, last, continuity });
            first = last + 1;
        }
        Ok(knots)
    }

    /// How many derivatives agree where the end of a clamped curve meets its start.
    pub(super) fn seam(&self, tolerance: f64) -> i32 {
        self.agreeing(self.points.len() - 1, self.degree, -1, tolerance)
    }

    /// The number of derivatives that agree at the end of one span and at the start of another.
    fn agreeing(&self, before: usize, after: usize, known: i32, tolerance: f64) -> i32 {
        let (mut before, mut after) = (Vectors::new(self, before), Vectors::new(self, after));
        for order in 0..=self.degree as i32 {
            if order > 0 {
                before.differentiate();
                after.differentiate();
            }
            if order > known && !before.agrees_with(&after, tolerance) {
                return order - 1;
            }
        }
        self.degree as i32
    }
}
