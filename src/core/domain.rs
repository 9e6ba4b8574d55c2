//! The range of a parameter, and what counts as its ends.

use super::error::{Error, every};
use super::fault::Fault;

/// A parameter so many units in the last place of the domain's larger end (or less) outside is that
/// end: callers compute parameters, and `0.1 + 0.2 + 0.7` is beyond 1.
pub const ULPS: f64 = 4.0;

/// A range of a parameter, its ends included.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Domain<'a> {
    /// The first and the last parameter, `a <= b`.
    pub ends: (f64, f64),
    /// What the parameter is called: `t`.
    pub name: &'a str,
    /// What it is a parameter of: `curve`.
    pub of: &'a str,
}

impl Domain<'_> {
    /// Whether a parameter is inside as it is.
    pub fn contains(&self, t: f64) -> bool {
        (self.ends.0 <= t) & (t <= self.ends.1)
    }

    /// The parameter that is meant: one inside is itself, one outside by no more than rounding is
    /// the end; nothing else is clamped.
    ///
    /// # Errors
    /// [`Fault::OutOfRange`].
    pub fn settle(&self, t: f64) -> Result<f64, Fault> {
        let (a, b) = self.ends;
        if self.contains(t) {
            return Ok(t);
        }
        match [a, b].into_iter().find(|&end| self.is_at(t, end)) {
            Some(end) => Ok(end),
            None => Err(self.refuse(t)),
        }
    }

    /// Whether a parameter is this end but for rounding.
    pub fn is_at(&self, t: f64, end: f64) -> bool {
        let largest = self.ends.0.abs().max(self.ends.1.abs());
        t.is_finite() && (t - end).abs() <= ULPS * (largest.next_up() - largest)
    }

    fn refuse(&self, value: f64) -> Fault {
        let ((a, b), Domain { name, of, .. }) = (self.ends, self);
        let what = match *name {
            "u" => "the parameter u",
            "v" => "the parameter v",
            _ => "the parameter",
        };
        Fault::OutOfRange {
            what,
            value,
            allowed: format!("the {of}'s domain, {a:?} <= {name} <= {b:?}"),
        }
    }

    /// The same for a list.
    ///
    /// # Errors
    /// Every parameter outside, at its position.
    pub fn settle_all(&self, values: &[f64]) -> Result<Vec<f64>, Error> {
        // Compared and copied in one pass, as wide registers do it; searched only where one is
        // outside.
        let mut all_within = true;
        let checked = values.iter().map(|&t| {
            all_within &= self.contains(t);
            t
        });
        let copy: Vec<f64> = checked.collect();
        if all_within {
            return Ok(copy);
        }
        every(copy.iter().enumerate().map(|(i, &t)| self.settle(t).map_err(|fault| fault.at(i))))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn domain(a: f64, b: f64) -> Domain<'static> {
        Domain { ends: (a, b), name: "t", of: "curve" }
    }

    #[test]
    fn rounding_beyond_an_end_is_the_end_and_more_is_refused() {
        let ulps = |end: f64, n: usize| (0..n).fold(end, |t, _| t.next_up());
        let unit = domain(0.0, 1.0);
        assert_eq!(unit.settle(0.1 + 0.2 + 0.7000000000000001), Ok(1.0));
        assert_eq!(unit.settle(ulps(1.0, 4)), Ok(1.0));
        assert!(unit.settle(ulps(1.0, 5)).is_err());
        assert_eq!(unit.settle(-5e-324), Ok(0.0));
        assert_eq!(unit.settle(0.3 - 0.1 * 3.0), Ok(0.0));
        assert!(unit.settle(-1e-15).is_err());
        let far = domain(1e6, 1e6 + 1.0);
        assert_eq!(far.settle(1e6 - 1e-10), Ok(1e6));
        assert!(far.settle(1e6 - 1e-9).is_err());
        assert!(unit.settle(f64::NAN).is_err() && unit.settle(f64::INFINITY).is_err());
        assert!(domain(-f64::MAX, 0.0).settle(f64::INFINITY).is_err());
    }

    #[test]
    fn a_parameter_inside_is_itself() {
        for t in [5e-324, 1e-17, 1.0f64.next_down(), 0.5] {
            assert_eq!(domain(0.0, 1.0).settle(t), Ok(t));
        }
    }

    #[test]
    fn every_parameter_outside_is_named() {
        let error = domain(0.0, 1.0).settle_all(&[0.0, 2.0, 0.5, -3.0]).unwrap_err();
        let places: Vec<String> =
            error.each().iter().map(|error| error.place.to_string()).collect();
        assert_eq!(places, ["/1", "/3"]);
    }
}
