//! Bending a rational curve by its shape parameters.

use super::{AnyCurve, Jets, Rational, continuity};
use crate::core::argument::Argument;
use crate::core::context::Context;
use crate::core::continuity::{Joint, Tolerance};
use crate::core::curve::{Bases, Curve, Piecewise};
use crate::core::error::{Error, Locate};
use crate::core::joint_rows::{Side, rational_row};
use crate::core::reshape::{Kept, Reshaped, mend, reshape as polynomial_reshape};
use crate::core::smoothness::Smoothness;

/// Places of a segment at which the old and the new curve are compared.
pub const PLACES: usize = 128;

/// Gives a rational curve new bases: as [`reshape`](crate::core::reshape::reshape). Weights stay,
/// but under [`Smoothness::C2`], where the curve stays and is written in the new bases.
///
/// # Errors
/// As [`reshape`](crate::core::reshape::reshape). At `keep`: under `C2`, a weight that would not be
/// positive.
pub fn reshape<const D: usize, const H: usize>(
    context: &Context,
    curve: &Rational<D, H>,
    bases: Bases,
    keep: Smoothness,
) -> Result<Reshaped<Rational<D, H>>, Error> {
    let new = if keep == Smoothness::C2 {
        let lifted = curve.homogeneous(context).at(Argument::Curve)?;
        let found = polynomial_reshape(context, &lifted.curve, bases, keep)?;
        lifted.back(context, &found.curve).map_err(|error| error.fault.at(Argument::Keep))?
    } else {
        with_weights_kept(context, curve, bases, keep)?
    };
    let report = |curve: &Rational<D, H>| {
        let curve = AnyCurve::Rational(curve.clone());
        Ok::<_, Error>(continuity(context, &curve, Tolerance::default())?.1)
    };
    let pairs = curve.curve().control_points().iter().zip(new.curve().control_points());
    Ok(Reshaped {
        continuity: report(&new)?,
        curve_moved: distance(context, curve, &new)?,
        points_moved: pairs.map(|(p, q)| p.distance(*q)).fold(0.0, f64::max),
        curve: new,
    })
}

fn with_weights_kept<const D: usize, const H: usize>(
    context: &Context,
    curve: &Rational<D, H>,
    bases: Bases,
    keep: Smoothness,
) -> Result<Rational<D, H>, Error> {
    // What is kept is kept of the rational curve, below; G2 is refused like everywhere.
    let plain = if keep == Smoothness::G2 { keep } else { Smoothness::C0 };
    let bent = polynomial_reshape(context, curve.curve(), bases, plain)?.curve;
    let bent = match bent {
        Curve::Piecewise(bent) if keep > Smoothness::C0 => {
            Curve::Piecewise(mended(context, curve, bent, keep)?)
        }
        bent => bent,
    };
    Ok(Rational { curve: bent, weights: curve.weights().clone() })
}

fn mended<const D: usize, const H: usize>(
    context: &Context,
    old: &Rational<D, H>,
    bent: Piecewise<D>,
    keep: Smoothness,
) -> Result<Piecewise<D>, Error> {
    let (order, weights) = (bent.order(), old.weights().scaled());
    let row = |segment: usize, side: Side| {
        let (a, b) = bent.breaks().interval(segment);
        let weights = &weights[segment * order..=(segment + 1) * order];
        rational_row(bent.bases().of(segment), order, b - a, 1, side, weights)
    };
    let kept = kept_joints(context, old, keep)?;
    let changes = mend(context, &bent, &kept, row).at(Argument::Keep)?;
    let points = bent.control_points().iter().zip(changes).map(|(&p, change)| p + change);
    let (bases, breaks) = (bent.bases().clone(), bent.breaks().clone());
    Piecewise::new(context, bases, order, breaks, bent.closed(), points.collect()).of_result()
}

/// The joints at which the old curve had the class to keep, with the ratio of its speeds there.
fn kept_joints<const D: usize, const H: usize>(
    context: &Context,
    old: &Rational<D, H>,
    keep: Smoothness,
) -> Result<Vec<Kept>, Error> {
    let any = AnyCurve::Rational(old.clone());
    let report = continuity(context, &any, Tolerance::default())?.1;
    let jets = Jets::of(context, old)?;
    let kept = |(i, joint): (usize, &Joint)| {
        let (left, right) = (i, (i + 1) % jets.segments());
        let speed = |segment, u, v| jets.within(segment, u, v)[1].norm();
        let ratio = match keep {
            Smoothness::C1 if joint.parametric >= keep => 1.0,
            Smoothness::G1 if joint.geometric >= keep => {
                speed(right, 0.0, 1.0) / speed(left, 1.0, 0.0)
            }
            _ => return None,
        };
        Some(Kept { parameter: joint.parameter, left, right, ratio })
    };
    Ok(report.joints.iter().enumerate().filter_map(kept).collect())
}

/// The largest distance at the places compared.
fn distance<const D: usize, const H: usize>(
    context: &Context,
    a: &Rational<D, H>,
    b: &Rational<D, H>,
) -> Result<f64, Error> {
    let (a, b) = (Jets::of(context, a)?, Jets::of(context, b)?);
    let mut pace = context.pace();
    let mut largest = 0.0;
    for segment in 0..a.segments() {
        for i in 0..=PLACES {
            pace.step()?;
            let u = i as f64 / PLACES as f64;
            let at = |jets: &Jets<D, H>| jets.within(segment, u, 1.0 - u)[0];
            largest = f64::max(largest, at(&a).distance(at(&b)));
        }
    }
    Ok(largest)
}
