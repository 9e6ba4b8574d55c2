//! How far a curve is from points.

use crate::core::context::Context;
use crate::core::curve::Curve;
use crate::core::error::Error;
use crate::core::point::Point;

/// Distances between points and the curve at their parameters.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FitError {
    /// The largest.
    pub max: f64,
    /// The root of the mean of their squares.
    pub rms: f64,
    /// The point that is furthest from the curve; the first of several.
    pub worst_index: usize,
}

impl FitError {
    /// Of at least one distance. Scaled by the largest, so that no square overflows or vanishes.
    pub(super) fn of(distances: &[f64]) -> Self {
        let (mut worst_index, mut max) = (0, 0.0);
        for (i, &distance) in distances.iter().enumerate() {
            if distance > max || distance.is_nan() {
                (worst_index, max) = (i, distance);
            }
        }
        let scale = if max > 0.0 { max } else { 1.0 };
        let squares: f64 = distances.iter().map(|d| (d / scale) * (d / scale)).sum();
        FitError { max, rms: scale * (squares / distances.len() as f64).sqrt(), worst_index }
    }
}

/// Evaluates the curve at each parameter. O(points * degree).
pub(super) fn measure<const D: usize>(
    context: &Context,
    curve: &Curve<D>,
    points: &[Point<D>],
    parameters: &[f64],
) -> Result<FitError, Error> {
    let composite = curve.composite(context)?;
    let sampled = composite.evaluator(context)?.sample(context, parameters)?;
    let distances = context.collect(points.iter().zip(sampled).map(|(&p, q)| q.distance(p)))?;
    Ok(FitError::of(&distances))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn extreme_distances_keep_their_root_mean_square() {
        let error = FitError::of(&[3e-200, 0.0, 4e-200, 0.0]);
        assert_eq!((error.max, error.worst_index), (4e-200, 2));
        assert!((error.rms / 2.5e-200 - 1.0).abs() < 1e-15);
        assert_eq!(FitError::of(&[0.0, 0.0]), FitError { max: 0.0, rms: 0.0, worst_index: 0 });
    }
}
