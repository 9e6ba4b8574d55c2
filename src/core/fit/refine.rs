//! More joints, until the tolerance holds.

use super::spline::{Ordered, Spline};
use crate::core::least_squares::Deficient;

/// After so many rounds every segment is split, so that the rounds that follow are few.
const PATIENCE: usize = 40;

/// The first spline on a path from one segment to interpolation that holds the tolerance, and how
/// many splines were tried; the last one where none does.
///
/// A segment with a point too far off is split at the place in the middle of its points.
pub(super) fn refine<const D: usize>(ordered: &Ordered<D>, tolerance: f64) -> Result<(Spline<D>, usize), Deficient> {
    let mut spline = ordered.spline(vec![0, ordered.places.len() - 1])?;
    let mut rounds = 1;
    while spline.error() > tolerance {
        let Some(joints) = more_joints(ordered, &spline, tolerance, rounds >= PATIENCE) else { break };
        spline = ordered.spline(joints)?;
        rounds += 1;
    }
    Ok((spline, rounds))
}

/// The joints of the next round; `None` where there are as many as interpolation has.
fn more_joints<const D: usize>(ordered: &Ordered<D>, spline: &Spline<D>, tolerance: f64, all: bool) -> Option<Vec<usize>> {
    let places = ordered.places.len();
    // With `joints + 2 = places` the spline has a coefficient for each place.
    let most = places - 2;
    if spline.joints.len() >= most {
        return None;
    }
    let violated = if all { vec![true; spline.segments()] } else { violated_segments(ordered, spline, tolerance) };
    let mut joints = split(ordered, &spline.joints, &violated);
    if joints.len() == spline.joints.len() {
        joints = split(ordered, &spline.joints, &vec![true; spline.segments()]);
    }
    if joints.len() > most {
        joints = not_a_knot(places);
    }
    Some(joints)
}

/// Joints at all places but the second and the last but one: as many coefficients as places.
fn not_a_knot(places: usize) -> Vec<usize> {
    std::iter::once(0).chain(2..places - 2).chain(std::iter::once(places - 1)).collect()
}

/// Which segments hold a point that is too far off; a point at a joint counts for both sides.
pub(super) fn violated_segments<const D: usize>(ordered: &Ordered<D>, spline: &Spline<D>, tolerance: f64) -> Vec<bool> {
    let mut violated = vec![false; spline.segments()];
    for (i, _) in spline.distances.iter().enumerate().filter(|&(_, &d)| d > tolerance) {
        let place = ordered.place_of[i];
        let right = spline.joints.partition_point(|&joint| joint <= place).clamp(1, violated.len()) - 1;
        violated[right] = true;
        if spline.joints[right] == place && right > 0 {
            violated[right - 1] = true;
        }
    }
    violated
}

/// A new joint in the middle of each marked segment that has a place inside.
fn split<const D: usize>(ordered: &Ordered<D>, joints: &[usize], marked: &[bool]) -> Vec<usize> {
    let mut finer = Vec::with_capacity(2 * joints.len());
    for (ends, &marked) in joints.windows(2).zip(marked) {
        finer.push(ends[0]);
        if marked && ends[1] - ends[0] >= 2 {
            finer.push(middle(&ordered.places, ends[0], ends[1]));
        }
    }
    finer.extend(joints.last());
    finer
}

/// The place in the middle; of two, the one nearer to the middle parameter, whichever end is first.
fn middle(places: &[f64], first: usize, last: usize) -> usize {
    let low = (first + last) / 2;
    let high = (first + last).div_ceil(2);
    if places[last] - places[high] >= places[low] - places[first] { high } else { low }
}
