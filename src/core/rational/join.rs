//! Joining rational curves smoothly.

use super::{AnyCurve, continuity};
use crate::core::argument::Argument;
use crate::core::context::Context;
use crate::core::continuity::Tolerance;
use crate::core::curve::{Curve, Piecewise, Single};
use crate::core::error::Error;
use crate::core::fault::Fault;
use crate::core::join::{Joined, Movable, join_weighted};
use crate::core::smoothness::Smoothness;
use crate::core::weights::Weights;

/// Joins curves of which some have weights: as [`join`](crate::core::join::join). Control points
/// move, weights do not, but for one factor of each curve, which makes neighbours agree at their
/// joint and changes no curve.
///
/// # Errors
/// As [`join`](crate::core::join::join). At `curves`: weights that then differ too much.
pub fn join<const D: usize, const H: usize>(
    context: &Context,
    curves: Vec<(Single<D>, Option<Weights>)>,
    smoothness: Smoothness,
    movable: Movable,
) -> Result<Joined<AnyCurve<D, H>>, Error> {
    let (singles, weights) = with_common_weights(curves);
    let shared = shared(&singles, &weights);
    // Before anything is computed with them.
    if Weights::new(shared.clone(), shared.len()).is_err() {
        let why = "joined, the weights of these curves would differ by more than a factor of 1e12";
        return Err(Fault::UnsuitableCurve(why.into()).at(Argument::Curves));
    }
    let weighted = |curve: &Piecewise<D>| {
        let curve = Curve::Piecewise(curve.clone());
        AnyCurve::<D, H>::new(context, curve, shared.clone())
            .map_err(|error| error.fault.at(Argument::Curves))
    };
    let measure =
        |curve: &Piecewise<D>| Ok(continuity(context, &weighted(curve)?, Tolerance::default())?.1);
    let found = join_weighted(context, singles, Some(weights), smoothness, movable, measure)?;
    let (curve, moved, continuity) = (weighted(&found.curve)?, found.moved, found.continuity);
    Ok(Joined { curve, moved, continuity })
}

/// The curves, and the weights of all their points, the same on both sides of each joint. All are
/// scaled, as those of one curve may be as large as a double.
fn with_common_weights<const D: usize>(
    curves: Vec<(Single<D>, Option<Weights>)>,
) -> (Vec<Single<D>>, Vec<f64>) {
    let mut all: Vec<f64> = Vec::new();
    let mut singles = Vec::with_capacity(curves.len());
    for (curve, weights) in curves {
        let weights = weights.unwrap_or_else(|| Weights::ones(curve.order() + 1));
        let scaled = weights.scaled();
        let factor = all.last().map_or(1.0, |last| last / scaled[0]);
        all.extend(scaled.iter().map(|w| w * factor));
        singles.push(curve);
    }
    (singles, all)
}

/// The weights of the joined curve, whose neighbours share the point at their joint.
fn shared<const D: usize>(singles: &[Single<D>], weights: &[f64]) -> Vec<f64> {
    let mut shared: Vec<f64> = Vec::with_capacity(weights.len());
    let mut rest = weights;
    for single in singles {
        let (own, after) = rest.split_at(single.order() + 1);
        shared.extend(&own[usize::from(!shared.is_empty())..]);
        rest = after;
    }
    shared
}
