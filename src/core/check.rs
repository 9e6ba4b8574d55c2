//! What several functions of the core ask of their arguments.

use std::ops::RangeInclusive;

use super::context::Context;
use super::error::Error;
use super::fault::Fault;
use super::limits::{self, Limits};

/// Refuses a count above a limit.
pub(crate) fn at_most(
    what: &'static str,
    count: usize,
    most: usize,
    advice: &'static str,
) -> Result<(), Fault> {
    if count > most { Err(Fault::TooLarge { what, count, most, advice }) } else { Ok(()) }
}

/// Refuses a count below a minimum.
pub(crate) fn at_least(what: &'static str, count: usize, least: usize) -> Result<(), Fault> {
    if count < least { Err(Fault::TooFew { what, count, least }) } else { Ok(()) }
}

/// Refuses a list that does not increase, with the position of the first value that breaks the
/// rule.
pub(crate) fn increasing(what: &'static str, values: &[f64], strictly: bool) -> Result<(), Error> {
    for (i, pair) in values.windows(2).enumerate() {
        let (previous, value) = (pair[0], pair[1]);
        // NaN breaks the rule too, whichever side it is on.
        let in_order = if strictly { value > previous } else { value >= previous };
        if !in_order {
            return Err(Fault::NotIncreasing { what, previous, value, strictly }.at(i + 1));
        }
    }
    Ok(())
}

/// Refuses a degree, or an order, that is 0 or above [`DEGREE`](crate::core::limits::DEGREE).
///
/// # Errors
/// [`Fault::OutOfRange`].
pub fn within_degrees(context: &Context, what: &'static str, value: usize) -> Result<(), Fault> {
    if (1..=context.limits.degree).contains(&value) {
        return Ok(());
    }
    let allowed = format!("1 <= {what} <= {}", context.limits.degree);
    Err(Fault::OutOfRange { what, value: value as f64, allowed })
}

impl Limits {
    /// Each with its name and the range it may have: below, not even a straight line or, for the
    /// degree, a cubic would be left.
    fn ranges(&self) -> [(&'static str, usize, RangeInclusive<usize>); 6] {
        [
            ("degree", self.degree, 3..=limits::DEGREE),
            ("control_points", self.control_points, 2..=limits::CONTROL_POINTS),
            ("data_points", self.data_points, 2..=limits::DATA_POINTS),
            ("samples", self.samples, 2..=limits::SAMPLES),
            ("answer_points", self.answer_points, 2..=limits::ANSWER_POINTS),
            ("segments", self.segments, 2..=limits::SEGMENTS),
        ]
    }
}

impl Limits {
    /// These limits, if each is one that may be set.
    ///
    /// # Errors
    /// [`Fault::OutOfRange`].
    pub fn checked(self) -> Result<Self, Fault> {
        for (what, value, range) in self.ranges() {
            if !range.contains(&value) {
                let allowed = format!("{} <= {what} <= {}", range.start(), range.end());
                return Err(Fault::OutOfRange { what, value: value as f64, allowed });
            }
        }
        Ok(self)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn increasing_names_the_first_offender() {
        let error = increasing("knots", &[0.0, 1.0, 1.0, 0.5], true).unwrap_err();
        assert_eq!(error.place.to_string(), "/2");
        let error = increasing("knots", &[0.0, 1.0, 1.0, 0.5], false).unwrap_err();
        assert_eq!(error.place.to_string(), "/3");
    }
}
