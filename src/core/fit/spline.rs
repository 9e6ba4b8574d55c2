//! The least-squares cubic spline for given joints.

use crate::core::curve::{BSpline, Composite};
use crate::core::error::{Error, Fault};
use crate::core::least_squares::LeastSquares;
use crate::core::point::Point;
use crate::core::work::Pace;

use super::data::Data;
use super::unsolved::Unsolved;

const DEGREE: usize = 3;

/// Points with parameters that do not decrease, and the different ones among these.
pub(super) struct Ordered<'a, const D: usize> {
    pub(super) data: &'a Data<D>,
    pub(super) parameters: &'a [f64],
    /// The different parameters: the places where a joint may be.
    pub(super) places: Vec<f64>,
    /// For each point, which place it has.
    pub(super) place_of: Vec<usize>,
}

/// A spline and how far each point is from it.
pub(super) struct Spline<const D: usize> {
    /// Indices of places, first and last included.
    pub(super) joints: Vec<usize>,
    pub(super) knots: Vec<f64>,
    pub(super) coefficients: Vec<Point<D>>,
    pub(super) distances: Vec<f64>,
}

impl<'a, const D: usize> Ordered<'a, D> {
    /// O(points).
    pub(super) fn new(data: &'a Data<D>, parameters: &'a [f64]) -> Self {
        let mut places = parameters.to_vec();
        places.dedup();
        let mut place = 0;
        let advance = |&t: &f64| {
            place += usize::from(t > places[place]);
            place
        };
        let place_of = parameters.iter().map(advance).collect();
        Ordered { data, parameters, places, place_of }
    }

    /// The least-squares C2 cubic with simple knots at these places. O(points + joints).
    ///
    /// Any joints at places determine it as long as there are `joints + 2` places or more: each segment has
    /// the place it starts with, which is what the conditions of Schoenberg and Whitney ask for.
    pub(super) fn spline(&self, joints: Vec<usize>) -> Result<Spline<D>, Unsolved> {
        let knots = self.clamped_knots(&joints);
        let count = knots.len() - DEGREE - 1;
        let fixed = self.data.fixed_ends();
        let unknown = if fixed.is_some() { 1..count - 1 } else { 0..count };
        let rows = self.rows(&joints, &knots);
        let mut problem = LeastSquares::banded(unknown.len(), DEGREE + 1);
        let mut pace = Pace::default();
        for (i, (first, values)) in rows.iter().enumerate() {
            pace.step()?;
            let mut right = self.data.points[i];
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
            problem.push(first, &row[..(DEGREE + 1).min(unknown.len() - first)], right, self.data.weight(i));
        }
        let mut coefficients = problem.solve()?;
        if let Some((start, end)) = fixed {
            coefficients.insert(0, start);
            coefficients.push(end);
        }
        let value = |(first, values): &(usize, [f64; 4])| super::reduced::combine(values, &coefficients[*first..]);
        let distances = rows.iter().zip(&self.data.points).map(|(row, &p)| value(row).distance(p)).collect();
        Ok(Spline { joints, knots, coefficients, distances })
    }

    fn clamped_knots(&self, joints: &[usize]) -> Vec<f64> {
        let last = joints.len() - 1;
        let end = |i: usize| std::iter::repeat_n(self.places[joints[i]], DEGREE);
        end(0).chain(joints.iter().map(|&place| self.places[place])).chain(end(last)).collect()
    }

    /// For each point the segment it is in, which is its first B-spline, and the values of the four there.
    fn rows(&self, joints: &[usize], knots: &[f64]) -> Vec<(usize, [f64; 4])> {
        let last = joints.len() - 2;
        let mut segment = 0;
        let row = |(&t, &place): (&f64, &usize)| {
            while segment < last && joints[segment + 1] <= place {
                segment += 1;
            }
            (segment, basis_values(&knots[segment..], t))
        };
        self.parameters.iter().zip(&self.place_of).map(row).collect()
    }
}

/// The four cubic B-splines that do not vanish on `[knots[3], knots[4])`, by the recurrence of Cox and de Boor
/// (The NURBS Book, algorithm A2.2); sums of non-negative numbers only.
fn basis_values(knots: &[f64], t: f64) -> [f64; 4] {
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

impl<const D: usize> Spline<D> {
    /// How many segments.
    pub(super) fn segments(&self) -> usize {
        self.joints.len() - 1
    }

    /// The largest distance.
    pub(super) fn error(&self) -> f64 {
        self.distances.iter().copied().fold(0.0, f64::max)
    }

    /// The Bezier segments.
    pub(super) fn composite(&self) -> Result<Composite<D>, Error> {
        let spline = BSpline::new(DEGREE, self.knots.clone(), self.coefficients.clone(), false);
        spline.and_then(|spline| spline.composite()).map_err(|error| match error.fault {
            Fault::Overflow => Fault::Overflow.at("points"),
            fault => Error { place: error.place, fault },
        })
    }
}
