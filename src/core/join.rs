//! Moving control points so that curves join smoothly.

mod conditions;
mod directions;

use super::argument::Argument;
use super::basis::Basis;
use super::check::{at_least, at_most};
use super::continuity::{Joint, Report, Tolerance, continuity};
use super::curve::{Bases, Piecewise, Single};
use super::error::{Error, Locate};
use super::fault::Fault;
use super::joint_rows::Side;
use super::knots::Breaks;
use super::limits;
use super::point::{Point, magnitude};
use super::smoothness::Smoothness;
use crate::core::context::Context;
use crate::core::linear::least_change::{Condition, least_change};
use conditions::Link;
use directions::normals;

/// Curves in one join.
pub const CURVES: usize = 1000;

/// Which control points next to a joint may move: as many on a side as derivatives are compared,
/// and the end itself.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Movable {
    /// Those of the curve after the joint.
    Following,
    /// Those of the curve before the joint.
    Leading,
    /// Both.
    #[default]
    Both,
}

/// Curves joined.
#[derive(Debug, Clone, PartialEq)]
pub struct Joined<C> {
    /// The piecewise curve.
    pub curve: C,
    /// `moved[i][j]`: how far point `j` of curve `i` moved.
    pub moved: Vec<Vec<f64>>,
    /// The continuity reached, measured.
    pub continuity: Report,
}

fn is_met(smoothness: Smoothness, report: &Report) -> bool {
    let geometric = smoothness.is_geometric();
    let reached = |joint: &Joint| if geometric { joint.geometric } else { joint.parametric };
    report.joints.iter().all(|joint| reached(joint) >= smoothness)
}

/// The curves under way, and what does not change about them.
struct Chain<const D: usize> {
    order: usize,
    lengths: Vec<f64>,
    bases: Vec<Basis>,
    original: Vec<Point<D>>,
    points: Vec<Point<D>>,
    movable: Vec<bool>,
    /// One for each point, where the curves are rational.
    weights: Option<Vec<f64>>,
    smoothness: Smoothness,
}

/// By what factor the ratio of the speeds at a joint may differ from the one it had. Where tangents
/// oppose each other the least change would be to stop at the joint, which has no tangent at all:
/// this bound keeps the curve going.
const SPEED_RATIO: f64 = 8.0;

/// Joins curves of one order, laid end to end over their own domains, by the least sum of squared
/// moves. O(curves) a step.
///
/// For C classes the conditions are linear, and the answer is the minimum. For G classes they are
/// linear once the ratio of speeds at each joint (and for G2 one more number) is chosen. Those
/// start as near to what the curves have as the class allows, and are then improved as long as that
/// lessens the sum of squares: so the class is reached wherever the linear conditions of the start
/// can be met, and the answer is a local minimum with ratios of speeds within a factor of 8 of what
/// they were, or the best after 50 steps.
///
/// # Errors
/// At `curves`: fewer than 2 or more than [`CURVES`], different orders, a basis that does not start
/// and end at its control points, coordinates too large to compute with. At `smoothness`: a class
/// that the points allowed to move cannot reach, with the joint.
pub fn join<const D: usize>(
    context: &Context,
    curves: Vec<Single<D>>,
    smoothness: Smoothness,
    movable: Movable,
) -> Result<Joined<Piecewise<D>>, Error> {
    let measure = |curve: &Piecewise<D>| {
        continuity(context, &curve.composite(context)?, false, Tolerance::default())
    };
    join_weighted(context, curves, None, smoothness, movable, measure)
}

/// The same of curves whose control points have these weights, one after the other, and whose
/// continuity is measured like this.
pub(crate) fn join_weighted<const D: usize>(
    context: &Context,
    curves: Vec<Single<D>>,
    weights: Option<Vec<f64>>,
    smoothness: Smoothness,
    movable: Movable,
    measure: impl FnOnce(&Piecewise<D>) -> Result<Report, Error>,
) -> Result<Joined<Piecewise<D>>, Error> {
    check(context, &curves).at(Argument::Curves)?;
    let mut chain = Chain { weights, ..Chain::new(curves, smoothness, movable) };
    if smoothness.is_geometric() {
        chain.descend(context)?;
    } else {
        chain.points = chain.solve(context, |left| chain.linked(left, Link { r: 1.0, s: 0.0 }))?;
    }
    chain.finish(context, measure)
}

fn check<const D: usize>(context: &Context, curves: &[Single<D>]) -> Result<(), Error> {
    at_least("curves", curves.len(), 2)?;
    at_most("curves", curves.len(), CURVES, "Join them in groups")?;
    let expected = curves[0].order() + 1;
    for (i, curve) in curves.iter().enumerate() {
        if curve.order() + 1 != expected {
            let rule = "joined curves have one order, that of the first; convert them to one first";
            let count = curve.order() + 1;
            return Err(Fault::WrongCount { what: "control points", count, expected, rule }
                .at(Argument::ControlPoints)
                .at(i));
        }
        context.checkpoint()?;
        curve.basis().joinable(context, curve.order()).at(i)?;
    }
    Ok(())
}

impl<const D: usize> Chain<D> {
    fn new(curves: Vec<Single<D>>, smoothness: Smoothness, movable: Movable) -> Self {
        let order = curves[0].order();
        let count = curves.len();
        let reach = smoothness.order();
        let may_move = |curve: usize, point: usize| {
            let follows = curve > 0 && point <= reach && movable != Movable::Leading;
            let leads =
                curve + 1 < count && order - point <= reach && movable != Movable::Following;
            follows || leads
        };
        let movable =
            (0..count * (order + 1)).map(|i| may_move(i / (order + 1), i % (order + 1))).collect();
        let lengths = curves.iter().map(|curve| curve.basis().length()).collect();
        let (bases, points): (Vec<_>, Vec<_>) = curves.into_iter().map(Single::into_parts).unzip();
        let points = points.concat();
        Chain {
            order,
            lengths,
            bases,
            original: points.clone(),
            points,
            movable,
            weights: None,
            smoothness,
        }
    }

    /// The link that a joint has, as far as it has one; `None` where the speed before it vanishes.
    fn link(&self, left: usize, r: impl Fn(f64, f64) -> f64) -> Option<Link> {
        let derivative = |k| {
            let (before, after) =
                (self.row(left, k, Side::End), self.row(left + 1, k, Side::Start));
            (self.value(left, &before), self.value(left + 1, &after))
        };
        let (v, w) = derivative(1);
        let (tangent, speed) = (v.unit()?, v.norm());
        let r = r(w.norm() / speed, w.dot(tangent) / speed);
        if self.smoothness != Smoothness::G2 {
            return Some(Link { r, s: 0.0 });
        }
        let (a, b) = derivative(2);
        Some(Link { r, s: tangent.dot(b - a * (r * r)) / speed })
    }

    /// The links that a function gives the joints; each may take milliseconds.
    fn each_joint(
        &self,
        context: &Context,
        link: impl Fn(usize) -> Link,
    ) -> Result<Vec<Link>, Error> {
        let joints = 0..self.bases.len() - 1;
        joints.map(|left| context.checkpoint().map(|()| link(left))).collect()
    }

    /// Improves the links from those of the original points, as long as that lessens the sum of
    /// squared moves. Every trial meets the class for its links; the direction is that of the
    /// linearised problem, which leads down to first order.
    fn descend(&mut self, context: &Context) -> Result<(), Error> {
        const STEPS: usize = 50;
        const SHORTEST: f64 = 1e-3;
        let joints = self.bases.len() - 1;
        let usable = |r: f64| if r > 0.0 && r.is_finite() { r } else { 1.0 };
        let start =
            |left| self.link(left, |ratio, _| usable(ratio)).unwrap_or(Link { r: 1.0, s: 0.0 });
        let start = self.each_joint(context, start)?;
        let mut links = start.clone();
        self.points = self.solve(context, |left| self.linked(left, links[left]))?;
        for _ in 0..STEPS {
            let linear = (0..joints)
                .map(|left| self.linearised(context, left))
                .collect::<Result<Vec<_>, _>>()?;
            let (best, cost) = (self.points.clone(), self.cost(&self.points));
            self.points = self.solve(context, |left| linear[left].clone())?;
            let wanted = self.each_joint(context, |left| {
                let usual = start[left].r;
                let near = |_, along: f64| along.clamp(usual / SPEED_RATIO, usual * SPEED_RATIO);
                self.link(left, near).unwrap_or(links[left])
            })?;
            let mut fraction = 1.0;
            let better = loop {
                let between = |(a, b): (&Link, &Link)| Link {
                    r: a.r + fraction * (b.r - a.r),
                    s: a.s + fraction * (b.s - a.s),
                };
                let trial: Vec<Link> = links.iter().zip(&wanted).map(between).collect();
                let points = self.solve(context, |left| self.linked(left, trial[left]))?;
                // A trial whose numbers overflow compares as no better.
                if self.cost(&points) < cost * (1.0 - 1e-12) {
                    break Some((points, trial));
                }
                fraction *= 0.25;
                if fraction < SHORTEST {
                    break None;
                }
            };
            let Some((points, trial)) = better else {
                self.points = best;
                return Ok(());
            };
            (self.points, links) = (points, trial);
        }
        Ok(())
    }

    /// The sum of squared moves.
    fn cost(&self, points: &[Point<D>]) -> f64 {
        points.iter().zip(&self.original).map(|(p, q)| p.distance(*q).powi(2)).sum()
    }

    /// The points after the least moves from the original ones that meet the conditions of every
    /// joint.
    fn solve(
        &self,
        context: &Context,
        conditions: impl Fn(usize) -> Vec<Condition>,
    ) -> Result<Vec<Point<D>>, Error> {
        let mut joints = Vec::new();
        for left in 0..self.bases.len() - 1 {
            context.checkpoint()?;
            joints.extend(conditions(left));
        }
        let change = least_change(context, self.points.len() * D, joints, 0)?;
        let moved = |(i, p): (usize, &Point<D>)| {
            *p + Point(std::array::from_fn(|axis| change.values[i * D + axis]))
        };
        Ok(self.original.iter().enumerate().map(moved).collect())
    }

    /// The components across the tangent `t` of: C'(right) = r C'(left), and C''(right) = r^2
    /// C''(left) + s C'(left), with `r` and `s` as they are now. Along the tangent both are met by
    /// the choice of `r` and `s`, which follow the moves to first order.
    fn linearised(&self, context: &Context, left: usize) -> Result<Vec<Condition>, Error> {
        context.checkpoint()?;
        let right = left + 1;
        let mut conditions = self.meeting(left);
        let rows = |k: usize| (self.row(left, k, Side::End), self.row(right, k, Side::Start));
        let (before1, after1) = rows(1);
        let (v, w) = (self.value(left, &before1), self.value(right, &after1));
        let Some((tangent, speed)) = v.unit().map(|t| (t, v.norm())) else {
            let why = format!(
                "curve {left} has no tangent at its end (its first derivative vanishes there), so nothing can be tangent to it"
            );
            return Err(Fault::UnsuitableCurve(why).at(left).at(Argument::Curves));
        };
        let along = w.dot(tangent) / speed;
        let ratio = if along > 0.0 { along } else { w.norm() / speed };
        let ratio = if ratio > 0.0 { ratio } else { 1.0 };
        for normal in normals(tangent) {
            let mut condition = Condition::default();
            self.add(&mut condition, right, &after1, normal);
            self.add(&mut condition, left, &before1, normal * -ratio);
            conditions.push(condition);
            if self.smoothness == Smoothness::G2 {
                conditions.push(self.bend(left, normal, tangent, ratio));
            }
        }
        Ok(conditions)
    }

    fn finish(
        self,
        context: &Context,
        measure: impl FnOnce(&Piecewise<D>) -> Result<Report, Error>,
    ) -> Result<Joined<Piecewise<D>>, Error> {
        let per_curve = self.order + 1;
        let moves: Vec<f64> =
            self.points.iter().zip(&self.original).map(|(p, q)| p.distance(*q)).collect();
        let mut joints = vec![0.0];
        joints.extend(self.lengths.iter().scan(0.0, |sum, length| {
            *sum += length;
            Some(*sum)
        }));
        let mut points: Vec<Point<D>> = Vec::with_capacity(self.points.len());
        for (i, curve) in self.points.chunks_exact(per_curve).enumerate() {
            points.extend(&curve[usize::from(i > 0)..]);
        }
        let smoothness = self.smoothness;
        // What the result exceeds, the curves of the request caused.
        let placed = |error: Error| error.of_result().fault.at(Argument::Curves);
        let gaps = (1..self.bases.len())
            .map(|i| self.points[i * per_curve - 1].distance(self.points[i * per_curve]));
        let gap = gaps.fold(0.0, f64::max);
        let curve = Piecewise::new(
            context,
            Bases::PerSegment(self.bases),
            self.order,
            Breaks::new(context, joints).map_err(placed)?,
            false,
            points,
        )
        .map_err(placed)?;
        let continuity = measure(&curve)?;
        let together = gap <= limits::CONTINUITY_TOLERANCE * magnitude(curve.control_points());
        if !(together && is_met(smoothness, &continuity)) {
            return Err(Fault::UnsuitableCurve(impossible(smoothness, &continuity))
                .at(Argument::Smoothness));
        }
        let moved = moves.chunks_exact(per_curve).map(<[f64]>::to_vec).collect();
        Ok(Joined { curve, moved, continuity })
    }
}

fn impossible(smoothness: Smoothness, report: &Report) -> String {
    let worst = report.joints.iter().min_by_key(|joint| joint.class);
    let at = worst.map_or(String::new(), |joint| {
        format!("; {} was reached at the joint {:?}", joint.class.name(), joint.parameter)
    });
    format!(
        "the control points that may move cannot make every joint {smoothness:?}{at}. Let both sides move, ask for less, or use curves of higher order"
    )
}

#[cfg(test)]
mod tests;
