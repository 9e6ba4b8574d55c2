//! Whether a curve stays near the points between them.

use super::between::second;
use super::chord::{Chord, part};
use super::ordered::Ordered;
use crate::core::context::{Context, Pace};
use crate::core::curve::Composite;
use crate::core::error::Error;
use crate::core::interpolate::{End, derivatives};
use crate::core::point::Point;

/// The part of a chord, or of a longer one next to it, that a stretch may ever be away from it.
const BULGE: f64 = 0.5;
/// The same at either end of the curve, which nothing holds from beyond.
const END_BULGE: f64 = 1.0;
/// The part of the diagonal of the data's box that a stretch may ever be away from its chord.
const REACH: f64 = 0.5;

/// How far each stretch of a curve, from one place to the next, may be from its chord.
///
/// What is allowed is the tolerance twice, and twice what interpolation needs there or in a stretch
/// beside it, be it natural or not-a-knot; but never more than half the longest chord of these
/// stretches (at an end, all of it), nor half the diagonal of the data's box. As chords are inside
/// the box, no curve that is near leaves it by more than that half.
pub(super) struct Near<const D: usize> {
    /// For any curve.
    allowed: Vec<f64>,
    /// For a curve through the points, which has no points to spare.
    limits: Vec<f64>,
    /// The derivatives of the natural spline through the places.
    pub(super) slopes: Vec<Point<D>>,
    tolerance: f64,
}

impl<const D: usize> Near<D> {
    /// O(points).
    pub(super) fn new(
        context: &Context,
        ordered: &Ordered<D>,
        tolerance: f64,
    ) -> Result<Self, Error> {
        let slopes = derivatives(&ordered.centres, &ordered.places, End::Natural);
        let lengths =
            context.collect((0..ordered.stretches()).map(|i| ordered.chord(i).length()))?;
        let reach = REACH * diagonal(&ordered.data.points);
        let last = lengths.len() - 1;
        let bulge = |i: usize| if i == 0 || i == last { END_BULGE } else { BULGE };
        let limit = |(i, longest): (usize, f64)| (2.0 * tolerance + bulge(i) * longest).min(reach);
        let limits: Vec<_> = nearby(&lengths).enumerate().map(limit).collect();
        let mut bulges = bulges(context, ordered, &slopes)?;
        if ordered.places.len() > 3 {
            let other = self::bulges(
                context,
                ordered,
                &derivatives(&ordered.centres, &ordered.places, End::NotAKnot),
            )?;
            bulges.iter_mut().zip(other).for_each(|(a, b)| *a = a.max(b));
        }
        let allowed = nearby(&bulges)
            .zip(&limits)
            .map(|(bulge, &limit)| limit.min(2.0 * (tolerance + bulge)))
            .collect();
        Ok(Near { allowed, limits, slopes, tolerance })
    }

    /// The stretches of a curve, no further from the points than the tolerance, that are too far
    /// from their chords.
    pub(super) fn strays(
        &self,
        context: &Context,
        ordered: &Ordered<D>,
        curve: &Composite<D>,
    ) -> Result<Vec<usize>, Error> {
        self.beyond(context, &self.allowed, ordered, curve, false)
    }

    /// The same for a curve through the points.
    pub(super) fn strays_through(
        &self,
        context: &Context,
        ordered: &Ordered<D>,
        curve: &Composite<D>,
    ) -> Result<Vec<usize>, Error> {
        self.beyond(context, &self.limits, ordered, curve, false)
    }

    /// Whether there is none.
    pub(super) fn holds(
        &self,
        context: &Context,
        ordered: &Ordered<D>,
        curve: &Composite<D>,
    ) -> Result<bool, Error> {
        Ok(self.beyond(context, &self.allowed, ordered, curve, true)?.is_empty())
    }

    fn beyond(
        &self,
        context: &Context,
        allowed: &[f64],
        ordered: &Ordered<D>,
        curve: &Composite<D>,
        first: bool,
    ) -> Result<Vec<usize>, Error> {
        let breaks = curve.breaks().as_slice();
        let mut pace = context.pace();
        let (mut found, mut k, mut bend) = (Vec::new(), 0, second(curve, 0));
        for (i, ends) in ordered.places.windows(2).enumerate() {
            pace.step()?;
            while breaks[k + 1] <= ends[0] {
                k += 1;
                bend = second(curve, k);
            }
            let (start, mut most) = (k, bend);
            while breaks[k + 1] < ends[1] {
                k += 1;
                bend = second(curve, k);
                most = most.max(bend);
            }
            // Between ends within the tolerance, a second derivative up to `most` allows no more
            // than this.
            let bound = self.tolerance + (ends[1] - ends[0]) * (ends[1] - ends[0]) * most / 8.0;
            let settled = bound <= allowed[i];
            if !settled
                && is_beyond(
                    ordered.chord(i),
                    curve,
                    start..=k,
                    [ends[0], ends[1]],
                    allowed[i],
                    &mut pace,
                )?
            {
                found.push(i);
                if first {
                    break;
                }
            }
        }
        Ok(found)
    }
}

/// Whether the stretch between two parameters, in these segments, is further from a chord than
/// allowed.
fn is_beyond<const D: usize>(
    chord: Chord<D>,
    curve: &Composite<D>,
    mut segments: std::ops::RangeInclusive<usize>,
    [from, to]: [f64; 2],
    allowed: f64,
    pace: &mut Pace<'_>,
) -> Result<bool, Error> {
    let breaks = curve.breaks();
    let farthest = segments.try_fold(allowed, |known, k| {
        let (a, b) = breaks.interval(k);
        let bezier =
            part(&curve.segment(k), breaks.local(k, from.max(a)).0, breaks.local(k, to.min(b)).0);
        chord.farthest(bezier, known, allowed, pace)
    })?;
    Ok(farthest > allowed)
}

/// How far the cubics with these derivatives may be from their chords, by their control points.
fn bulges<const D: usize>(
    context: &Context,
    ordered: &Ordered<D>,
    slopes: &[Point<D>],
) -> Result<Vec<f64>, Error> {
    context.collect((0..ordered.stretches()).map(|i| {
        let third = (ordered.places[i + 1] - ordered.places[i]) / 3.0;
        let chord = ordered.chord(i);
        chord.bound(&[chord.start + slopes[i] * third, chord.end - slopes[i + 1] * third])
    }))
}

/// The largest of each number and its neighbours.
fn nearby(values: &[f64]) -> impl Iterator<Item = f64> + '_ {
    (0..values.len()).map(|i| {
        values[i.saturating_sub(1)..(i + 2).min(values.len())].iter().copied().fold(0.0, f64::max)
    })
}

/// The diagonal of the box of the points.
fn diagonal<const D: usize>(points: &[Point<D>]) -> f64 {
    let corner = |pick: fn(f64, f64) -> f64| {
        points.iter().fold(points[0], |c, p| Point(std::array::from_fn(|k| pick(c[k], p[k]))))
    };
    corner(f64::min).distance(corner(f64::max))
}
