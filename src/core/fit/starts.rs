//! Parameters to start from.

use super::data::Data;
use super::descent::{Search, State};
use crate::core::context::Context;
use crate::core::curve::Composite;
use crate::core::error::Error;

/// Rounds of feet and solves.
const ALTERNATIONS: usize = 8;
/// Pieces of a warp of the unit interval.
const PIECES: usize = 64;
/// Hops from a minimum.
const HOPS: usize = 20;
/// Waves that a warp is made of.
const WAVES: usize = 5;

/// A piecewise linear map of parameters that keeps their order.
#[derive(Debug, Clone)]
pub(super) struct Warp(Vec<(f64, f64)>);

impl Warp {
    /// Takes some parameters to others.
    pub(super) fn between(from: &[f64], to: &[f64]) -> Self {
        let mut pairs: Vec<_> = from.iter().copied().zip(to.iter().copied()).collect();
        pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
        pairs.dedup_by(|next, kept| next.0 == kept.0);
        Warp(pairs)
    }

    /// Of the unit interval, in waves as large as `size` that look random and are always the same.
    fn random(seed: usize, size: f64) -> Self {
        let waves: Vec<f64> = (1..=WAVES).map(|h| size * number(1000 * seed + h)).collect();
        let density = |u: f64| {
            let wave =
                |(h, c): (usize, &f64)| c * ((h + 1) as f64 * std::f64::consts::PI * u).cos();
            waves.iter().enumerate().map(wave).sum::<f64>().exp()
        };
        let mut sums = vec![0.0];
        for k in 0..PIECES {
            sums.push(sums[k] + density((k as f64 + 0.5) / PIECES as f64));
        }
        let pair = |(k, sum): (usize, &f64)| (k as f64 / PIECES as f64, sum / sums[PIECES]);
        Warp(sums.iter().enumerate().map(pair).collect())
    }

    /// Where a parameter goes; one outside the first and the last stays as far from them.
    pub(super) fn at(&self, t: f64) -> f64 {
        let next = self.0.partition_point(|pair| pair.0 <= t).clamp(1, self.0.len().max(2) - 1);
        match (self.0.get(next - 1), self.0.get(next)) {
            (Some(&a), Some(&b)) => a.1 + (b.1 - a.1) * ((t - a.0) / (b.0 - a.0)),
            (Some(&a), None) => a.1,
            _ => t,
        }
    }
}

/// In [-1, 1).
fn number(i: usize) -> f64 {
    let mixed = (i as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let mixed = (mixed ^ (mixed >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    (mixed >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

/// Other parameters for the first fit.
pub(super) fn warps() -> impl Iterator<Item = Warp> {
    [4, 7, 5].into_iter().map(|seed| Warp::random(seed, 0.5))
}

/// Steps away from a minimum, small and large ones in turn.
pub(super) fn hops() -> impl Iterator<Item = Warp> {
    (10..10 + HOPS).map(|seed| Warp::random(seed, if seed % 2 == 0 { 0.15 } else { 0.4 }))
}

/// Where a search puts the points on a curve, from the parameters that they have.
type Project<const D: usize> =
    fn(&Context, &Composite<D>, &Data<D>, &[f64]) -> Result<Vec<f64>, Error>;

/// Feet and solves in turn (Hoschek 1988).
pub(super) fn alternated<const D: usize>(
    context: &Context,
    search: &Search<D>,
    first: &State<D>,
    project: Project<D>,
) -> Result<Option<State<D>>, Error> {
    let mut parameters = project(
        context,
        &first.solved.curve.composite(context)?,
        search.data(),
        &first.parameters,
    )?;
    for _ in 1..ALTERNATIONS {
        let Some(state) = search.at(context, parameters)? else { return Ok(None) };
        parameters = project(
            context,
            &state.solved.curve.composite(context)?,
            search.data(),
            &state.parameters,
        )?;
    }
    search.at(context, parameters)
}
