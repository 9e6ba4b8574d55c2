//! A B-spline under way: its knots and control points may change.

use crate::core::context::Context;
use crate::core::curve::{BSpline, Composite};
use crate::core::error::Error;
use crate::core::local::localized;
use crate::core::point::Point;

/// A B-spline whose domain starts at the last of equal knots and ends at the first.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Spline<const D: usize> {
    pub(super) degree: usize,
    pub(super) knots: Vec<f64>,
    pub(super) points: Vec<Point<D>>,
}

impl<const D: usize> Spline<D> {
    /// A B-spline without the control points that its curve does not depend on.
    pub(super) fn of_bspline(curve: &BSpline<D>) -> Self {
        let (degree, knots) = (curve.degree(), curve.knots());
        let spans = knots.spans().fold(None, |spans: Option<(usize, usize)>, span| {
            Some((spans.map_or(span, |s| s.0), span))
        });
        let (first, last) = spans.unwrap_or((degree, degree));
        let knots = knots.as_slice()[first - degree..=last + degree + 1].to_vec();
        Spline { degree, knots, points: curve.control_points()[first - degree..=last].to_vec() }
    }

    /// Bezier segments as they are: each joint a knot of multiplicity `degree + 1`.
    pub(super) fn of_composite(context: &Context, composite: &Composite<D>) -> Result<Self, Error> {
        let degree = composite.degree();
        let knots = composite
            .breaks()
            .as_slice()
            .iter()
            .flat_map(|&t| std::iter::repeat_n(t, degree + 1))
            .collect();
        let mut points = Vec::with_capacity(composite.breaks().segments() * (degree + 1));
        let mut pace = context.pace();
        for segment in composite.locals() {
            pace.step()?;
            points.extend(segment.absolute());
        }
        Ok(Spline { degree, knots, points })
    }

    /// First and last parameter.
    pub(super) fn domain(&self) -> (f64, f64) {
        (self.knots[self.degree], self.knots[self.points.len()])
    }

    /// The knots inside the domain.
    pub(super) fn inner(&self) -> &[f64] {
        &self.knots[self.degree + 1..self.points.len()]
    }

    /// The same curve with other knots up to the start of the domain, which is the last of them,
    /// and others from its end on, which is the first of them: `degree + 1` each.
    pub(super) fn with_ends(self, start: &[f64], end: &[f64]) -> Self {
        let end: Vec<f64> = end.iter().rev().map(|t| -t).collect();
        self.with_start(start).reversed().with_start(&end).reversed()
    }

    /// Control point `i` is the blossom at knots `i + 1` to `i + degree` (Ramshaw 1987). So the
    /// first `degree` of them change, each by a triangle of de Boor's whose arguments are the new
    /// knots. Within the domain its steps are convex combinations, as when knots are inserted.
    fn with_start(mut self, start: &[f64]) -> Self {
        let degree = self.degree;
        let (origin, old) = localized(&self.points[..=degree]);
        for i in 0..degree {
            let arguments = &start[i + 1..=degree];
            if arguments != &self.knots[i + 1..=degree] {
                self.points[i] = origin + self.blossom(i, old[i..].to_vec(), arguments);
            }
        }
        self.knots[..=degree].copy_from_slice(start);
        self
    }

    /// The blossom at these arguments and as many of the first inner knots as they leave out, from
    /// control points `i` to `degree`. The last argument is taken first: the nearest to the domain.
    fn blossom(&self, i: usize, mut points: Vec<Point<D>>, arguments: &[f64]) -> Point<D> {
        for (r, x) in (1..).zip(arguments.iter().rev()) {
            for j in 0..points.len() - 1 {
                let (low, high) = (self.knots[i + j + r], self.knots[i + j + self.degree + 1]);
                points[j] = points[j].lerp(points[j + 1], (x - low) / (high - low));
            }
            points.pop();
        }
        points[0]
    }

    /// The curve run through backwards, its parameter negated.
    fn reversed(mut self) -> Self {
        self.points.reverse();
        self.knots.reverse();
        self.knots.iter_mut().for_each(|t| *t = -*t);
        self
    }
}
