//! More joints, until the tolerance holds.

use super::problem::Problem;
use super::spline::CubicSpline;
use super::through::through;
use crate::core::argument::Argument;
use crate::core::check::at_most;
use crate::core::context::Context;
use crate::core::error::Error;
use crate::core::fault::Fault;

/// After so many rounds every segment is split, so that the rounds that follow are few.
const PATIENCE: usize = 40;
/// Places a segment spans before it is split, as long as others can be: two halves with a place
/// inside each.
const ROOMY: usize = 4;
/// Places a segment must span for a place to be inside it.
const TIGHT: usize = 2;
/// Lengths this close, relative to the segment, differ by rounding.
const TIE: f64 = 1e-9;

/// The first spline on a path from one segment to interpolation that holds, and how many splines
/// were tried; a curve through the points where no other does.
///
/// A segment with a point too far off, or a stretch that strays, is split at the place in the
/// middle of its points.
pub(super) fn refine<const D: usize>(
    context: &Context,
    problem: &Problem<D>,
) -> Result<(CubicSpline<D>, usize), Error> {
    let mut joints = vec![0, problem.ordered.stretches()];
    let mut rounds = 1;
    while let Some(spline) = at_places(context, problem, &joints)? {
        let violated = problem.violated(context, &spline)?;
        if !violated.contains(&true) {
            return Ok((spline, rounds));
        }
        let Some(more) = more_joints(problem, &joints, &spline, violated, rounds >= PATIENCE)
        else {
            break;
        };
        joints = more;
        rounds += 1;
    }
    through_points(context, problem, rounds + 1)
}

/// Interpolation: not-a-knot where that holds, which leaves room to take joints out of it.
fn through_points<const D: usize>(
    context: &Context,
    problem: &Problem<D>,
    rounds: usize,
) -> Result<(CubicSpline<D>, usize), Error> {
    if problem.ordered.places.len() > 3
        && let Some(spline) =
            at_places(context, problem, &not_a_knot(problem.ordered.places.len()))?
        && problem.holds(context, &spline)?
    {
        return Ok((spline, rounds));
    }
    check_size(context, problem.ordered.stretches())?;
    let spline = through(context, problem)?;
    check_size(context, spline.segments())?;
    Ok((spline, rounds + 1))
}

/// The least-squares spline with joints at these places.
fn at_places<const D: usize>(
    context: &Context,
    problem: &Problem<D>,
    joints: &[usize],
) -> Result<Option<CubicSpline<D>>, Error> {
    check_size(context, joints.len() - 1)?;
    let breaks: Vec<f64> = joints.iter().map(|&place| problem.ordered.places[place]).collect();
    problem.spline(context, &breaks)
}

/// Refuses a spline of more segments than a curve may have, also where some could be left out
/// again: the limits bound the work as well.
fn check_size(context: &Context, segments: usize) -> Result<(), Error> {
    const ADVICE: &str = "Raise the tolerance, or fit the points in parts";
    let limits = &context.limits;
    at_most("segments on the way to this tolerance", segments, limits.segments, ADVICE)
        .and_then(|()| {
            at_most(
                "control points on the way to this tolerance",
                3 * segments + 1,
                limits.control_points,
                ADVICE,
            )
        })
        .map_err(|fault: Fault| fault.at(Argument::Tolerance).at(Argument::Solve))
}

/// The joints of the next round; `None` where there are as many as interpolation has.
fn more_joints<const D: usize>(
    problem: &Problem<D>,
    joints: &[usize],
    spline: &CubicSpline<D>,
    violated: Vec<bool>,
    all: bool,
) -> Option<Vec<usize>> {
    let places = problem.ordered.places.len();
    // With `joints + 2 = places` the spline has a coefficient for each place.
    let most = places - 2;
    if joints.len() >= most {
        return None;
    }
    let every = vec![true; joints.len() - 1];
    let violated = if all { every.clone() } else { violated };
    let ways = [(&violated, ROOMY), (&violated, TIGHT), (&every, TIGHT)];
    let finer =
        ways.into_iter().map(|(marked, least)| split(problem, joints, spline, marked, least));
    let more = finer.into_iter().find(|finer| finer.len() > joints.len());
    Some(more.filter(|joints| joints.len() <= most).unwrap_or_else(|| not_a_knot(places)))
}

/// Joints at all places but the second and the last but one: as many coefficients as places. With a
/// joint there too, what an end does would be determined from the other end, by way of all joints,
/// which multiplies errors by four for each.
fn not_a_knot(places: usize) -> Vec<usize> {
    std::iter::once(0).chain(2..places - 2).chain(std::iter::once(places - 1)).collect()
}

/// A new joint in the middle of each marked segment that is long enough, but none right beside an
/// end of the curve.
fn split<const D: usize>(
    problem: &Problem<D>,
    joints: &[usize],
    spline: &CubicSpline<D>,
    marked: &[bool],
    least: usize,
) -> Vec<usize> {
    let last = problem.ordered.stretches();
    let mut finer = Vec::with_capacity(2 * joints.len());
    for (ends, &marked) in joints.windows(2).zip(marked) {
        finer.push(ends[0]);
        if marked && ends[1] - ends[0] >= least {
            let middle = middle(problem, spline, ends[0], ends[1]);
            if (2..=last - 2).contains(&middle) {
                finer.push(middle);
            }
        }
    }
    finer.extend(joints.last());
    finer
}

/// The place in the middle; of two, the one nearer to the middle parameter, or else with the larger
/// distance: rules that do not depend on which end is first.
fn middle<const D: usize>(
    problem: &Problem<D>,
    spline: &CubicSpline<D>,
    first: usize,
    last: usize,
) -> usize {
    let (low, high) = ((first + last) / 2, (first + last).div_ceil(2));
    let ordered = &problem.ordered;
    let places = &ordered.places;
    let (after, before) = (places[last] - places[high], places[low] - places[first]);
    if (after - before).abs() <= TIE * (places[last] - places[first]) {
        let distance = |place: usize| ordered.distance_at(place, &spline.distances);
        return if distance(high) > distance(low) { high } else { low };
    }
    if after > before { high } else { low }
}
