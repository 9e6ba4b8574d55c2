//! What a tolerance fit has to hold.

use super::near::Near;
use super::ordered::Ordered;
use super::spline::CubicSpline;
use super::unsolved::Unsolved;
use crate::core::context::Context;
use crate::core::error::Error;

/// Points to come close to, and to stay near in between.
pub(super) struct Problem<'a, const D: usize> {
    pub(super) ordered: Ordered<'a, D>,
    pub(super) near: Near<D>,
    /// The largest distance of a point.
    pub(super) tolerance: f64,
}

impl<'a, const D: usize> Problem<'a, D> {
    /// O(points).
    pub(super) fn new(
        context: &Context,
        ordered: Ordered<'a, D>,
        tolerance: f64,
    ) -> Result<Self, Error> {
        let near = Near::new(context, &ordered, tolerance)?;
        Ok(Problem { ordered, near, tolerance })
    }

    /// The least-squares spline; `None` where the points do not determine it well.
    pub(super) fn spline(
        &self,
        context: &Context,
        breaks: &[f64],
    ) -> Result<Option<CubicSpline<D>>, Error> {
        match CubicSpline::least_squares(context, &self.ordered, breaks) {
            Ok(spline) => Ok(Some(spline)),
            Err(Unsolved::Deficient(_)) => Ok(None),
            Err(Unsolved::Stopped(error)) => Err(error),
        }
    }

    /// Whether every point is within the tolerance, and every stretch near its chord.
    pub(super) fn holds(&self, context: &Context, spline: &CubicSpline<D>) -> Result<bool, Error> {
        Ok(spline.error() <= self.tolerance
            && self.near.holds(context, &self.ordered, &spline.composite)?)
    }

    /// The same for a list of breaks: the spline, where it holds.
    pub(super) fn held(
        &self,
        context: &Context,
        breaks: &[f64],
    ) -> Result<Option<CubicSpline<D>>, Error> {
        match self.spline(context, breaks)? {
            Some(spline) if self.holds(context, &spline)? => Ok(Some(spline)),
            _ => Ok(None),
        }
    }

    /// Which segments have a point too far off, or a stretch that strays; what is at a joint counts
    /// for both sides.
    pub(super) fn violated(
        &self,
        context: &Context,
        spline: &CubicSpline<D>,
    ) -> Result<Vec<bool>, Error> {
        let breaks = spline.breaks();
        let mut violated = vec![false; spline.segments()];
        let mut mark = |from: f64, to: f64| {
            let first = breaks.partition_point(|&knot| knot < from).max(1) - 1;
            let after = breaks.partition_point(|&knot| knot <= to).min(violated.len());
            violated[first..after].fill(true);
        };
        let places = &self.ordered.places;
        for (i, _) in
            spline.distances.iter().enumerate().filter(|&(_, &d)| d > self.tolerance || d.is_nan())
        {
            let t = self.ordered.parameters[i];
            mark(t, t);
        }
        for i in self.near.strays(context, &self.ordered, &spline.composite)? {
            mark(places[i], places[i + 1]);
        }
        Ok(violated)
    }
}
