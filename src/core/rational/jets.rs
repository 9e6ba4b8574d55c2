//! Points and derivatives within the segments of a rational curve.

use super::{Homogeneous, Rational};
use crate::core::context::Context;
use crate::core::curve::Composite;
use crate::core::error::Error;
use crate::core::homogeneous::project_jet;

use crate::core::local::placed;
use crate::core::point::Point;

/// The point and two derivatives anywhere on a rational curve, one place at a time.
pub(crate) struct Jets<const D: usize, const H: usize> {
    lifted: Homogeneous<D, H>,
    curves: [Composite<H>; 3],
}

impl<const D: usize, const H: usize> Jets<D, H> {
    /// Makes a curve ready. O(segments * degree).
    ///
    /// # Errors
    /// [`Fault::Cancelled`](crate::core::fault::Fault).
    pub(crate) fn of(context: &Context, curve: &Rational<D, H>) -> Result<Self, Error> {
        let lifted = curve.homogeneous(context)?;
        let whole = lifted.curve.composite(context)?;
        let first = whole.derivative(context)?;
        let second = first.derivative(context)?;
        Ok(Jets { lifted, curves: [whole, first, second] })
    }

    /// How many segments there are.
    pub(crate) fn segments(&self) -> usize {
        self.curves[0].breaks().segments()
    }

    /// The point and the derivatives of a segment at its own parameter `u`, with `v = 1 - u`.
    pub(crate) fn within(&self, segment: usize, u: f64, v: f64) -> [Point<D>; 3] {
        let jet = self.curves.each_ref().map(|curve| curve.local(segment).at(u, v));
        let [point, first, second] = project_jet(jet);
        [placed(self.lifted.origin, point), first, second]
    }
}
