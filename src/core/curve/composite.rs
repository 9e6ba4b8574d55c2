//! The common ground of all curves: polynomial segments in Bezier form, end to end.

use crate::core::bezier_form::{binomials, elevate, hodograph, horner, scaled, unit_of};
use crate::core::error::{Error, Fault};
use crate::core::knots::Breaks;
use crate::core::lanes::{self, LANES, Lanes};
use crate::core::point::{Point, magnitude};
use crate::core::work::{self, Pace};

/// Segments of one degree over the intervals between joints. Neighbours need not meet: a B-spline
/// may jump at a knot of multiplicity `degree + 1`.
#[derive(Debug, Clone, PartialEq)]
pub struct Composite<const D: usize> {
    breaks: Breaks,
    degree: usize,
    /// `degree + 1` Bezier points for each segment, one segment after the other.
    points: Vec<Point<D>>,
}

/// A composite made ready to be evaluated many times.
#[derive(Debug, Clone)]
pub struct Evaluator<'a, const D: usize> {
    breaks: &'a Breaks,
    degree: usize,
    /// Bezier points times binomial coefficients.
    scaled: Vec<Point<D>>,
    /// What to multiply by, so that nothing overflows on the way.
    unit: f64,
}

impl<const D: usize> Composite<D> {
    /// From the Bezier points of each segment; segments of lower degree are elevated to the highest.
    /// As many segments as the breaks have intervals, each of at least one point.
    ///
    /// # Errors
    /// [`Fault::Cancelled`].
    pub fn from_segments<'a>(breaks: Breaks, segments: impl Iterator<Item = &'a [Point<D>]> + Clone) -> Result<Self, Error> {
        debug_assert_eq!(breaks.segments(), segments.clone().count());
        let degree = segments.clone().map(<[_]>::len).max().unwrap_or(1) - 1;
        let mut points = Vec::with_capacity(breaks.segments() * (degree + 1));
        let mut pace = Pace::default();
        for segment in segments {
            pace.step()?;
            if segment.len() == degree + 1 {
                points.extend_from_slice(segment);
            } else {
                points.extend(elevate(segment, degree));
            }
        }
        Ok(Composite { breaks, degree, points })
    }

    /// From the Bezier points of all segments, one after the other.
    pub(crate) fn from_flat(breaks: Breaks, degree: usize, points: Vec<Point<D>>) -> Self {
        debug_assert_eq!(breaks.segments() * (degree + 1), points.len());
        Composite { breaks, degree, points }
    }

    /// Curves one after the other, each over an interval as long as its own domain; the first starts at 0.
    ///
    /// # Errors
    /// More segments than [`crate::core::limits::SEGMENTS`]; domains whose sum is not finite.
    pub fn end_to_end(curves: &[Composite<D>]) -> Result<Self, Error> {
        let mut knots = vec![0.0];
        for curve in curves {
            let start = knots[knots.len() - 1];
            let own = curve.breaks.as_slice();
            knots.extend(own[1..].iter().map(|t| start + (t - own[0])));
        }
        Self::from_segments(Breaks::new(knots)?, curves.iter().flat_map(Composite::segments))
    }

    /// The joints.
    pub fn breaks(&self) -> &Breaks {
        &self.breaks
    }

    /// The degree of every segment.
    pub fn degree(&self) -> usize {
        self.degree
    }

    /// The Bezier points of one segment.
    pub fn segment(&self, index: usize) -> &[Point<D>] {
        &self.points[index * (self.degree + 1)..(index + 1) * (self.degree + 1)]
    }

    /// The Bezier points of every segment, in order.
    pub fn segments(&self) -> impl DoubleEndedIterator<Item = &[Point<D>]> + ExactSizeIterator + Clone {
        self.points.chunks_exact(self.degree + 1)
    }

    /// The largest absolute coordinate of a Bezier point: the unit of rounding errors.
    pub fn magnitude(&self) -> f64 {
        magnitude(&self.points)
    }

    /// The derivative with respect to the curve's own parameter.
    ///
    /// # Errors
    /// [`Fault::Cancelled`].
    pub fn derivative(&self) -> Result<Self, Error> {
        let mut points = Vec::with_capacity(self.points.len());
        let mut pace = Pace::default();
        for (i, segment) in self.segments().enumerate() {
            pace.step()?;
            let (a, b) = self.breaks.interval(i);
            points.extend(hodograph(segment, b - a));
        }
        Ok(Composite { breaks: self.breaks.clone(), degree: self.degree.saturating_sub(1), points })
    }

    /// Refuses a curve that jumps: the segments of a piecewise curve share their joints.
    ///
    /// # Errors
    /// [`Fault::UnsuitableCurve`] with the first joint at which neighbours do not meet.
    pub(crate) fn check_joined(&self) -> Result<(), Fault> {
        let allowed = 64.0 * f64::EPSILON * self.magnitude();
        let gap = |i: &usize| self.segment(i - 1)[self.degree].distance(self.segment(*i)[0]);
        let Some(i) = (1..self.breaks.segments()).find(|i| gap(i) > allowed) else { return Ok(()) };
        let t = self.breaks.as_slice()[i];
        Err(Fault::UnsuitableCurve(format!("the curve jumps at the knot {t:?} (multiplicity degree + 1), but segments share their joints")))
    }

    /// Whether a curve declared closed ends where it starts to within rounding. A B-spline may miss that by more.
    pub(crate) fn closes(&self, declared: bool) -> bool {
        let last = self.segment(self.breaks.segments() - 1);
        declared && last[self.degree].distance(self.segment(0)[0]) <= 64.0 * f64::EPSILON * self.magnitude()
    }

    /// Ready to be evaluated many times.
    ///
    /// # Errors
    /// [`Fault::Cancelled`].
    pub fn evaluator(&self) -> Result<Evaluator<'_, D>, Error> {
        let unit = unit_of(self.magnitude());
        let binomials = binomials(self.degree);
        let mut points = Vec::with_capacity(self.points.len());
        let mut pace = Pace::default();
        for segment in self.segments() {
            pace.step()?;
            points.extend(scaled(segment, binomials, unit));
        }
        Ok(Evaluator { breaks: &self.breaks, degree: self.degree, scaled: points, unit })
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
        horner(self.scaled(segment), u, v) * self.unit
    }

    /// The points at parameters of the domain in any order, each as [`Evaluator::at`] gives it. O(degree) for one in the same
    /// segment as the one before or in the next.
    ///
    /// # Errors
    /// [`Fault::Cancelled`].
    pub fn sample(&self, parameters: &[f64]) -> Result<Vec<Point<D>>, Error> {
        let mut points = Vec::with_capacity(parameters.len());
        let (mut lanes, mut segment) = (None, 0);
        for part in parameters.chunks(LANES) {
            work::checkpoint()?;
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
    fn extend(&self, points: &mut Vec<Point<D>>, lanes: &mut Option<Lanes<D>>, segment: usize, parameters: &[f64]) {
        if parameters.len() < FEW {
            let local = parameters.iter().map(|&t| self.breaks.local(segment, t));
            return points.extend(local.map(|(u, v)| self.within(segment, u, v)));
        }
        let lanes = lanes.get_or_insert_with(Lanes::new);
        lanes::extend(points, lanes, self.scaled(segment), self.unit, self.breaks.interval(segment), parameters);
    }

    fn scaled(&self, segment: usize) -> &[Point<D>] {
        &self.scaled[segment * (self.degree + 1)..(segment + 1) * (self.degree + 1)]
    }
}

/// Fewer parameters are faster one at a time.
const FEW: usize = 16;

/// The composite of one segment over `[0, length]`.
pub(crate) fn single_segment<const D: usize>(length: f64, bezier: Vec<Point<D>>) -> Result<Composite<D>, Error> {
    let degree = bezier.len() - 1;
    Ok(Composite::from_flat(Breaks::new(vec![0.0, length])?, degree, bezier))
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
        let points = (0..(degree + 1) * (knots.len() - 1)).map(|i| Point([0, 1, 2].map(|k| size * (number(3 * i + k) - 0.5)))).collect();
        Composite::from_flat(Breaks::new(knots.to_vec()).unwrap(), degree, points)
    }

    /// Parameters in order and out of order, with every joint and both ends; a number of them that fills no group of lanes.
    fn parameters(knots: &[f64]) -> Vec<f64> {
        let (a, b) = (knots[0], knots[knots.len() - 1]);
        let sorted = (0..=300).map(|i| a + (b - a) * (i as f64 / 300.0)).chain(knots.iter().copied());
        sorted.chain((0..301).map(|i| a + (b - a) * number(i))).map(|t| t.min(b)).collect()
    }

    #[test]
    fn many_parameters_have_the_bits_of_each_alone_and_are_on_the_curve() {
        for knots in [vec![0.0, 1.0], vec![-1.0, 0.5, 0.75, 3.0], vec![1e9, 1e9 + 1.0, 1e9 + 3.0]] {
            for degree in (0..=9).chain([33, 64]) {
                for size in [1.0, 1e-300, 1e308] {
                    let curve = wave(degree, &knots, size);
                    let (evaluator, parameters) = (curve.evaluator().unwrap(), parameters(&knots));
                    let together = evaluator.sample(&parameters).unwrap();
                    assert_eq!(together.len(), parameters.len());
                    for (&t, p) in parameters.iter().zip(together) {
                        assert_eq!(p.0.map(f64::to_bits), evaluator.at(t).0.map(f64::to_bits), "degree {degree} at {t}");
                        let segment = curve.breaks().segment_at(t);
                        let (u, _) = curve.breaks().local(segment, t);
                        let expected = blossom(curve.segment(segment), vec![u; degree]);
                        assert!(p.distance(expected) <= 1e-15 * (degree + 1) as f64 * size, "degree {degree} at {t}");
                    }
                }
            }
        }
    }

    #[test]
    fn ends_are_met_exactly() {
        let curve = wave(64, &[0.1, 0.3, 0.7], 1.0);
        let ends = curve.evaluator().unwrap().sample(&[0.1, 0.3, 0.7]).unwrap();
        assert_eq!(ends, [curve.segment(0)[0], curve.segment(1)[0], curve.segment(1)[64]]);
    }
}
