//! The points to fit, checked.

use super::Ends;
use crate::core::argument::Argument;
use crate::core::check::{at_least, at_most};
use crate::core::context::Context;
use crate::core::curve::finite_points;
use crate::core::error::{Error, Locate, every};
use crate::core::fault::Fault;
use crate::core::point::Point;

/// Points, weights and what happens at the ends.
pub(super) struct Data<const D: usize> {
    pub(super) points: Vec<Point<D>>,
    pub(super) weights: Option<Vec<f64>>,
    pub(super) ends: Ends,
}

impl<const D: usize> Data<D> {
    /// Checks counts, that numbers are finite, and that weights are positive.
    pub(super) fn new(
        context: &Context,
        points: Vec<Point<D>>,
        weights: Option<Vec<f64>>,
        ends: Ends,
    ) -> Result<Self, Error> {
        let counted = at_least("points", points.len(), 2);
        counted
            .and_then(|()| {
                at_most("points", points.len(), context.limits.data_points, "Thin the data out")
            })
            .map_err(|f| f.at(Argument::Points))?;
        finite_points(&points).at(Argument::Points)?;
        if let Some(weights) = &weights {
            check_weights(weights, points.len()).at(Argument::Weights)?;
        }
        Ok(Data { points, weights, ends })
    }

    /// So many of the points at even distances in the list, the first and the last among them, and
    /// their places.
    pub(super) fn thinned(&self, count: usize) -> (Self, Vec<usize>) {
        let last = self.points.len() - 1;
        let chosen: Vec<usize> = (0..count).map(|k| k * last / (count - 1)).collect();
        let points = chosen.iter().map(|&i| self.points[i]).collect();
        let weights =
            self.weights.as_ref().map(|weights| chosen.iter().map(|&i| weights[i]).collect());
        (Data { points, weights, ends: self.ends }, chosen)
    }

    /// The weight of one point.
    pub(super) fn weight(&self, i: usize) -> f64 {
        self.weights.as_ref().map_or(1.0, |weights| weights[i])
    }

    /// The first and the last point, where the curve must pass through them.
    pub(super) fn fixed_ends(&self) -> Option<(Point<D>, Point<D>)> {
        match self.ends {
            Ends::Interpolate => Some((self.points[0], self.points[self.points.len() - 1])),
            Ends::Free => None,
        }
    }
}

fn check_weights(weights: &[f64], points: usize) -> Result<(), Error> {
    if weights.len() != points {
        return Err(Fault::WrongCount {
            what: "weights",
            count: weights.len(),
            expected: points,
            rule: "one weight per point",
        }
        .into());
    }
    let check = |(i, &weight): (usize, &f64)| {
        let allowed =
            || "a finite weight > 0 (leave a point out instead of giving it weight 0)".into();
        let valid = weight > 0.0 && weight.is_finite();
        if valid {
            Ok(())
        } else {
            Err(Fault::OutOfRange { what: "this weight", value: weight, allowed: allowed() }.at(i))
        }
    };
    every(weights.iter().enumerate().map(check)).map(drop)
}
