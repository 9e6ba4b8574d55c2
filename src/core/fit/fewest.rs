//! The fewest segments that were found to hold.

use super::coarsen;
use super::problem::Problem;
use super::spacing::Spacing;
use super::spline::CubicSpline;
use crate::core::context::Context;
use crate::core::error::Error;

/// Rounds of moving joints.
const ROUNDS: usize = 16;
/// Rounds in a row that hold no tolerance with a number of segments, before it is given up.
const VAIN: usize = 3;
/// Points in all trials of equal spacing with each number of segments in turn.
const SCAN: usize = 8_000;

/// A spline with as few segments as were found, and whether every single joint of it was tried in
/// vain. It starts from one that holds; if that has more than one segment, one was not enough.
///
/// Joints are taken out; others are spread evenly, by length and by places, and moved to where the
/// error asks for them; then single joints of the best are taken out.
pub(super) fn fewest<const D: usize>(
    context: &Context,
    problem: &Problem<D>,
    start: CubicSpline<D>,
) -> Result<(CubicSpline<D>, bool), Error> {
    if start.segments() == 1 {
        return Ok((start, true));
    }
    let (mut best, mut minimal) =
        coarsen::one_by_one(context, problem, coarsen::in_batches(context, problem, start)?)?;
    let equal = Spacing::equal(&problem.ordered);
    let mut other = None;
    for spacing in [&equal, &Spacing::places(&problem.ordered)] {
        other = spread(context, problem, spacing, other.as_ref().unwrap_or(&best))?.or(other);
    }
    other = moved(context, problem, other.as_ref().unwrap_or(&best))?.or(other);
    if let Some(other) = other {
        (best, minimal) = coarsen::one_by_one(context, problem, other)?;
    }
    match scan(context, problem, &equal, best.segments())? {
        Some(fewer) => coarsen::one_by_one(context, problem, fewer),
        None => Ok((best, minimal)),
    }
}

/// Whether a spline is better than another: fewer segments, or as many and a smaller error.
fn is_better<const D: usize>(spline: &CubicSpline<D>, other: &CubicSpline<D>) -> bool {
    let (segments, than) = (spline.segments(), other.segments());
    segments < than || (segments == than && spline.error() < other.error())
}

/// A better spline with joints spread by a rule: their number is doubled until the spline holds,
/// then bisected.
fn spread<const D: usize>(
    context: &Context,
    problem: &Problem<D>,
    spacing: &Spacing,
    best: &CubicSpline<D>,
) -> Result<Option<CubicSpline<D>>, Error> {
    if best.segments() == 1 {
        return Ok(None);
    }
    // One segment was tried first of all.
    let (mut few, mut many) = (1, 2);
    let mut found = loop {
        if let Some(spline) = problem.held(context, &spacing.breaks(many))? {
            break spline;
        }
        if many == best.segments() {
            return Ok(None);
        }
        (few, many) = (many, (2 * many).min(best.segments()));
    };
    while many - few > 1 {
        let middle = few + (many - few) / 2;
        match problem.held(context, &spacing.breaks(middle))? {
            Some(spline) => (found, many) = (spline, middle),
            None => few = middle,
        }
    }
    Ok(is_better(&found, best).then_some(found))
}

/// A spline with fewer segments, whose joints were moved until every segment has as much of the
/// error.
fn moved<const D: usize>(
    context: &Context,
    problem: &Problem<D>,
    start: &CubicSpline<D>,
) -> Result<Option<CubicSpline<D>>, Error> {
    let (mut spacing, mut vain) = (Spacing::by_jumps(&start.composite), 0);
    let (mut best, mut least) = (None, start.segments());
    let mut wanted = least - 1;
    for _ in 0..ROUNDS {
        if wanted < 2 {
            break;
        }
        let Some(trial) = problem.spline(context, &spacing.breaks(wanted))? else { break };
        // As many segments as the error would be even in.
        spacing = Spacing::by_errors(problem, &trial);
        if problem.holds(context, &trial)? {
            (best, vain, least) = (Some(trial), 0, wanted);
            wanted = (spacing.total().ceil() as usize).clamp(least / 2, least - 1);
            continue;
        }
        vain += 1;
        if vain == VAIN {
            if wanted + 1 == least {
                break;
            }
            (wanted, vain) = (least - 1, 0);
        }
    }
    Ok(best)
}

/// With joints at equal distances and fewer segments than these, where bisection may have missed
/// it, as far as the bounded work goes.
fn scan<const D: usize>(
    context: &Context,
    problem: &Problem<D>,
    equal: &Spacing,
    below: usize,
) -> Result<Option<CubicSpline<D>>, Error> {
    let trials = SCAN / problem.ordered.parameters.len();
    for segments in below.saturating_sub(trials).max(2)..below {
        if let Some(spline) = problem.held(context, &equal.breaks(segments))? {
            return Ok(Some(spline));
        }
    }
    Ok(None)
}
