//! How data points get their parameters.

use super::argument::Argument;
use super::check::increasing;
use super::error::{Error, Locate};
use super::fault::Fault;
use super::knots::Breaks;
use super::point::Point;
use crate::core::context::Context;

/// A rule for parameters, or the parameters themselves.
#[derive(Debug, Clone, PartialEq)]
pub enum Parameterization {
    /// `0, 1, 2, ..`: blind to the distances between points.
    Uniform,
    /// Sums of the distances between neighbours.
    ChordLength,
    /// Sums of the square roots of the distances (Lee 1989): calmer at sharp turns.
    Centripetal,
    /// The parameters themselves. Of an interpolant: one for each point, strictly increasing; a
    /// closed curve has one more, where it returns to the first. Of a fit: one native parameter for
    /// each point. For a single segment: inside its domain, in any order. For a tolerance fit: not
    /// decreasing; the first and the last are the domain.
    Given(Vec<f64>),
}

impl Parameterization {
    /// The name on the wire.
    pub fn name(&self) -> &'static str {
        match self {
            Parameterization::Uniform => "uniform",
            Parameterization::ChordLength => "chord-length",
            Parameterization::Centripetal => "centripetal",
            Parameterization::Given(_) => "knots",
        }
    }

    /// Knots for a curve through the points in turn; a closed curve gets one more knot than points.
    ///
    /// # Errors
    /// At `points`: neighbours that coincide, or that their distance along the curve cannot tell
    /// apart, or does not fit a double, where distances are used. At `parameterization`: given
    /// knots that are too few, too many, or do not increase strictly.
    pub fn knots<const D: usize>(
        &self,
        context: &Context,
        points: &[Point<D>],
        closed: bool,
    ) -> Result<Breaks, Error> {
        let count = points.len() + usize::from(closed);
        let knots = match self {
            Parameterization::Given(knots) => {
                if knots.len() != count {
                    let rule = if closed {
                        "a closed curve has one knot per point and one more, where it returns to the first"
                    } else {
                        "one knot per point"
                    };
                    return Err(Fault::WrongCount {
                        what: "knots",
                        count: knots.len(),
                        expected: count,
                        rule,
                    }
                    .at(Argument::Knots)
                    .at(Argument::Parameterization));
                }
                increasing("knots", knots, true)
                    .at(Argument::Knots)
                    .at(Argument::Parameterization)?;
                knots.clone()
            }
            rule => rule.sums(points, count),
        };
        if let Some(i) =
            (1..knots.len()).find(|&i| knots[i] <= knots[i - 1] || !knots[i].is_finite())
        {
            let closing = i == points.len();
            let (here, before) = (points[i % points.len()], points[i - 1]);
            if here != before {
                let too_close = Fault::NotIncreasing {
                    what: "the parameters of the points",
                    previous: knots[i - 1],
                    value: knots[i],
                    strictly: true,
                };
                let fault = if knots[i].is_finite() { too_close } else { Fault::Overflow };
                return Err(fault.at(if closing { i - 1 } else { i }).at(Argument::Points));
            }
            let repeated = Fault::RepeatedPoint { parameterization: self.name(), closing };
            return Err(repeated.at(if closing { i - 1 } else { i }).at(Argument::Points));
        }
        Breaks::new(context, knots)
    }

    /// The running sums of the rule: `count` parameters from 0, each at least the one before. Given
    /// parameters as they are.
    pub(crate) fn sums<const D: usize>(&self, points: &[Point<D>], count: usize) -> Vec<f64> {
        let step = |i: usize| {
            let chord = || points[i % points.len()].distance(points[i - 1]);
            match self {
                Parameterization::Uniform | Parameterization::Given(_) => 1.0,
                Parameterization::ChordLength => chord(),
                Parameterization::Centripetal => chord().sqrt(),
            }
        };
        if let Parameterization::Given(parameters) = self {
            return parameters.clone();
        }
        let mut sum = 0.0;
        let later = (1..count).map(|i| {
            sum += step(i);
            sum
        });
        std::iter::once(0.0).chain(later).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const SQUARE: [Point<2>; 4] =
        [Point([0.0, 0.0]), Point([4.0, 0.0]), Point([4.0, 9.0]), Point([0.0, 9.0])];

    fn knots(rule: Parameterization, closed: bool) -> Vec<f64> {
        rule.knots(&Context::default(), &SQUARE, closed).unwrap().as_slice().to_vec()
    }

    #[test]
    fn rules_sum_their_steps() {
        assert_eq!(knots(Parameterization::Uniform, true), [0.0, 1.0, 2.0, 3.0, 4.0]);
        assert_eq!(knots(Parameterization::ChordLength, false), [0.0, 4.0, 13.0, 17.0]);
        assert_eq!(knots(Parameterization::Centripetal, true), [0.0, 2.0, 5.0, 7.0, 10.0]);
    }

    #[test]
    fn the_second_of_two_repeated_points_is_named() {
        let place = |points: &[Point<2>], closed| {
            Parameterization::ChordLength
                .knots(&Context::default(), points, closed)
                .unwrap_err()
                .place
                .to_string()
        };
        assert_eq!(place(&[SQUARE[0], SQUARE[1], SQUARE[1], SQUARE[2]], false), "/points/2");
        assert_eq!(place(&[SQUARE[0], SQUARE[1], SQUARE[2], SQUARE[0]], true), "/points/3");
        assert!(
            Parameterization::Uniform
                .knots(&Context::default(), &[SQUARE[0], SQUARE[0]], false)
                .is_ok()
        );
    }
}
