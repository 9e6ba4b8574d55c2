//! Fewer joints, while the tolerance holds.

use std::collections::BTreeSet;

use super::refine::violated_segments;
use super::spline::{Ordered, Spline};
use crate::core::error::Error;
use crate::core::work;

/// Trials of many joints at once.
const BATCHES: usize = 40;
/// Points in all trials of one joint at a time: about a second's work.
const WORK: usize = 4_000_000;

/// The spline without the joints it can do without, and whether every single remaining joint was tried in vain.
///
/// First many joints at once, those first whose third derivative jumps least; then one at a time.
pub(super) fn coarsen<const D: usize>(ordered: &Ordered<D>, spline: Spline<D>, tolerance: f64) -> Result<(Spline<D>, bool), Error> {
    let spline = in_batches(ordered, spline, tolerance)?;
    one_by_one(ordered, spline, tolerance)
}

/// Takes out every other joint at most; puts back those next to which the tolerance breaks, which are
/// then left alone. O(points) per trial.
fn in_batches<const D: usize>(ordered: &Ordered<D>, spline: Spline<D>, tolerance: f64) -> Result<Spline<D>, Error> {
    let mut best = spline;
    let mut needed = vec![false; ordered.places.len()];
    let mut trials = 0;
    while trials < BATCHES {
        let mut out = removable(&best, &needed)?;
        if out.is_empty() {
            break;
        }
        while trials < BATCHES && !out.is_empty() {
            trials += 1;
            let kept = best.joints.iter().copied().filter(|place| !out.contains(place)).collect();
            let Ok(trial) = ordered.spline(kept) else {
                work::checkpoint()?;
                // The joints that are left lose the rank together: try fewer.
                keep_half(&mut out, &mut needed);
                continue;
            };
            let violated = violated_segments(ordered, &trial, tolerance);
            if !violated.contains(&true) {
                best = trial;
                break;
            }
            restore(&mut out, &mut needed, &trial.joints, &violated)?;
        }
    }
    Ok(best)
}

/// Joints to take out together: no two neighbours, the least jumps first, no more than half of the candidates.
fn removable<const D: usize>(spline: &Spline<D>, needed: &[bool]) -> Result<BTreeSet<usize>, Error> {
    let order = by_jump(spline)?;
    let mut taken = vec![false; spline.joints.len()];
    let candidates: Vec<usize> = order.into_iter().filter(|&k| !needed[spline.joints[k]]).collect();
    for &k in candidates.iter().take(candidates.len().div_ceil(2)) {
        taken[k] = !taken[k - 1] && !taken[k + 1];
    }
    Ok((0..taken.len()).filter(|&k| taken[k]).map(|k| spline.joints[k]).collect())
}

/// Puts back the second half of the joints; a single one for good.
fn keep_half(out: &mut BTreeSet<usize>, needed: &mut [bool]) {
    let middle = out.iter().nth(out.len() / 2).copied().unwrap_or(0);
    if out.len() == 1 {
        needed[middle] = true;
    }
    out.split_off(&middle);
}

/// Puts back the joints inside violated segments; where there is none, all that are near one, or else all.
fn restore(out: &mut BTreeSet<usize>, needed: &mut [bool], joints: &[usize], violated: &[bool]) -> Result<(), Error> {
    let mut reach = 0;
    loop {
        let near = |k: usize| (k.saturating_sub(reach)..=(k + reach).min(violated.len() - 1)).any(|k| violated[k]);
        let guilty = |place: &usize| near(joints.partition_point(|joint| joint <= place) - 1);
        let verdicts = work::collect(out.iter().map(|place| (*place, guilty(place))))?;
        if verdicts.iter().any(|&(_, guilty)| guilty) {
            for (place, _) in verdicts.into_iter().filter(|&(_, guilty)| guilty) {
                out.remove(&place);
                needed[place] = true;
            }
            return Ok(());
        }
        reach = 2 * reach + 1;
    }
}

/// Inner joints by what taking each out would change, least first: the jump of the third derivative
/// times the cube of the lengths it acts over (Lyche and Morken 1987 weigh knots alike).
fn by_jump<const D: usize>(spline: &Spline<D>) -> Result<Vec<usize>, Error> {
    let composite = spline.composite()?;
    let breaks = composite.breaks();
    let third = |k: usize| {
        let (a, b) = breaks.interval(k);
        let q = composite.segment(k);
        ((q[3] - q[0]) + (q[1] - q[2]) * 3.0, b - a)
    };
    let change = |k: usize| {
        let ((before, h), (after, g)) = (third(k - 1), third(k));
        // Each difference belongs to its own cubed length; both are brought to the harmonic one.
        let scale = |own: f64| ((h.min(g) / own) / (1.0 + h.min(g) / h.max(g))).powi(3);
        (after * scale(g) - before * scale(h)).norm()
    };
    let mut order: Vec<(usize, f64)> = (1..spline.segments()).map(|k| (k, change(k))).collect();
    order.sort_by(|a, b| a.1.total_cmp(&b.1));
    Ok(order.into_iter().map(|(k, _)| k).collect())
}

/// Takes out one joint after the other, in sweeps, until a sweep takes out none, or the work is done.
fn one_by_one<const D: usize>(ordered: &Ordered<D>, spline: Spline<D>, tolerance: f64) -> Result<(Spline<D>, bool), Error> {
    let mut best = spline;
    let mut trials = WORK / ordered.parameters.len();
    loop {
        let places: Vec<usize> = by_jump(&best)?.into_iter().map(|k| best.joints[k]).collect();
        let before = best.segments();
        for place in places {
            if trials == 0 {
                return Ok((best, false));
            }
            trials -= 1;
            work::checkpoint()?;
            let fewer = best.joints.iter().copied().filter(|&joint| joint != place).collect();
            best = match ordered.spline(fewer) {
                Ok(trial) if trial.error() <= tolerance => trial,
                _ => best,
            };
        }
        if best.segments() == before {
            return Ok((best, true));
        }
    }
}
