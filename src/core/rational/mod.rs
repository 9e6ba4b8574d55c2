//! Curves with weights: rational members of every family.
//!
//! With weights `w_j` a curve is `C = sum w_j P_j b_j / sum w_j b_j`. In homogeneous coordinates it
//! is polynomial, and whatever is linear in the control points goes through the code of polynomial
//! curves, one dimension up.

mod continuity;
mod convert;
mod evaluate;
mod jets;
mod join;
mod reshape;
mod subdivide;
mod to_bspline;

pub use continuity::{continuity, end_to_end};
pub use convert::convert;
pub use evaluate::{evaluate, polyline};
pub(crate) use jets::Jets;
pub use join::join;
pub use reshape::{PLACES, reshape};
pub use subdivide::subdivide;
pub use to_bspline::to_bspline;

use super::argument::Argument;
use super::context::Context;
use super::curve::Curve;
use super::error::{Error, Locate};
use super::fault::Fault;
use super::homogeneous::{lifted, projected, weight};
use super::local::{localized, placed};
use super::metric::Projective;
use super::point::Point;
use super::weights::Weights;

/// A curve whose control points have weights that are not all the same. `H = D + 1`.
#[derive(Debug, Clone, PartialEq)]
pub struct Rational<const D: usize, const H: usize> {
    curve: Curve<D>,
    weights: Weights,
}

/// A curve with weights or without.
#[derive(Debug, Clone, PartialEq)]
pub enum AnyCurve<const D: usize, const H: usize> {
    /// Without: all are 1.
    Polynomial(Curve<D>),
    /// With different weights.
    Rational(Rational<D, H>),
}

/// A rational curve in homogeneous coordinates.
pub(crate) struct Homogeneous<const D: usize, const H: usize> {
    /// What points are relative to.
    pub(crate) origin: Point<D>,
    /// The factor of the weights.
    unit: f64,
    /// The polynomial curve, one dimension up.
    pub(crate) curve: Curve<H>,
}

impl<const D: usize, const H: usize> AnyCurve<D, H> {
    /// A curve with these weights; equal ones are none.
    ///
    /// # Errors
    /// As [`Rational::new`].
    pub fn new(context: &Context, curve: Curve<D>, weights: Vec<f64>) -> Result<Self, Error> {
        let rational = Rational::new(context, curve, weights)?;
        Ok(if rational.weights.are_equal() {
            AnyCurve::Polynomial(rational.curve)
        } else {
            AnyCurve::Rational(rational)
        })
    }

    /// With weights: without any they are 1.
    pub(crate) fn weighted(&self) -> Rational<D, H> {
        match self {
            AnyCurve::Rational(rational) => rational.clone(),
            AnyCurve::Polynomial(curve) => {
                let weights = Weights::ones(curve.control_points().len());
                Rational { curve: curve.clone(), weights }
            }
        }
    }
}

impl<const D: usize, const H: usize> Rational<D, H> {
    /// Gives the control points of a curve weights. They are not multiplied with them.
    ///
    /// # Errors
    /// At `weights`: as [`Weights::new`]; a closed curve whose weight is not the same where it starts
    /// and where it ends.
    pub fn new(context: &Context, curve: Curve<D>, weights: Vec<f64>) -> Result<Self, Error> {
        let count = curve.control_points().len();
        let weights = Weights::new(weights, count).at(Argument::Weights)?;
        let [first, .., last] = weights.as_slice() else {
            return Err(Fault::TooFew { what: "weights", count, least: 2 }.at(Argument::Weights));
        };
        if curve.closed() && first != last && matches!(curve, Curve::Piecewise(_)) {
            let why = format!(
                "a closed curve has the same weight where it starts and where it ends; here {first:?} and {last:?}"
            );
            let place = Fault::UnsuitableCurve(why).at(count - 1);
            return Err(place.at(Argument::Weights));
        }
        let rational = Rational { curve, weights };
        let closed = rational.curve.closed();
        let named = |error: Error| match &error.fault {
            Fault::UnsuitableCurve(_) if closed => {
                let why = "the curve ends where it starts, but not with the weight it starts with";
                Fault::UnsuitableCurve(why.into()).at(Argument::Weights)
            }
            _ => error,
        };
        rational.homogeneous(context).map_err(named)?;
        Ok(rational)
    }

    /// The curve of the control points alone.
    pub fn curve(&self) -> &Curve<D> {
        &self.curve
    }

    /// The weights.
    pub fn weights(&self) -> &Weights {
        &self.weights
    }

    /// The parts.
    pub fn into_parts(self) -> (Curve<D>, Weights) {
        (self.curve, self.weights)
    }

    /// In homogeneous coordinates: points from an origin near them, weights of about 1.
    pub(crate) fn homogeneous(&self, context: &Context) -> Result<Homogeneous<D, H>, Error> {
        let (origin, points) = localized(self.curve.control_points());
        let unit = self.weights.unit();
        let lift = |(&p, w): (&Point<D>, f64)| lifted::<D, H>(p, w);
        let points = points.iter().zip(self.weights.scaled()).map(lift).collect();
        let curve = self.curve.with_points(context, points).of_result()?;
        Ok(Homogeneous { origin, unit, curve })
    }
}

impl<const D: usize, const H: usize> Homogeneous<D, H> {
    /// Its distances.
    pub(crate) fn metric(&self) -> Projective<D> {
        Projective(self.origin)
    }

    /// The point itself.
    pub(crate) fn point(&self, h: Point<H>) -> Point<D> {
        placed(self.origin, projected(h))
    }

    /// A curve that was computed from this one, in points and weights. Equal weights stay.
    ///
    /// # Errors
    /// [`Fault::UnsuitableCurve`]: a weight that is not positive, or too small beside the others.
    pub(crate) fn back(
        &self,
        context: &Context,
        curve: &Curve<H>,
    ) -> Result<Rational<D, H>, Error> {
        let points = curve.control_points();
        if let Some(i) = points.iter().position(|&h| weight(h) <= 0.0 || weight(h).is_nan()) {
            let why = format!(
                "control point {i} would have a weight that is not positive; Bezier form always has positive ones"
            );
            return Err(Fault::UnsuitableCurve(why).into());
        }
        let weights = points.iter().map(|&h| weight(h) / self.unit).collect();
        let weights = Weights::new(weights, points.len()).map_err(|_| {
            let why = "the weights would differ by more than a factor of 1e12";
            Error::from(Fault::UnsuitableCurve(why.into()))
        })?;
        let points = points.iter().map(|&h| self.point(h)).collect();
        let curve = curve.with_points(context, points).of_result()?;
        Ok(Rational { curve, weights })
    }
}
