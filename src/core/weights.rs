//! Weights of control points.

use super::error::{Error, every};
use super::fault::Fault;
use super::limits::WEIGHT_RATIO;

/// Positive weights, one for each control point, whose largest is at most [`WEIGHT_RATIO`] times the
/// smallest.
#[derive(Debug, Clone, PartialEq)]
pub struct Weights(Vec<f64>);

impl Weights {
    /// Checks weights for this many control points.
    ///
    /// # Errors
    /// Another count; at a weight: one that is not positive and finite, or so small beside the
    /// largest.
    pub fn new(weights: Vec<f64>, points: usize) -> Result<Self, Error> {
        if weights.len() != points {
            let rule = "one weight per control point";
            let (what, count) = ("weights", weights.len());
            return Err(Fault::WrongCount { what, count, expected: points, rule }.into());
        }
        let is_positive = |(i, &value): (usize, &f64)| {
            if value > 0.0 && value.is_finite() {
                return Ok(());
            }
            let allowed = "a finite weight > 0".into();
            Err(Fault::OutOfRange { what: "this weight", value, allowed }.at(i))
        };
        every(weights.iter().enumerate().map(is_positive))?;
        let largest = weights.iter().copied().fold(0.0, f64::max);
        let too_small = |w: &f64| largest / w > WEIGHT_RATIO;
        if let Some(i) = weights.iter().position(too_small) {
            let allowed = format!("at least 1 / {WEIGHT_RATIO:e} of the largest, {largest:?}");
            let (what, value) = ("this weight", weights[i]);
            return Err(Fault::OutOfRange { what, value, allowed }.at(i));
        }
        Ok(Weights(weights))
    }

    /// As many as there are points, all the same.
    pub(crate) fn ones(points: usize) -> Self {
        Weights(vec![1.0; points])
    }

    /// The weights.
    pub fn as_slice(&self) -> &[f64] {
        &self.0
    }

    /// The weights themselves.
    pub fn into_vec(self) -> Vec<f64> {
        self.0
    }

    /// The same with the largest below 1: see [`Weights::unit`].
    pub(crate) fn scaled(&self) -> Vec<f64> {
        let unit = self.unit();
        self.0.iter().map(|w| w * unit).collect()
    }

    /// Whether all are the same: then they mean nothing.
    pub fn are_equal(&self) -> bool {
        self.0.windows(2).all(|pair| pair[0] == pair[1])
    }

    /// A power of two that brings the largest weight below 1, so that no point overflows by its
    /// weight, and mostly to 0.5 or more. Multiplying by it changes no digit, and only ratios of
    /// weights count.
    pub(crate) fn unit(&self) -> f64 {
        let largest = self.0.iter().copied().fold(0.0, f64::max);
        let unit = 2f64.powi((-1.0 - largest.log2().floor()).clamp(-1022.0, 1022.0) as i32);
        // A logarithm is rounded.
        if largest * unit >= 1.0 { unit / 2.0 } else { unit }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_no_weight_is_refused_at_its_place() {
        let place =
            |weights: &[f64]| Weights::new(weights.to_vec(), 3).unwrap_err().place.to_string();
        assert_eq!(place(&[1.0, 1.0]), "");
        for bad in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert_eq!(place(&[1.0, 2.0, bad]), "/2");
        }
        assert_eq!(place(&[1e-3, 1e10, 1.0]), "/0");
        assert!(Weights::new(vec![1e-2, 1e10, 1.0], 3).is_ok());
    }

    #[test]
    fn the_unit_is_a_power_of_two_that_brings_the_largest_below_one() {
        for largest in [1.0, 3.0, 0.1, 1e300, 1e-300, 2f64.powi(-7), 1.0_f64.next_down()] {
            let unit = Weights::new(vec![largest / 2.0, largest], 2).unwrap().unit();
            assert!((0.25..1.0).contains(&(largest * unit)), "{largest}: {unit}");
            assert_eq!(unit.log2().fract(), 0.0);
        }
        assert!(Weights::new(vec![5e-324; 2], 2).unwrap().unit().is_finite());
        assert!(f64::MAX * Weights::new(vec![f64::MAX; 2], 2).unwrap().unit() < 4.0);
    }
}
