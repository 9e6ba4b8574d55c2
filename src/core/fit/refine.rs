//! More joints, until the tolerance holds.

use super::spline::{Ordered, Spline};
use super::unsolved::Unsolved;

/// After so many rounds every segment is split, so that the rounds that follow are few.
const PATIENCE: usize = 40;
/// Places a segment spans before it is split, as long as others can be: two halves with a place inside each.
const ROOMY: usize = 4;
/// Places a segment must span for a place to be inside it.
const TIGHT: usize = 2;
/// Lengths this close, relative to the segment, differ by rounding.
const TIE: f64 = 1e-9;

/// The first spline on a path from one segment to interpolation that holds the tolerance, and how
/// many splines were tried; the last one where none does.
///
/// A segment with a point too far off is split at the place in the middle of its points.
pub(super) fn refine<const D: usize>(ordered: &Ordered<D>, tolerance: f64) -> Result<(Spline<D>, usize), Unsolved> {
    let mut spline = ordered.spline(vec![0, ordered.places.len() - 1])?;
    let mut rounds = 1;
    while spline.error() > tolerance {
        let Some(joints) = more_joints(ordered, &spline, tolerance, rounds >= PATIENCE) else { break };
        // Long runs of neighbouring joints are determined, but may lose all digits; interpolation is sound.
        spline = ordered.spline(joints).or_else(|unsolved| match unsolved {
            Unsolved::Deficient(_) => ordered.spline(not_a_knot(ordered.places.len())),
            stopped => Err(stopped),
        })?;
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
    let every = vec![true; spline.segments()];
    let violated = if all { every.clone() } else { violated_segments(ordered, spline, tolerance) };
    let ways = [(&violated, ROOMY), (&violated, TIGHT), (&every, TIGHT)];
    let finer = ways.into_iter().map(|(marked, least)| split(ordered, spline, marked, least));
    let joints = finer.into_iter().find(|finer| finer.len() > spline.joints.len());
    Some(joints.filter(|joints| joints.len() <= most).unwrap_or_else(|| not_a_knot(places)))
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

/// A new joint in the middle of each marked segment that is long enough.
fn split<const D: usize>(ordered: &Ordered<D>, spline: &Spline<D>, marked: &[bool], least: usize) -> Vec<usize> {
    let mut finer = Vec::with_capacity(2 * spline.joints.len());
    for (ends, &marked) in spline.joints.windows(2).zip(marked) {
        finer.push(ends[0]);
        if marked && ends[1] - ends[0] >= least {
            finer.push(middle(ordered, spline, ends[0], ends[1]));
        }
    }
    finer.extend(spline.joints.last());
    finer
}

/// The place in the middle; of two, the one nearer to the middle parameter, or else with the larger
/// distance: rules that do not depend on which end is first.
fn middle<const D: usize>(ordered: &Ordered<D>, spline: &Spline<D>, first: usize, last: usize) -> usize {
    let (low, high) = ((first + last) / 2, (first + last).div_ceil(2));
    let places = &ordered.places;
    let (after, before) = (places[last] - places[high], places[low] - places[first]);
    if (after - before).abs() <= TIE * (places[last] - places[first]) {
        let distance = |place: usize| spline.distances[ordered.place_of.partition_point(|&p| p < place)];
        return if distance(high) > distance(low) { high } else { low };
    }
    if after > before { high } else { low }
}
