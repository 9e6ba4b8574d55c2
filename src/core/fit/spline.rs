//! C2 cubic splines, and how far each point is from them.

use super::data::Data;
use super::ordered::Ordered;
use super::reduced::combine;
use super::unsolved::Unsolved;
use crate::core::context::Context;
use crate::core::curve::{BSpline, Composite};
use crate::core::error::Error;
use crate::core::fault::Fault;
use crate::core::linear::least_squares::{Deficient, LeastSquares};
use crate::core::point::Point;

const DEGREE: usize = 3;
/// The least part of a column of the least-squares problem that must not be in the span of those
/// before it: room in the conditions of Schoenberg and Whitney 1953. A B-spline with a point near
/// its middle has a tenth or more.
const ROOM: f64 = 1e-6;

/// A spline and how far each point is from it.
pub(super) struct CubicSpline<const D: usize> {
    /// The cubic segments.
    pub(super) composite: Composite<D>,
    /// Of each point from the spline at its parameter.
    pub(super) distances: Vec<f64>,
}

impl<const D: usize> CubicSpline<D> {
    /// The least-squares C2 cubic with simple knots at these breaks, which increase strictly.
    /// O(points + breaks).
    ///
    /// # Errors
    /// [`Unsolved::Deficient`] where the points do not determine it well: the conditions of
    /// Schoenberg and Whitney 1953 do not hold, or only just, or the coefficients are too large
    /// for a double.
    pub(super) fn least_squares(
        context: &Context,
        ordered: &Ordered<D>,
        breaks: &[f64],
    ) -> Result<Self, Unsolved> {
        let knots = clamped_knots(breaks);
        let count = knots.len() - DEGREE - 1;
        let data = ordered.data;
        let fixed = data.fixed_ends();
        let unknown = if fixed.is_some() { 1..count - 1 } else { 0..count };
        if unknown.len() > ordered.places.len() - (count - unknown.len()) {
            return Err(Deficient { rank: 0, columns: unknown.len() }.into());
        }
        let rows = rows(ordered.parameters, breaks, &knots);
        let mut problem = LeastSquares::banded(unknown.len(), DEGREE + 1);
        let mut pace = context.pace();
        for (i, (first, values)) in rows.iter().enumerate() {
            pace.step()?;
            let mut right = data.points[i];
            let mut row = *values;
            let mut start = *first;
            if let Some((at_start, at_end)) = fixed {
                if *first == 0 {
                    right = right - at_start * values[0];
                    row.copy_within(1.., 0);
                    row[DEGREE] = 0.0;
                    start = 1;
                }
                if *first + DEGREE == count - 1 {
                    right = right - at_end * values[DEGREE];
                    let end = count - 1 - start;
                    row[end.min(DEGREE)] = 0.0;
                }
            }
            let first = start - unknown.start;
            problem.push(
                first,
                &row[..(DEGREE + 1).min(unknown.len() - first)],
                right,
                data.weight(i),
            );
        }
        let mut coefficients = problem.solve_with_room(ROOM)?;
        if let Some((start, end)) = fixed {
            coefficients.insert(0, start);
            coefficients.push(end);
        }
        let value = |(first, values): &(usize, [f64; 4])| combine(values, &coefficients[*first..]);
        let distances =
            rows.iter().zip(&data.points).map(|(row, &p)| value(row).distance(p)).collect();
        Ok(CubicSpline {
            composite: composite(context, knots, coefficients, unknown.len())?,
            distances,
        })
    }

    /// A spline that is known. O(points + segments).
    pub(super) fn of(
        context: &Context,
        composite: Composite<D>,
        data: &Data<D>,
        parameters: &[f64],
    ) -> Result<Self, Error> {
        let on = composite.evaluator(context)?.sample(context, parameters)?;
        let distances = context.collect(data.points.iter().zip(on).map(|(&p, q)| q.distance(p)))?;
        Ok(CubicSpline { composite, distances })
    }

    /// First and last parameter, and the joints between.
    pub(super) fn breaks(&self) -> &[f64] {
        self.composite.breaks().as_slice()
    }

    /// How many segments.
    pub(super) fn segments(&self) -> usize {
        self.composite.breaks().segments()
    }

    /// The largest distance.
    pub(super) fn error(&self) -> f64 {
        self.distances.iter().copied().fold(0.0, f64::max)
    }
}

/// The knots of a spline with simple joints and coefficients that are its end points.
pub(super) fn clamped_knots(breaks: &[f64]) -> Vec<f64> {
    let end = |t: f64| std::iter::repeat_n(t, DEGREE);
    end(breaks[0]).chain(breaks.iter().copied()).chain(end(breaks[breaks.len() - 1])).collect()
}

/// For each parameter the segment it is in, which is its first B-spline, and the values of the four
/// there.
pub(super) fn rows(parameters: &[f64], breaks: &[f64], knots: &[f64]) -> Vec<(usize, [f64; 4])> {
    let last = breaks.len() - 2;
    let mut segment = 0;
    let row = |&t: &f64| {
        while segment < last && breaks[segment + 1] <= t {
            segment += 1;
        }
        (segment, basis_values(&knots[segment..], t))
    };
    parameters.iter().map(row).collect()
}

/// The four cubic B-splines that do not vanish on `[knots[3], knots[4])`, by the recurrence of Cox
/// and de Boor (Piegl and Tiller 1997, algorithm A2.2); sums of non-negative numbers only.
pub(super) fn basis_values(knots: &[f64], t: f64) -> [f64; 4] {
    let mut values = [1.0, 0.0, 0.0, 0.0];
    for degree in 1..=DEGREE {
        let mut carried = 0.0;
        for r in 0..degree {
            let (low, high) = (knots[DEGREE + 1 + r - degree], knots[DEGREE + 1 + r]);
            let share = values[r] / (high - low);
            values[r] = carried + (high - t) * share;
            carried = (t - low) * share;
        }
        values[degree] = carried;
    }
    values
}

/// The Bezier segments; a spline too large for a double counts as not determined.
fn composite<const D: usize>(
    context: &Context,
    knots: Vec<f64>,
    coefficients: Vec<Point<D>>,
    columns: usize,
) -> Result<Composite<D>, Unsolved> {
    let spline = BSpline::new(context, DEGREE, knots, coefficients, false);
    spline.and_then(|spline| spline.composite(context)).map_err(|error| match error.fault {
        Fault::Cancelled => Unsolved::Stopped(error),
        _ => Unsolved::Deficient(Deficient { rank: 0, columns }),
    })
}
