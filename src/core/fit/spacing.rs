//! Joints spread by a rule, as many as wanted.

use super::ordered::Ordered;
use super::problem::Problem;
use super::spline::CubicSpline;
use crate::core::curve::Composite;

/// The least part of the largest share that a segment counts for, so that no stretch is left
/// without joints.
const LEAST: f64 = 1e-3;

/// A share for each part of the domain: joints divide the whole evenly.
pub(super) struct Spacing {
    parts: Vec<f64>,
    /// The sum of the shares up to each end of a part.
    sums: Vec<f64>,
}

impl Spacing {
    /// Equal lengths.
    pub(super) fn equal<const D: usize>(ordered: &Ordered<D>) -> Self {
        let (first, last) = (ordered.places[0], ordered.places[ordered.stretches()]);
        Spacing { parts: vec![first, last], sums: vec![0.0, 1.0] }
    }

    /// Equal numbers of places.
    pub(super) fn places<const D: usize>(ordered: &Ordered<D>) -> Self {
        Spacing {
            parts: ordered.places.clone(),
            sums: (0..ordered.places.len()).map(|i| i as f64).collect(),
        }
    }

    /// By the fourth root of the fourth derivative, on which the error of the best cubics depends,
    /// taken from the jumps of the third (de Boor 1978, XII, `NEWNOT`).
    pub(super) fn by_jumps<const D: usize>(composite: &Composite<D>) -> Self {
        let breaks = composite.breaks().as_slice();
        let third = |k: usize| {
            let (q, h) = (composite.segment(k), breaks[k + 1] - breaks[k]);
            ((q[3] - q[0]) + (q[1] - q[2]) * 3.0).map(|x| x / h / h / h)
        };
        let last = breaks.len() - 2;
        // Half the jump over the distance of the middles, at each joint.
        let fourth = |joint: usize| {
            (third(joint) - third(joint - 1)).norm() / (breaks[joint + 1] - breaks[joint - 1])
        };
        let share = |k: usize| {
            let (before, after) = ((k > 0).then(|| fourth(k)), (k < last).then(|| fourth(k + 1)));
            let sides = before.or(after).unwrap_or(0.0) + after.or(before).unwrap_or(0.0);
            sides.sqrt().sqrt() * (breaks[k + 1] - breaks[k])
        };
        Self::of(breaks, (0..=last).map(share).collect())
    }

    /// By the fourth root of the error in each segment: what its length would have to shrink by.
    pub(super) fn by_errors<const D: usize>(problem: &Problem<D>, spline: &CubicSpline<D>) -> Self {
        let breaks = spline.breaks();
        let mut errors = vec![0.0f64; spline.segments()];
        let mut k = 0;
        for (&t, &distance) in problem.ordered.parameters.iter().zip(&spline.distances) {
            while k + 1 < errors.len() && breaks[k + 1] <= t {
                k += 1;
            }
            errors[k] = errors[k].max(distance);
        }
        Self::of(
            breaks,
            errors.into_iter().map(|error| (error / problem.tolerance).sqrt().sqrt()).collect(),
        )
    }

    fn of(breaks: &[f64], mut shares: Vec<f64>) -> Self {
        let largest = shares.iter().copied().fold(f64::MIN_POSITIVE, f64::max);
        shares.iter_mut().for_each(|share| *share = share.max(LEAST * largest));
        let mut sums = vec![0.0; breaks.len()];
        (0..shares.len()).for_each(|k| sums[k + 1] = sums[k] + shares[k]);
        Spacing { parts: breaks.to_vec(), sums }
    }

    /// The sum of all shares.
    pub(super) fn total(&self) -> f64 {
        self.sums[self.sums.len() - 1]
    }

    /// First and last parameter, and `segments - 1` joints between.
    pub(super) fn breaks(&self, segments: usize) -> Vec<f64> {
        let mut part = 0;
        let at = |i: usize| {
            let wanted = self.total() * (i as f64 / segments as f64);
            while part + 2 < self.sums.len() && self.sums[part + 1] <= wanted {
                part += 1;
            }
            let share = (wanted - self.sums[part]) / (self.sums[part + 1] - self.sums[part]);
            self.parts[part] * (1.0 - share) + self.parts[part + 1] * share
        };
        let inner: Vec<f64> = (1..segments).map(at).collect();
        let (first, last) = (self.parts[0], self.parts[self.parts.len() - 1]);
        std::iter::once(first).chain(inner).chain(std::iter::once(last)).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn joints_divide_the_shares_evenly() {
        let spacing = Spacing::of(&[0.0, 1.0, 3.0], vec![3.0, 1.0]);
        assert_eq!(spacing.breaks(4), [0.0, 1.0 / 3.0, 2.0 / 3.0, 1.0, 3.0]);
        assert_eq!(spacing.breaks(1), [0.0, 3.0]);
    }
}
