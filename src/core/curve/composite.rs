//! The common ground of all curves: polynomial segments in Bezier form, end to end.

use crate::core::bezier_form::{binomials, elevate, hodograph, horner, scaled, unit_of};
use crate::core::error::{Error, Fault};
use crate::core::knots::Breaks;
use crate::core::point::{Point, magnitude};
use crate::core::work::Pace;

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
            points.extend(scaled(segment, &binomials, unit));
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
        let first = segment * (self.degree + 1);
        horner(&self.scaled[first..=first + self.degree], u, v) * self.unit
    }
}

/// The composite of one segment over `[0, length]`.
pub(crate) fn single_segment<const D: usize>(length: f64, bezier: Vec<Point<D>>) -> Result<Composite<D>, Error> {
    let degree = bezier.len() - 1;
    Ok(Composite::from_flat(Breaks::new(vec![0.0, length])?, degree, bezier))
}
