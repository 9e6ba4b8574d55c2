//! The shape of a Beta-Bezier curve.

use super::data::Data;
use super::freedom::Freedom;
use super::influence::{no_influence, rounding};
use super::reduced::{Reduced, inner, length};
use super::{Solved, Solver};
use crate::core::basis::{Basis, Beta};
use crate::core::context::Context;
use crate::core::curve::Single;
use crate::core::error::Error;
use crate::core::point::Point;

/// Intervals of the grid over `tau = beta / (1 + beta)` in [0, 1].
const GRID: usize = 64;
/// Valleys of the grid that are refined.
const VALLEYS: usize = 3;
/// Golden sections per valley: its width shrinks to 1e-7, about what comparing errors can show.
const SECTIONS: usize = 28;
/// Gauss-Newton steps after that, which find the zero of the slope to all digits.
const POLISHING: usize = 12;
/// The distance over which the slope is measured.
const SLOPE: f64 = 1e-4;

/// `beta` for a control polygon.
pub(super) struct BetaShape<const D: usize> {
    polygon: Vec<Point<D>>,
}

impl<const D: usize> BetaShape<D> {
    /// For at least two control points.
    pub(super) fn new(polygon: Vec<Point<D>>) -> Self {
        BetaShape { polygon }
    }
}

impl<const D: usize> Solver<D> for BetaShape<D> {
    fn solve(
        &self,
        context: &Context,
        data: &Data<D>,
        parameters: &[f64],
    ) -> Result<Solved<D>, Error> {
        let origin = self.polygon[0];
        let polygon: Vec<_> = self.polygon.iter().map(|&p| p - origin).collect();
        let reduced = Reduced::new(context, data, parameters, polygon.len() - 1, origin)?;
        let tau = Trials { polygon, reduced }.best(context)?;
        let at_bound = tau == 0.0 || tau == 1.0;
        let curve = Single::new(context, Basis::Beta(basis(tau)?), self.polygon.clone())?;
        Ok(Solved { curve, iterations: 1, converged: true, at_bound })
    }

    fn freedom(&self, curve: &Single<D>, _: &Data<D>) -> Freedom<D> {
        let order = curve.order();
        let tau = match curve.basis() {
            Basis::Beta(beta) if beta.beta().is_finite() => beta.beta() / (1.0 + beta.beta()),
            _ => 1.0,
        };
        let bezier =
            |tau| Some(Basis::Beta(basis(tau).ok()?).shape_matrix(order).apply(&self.polygon));
        let ends = (tau - SLOPE, tau + SLOPE);
        let inside = tau > 0.0 && tau < 1.0;
        let pair = (bezier(ends.0.max(0.0)), bezier(ends.1.min(1.0)));
        let (true, (Some(below), Some(above))) = (inside, pair) else {
            return Freedom::of_motions(order, vec![]);
        };
        let motion = above.iter().zip(&below).map(|(&a, &b)| a - b).collect();
        Freedom::of_motions(order, vec![motion])
    }
}

/// `beta = tau / (1 - tau)`; the straight limit is given as `lambda = 0`.
fn basis(tau: f64) -> Result<Beta, Error> {
    if tau < 1.0 { Beta::from_beta(tau / (1.0 - tau)) } else { Beta::from_lambda(0.0) }
}

/// Trials of `tau` against the reduced data.
struct Trials<const D: usize> {
    polygon: Vec<Point<D>>,
    reduced: Reduced<D>,
}

impl<const D: usize> Trials<D> {
    fn bezier(&self, context: &Context, tau: f64) -> Result<Vec<Point<D>>, Error> {
        context.checkpoint()?;
        Ok(Basis::Beta(basis(tau)?).shape_matrix(self.polygon.len() - 1).apply(&self.polygon))
    }

    fn error(&self, context: &Context, tau: f64) -> Result<f64, Error> {
        Ok(self.reduced.error(&self.bezier(context, tau)?))
    }

    /// The best `tau` found: deterministic, and the global minimum wherever the grid shows its
    /// valley.
    fn best(&self, context: &Context) -> Result<f64, Error> {
        self.check_influence(context)?;
        let errors =
            (0..=GRID).map(|k| self.error(context, node(k))).collect::<Result<Vec<_>, _>>()?;
        let is_valley = |&k: &usize| {
            (k == 0 || errors[k] <= errors[k - 1]) && (k == GRID || errors[k] < errors[k + 1])
        };
        let mut valleys: Vec<usize> = (0..=GRID).filter(is_valley).collect();
        valleys.sort_by(|&a, &b| errors[a].total_cmp(&errors[b]));
        let rounding = rounding(self.reduced.norm(), &self.polygon);
        let mut best = (0.0, errors[0]);
        for &k in valleys.iter().take(VALLEYS) {
            let refined = self.polish(
                context,
                self.golden_section(context, node(k.saturating_sub(1)), node((k + 1).min(GRID)))?,
            )?;
            let error = self.error(context, refined)?;
            // Within rounding the node is as good, and may be a bound.
            let better =
                if error + rounding < errors[k] { (refined, error) } else { (node(k), errors[k]) };
            if better.1 < best.1 {
                best = better;
            }
        }
        Ok(best.0)
    }

    /// Refuses a polygon whose curve is the same for every `beta`, as far as the data can tell.
    fn check_influence(&self, context: &Context) -> Result<(), Error> {
        let rest = self.bezier(context, 0.0)?;
        let threshold = rounding(self.reduced.norm(), &self.polygon);
        for k in [1, GRID / 4, GRID / 2, GRID] {
            let moved: Vec<_> =
                self.bezier(context, node(k))?.iter().zip(&rest).map(|(&q, &p)| q - p).collect();
            if length(&self.reduced.apply(&moved)) > threshold {
                return Ok(());
            }
        }
        Err(no_influence("beta"))
    }

    /// Kiefer 1953: the bracket of a minimum shrinks by the golden ratio with each trial.
    fn golden_section(&self, context: &Context, mut low: f64, mut high: f64) -> Result<f64, Error> {
        let ratio = (5f64.sqrt() - 1.0) / 2.0;
        let inside =
            |low: f64, high: f64| (high - ratio * (high - low), low + ratio * (high - low));
        let (mut a, mut b) = inside(low, high);
        let (mut at_a, mut at_b) = (self.error(context, a)?, self.error(context, b)?);
        for _ in 0..SECTIONS {
            if at_a <= at_b {
                (high, b, at_b) = (b, a, at_a);
                a = inside(low, high).0;
                at_a = self.error(context, a)?;
            } else {
                (low, a, at_a) = (a, b, at_b);
                b = inside(low, high).1;
                at_b = self.error(context, b)?;
            }
        }
        Ok(if at_a <= at_b { a } else { b })
    }

    /// Gauss-Newton steps for `d|r|^2 / d tau = 0`, for as long as they shrink: comparing errors
    /// finds a minimum only to half the digits.
    fn polish(&self, context: &Context, start: f64) -> Result<f64, Error> {
        let (mut tau, mut last_step) = (start, SLOPE);
        for _ in 0..POLISHING {
            let (low, high) = ((tau - SLOPE).max(0.0), (tau + SLOPE).min(1.0));
            let (below, above) = (self.bezier(context, low)?, self.bezier(context, high)?);
            let change: Vec<_> = above.iter().zip(&below).map(|(&a, &b)| a - b).collect();
            let slope = self.reduced.apply(&change);
            let residual = self.reduced.residual(&self.bezier(context, tau)?);
            let step = -inner(&slope, &residual) / inner(&slope, &slope) * (high - low);
            let next = (tau + step).clamp(0.0, 1.0);
            if step.is_nan() || step.abs() >= last_step || next == tau {
                break;
            }
            (tau, last_step) = (next, step.abs());
        }
        // A polished value that rounding or a strange valley made worse is dropped.
        let (before, after) = (self.error(context, start)?, self.error(context, tau)?);
        Ok(if after <= before * (1.0 + 1e-12) { tau } else { start })
    }
}

/// A grid node.
fn node(k: usize) -> f64 {
    k as f64 / GRID as f64
}
