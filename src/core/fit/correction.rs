//! Parameter correction: the curve and the parameters of the points sought together.
//!
//! Total least squares (Borges and Pastva 2002), with [`descents`](super::descent) from
//! several starts, always the same, as there are many local minima.

use super::data::Data;
use super::descent::{Descent, Search, State};
use super::feet::{feet, nearest_feet};
use super::starts::{Warp, alternated, hops, warps};
use super::{Fit, Solved, Solver};
use crate::core::context::Context;
use crate::core::error::Error;
use crate::core::parameterization::Parameterization;

/// Points that are enough to tell starts apart, and so many more for each control point.
const EXPLORED: (usize, usize) = (64, 8);

/// The most rounds where only a few points were explored, as these rounds are long.
const MANY: usize = 100;

/// The most rounds of feet and solves in turn, and by what part one must lower the sum to be
/// followed.
const TURNS: usize = 10;
const PROGRESS: f64 = 2e-6;
/// The most times a descent goes on from the nearest feet.
const LANDINGS: usize = 4;
/// Hops that end the search, and by what part one must lower the sum to count.
const VAIN: usize = 5;
const WORTHWHILE: f64 = 1e-3;

/// The best of the minima that the starts lead to: never worse than the first fit.
pub(super) fn correct<const D: usize>(
    context: &Context,
    first: Solved<D>,
    parameters: Vec<f64>,
    solver: &dyn Solver<D>,
    data: &Data<D>,
    rule: &Parameterization,
) -> Result<Fit<D>, Error> {
    let mut search = Search::new(data, solver);
    let first = search.state(context, first, parameters)?;
    let enough = EXPLORED.0 + EXPLORED.1 * first.solved.curve.control_points().len();
    let best = if !solver.is_exact() {
        in_turn(context, &search, first)?
    } else if data.points.len() <= enough {
        explored(context, &search, first, rule)?
    } else {
        search.rounds = MANY;
        beyond(context, &search, first, rule, enough)?
    };
    let Descent { state, rounds, gradient, tolerance } = best;
    let converged = gradient <= tolerance && state.solved.converged;
    let solved = Solved { iterations: rounds, converged, ..state.solved };
    let fit = Fit::of(context, solved, data, state.parameters)?;
    Ok(Fit { gradient: Some(gradient), gradient_tolerance: Some(tolerance), ..fit })
}

/// Feet and solves in turn, while the sum of squares falls (Hoschek 1988).
fn in_turn<const D: usize>(
    context: &Context,
    search: &Search<D>,
    first: State<D>,
) -> Result<Descent<D>, Error> {
    let mut best = first;
    let mut rounds = 1;
    while rounds < TURNS {
        rounds += 1;
        let parameters =
            feet(context, &best.solved.curve.composite(context)?, search.data(), &best.parameters)?;
        match search.at(context, parameters)? {
            Some(next) if next.squares < best.squares * (1.0 - PROGRESS) => best = next,
            _ => break,
        }
    }
    let (gradient, tolerance) = search.gradient_of(context, &best)?;
    Ok(Descent { state: best, rounds, gradient, tolerance })
}

/// With many points: a few of them show the best start for all.
fn beyond<const D: usize>(
    context: &Context,
    search: &Search<D>,
    first: State<D>,
    rule: &Parameterization,
    enough: usize,
) -> Result<Descent<D>, Error> {
    let (few, chosen) = search.data().thinned(enough);
    let known = &first.parameters;
    let parameters: Vec<f64> = chosen.iter().map(|&i| known[i]).collect();
    let start = Search::new(&few, search.solver);
    let Some(state) = start.at(context, parameters.clone())? else {
        return search.descend(context, first, None);
    };
    let found = explored(context, &start, state, rule)?;
    let spread = Warp::between(&parameters, &found.state.parameters);
    let start = search.at(context, known.iter().map(|&t| spread.at(t)).collect())?;
    let mut best = match start.filter(|start| start.squares < first.squares) {
        Some(start) => search.descend(context, start, None)?,
        None => search.descend(context, first, None)?,
    };
    best = settled(context, search, best)?;
    best.rounds += found.rounds;
    Ok(best)
}

/// Descents from every start, then from around the best.
fn explored<const D: usize>(
    context: &Context,
    search: &Search<D>,
    first: State<D>,
    rule: &Parameterization,
) -> Result<Descent<D>, Error> {
    let length = search.solver.length();
    let given = first.parameters.clone();
    let mut starts = vec![
        alternated(context, search, &first, feet)?,
        at_nearest_feet(context, search, &first)?,
        alternated(context, search, &first, nearest_feet)?,
    ];
    for other in rule.others() {
        starts.push(search.at(context, other.on_domain(search.data(), length)?)?);
    }
    for warp in warps() {
        starts.push(
            search.at(context, given.iter().map(|&t| length * warp.at(t / length)).collect())?,
        );
    }
    let any_polynomial = search.solver.lower().is_some();
    let joint =
        if any_polynomial { search.at(context, search.jointly(context, &first)?)? } else { None };
    let mut best = search.descend(context, first, None)?;
    for start in starts.into_iter().chain([joint]).flatten() {
        let end = search.descend(context, start, Some(best.state.squares))?;
        let landed = at_nearest_feet(context, search, &end.state)?;
        best = search.improved(context, best.or(end), landed)?;
    }
    best = settled(context, search, best)?;
    if let Some(lower) = search.solver.lower() {
        best = from_lower(context, search, lower.as_ref(), best, &given, rule)?;
    }
    hopped(context, search, best)
}

/// The points at their nearest feet, wherever along the curve they are.
fn at_nearest_feet<const D: usize>(
    context: &Context,
    search: &Search<D>,
    state: &State<D>,
) -> Result<Option<State<D>>, Error> {
    let curve = state.solved.curve.composite(context)?;
    search.at(context, nearest_feet(context, &curve, search.data(), &state.parameters)?)
}

/// On from the nearest feet, while that leads below: a foot may be the nearest of its
/// neighbourhood only.
fn settled<const D: usize>(
    context: &Context,
    search: &Search<D>,
    mut best: Descent<D>,
) -> Result<Descent<D>, Error> {
    for _ in 0..LANDINGS {
        let before = best.state.squares;
        let start = at_nearest_feet(context, search, &best.state)?;
        let Some(start) = start.filter(|start| start.squares < before * (1.0 - WORTHWHILE)) else {
            break;
        };
        best = search.improved(context, best, Some(start))?;
    }
    Ok(best)
}

/// From around the best, until some hops in turn lead back to it, or above.
fn hopped<const D: usize>(
    context: &Context,
    search: &Search<D>,
    mut best: Descent<D>,
) -> Result<Descent<D>, Error> {
    let (length, mut vain) = (search.solver.length(), 0);
    for warp in hops() {
        let before = best.state.squares;
        let moved = best.state.parameters.iter().map(|&t| length * warp.at(t / length)).collect();
        best = search.improved(context, best, search.at(context, moved)?)?;
        if best.state.squares < before {
            best = settled(context, search, best)?;
        }
        vain = if best.state.squares < before * (1.0 - WORTHWHILE) { 0 } else { vain + 1 };
        if vain == VAIN {
            break;
        }
    }
    Ok(best)
}

/// From parameters that are best for a curve with one control point less.
fn from_lower<const D: usize>(
    context: &Context,
    search: &Search<D>,
    lower: &dyn Solver<D>,
    mut best: Descent<D>,
    given: &[f64],
    rule: &Parameterization,
) -> Result<Descent<D>, Error> {
    let below = Search::new(search.data(), lower);
    let mut starts = vec![given.to_vec(), best.state.parameters.clone()];
    for other in rule.others() {
        starts.push(other.on_domain(search.data(), lower.length())?);
    }
    for parameters in starts {
        let Some(start) = below.at(context, parameters)? else { continue };
        let found = below.descend(context, start, None)?;
        best.rounds += found.rounds;
        best = search.improved(context, best, search.at(context, found.state.parameters)?)?;
    }
    Ok(best)
}
