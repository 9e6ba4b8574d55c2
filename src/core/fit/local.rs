//! What taking out one joint does next to it.

use super::problem::Problem;
use super::reduced::combine;
use super::spline::{CubicSpline, basis_values, clamped_knots, rows};
use crate::core::context::Context;
use crate::core::error::Error;
use crate::core::linear::least_squares::LeastSquares;
use crate::core::point::Point;

/// Segments on either side of a joint whose B-splines change without it.
const REACH: usize = 3;
/// How far above the tolerance, relative to it, is no rounding.
const ROUNDING: f64 = 1e-9;

/// Three equations for three neighbouring coefficients: all that the points on one side say about
/// these.
type Carry<const D: usize> = [([f64; 3], Point<D>); 3];

/// A least-squares problem cut at every joint: what the points before it, and those after it, say
/// about the three coefficients that both sides share. So the problem without one joint costs only
/// the points of six segments.
pub(super) struct Local<'a, 'b, const D: usize> {
    problem: &'a Problem<'b, D>,
    breaks: Vec<f64>,
    /// The first point of each segment, and the number of points.
    starts: Vec<usize>,
    /// At each joint, from the points before it; the coefficients in order.
    before: Vec<Carry<D>>,
    /// From the points after it; the coefficients in reverse.
    after: Vec<Carry<D>>,
}

impl<'a, 'b, const D: usize> Local<'a, 'b, D> {
    /// O(points).
    pub(super) fn new(
        context: &Context,
        problem: &'a Problem<'b, D>,
        spline: &CubicSpline<D>,
    ) -> Result<Self, Error> {
        let (breaks, ordered) = (spline.breaks().to_vec(), &problem.ordered);
        let segments = breaks.len() - 1;
        let rows = rows(ordered.parameters, &breaks, &clamped_knots(&breaks));
        let starts: Vec<usize> =
            (0..=segments).map(|k| rows.partition_point(|&(segment, _)| segment < k)).collect();
        let mut local = Local {
            problem,
            breaks,
            starts,
            before: vec![nothing(); segments + 1],
            after: vec![nothing(); segments + 1],
        };
        let equations = |k: usize| local.starts[k]..local.starts[k + 1];
        let equation = |i: usize| local.settled(rows[i].0, segments, rows[i].1, i);
        let mut pace = context.pace();
        let (mut before, mut after) = (local.before.clone(), local.after.clone());
        for k in 0..segments {
            pace.step()?;
            before[k + 1] = carried(&before[k], equations(k).map(equation));
        }
        for k in (0..segments).rev() {
            pace.step()?;
            let mirrored = |(mut values, right, weight): ([f64; 4], Point<D>, f64)| {
                values.reverse();
                (values, right, weight)
            };
            after[k] = carried(&after[k + 1], equations(k).map(equation).map(mirrored));
        }
        (local.before, local.after) = (before, after);
        Ok(local)
    }

    /// The equation of a point in a segment, without end coefficients that are known; and its
    /// weight.
    fn settled(
        &self,
        segment: usize,
        segments: usize,
        mut values: [f64; 4],
        i: usize,
    ) -> ([f64; 4], Point<D>, f64) {
        let data = self.problem.ordered.data;
        let mut right = data.points[i];
        if let Some((start, end)) = data.fixed_ends() {
            if segment == 0 {
                right = right - start * std::mem::take(&mut values[0]);
            }
            if segment + 1 == segments {
                right = right - end * std::mem::take(&mut values[3]);
            }
        }
        (values, right, data.weight(i))
    }

    /// The points of the segments whose B-splines change without a joint.
    fn segments_near(&self, joint: usize) -> std::ops::Range<usize> {
        joint.saturating_sub(REACH)..(joint + REACH).min(self.breaks.len() - 1)
    }

    /// How many points there are near a joint.
    pub(super) fn points_near(&self, joint: usize) -> usize {
        let near = self.segments_near(joint);
        self.starts[near.end] - self.starts[near.start]
    }

    /// Whether the least-squares spline without an inner joint misses a point near it by more than
    /// the tolerance.
    pub(super) fn misses(&self, context: &Context, joint: usize) -> Result<bool, Error> {
        context.checkpoint()?;
        let (near, data) = (self.segments_near(joint), self.problem.ordered.data);
        let segments = self.breaks.len() - 1;
        let mut fewer = self.breaks.clone();
        fewer.remove(joint);
        let points = self.starts[near.start]..self.starts[near.end];
        let rows = self.rows_without(&fewer, near.start, points.clone());
        let mut local = LeastSquares::banded(near.len() + 2, 4);
        if near.start > 0 {
            self.before[near.start].iter().for_each(|(row, right)| local.push(0, row, *right, 1.0));
        } else if let Some((start, _)) = data.fixed_ends() {
            local.push(0, &[1.0], start, 1.0);
        }
        for (&(segment, values), i) in rows.iter().zip(points.clone()) {
            let (values, right, weight) = self.settled(segment, segments - 1, values, i);
            local.push(segment - near.start, &values, right, weight);
        }
        if near.end < segments {
            let in_order = |row: &[f64; 3]| [row[2], row[1], row[0]];
            self.after[near.end]
                .iter()
                .for_each(|(row, right)| local.push(near.len() - 1, &in_order(row), *right, 1.0));
        } else if let Some((_, end)) = data.fixed_ends() {
            local.push(near.len() + 1, &[1.0], end, 1.0);
        }
        let Ok(x) = local.solve() else { return Ok(false) };
        let most = self.problem.tolerance * (1.0 + ROUNDING);
        let value =
            |(segment, values): &(usize, [f64; 4])| combine(values, &x[segment - near.start..]);
        Ok(rows.iter().zip(&data.points[points]).any(|(row, &p)| value(row).distance(p) > most))
    }

    /// The segments and B-splines of some points, the first of them in `segment` or later.
    fn rows_without(
        &self,
        fewer: &[f64],
        mut segment: usize,
        points: std::ops::Range<usize>,
    ) -> Vec<(usize, [f64; 4])> {
        let knots = clamped_knots(fewer);
        let row = |&t: &f64| {
            while segment + 2 < fewer.len() && fewer[segment + 1] <= t {
                segment += 1;
            }
            (segment, basis_values(&knots[segment..], t))
        };
        self.problem.ordered.parameters[points].iter().map(row).collect()
    }
}

/// What equations for four coefficients, of which three come from before, say about the last three.
fn carried<const D: usize>(
    before: &Carry<D>,
    equations: impl Iterator<Item = ([f64; 4], Point<D>, f64)>,
) -> Carry<D> {
    let mut problem = LeastSquares::dense(4);
    before.iter().for_each(|(row, right)| problem.push(0, row, *right, 1.0));
    equations.for_each(|(row, right, weight)| problem.push(0, &row, right, weight));
    let mut carry = nothing();
    for (k, (entries, right)) in problem.reduced().enumerate().skip(1) {
        carry[k - 1].0[k - 1..].copy_from_slice(entries);
        carry[k - 1].1 = right;
    }
    carry
}

/// What no points say.
fn nothing<const D: usize>() -> Carry<D> {
    [([0.0; 3], Point::ZERO); 3]
}

#[cfg(test)]
mod tests {
    use super::super::Ends;
    use super::super::data::Data;
    use super::super::ordered::Ordered;
    use super::*;

    /// Near every joint and for every tolerance between, the whole problem without the joint says
    /// the same.
    #[test]
    fn it_says_what_the_whole_problem_says() {
        let points: Vec<_> =
            (0..90).map(|i| f64::from(i) / 10.0).map(|t| Point([t, (t * t / 3.0).sin()])).collect();
        let parameters: Vec<f64> =
            (0..90).map(|i| f64::from(i) + 0.3 * f64::from(i * i % 3)).collect();
        for ends in [Ends::Free, Ends::Interpolate] {
            for segments in [2, 3, 5, 8, 20] {
                let weights = (0..90).map(|i| 1.0 + f64::from(i % 4)).collect();
                let data =
                    Data::new(&Context::default(), points.clone(), Some(weights), ends).unwrap();
                let breaks: Vec<f64> = (0..=segments)
                    .map(|k| parameters[89] * f64::from(k) / f64::from(segments))
                    .collect();
                let problem = |tolerance| {
                    Problem::new(&Context::default(), Ordered::new(&data, &parameters), tolerance)
                        .unwrap()
                };
                let spline = problem(1.0).spline(&Context::default(), &breaks).unwrap().unwrap();
                for joint in 1..segments as usize {
                    let mut fewer = breaks.clone();
                    fewer.remove(joint);
                    let whole = problem(1.0).spline(&Context::default(), &fewer).unwrap().unwrap();
                    let near = Local::new(&Context::default(), &problem(1.0), &spline)
                        .map(|local| (local.segments_near(joint), local.starts.clone()))
                        .unwrap();
                    let most = whole.distances[near.1[near.0.start]..near.1[near.0.end]]
                        .iter()
                        .copied()
                        .fold(0.0, f64::max);
                    let misses = |tolerance| {
                        Local::new(&Context::default(), &problem(tolerance), &spline)
                            .unwrap()
                            .misses(&Context::default(), joint)
                            .unwrap()
                    };
                    assert!(
                        misses(most * (1.0 - 1e-6)) && !misses(most * (1.0 + 1e-6)),
                        "{ends:?} {segments} {joint}"
                    );
                }
            }
        }
    }
}
