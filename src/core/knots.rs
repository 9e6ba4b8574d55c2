//! Knot vectors that cannot be invalid.

use super::check::{at_least, at_most, increasing};
use super::error::Error;
use super::fault::Fault;
use crate::core::context::Context;

/// The full knot vector of a B-spline: `control points + degree + 1` knots that do not decrease,
/// none more than `degree + 1` times, with a parameter range of positive length.
#[derive(Debug, Clone, PartialEq)]
pub struct KnotVector {
    degree: usize,
    knots: Vec<f64>,
}

impl KnotVector {
    /// Checks a knot vector for a degree and a number of control points.
    ///
    /// # Errors
    /// [`Fault::WrongCount`] or [`Fault::TooFew`] without a place; at the offending knot:
    /// [`Fault::NotIncreasing`], a multiplicity above `degree + 1`, or a valid range that is empty.
    pub fn new(degree: usize, knots: Vec<f64>, control_points: usize) -> Result<Self, Error> {
        at_least("control points", control_points, degree + 1)?;
        let expected = control_points + degree + 1;
        if knots.len() != expected {
            let rule = "a full knot vector has control points + degree + 1 knots (some programs leave out the first and the last)";
            return Err(
                Fault::WrongCount { what: "knots", count: knots.len(), expected, rule }.into()
            );
        }
        increasing("knots", &knots, false)?;
        if let Some(i) = (degree + 1..knots.len()).find(|&i| knots[i] == knots[i - degree - 1]) {
            let allowed = format!("a multiplicity of at most degree + 1 = {}", degree + 1);
            return Err(
                Fault::OutOfRange { what: "this repeated knot", value: knots[i], allowed }.at(i)
            );
        }
        let vector = KnotVector { degree, knots };
        let (a, b) = vector.domain();
        if a == b {
            return Err(Fault::NotIncreasing {
                what: "the first and last knot of the curve",
                previous: a,
                value: b,
                strictly: true,
            }
            .at(control_points));
        }
        // Differences of knots may still be too large for a double.
        if !(vector.knots[vector.knots.len() - 1] - vector.knots[0]).is_finite() {
            return Err(beyond(&vector.knots));
        }
        Ok(vector)
    }

    /// The degree the vector was made for.
    pub fn degree(&self) -> usize {
        self.degree
    }

    /// All knots.
    pub fn as_slice(&self) -> &[f64] {
        &self.knots
    }

    /// The valid parameter range, `[knots[degree], knots[control points]]`.
    pub fn domain(&self) -> (f64, f64) {
        (self.knots[self.degree], self.knots[self.knots.len() - 1 - self.degree])
    }

    /// The spans of positive length inside the domain: each `i` with `knots[i] < knots[i + 1]`.
    pub fn spans(&self) -> impl Iterator<Item = usize> + '_ {
        (self.degree..self.knots.len() - 1 - self.degree)
            .filter(|&i| self.knots[i] < self.knots[i + 1])
    }

    /// The knots of the derivative: without the first and the last. Inner ones may be repeated once
    /// more than the degree allows for a curve.
    pub(super) fn of_derivative(&self) -> Self {
        KnotVector { degree: self.degree - 1, knots: self.knots[1..self.knots.len() - 1].to_vec() }
    }

    /// Gives the checked knots back.
    pub fn into_vec(self) -> Vec<f64> {
        self.knots
    }
}

/// The joints of a composite curve: at least two parameters that increase strictly.
#[derive(Debug, Clone, PartialEq)]
pub struct Breaks(Vec<f64>);

impl Breaks {
    /// Checks the joints.
    ///
    /// # Errors
    /// Fewer than 2, more than [`SEGMENTS`](crate::core::limits::SEGMENTS) + 1; at the offending
    /// knot, one that does not increase.
    pub fn new(context: &Context, knots: Vec<f64>) -> Result<Self, Error> {
        at_least("knots", knots.len(), 2)?;
        at_most("segments", knots.len() - 1, context.limits.segments, "Send the curve in parts")?;
        increasing("knots", &knots, true)?;
        if !(knots[knots.len() - 1] - knots[0]).is_finite() {
            return Err(beyond(&knots));
        }
        Ok(Breaks(knots))
    }

    /// The joints, first to last.
    pub fn as_slice(&self) -> &[f64] {
        &self.0
    }

    /// How many intervals lie between the joints.
    pub fn segments(&self) -> usize {
        self.0.len() - 1
    }

    /// First and last joint.
    pub fn domain(&self) -> (f64, f64) {
        (self.0[0], self.0[self.0.len() - 1])
    }

    /// One interval.
    pub fn interval(&self, segment: usize) -> (f64, f64) {
        (self.0[segment], self.0[segment + 1])
    }

    /// The segment at `t`: the one to the right of a joint, the last one at the end. `t` is inside
    /// the domain.
    pub fn segment_at(&self, t: f64) -> usize {
        self.0.partition_point(|&knot| knot <= t).clamp(1, self.segments()) - 1
    }

    /// The same, without a search where it is the segment given or the next.
    pub fn segment_near(&self, near: usize, t: f64) -> usize {
        let next = (near + 1).min(self.segments() - 1);
        [near, next]
            .into_iter()
            .find(|&segment| self.owns(segment, &t))
            .unwrap_or_else(|| self.segment_at(t))
    }

    /// How many of these parameters of the domain, from the first on, belong to a segment.
    pub fn run(&self, segment: usize, parameters: &[f64]) -> usize {
        if self.segments() == 1 {
            return parameters.len();
        }
        parameters.iter().take_while(|t| self.owns(segment, t)).count()
    }

    fn owns(&self, segment: usize, t: &f64) -> bool {
        let (a, b) = self.interval(segment);
        (a <= *t) & ((*t < b) | (segment + 1 == self.segments()))
    }

    /// `t` in the parameter of a segment: `u` from its start and `v = 1 - u` from its end, each to
    /// full accuracy.
    pub fn local(&self, segment: usize, t: f64) -> (f64, f64) {
        let (a, b) = self.interval(segment);
        ((t - a) / (b - a), (b - t) / (b - a))
    }
}

/// Knots in order whose span is not finite: one of them is not, or they are too far apart.
fn beyond(knots: &[f64]) -> Error {
    match knots.iter().position(|knot| !knot.is_finite()) {
        Some(i) => Fault::NotFinite.at(i),
        None => Fault::Overflow.into(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place(degree: usize, knots: &[f64], points: usize) -> String {
        KnotVector::new(degree, knots.to_vec(), points).unwrap_err().place.to_string()
    }

    #[test]
    fn knot_faults_point_at_the_knot() {
        assert_eq!(place(1, &[0.0, 0.0, 1.0, 0.5, 1.0], 3), "/3");
        assert_eq!(place(1, &[0.0, 0.0, 0.0, 1.0, 1.0], 3), "/2");
        assert_eq!(place(1, &[0.0, 0.0, 1.0], 3), "");
        assert_eq!(place(2, &[0.0; 4], 1), "");
        assert_eq!(
            place(1, &[0.0, 1.0, 1.0, 2.0], 2),
            "/2",
            "an empty range, between knots 1 and 2"
        );
    }

    #[test]
    fn spans_skip_repeated_knots() {
        let knots = KnotVector::new(2, vec![0.0, 0.0, 0.0, 1.0, 1.0, 2.0, 2.0, 2.0], 5).unwrap();
        assert_eq!(knots.spans().collect::<Vec<_>>(), [2, 4]);
        assert_eq!(knots.domain(), (0.0, 2.0));
    }

    #[test]
    fn a_joint_belongs_to_the_segment_on_its_right() {
        let breaks = Breaks::new(&Context::default(), vec![0.0, 1.0, 3.0]).unwrap();
        assert_eq!([0.0, 0.5, 1.0, 2.9, 3.0].map(|t| breaks.segment_at(t)), [0, 0, 1, 1, 1]);
        assert_eq!(breaks.local(1, 2.5), (0.75, 0.25));
        assert_eq!(
            Breaks::new(&Context::default(), vec![0.0, 1.0, 1.0]).unwrap_err().place.to_string(),
            "/2"
        );
    }
}
