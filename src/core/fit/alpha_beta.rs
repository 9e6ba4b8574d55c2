//! The shape of an alpha-beta-Bezier cubic.

use super::data::Data;
use super::freedom::Freedom;
use super::influence::{no_influence, rounding};
use super::reduced::{Reduced, inner, length};
use super::{Solved, Solver};
use crate::core::basis::{AlphaBeta, Basis};
use crate::core::context::Context;
use crate::core::curve::Single;
use crate::core::error::Error;
use crate::core::point::Point;

/// The least `s = alpha beta` returned, as 0 is outside the range: 0 to all digits of a drawing.
const LEAST: f64 = 1e-9;
/// The largest `s`: the Bezier curve.
const MOST: f64 = 3.0;

/// `s` for a control polygon of four points. The curve is linear in `s`, so its best value is a
/// quotient.
pub(super) struct AlphaBetaShape<const D: usize> {
    polygon: Vec<Point<D>>,
}

impl<const D: usize> AlphaBetaShape<D> {
    /// For four control points.
    pub(super) fn new(polygon: Vec<Point<D>>) -> Self {
        AlphaBetaShape { polygon }
    }
}

impl<const D: usize> Solver<D> for AlphaBetaShape<D> {
    fn solve(
        &self,
        context: &Context,
        data: &Data<D>,
        parameters: &[f64],
    ) -> Result<Solved<D>, Error> {
        let p = &self.polygon;
        let origin = p[0];
        let reduced = Reduced::new(context, data, parameters, 3, origin)?;
        let end = p[3] - origin;
        let still = [Point::ZERO, Point::ZERO, end, end];
        let moving = moving(p);
        let direction = reduced.apply(&moving);
        if length(&direction) <= rounding(reduced.norm(), &[end, p[1] - origin, p[2] - origin]) {
            return Err(no_influence("s = alpha * beta"));
        }
        let unit = length(&direction);
        let direction: Vec<_> = direction.iter().map(|g| g.map(|x| x / unit)).collect();
        let best = -inner(&direction, &reduced.residual(&still)) / unit;
        let s = best.clamp(LEAST, MOST);
        let at_bound = s != best;
        let curve = Single::new(context, Basis::AlphaBeta(AlphaBeta::new(1.0, s)?), p.clone())?;
        Ok(Solved { curve, iterations: 1, converged: true, at_bound })
    }

    fn freedom(&self, curve: &Single<D>, _: &Data<D>) -> Freedom<D> {
        let inside =
            matches!(curve.basis(), Basis::AlphaBeta(b) if b.beta() > LEAST && b.beta() < MOST);
        Freedom::of_motions(3, if inside { vec![moving(&self.polygon).to_vec()] } else { vec![] })
    }
}

/// How the Bezier points move with `s`.
fn moving<const D: usize>(p: &[Point<D>]) -> [Point<D>; 4] {
    [Point::ZERO, (p[1] - p[0]) * (1.0 / 3.0), (p[2] - p[3]) * (1.0 / 3.0), Point::ZERO]
}
