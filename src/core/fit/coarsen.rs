//! Fewer joints, while the tolerance holds.

use std::collections::BTreeSet;

use super::local::Local;
use super::problem::Problem;
use super::spline::CubicSpline;
use crate::core::context::Context;
use crate::core::error::Error;

/// Trials of many joints at once.
const BATCHES: usize = 40;
/// Points in all trials of one joint at a time: about a second's work.
const WORK: usize = 4_000_000;
/// What such a trial costs besides, in points.
const OVERHEAD: usize = 64;

/// Takes out every other joint at most, those first whose third derivative jumps least; puts back
/// those next to which the spline does not hold, which are then left alone. O(points) per trial.
pub(super) fn in_batches<const D: usize>(
    context: &Context,
    problem: &Problem<D>,
    spline: CubicSpline<D>,
) -> Result<CubicSpline<D>, Error> {
    let all = spline.breaks().to_vec();
    let mut best = spline;
    let mut joints: Vec<usize> = (0..all.len()).collect();
    let mut needed = vec![false; all.len()];
    let mut trials = 0;
    while trials < BATCHES {
        let mut out = removable(&best, &joints, &needed);
        if out.is_empty() {
            break;
        }
        while trials < BATCHES && !out.is_empty() {
            trials += 1;
            let kept: Vec<usize> =
                joints.iter().copied().filter(|joint| !out.contains(joint)).collect();
            let breaks: Vec<f64> = kept.iter().map(|&joint| all[joint]).collect();
            let Some(trial) = problem.spline(context, &breaks)? else {
                context.checkpoint()?;
                // The joints that are left are not determined well together: try fewer.
                keep_half(&mut out, &mut needed);
                continue;
            };
            let violated = problem.violated(context, &trial)?;
            if !violated.contains(&true) {
                (best, joints) = (trial, kept);
                break;
            }
            restore(context, &mut out, &mut needed, &kept, &violated)?;
        }
    }
    Ok(best)
}

/// Joints to take out together: no two neighbours, the least jumps first, no more than half of the
/// candidates.
fn removable<const D: usize>(
    spline: &CubicSpline<D>,
    joints: &[usize],
    needed: &[bool],
) -> BTreeSet<usize> {
    let candidates: Vec<usize> =
        by_jump(spline).into_iter().filter(|&k| !needed[joints[k]]).collect();
    let mut taken = vec![false; joints.len()];
    for &k in candidates.iter().take(candidates.len().div_ceil(2)) {
        taken[k] = !taken[k - 1] && !taken[k + 1];
    }
    (0..taken.len()).filter(|&k| taken[k]).map(|k| joints[k]).collect()
}

/// Puts back the second half of the joints; a single one for good.
fn keep_half(out: &mut BTreeSet<usize>, needed: &mut [bool]) {
    let middle = out.iter().nth(out.len() / 2).copied().unwrap_or(0);
    if out.len() == 1 {
        needed[middle] = true;
    }
    out.split_off(&middle);
}

/// Puts back the joints inside violated segments; where there is none, all that are near one, or
/// else all.
fn restore(
    context: &Context,
    out: &mut BTreeSet<usize>,
    needed: &mut [bool],
    joints: &[usize],
    violated: &[bool],
) -> Result<(), Error> {
    let mut reach = 0;
    loop {
        let near = |k: usize| {
            (k.saturating_sub(reach)..=(k + reach).min(violated.len() - 1)).any(|k| violated[k])
        };
        let guilty = |joint: &usize| near(joints.partition_point(|kept| kept <= joint) - 1);
        let verdicts = context.collect(out.iter().map(|joint| (*joint, guilty(joint))))?;
        if verdicts.iter().any(|&(_, guilty)| guilty) {
            for (joint, _) in verdicts.into_iter().filter(|&(_, guilty)| guilty) {
                out.remove(&joint);
                needed[joint] = true;
            }
            return Ok(());
        }
        reach = 2 * reach + 1;
    }
}

/// Inner joints by what taking each out would change, least first: the jump of the third derivative
/// times the cube of the lengths it acts over (Lyche and Morken 1987 weigh knots alike).
fn by_jump<const D: usize>(spline: &CubicSpline<D>) -> Vec<usize> {
    let breaks = spline.composite.breaks();
    let third = |k: usize| {
        let (a, b) = breaks.interval(k);
        let q = spline.composite.segment(k);
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
    order.into_iter().map(|(k, _)| k).collect()
}

/// Takes out one joint after the other, in sweeps, until a sweep takes out none, or the work is
/// done. Also whether every single joint that is left was tried in vain, each by a spline that the
/// points determine.
pub(super) fn one_by_one<const D: usize>(
    context: &Context,
    problem: &Problem<D>,
    spline: CubicSpline<D>,
) -> Result<(CubicSpline<D>, bool), Error> {
    let mut best = spline;
    let mut local = Local::new(context, problem, &best)?;
    let mut work = WORK;
    loop {
        let joints: Vec<f64> = by_jump(&best).into_iter().map(|k| best.breaks()[k]).collect();
        let before = best.segments();
        let mut minimal = true;
        for joint in joints {
            let k = best.breaks().partition_point(|&knot| knot < joint);
            let Some(rest) = work.checked_sub(local.points_near(k) + OVERHEAD) else {
                return Ok((best, false));
            };
            work = rest;
            if local.misses(context, k)? {
                continue;
            }
            let mut fewer = best.breaks().to_vec();
            fewer.remove(k);
            work = work.saturating_sub(problem.ordered.parameters.len());
            match problem.spline(context, &fewer)? {
                Some(trial) if problem.holds(context, &trial)? => {
                    best = trial;
                    local = Local::new(context, problem, &best)?;
                }
                trial => minimal &= trial.is_some(),
            }
        }
        if best.segments() == before {
            return Ok((best, minimal));
        }
    }
}
