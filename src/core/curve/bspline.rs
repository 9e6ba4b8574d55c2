//! B-spline curves.

use super::composite::Composite;
use super::valid_points;
use crate::core::argument::Argument;
use crate::core::bezier_form::difference;
use crate::core::check::within_degrees;
use crate::core::context::Context;
use crate::core::error::{Error, Locate};
use crate::core::fault::Fault;
use crate::core::knots::{Breaks, KnotVector};
use crate::core::limits;
use crate::core::local::localized;
use crate::core::point::{Point, magnitude};

/// A B-spline curve on a full knot vector, over its valid range.
#[derive(Debug, Clone, PartialEq)]
pub struct BSpline<const D: usize> {
    knots: KnotVector,
    points: Vec<Point<D>>,
    closed: bool,
}

impl<const D: usize> BSpline<D> {
    /// Checks and joins the parts. `closed` states that the curve ends where it starts.
    ///
    /// # Errors
    /// At `degree`, `knots` or `control_points`; a closed curve whose ends are further apart than
    /// 1e-9 of its largest coordinate.
    pub fn new(
        context: &Context,
        degree: usize,
        knots: Vec<f64>,
        points: Vec<Point<D>>,
        closed: bool,
    ) -> Result<Self, Error> {
        within_degrees(context, "degree", degree).at(Argument::Degree)?;
        valid_points(context, &points, degree + 1).at(Argument::ControlPoints)?;
        let knots = KnotVector::new(degree, knots, points.len()).at(Argument::Knots)?;
        let curve = BSpline { knots, points, closed };
        if closed {
            curve.check_closed()?;
        }
        Ok(curve)
    }

    fn check_closed(&self) -> Result<(), Error> {
        let spans: Vec<_> = self.knots.spans().collect();
        let (first, last) = (self.span(spans[0]), self.span(spans[spans.len() - 1]));
        let gap = first[0].distance(last[self.degree()]);
        if gap <= limits::CONTINUITY_TOLERANCE * magnitude(&self.points) {
            return Ok(());
        }
        let why = format!(
            "a closed curve ends where it starts, but these ends are {gap:e} apart; leave \"closed\" out"
        );
        Err(Fault::UnsuitableCurve(why).at(Argument::Closed))
    }

    /// The degree.
    pub fn degree(&self) -> usize {
        self.knots.degree()
    }

    /// The knot vector.
    pub fn knots(&self) -> &KnotVector {
        &self.knots
    }

    /// The control points.
    pub fn control_points(&self) -> &[Point<D>] {
        &self.points
    }

    /// The control points, taken out.
    pub fn into_control_points(self) -> Vec<Point<D>> {
        self.points
    }

    /// Whether the curve ends where it starts.
    pub fn closed(&self) -> bool {
        self.closed
    }

    /// The Bezier points over `[knots[span], knots[span + 1]]`: both knots are inserted up to full
    /// multiplicity (Boehm 1980). Convex combinations only; O(d^2).
    fn span(&self, span: usize) -> Vec<Point<D>> {
        let mut points = self.points[span - self.degree()..=span].to_vec();
        self.insert(span, &mut points);
        points
    }

    /// The control points of a span become its Bezier points.
    fn insert(&self, span: usize, points: &mut [Point<D>]) {
        let d = self.degree();
        let knots = self.knots.as_slice();
        let (a, b) = (knots[span], knots[span + 1]);
        // tau(1) .. tau(2d) are the knots the span depends on; tau(d) = a and tau(d + 1) = b.
        let tau = |i: usize| knots[span - d + i];
        // The right edge of de Boor's triangle at a, from its tip on: the blossom values f(a^d),
        // f(a^(d-1), b ..), .., f(b ..).
        for r in 1..=d {
            for i in 0..=d - r {
                let alpha = (a - tau(i + r)) / (tau(i + d + 1) - tau(i + r));
                points[i] = points[i].lerp(points[i + 1], alpha);
            }
        }
        // The left edge of de Boor's triangle at b: the Bezier points f(a^(d-i), b^i).
        for r in 1..=d {
            for i in (r..=d).rev() {
                let alpha = (b - a) / (tau(i - r + d + 1) - a);
                points[i] = points[i - 1].lerp(points[i], alpha);
            }
        }
    }

    /// The Bezier segments of the same curve over its valid range. O(spans * d^2).
    ///
    /// # Errors
    /// More spans than [`limits::SEGMENTS`].
    pub fn composite(&self, context: &Context) -> Result<Composite<D>, Error> {
        let knots = self.knots.as_slice();
        let mut breaks = vec![self.knots.domain().0];
        breaks.extend(self.knots.spans().map(|span| knots[span + 1]));
        let mut composite =
            Composite::with_room(Breaks::new(context, breaks).at(Argument::Knots)?, self.degree());
        let mut pace = context.pace();
        for span in self.knots.spans() {
            pace.step()?;
            let (origin, mut points) = localized(&self.points[span - self.degree()..=span]);
            self.insert(span, &mut points);
            composite.push(origin, &points);
        }
        Ok(composite.of_spline(self.clone()))
    }

    /// How large the `k`-th derivative can be over each span for control points of size 1.
    pub(super) fn gains(&self, k: usize) -> Vec<f64> {
        let (degree, knots) = (self.degree(), self.knots.as_slice());
        let mut gains = vec![1.0; self.points.len()];
        for order in 1..=k.min(degree) {
            let gain = |(i, pair): (usize, &[f64])| {
                let length = knots[i + degree + 1] - knots[i + order];
                if length > 0.0 {
                    (pair[0] + pair[1]) * (degree + 1 - order) as f64 / length
                } else {
                    0.0
                }
            };
            gains = gains.windows(2).enumerate().map(gain).collect();
        }
        let least = k.min(degree);
        let over =
            |span: usize| gains[span - degree..=span - least].iter().copied().fold(0.0, f64::max);
        self.knots.spans().map(|span| if k > degree { 0.0 } else { over(span) }).collect()
    }

    /// The derivative, one degree lower: differences of the control points, taken before anything
    /// else (de Boor 1978, X (16)). Its inner knots may be one too
    /// many for a curve of its own. Of a curve of degree 1 and above.
    pub(super) fn derivative(&self) -> Self {
        let (degree, knots) = (self.degree(), self.knots.as_slice());
        let vector = |(i, pair): (usize, &[Point<D>])| {
            let length = knots[i + degree + 1] - knots[i + 1];
            // Nothing depends on a control point whose support is one knot.
            if length > 0.0 { difference(pair[0], pair[1], degree, length) } else { Point::ZERO }
        };
        let points = self.points.windows(2).enumerate().map(vector).collect();
        BSpline { knots: self.knots.of_derivative(), points, closed: self.closed }
    }
}
