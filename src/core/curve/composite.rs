//! The common ground of all curves: polynomial segments in Bezier form, end to end.

use super::BSpline;
use crate::core::bezier_form::derivative_size;
use crate::core::bezier_form::{bernstein, binomials, elevate, hodograph, horner, scaled, unit_of};
use crate::core::context::Context;
use crate::core::error::Error;
use crate::core::fault::Fault;
use crate::core::knots::Breaks;
use crate::core::linear::lanes::{self as lanes, LANES, Lanes};
use crate::core::local::{localized, origin_of, placed};
use crate::core::metric::{Affine, Metric};
use crate::core::point::{Point, larger};

/// Segments of one degree over the intervals between joints. Neighbours need not meet: a B-spline
/// may jump at a knot of multiplicity `degree + 1`.
///
/// Each segment is kept relative to an origin of its own, found before anything was computed from
/// its control points: so it has the digits of its own size, wherever it is.
#[derive(Debug, Clone, PartialEq)]
pub struct Composite<const D: usize> {
    breaks: Breaks,
    degree: usize,
    /// One for each segment.
    origins: Vec<Point<D>>,
    /// `degree + 1` Bezier points for each segment, from its origin, one segment after the other.
    points: Vec<Point<D>>,
    /// The B-spline whose segments these are: its derivatives are those of its control points, as
    /// differences within a short span would lose a digit for every one that it is shorter.
    spline: Option<Box<BSpline<D>>>,
}

/// One segment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Segment<'a, const D: usize> {
    /// What its points are relative to.
    pub origin: Point<D>,
    /// Its Bezier points, less the origin.
    pub points: &'a [Point<D>],
}

impl<const D: usize> Segment<'_, D> {
    /// The point at its own parameter `u`, with `v = 1 - u`.
    pub(crate) fn at(&self, u: f64, v: f64) -> Point<D> {
        let weights = bernstein(self.points.len() - 1, u, v);
        let sum = |sum: Point<D>, (&p, &b): (&Point<D>, &f64)| sum + p * b;
        placed(self.origin, self.points.iter().zip(&weights).fold(Point::ZERO, sum))
    }

    /// The first point.
    pub fn first(&self) -> Point<D> {
        placed(self.origin, self.points[0])
    }

    /// The last point.
    pub fn last(&self) -> Point<D> {
        placed(self.origin, self.points[self.points.len() - 1])
    }

    /// The Bezier points, each rounded once.
    pub fn absolute(&self) -> impl Iterator<Item = Point<D>> {
        self.points.iter().map(|&p| placed(self.origin, p))
    }
}

/// A composite made ready to be evaluated many times.
#[derive(Debug, Clone)]
pub struct Evaluator<'a, const D: usize> {
    breaks: &'a Breaks,
    degree: usize,
    origins: &'a [Point<D>],
    /// Bezier points times binomial coefficients.
    scaled: Vec<Point<D>>,
    /// What to multiply by, so that nothing overflows on the way.
    unit: f64,
}

impl<const D: usize> Composite<D> {
    /// Segments of lower degree are elevated to the highest. As many segments as the breaks have
    /// intervals, each of at least one point.
    ///
    /// # Errors
    /// [`Fault::Cancelled`].
    pub fn from_segments<'a>(
        context: &Context,
        breaks: Breaks,
        segments: impl Iterator<Item = Segment<'a, D>> + Clone,
    ) -> Result<Self, Error> {
        let degree = segments.clone().map(|segment| segment.points.len()).max().unwrap_or(1) - 1;
        let mut composite = Composite::with_room(breaks, degree);
        let mut pace = context.pace();
        for Segment { origin, points } in segments {
            pace.step()?;
            composite.push(origin, points);
        }
        Ok(composite)
    }

    /// From the Bezier points of all segments, one after the other.
    pub(crate) fn from_flat(breaks: Breaks, degree: usize, mut points: Vec<Point<D>>) -> Self {
        debug_assert_eq!(breaks.segments() * (degree + 1), points.len());
        let mut origins = Vec::with_capacity(breaks.segments());
        for segment in points.chunks_exact_mut(degree + 1) {
            let origin = origin_of(segment);
            segment.iter_mut().for_each(|p| *p = *p - origin);
            origins.push(origin);
        }
        Composite { breaks, degree, origins, points, spline: None }
    }

    /// Room for the segments, which are still to be pushed.
    pub(super) fn with_room(breaks: Breaks, degree: usize) -> Self {
        let origins = Vec::with_capacity(breaks.segments());
        let points = Vec::with_capacity(breaks.segments() * (degree + 1));
        Composite { breaks, degree, origins, points, spline: None }
    }

    /// The next segment: at most `degree + 1` Bezier points from an origin.
    pub(super) fn push(&mut self, origin: Point<D>, points: &[Point<D>]) {
        self.origins.push(origin);
        if points.len() == self.degree + 1 {
            self.points.extend_from_slice(points);
        } else {
            self.points.extend(elevate(points, self.degree));
        }
    }

    /// The same, with points that were not computed: they are Bezier points as they are.
    pub(super) fn push_absolute(&mut self, points: &[Point<D>]) {
        if points.len() == self.degree + 1 {
            let origin = origin_of(points);
            self.origins.push(origin);
            self.points.extend(points.iter().map(|&p| p - origin));
        } else {
            let (origin, points) = localized(points);
            self.push(origin, &points);
        }
    }

    /// The segments are those of a B-spline.
    pub(super) fn of_spline(self, spline: BSpline<D>) -> Self {
        Composite { spline: Some(Box::new(spline)), ..self }
    }

    /// Curves one after the other, each over an interval as long as its own domain; the first
    /// starts at 0.
    ///
    /// # Errors
    /// More segments than [`crate::core::limits::SEGMENTS`]; domains whose sum is not finite.
    pub fn end_to_end(context: &Context, curves: &[Composite<D>]) -> Result<Self, Error> {
        let mut knots = vec![0.0];
        for curve in curves {
            let start = knots[knots.len() - 1];
            let own = curve.breaks.as_slice();
            knots.extend(own[1..].iter().map(|t| start + (t - own[0])));
        }
        Self::from_segments(
            context,
            Breaks::new(context, knots)?,
            curves.iter().flat_map(Composite::locals),
        )
    }

    /// The joints.
    pub fn breaks(&self) -> &Breaks {
        &self.breaks
    }

    /// The degree of every segment.
    pub fn degree(&self) -> usize {
        self.degree
    }

    /// One segment, from its origin.
    pub fn local(&self, index: usize) -> Segment<'_, D> {
        Segment {
            origin: self.origins[index],
            points: &self.points[index * (self.degree + 1)..(index + 1) * (self.degree + 1)],
        }
    }

    /// Every segment, from its origin, in order.
    pub fn locals(
        &self,
    ) -> impl DoubleEndedIterator<Item = Segment<'_, D>> + ExactSizeIterator + Clone {
        let points = self.points.chunks_exact(self.degree + 1);
        self.origins.iter().zip(points).map(|(&origin, points)| Segment { origin, points })
    }

    /// The Bezier points of one segment, each rounded once.
    pub fn segment(&self, index: usize) -> Vec<Point<D>> {
        self.local(index).absolute().collect()
    }

    /// The Bezier points of every segment, in order.
    pub fn segments(
        &self,
    ) -> impl DoubleEndedIterator<Item = Vec<Point<D>>> + ExactSizeIterator + Clone {
        self.locals().map(|segment| segment.absolute().collect())
    }

    /// The largest absolute coordinate of a Bezier point: the unit of rounding errors.
    pub fn magnitude(&self) -> f64 {
        self.magnitude_in(&Affine)
    }

    /// The same of what its coordinates stand for.
    pub(crate) fn magnitude_in(&self, metric: &impl Metric<D>) -> f64 {
        self.locals()
            .flat_map(|segment| segment.points.iter().map(move |&p| segment.origin + p))
            .fold(0.0, |m, p| larger(m, metric.magnitude(p)))
    }

    /// Whether its derivatives are those of a B-spline, not differences within a segment.
    pub(crate) fn is_spline(&self) -> bool {
        self.spline.is_some()
    }

    /// How large the `k`-th derivative of each segment can be for control points of size 1;
    /// rounding errors of derivatives are measured in it. `d! / (d - k)! (2 / length)^k`; less
    /// where a B-spline has a short span.
    pub(crate) fn gains(&self, k: usize) -> Vec<f64> {
        if let Some(spline) = &self.spline {
            return spline.gains(k);
        }
        let gain = |i| {
            let (a, b) = self.breaks.interval(i);
            derivative_size(1.0, self.degree, k, b - a)
        };
        (0..self.breaks.segments()).map(gain).collect()
    }

    /// The derivative with respect to the curve's own parameter.
    ///
    /// # Errors
    /// [`Fault::Cancelled`].
    pub fn derivative(&self, context: &Context) -> Result<Self, Error> {
        if let (Some(spline), 1..) = (&self.spline, self.degree) {
            return spline.derivative().composite(context);
        }
        let mut points = Vec::with_capacity(self.points.len());
        let mut pace = context.pace();
        for (i, segment) in self.locals().enumerate() {
            pace.step()?;
            let (a, b) = self.breaks.interval(i);
            points.extend(hodograph(segment.points, b - a));
        }
        Ok(Composite::from_flat(self.breaks.clone(), self.degree.saturating_sub(1), points))
    }

    /// Refuses a curve that jumps: the segments of a piecewise curve share their joints.
    ///
    /// # Errors
    /// [`Fault::UnsuitableCurve`] with the first joint at which neighbours do not meet.
    pub(crate) fn check_joined(&self, metric: &impl Metric<D>) -> Result<(), Fault> {
        let allowed = 64.0 * f64::EPSILON * self.magnitude_in(metric);
        let gap = |i: &usize| metric.distance(self.local(i - 1).last(), self.local(*i).first());
        let Some(i) = (1..self.breaks.segments()).find(|i| gap(i) > allowed) else { return Ok(()) };
        let t = self.breaks.as_slice()[i];
        Err(Fault::UnsuitableCurve(format!(
            "the curve jumps at the knot {t:?} (multiplicity degree + 1), but segments share their joints"
        )))
    }

    /// Whether a curve declared closed ends where it starts to within rounding. A B-spline may miss
    /// that by more.
    pub(crate) fn closes(&self, declared: bool) -> bool {
        let last = self.local(self.breaks.segments() - 1);
        declared
            && last.last().distance(self.local(0).first()) <= 64.0 * f64::EPSILON * self.magnitude()
    }

    /// Ready to be evaluated many times.
    ///
    /// # Errors
    /// [`Fault::Cancelled`].
    pub fn evaluator(&self, context: &Context) -> Result<Evaluator<'_, D>, Error> {
        let unit = unit_of(self.magnitude());
        let binomials = binomials(self.degree);
        let mut points = Vec::with_capacity(self.points.len());
        let mut pace = context.pace();
        for segment in self.locals() {
            pace.step()?;
            points.extend(scaled(segment.points, binomials, unit));
        }
        Ok(Evaluator {
            breaks: &self.breaks,
            degree: self.degree,
            origins: &self.origins,
            scaled: points,
            unit,
        })
    }
}

impl<const D: usize> Evaluator<'_, D> {
    /// The point at a parameter of the domain; from the right at a joint, from the left at the end.
    /// O(log segments + degree).
    pub fn at(&self, t: f64) -> Point<D> {
        let segment = self.breaks.segment_at(t);
        let (u, v) = self.breaks.local(segment, t);
        self.within(segment, u, v)
    }

    /// The point of one segment at its own parameter `u`, with `v = 1 - u`.
    pub fn within(&self, segment: usize, u: f64, v: f64) -> Point<D> {
        horner(self.scaled(segment), u, v) * self.unit + self.origins[segment]
    }

    /// The points at parameters of the domain in any order, each as [`Evaluator::at`] gives it.
    /// O(degree) for one in the same segment as the one before or in the next.
    ///
    /// # Errors
    /// [`Fault::Cancelled`].
    pub fn sample(&self, context: &Context, parameters: &[f64]) -> Result<Vec<Point<D>>, Error> {
        let mut points = Vec::with_capacity(parameters.len());
        let (mut lanes, mut segment) = (None, 0);
        for part in parameters.chunks(LANES) {
            context.checkpoint()?;
            let mut rest = part;
            while let [t, later @ ..] = rest {
                segment = self.breaks.segment_near(segment, *t);
                let (run, after) = rest.split_at(1 + self.breaks.run(segment, later));
                self.extend(&mut points, &mut lanes, segment, run);
                rest = after;
            }
        }
        Ok(points)
    }

    /// Appends the points at up to [`LANES`] parameters of one segment.
    fn extend(
        &self,
        points: &mut Vec<Point<D>>,
        lanes: &mut Option<Lanes<D>>,
        segment: usize,
        parameters: &[f64],
    ) {
        if parameters.len() < FEW {
            let local = parameters.iter().map(|&t| self.breaks.local(segment, t));
            return points.extend(local.map(|(u, v)| self.within(segment, u, v)));
        }
        let lanes = lanes.get_or_insert_with(Lanes::new);
        let place = lanes::LocalFrame {
            origin: self.origins[segment],
            unit: self.unit,
            interval: self.breaks.interval(segment),
        };
        lanes::extend(points, lanes, self.scaled(segment), place, parameters);
    }

    fn scaled(&self, segment: usize) -> &[Point<D>] {
        &self.scaled[segment * (self.degree + 1)..(segment + 1) * (self.degree + 1)]
    }
}

/// Fewer parameters are faster one at a time.
const FEW: usize = 16;

/// The composite of one segment over `[0, length]`, its Bezier points from an origin.
pub(crate) fn single_segment<const D: usize>(
    context: &Context,
    length: f64,
    origin: Point<D>,
    bezier: Vec<Point<D>>,
) -> Result<Composite<D>, Error> {
    let degree = bezier.len() - 1;
    let mut composite = Composite::with_room(Breaks::new(context, vec![0.0, length])?, degree);
    composite.push(origin, &bezier);
    Ok(composite)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::bezier_form::blossom;

    /// Numbers in [0, 1) that look random and are always the same.
    fn number(i: usize) -> f64 {
        ((i as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 11) as f64 / (1u64 << 53) as f64
    }

    fn wave(degree: usize, knots: &[f64], size: f64) -> Composite<3> {
        let points = (0..(degree + 1) * (knots.len() - 1))
            .map(|i| Point([0, 1, 2].map(|k| size * (number(3 * i + k) - 0.5))))
            .collect();
        Composite::from_flat(
            Breaks::new(&Context::default(), knots.to_vec()).unwrap(),
            degree,
            points,
        )
    }

    /// Parameters in order and out of order, with every joint and both ends; a number of them that
    /// fills no group of lanes.
    fn parameters(knots: &[f64]) -> Vec<f64> {
        let (a, b) = (knots[0], knots[knots.len() - 1]);
        let sorted =
            (0..=300).map(|i| a + (b - a) * (i as f64 / 300.0)).chain(knots.iter().copied());
        sorted.chain((0..301).map(|i| a + (b - a) * number(i))).map(|t| t.min(b)).collect()
    }

    #[test]
    fn many_parameters_have_the_bits_of_each_alone_and_are_on_the_curve() {
        for knots in [vec![0.0, 1.0], vec![-1.0, 0.5, 0.75, 3.0], vec![1e9, 1e9 + 1.0, 1e9 + 3.0]] {
            for degree in (0..=9).chain([33, 64]) {
                for size in [1.0, 1e-300, 1e308] {
                    let curve = wave(degree, &knots, size);
                    let (evaluator, parameters) =
                        (curve.evaluator(&Context::default()).unwrap(), parameters(&knots));
                    let together = evaluator.sample(&Context::default(), &parameters).unwrap();
                    assert_eq!(together.len(), parameters.len());
                    for (&t, p) in parameters.iter().zip(together) {
                        assert_eq!(
                            p.0.map(f64::to_bits),
                            evaluator.at(t).0.map(f64::to_bits),
                            "degree {degree} at {t}"
                        );
                        let segment = curve.breaks().segment_at(t);
                        let (u, _) = curve.breaks().local(segment, t);
                        let expected = blossom(&curve.segment(segment), vec![u; degree]);
                        assert!(
                            p.distance(expected) <= 1e-15 * (degree + 1) as f64 * size,
                            "degree {degree} at {t}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn ends_are_met_exactly() {
        let curve = wave(64, &[0.1, 0.3, 0.7], 1.0);
        let ends = curve
            .evaluator(&Context::default())
            .unwrap()
            .sample(&Context::default(), &[0.1, 0.3, 0.7])
            .unwrap();
        assert_eq!(ends, [curve.segment(0)[0], curve.segment(1)[0], curve.segment(1)[64]]);
    }
}
