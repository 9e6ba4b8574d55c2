//! Curves through the points, where nothing with fewer segments will do.

use super::ordered::Ordered;
use super::problem::Problem;
use super::spline::CubicSpline;
use crate::core::argument::Argument;
use crate::core::bezier_form::elevate;
use crate::core::context::Context;
use crate::core::curve::Composite;
use crate::core::error::{Error, Locate};
use crate::core::knots::Breaks;
use crate::core::point::Point;

/// Rounds in which more places get short derivatives, before all do.
const ROUNDS: usize = 4;

/// The line or the parabola through two or three places, as one cubic.
pub(super) fn lowest<const D: usize>(
    context: &Context,
    ordered: &Ordered<D>,
) -> Result<Option<Composite<D>>, Error> {
    let (t, p) = (&ordered.places, &ordered.centres);
    let bezier = match p.len() {
        2 => vec![p[0], p[1]],
        3 => {
            // B_1(u) q = p - B_0(u) p_0 - B_2(u) p_2 at the place between.
            let (u, v) = ((t[1] - t[0]) / (t[2] - t[0]), (t[2] - t[1]) / (t[2] - t[0]));
            let rest = p[1] - p[0] * (v * v) - p[2] * (u * u);
            vec![p[0], rest.map(|x| x / (2.0 * u * v)), p[2]]
        }
        _ => return Ok(None),
    };
    let breaks = Breaks::new(context, vec![t[0], t[t.len() - 1]]).at(Argument::Points)?;
    Ok(Some(Composite::from_flat(breaks, 3, elevate(&bezier, 3))))
}

/// A C2 cubic through the centres of all places that is near them: the natural spline, but with
/// derivatives no longer than the chords next to them where it would stray.
///
/// Such a derivative goes along the mean of the two slopes, and the second derivative there is
/// zero. A stretch that has one gets two joints more, so that position and two derivatives at
/// either end determine it. Where both ends have one, its control points, and so all of it, are
/// within a third of its chord.
pub(super) fn through<const D: usize>(
    context: &Context,
    problem: &Problem<D>,
) -> Result<CubicSpline<D>, Error> {
    let ordered = &problem.ordered;
    let mut short = vec![false; ordered.places.len()];
    let mut rounds = 0;
    loop {
        let composite = hermite(context, ordered, &problem.near.slopes, &short)?;
        let strays = problem.near.strays_through(context, ordered, &composite)?;
        if strays.iter().all(|&i| short[i] && short[i + 1]) {
            return CubicSpline::of(context, composite, ordered.data, ordered.parameters);
        }
        rounds += 1;
        strays.into_iter().for_each(|i| short[i..=i + 1].fill(true));
        if rounds > ROUNDS {
            short.fill(true);
        }
    }
}

/// What a spline through the places has at one of them.
#[derive(Clone, Copy)]
struct Jet<const D: usize> {
    point: Point<D>,
    first: Point<D>,
    second: Point<D>,
}

fn hermite<const D: usize>(
    context: &Context,
    ordered: &Ordered<D>,
    slopes: &[Point<D>],
    short: &[bool],
) -> Result<Composite<D>, Error> {
    let jets = context.collect((0..short.len()).map(|i| jet(ordered, slopes, i, short[i])))?;
    let mut breaks = vec![ordered.places[0]];
    let mut bezier = Vec::with_capacity(4 * ordered.stretches());
    for (i, ends) in ordered.places.windows(2).enumerate() {
        let (h, start, end) = (ends[1] - ends[0], jets[i], jets[i + 1]);
        let (one, two) = (ends[0] + h / 3.0, ends[1] - h / 3.0);
        if (short[i] || short[i + 1]) && ends[0] < one && one < two && two < ends[1] {
            breaks.extend([one, two]);
            bezier.extend(three_cubics(start, end, h));
        } else {
            bezier.extend([
                start.point,
                start.point + start.first * (h / 3.0),
                end.point - end.first * (h / 3.0),
                end.point,
            ]);
        }
        breaks.push(ends[1]);
    }
    Ok(Composite::from_flat(Breaks::new(context, breaks).at(Argument::Points)?, 3, bezier))
}

fn jet<const D: usize>(ordered: &Ordered<D>, slopes: &[Point<D>], i: usize, short: bool) -> Jet<D> {
    let (places, centres) = (&ordered.places, &ordered.centres);
    let slope = |i: usize| (centres[i + 1] - centres[i]).map(|x| x / (places[i + 1] - places[i]));
    let last = places.len() - 1;
    let point = centres[i];
    if !short {
        // The natural spline in the stretch after the place, or at the end before it.
        let k = i.min(last - 1);
        let bend = slope(k) * 6.0
            - if i < last {
                slopes[i] * 4.0 + slopes[i + 1] * 2.0
            } else {
                slopes[k] * 2.0 + slopes[i] * 4.0
            };
        let second = bend.map(|x| if i < last { x } else { -x } / (places[k + 1] - places[k]));
        return Jet { point, first: slopes[i], second };
    }
    let first = match i {
        0 => slope(0),
        _ if i == last => slope(last - 1),
        _ => {
            let (before, after) = (slope(i - 1), slope(i));
            let share = (places[i] - places[i - 1]) / (places[i + 1] - places[i - 1]);
            let mean = before.lerp(after, share);
            let longest = before.norm().min(after.norm());
            mean * (longest / mean.norm()).min(1.0)
        }
    };
    Jet { point, first: if first.is_finite() { first } else { Point::ZERO }, second: Point::ZERO }
}

/// The C2 cubic with two joints inside, at thirds, that has these ends: six coefficients for the
/// knots `0 0 0 0 1/3 2/3 1 1 1 1`, as Bezier segments (knots inserted, Boehm 1980).
fn three_cubics<const D: usize>(start: Jet<D>, end: Jet<D>, h: f64) -> [Point<D>; 12] {
    let c = [
        start.point,
        start.point + start.first * (h / 9.0),
        start.point + start.first * (h / 3.0) + start.second * (h * h / 27.0),
        end.point - end.first * (h / 3.0) + end.second * (h * h / 27.0),
        end.point - end.first * (h / 9.0),
        end.point,
    ];
    let (low, high) = (c[1].lerp(c[2], 0.5), c[3].lerp(c[4], 0.5));
    let (inner_low, inner_high) = (c[2].lerp(c[3], 1.0 / 3.0), c[2].lerp(c[3], 2.0 / 3.0));
    let (first, second) = (low.lerp(inner_low, 0.5), inner_high.lerp(high, 0.5));
    [c[0], c[1], low, first, first, inner_low, inner_high, second, second, high, c[4], c[5]]
}
