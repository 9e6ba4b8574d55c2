//! Moving control points so that curves join smoothly.

use super::argument::Argument;
use super::basis::Basis;
use super::continuity::{Joint, Report, Tolerance, continuity};
use super::curve::{Bases, Piecewise, Single};
use super::error::{Error, Locate};
use super::fault::{Fault, at_least, at_most};
use super::joint_rows::{Side, derivative_row};
use super::knots::Breaks;
use super::limits;
use super::point::{Point, magnitude};
use super::smoothness::Smoothness;
use crate::core::context::Context;
use crate::core::linear::least_change::{Condition, least_change};

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
pub struct Joined<const D: usize> {
    /// The piecewise curve.
    pub curve: Piecewise<D>,
    /// `moved[i][j]`: how far point `j` of curve `i` moved.
    pub moved: Vec<Vec<f64>>,
    /// The continuity reached, measured.
    pub continuity: Report,
}

/// How many derivatives are compared.
fn derivatives_compared(smoothness: Smoothness) -> usize {
    match smoothness {
        Smoothness::Discontinuous | Smoothness::C0 => 0,
        Smoothness::G1 | Smoothness::C1 => 1,
        Smoothness::G2 | Smoothness::C2 => 2,
    }
}

fn is_geometric(smoothness: Smoothness) -> bool {
    matches!(smoothness, Smoothness::G1 | Smoothness::G2)
}

fn is_met(smoothness: Smoothness, report: &Report) -> bool {
    let reached = |joint: &Joint| {
        if is_geometric(smoothness) { joint.geometric } else { joint.parametric }
    };
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
    smoothness: Smoothness,
}

/// By what factor the ratio of the speeds at a joint may differ from the one it had. Where tangents
/// oppose each other the least change would be to stop at the joint, which has no tangent at all:
/// this bound keeps the curve going.
const SPEED_RATIO: f64 = 8.0;

/// How derivatives after a joint follow from those before it: `C' = r c'` and `C'' = r^2 c'' + s
/// c'`.
#[derive(Debug, Clone, Copy)]
struct Link {
    r: f64,
    s: f64,
}

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
) -> Result<Joined<D>, Error> {
    check(context, &curves).at(Argument::Curves)?;
    let mut chain = Chain::new(curves, smoothness, movable);
    if is_geometric(smoothness) {
        chain.descend(context)?;
    } else {
        chain.points = chain.solve(context, |left| chain.linked(left, Link { r: 1.0, s: 0.0 }))?;
    }
    chain.finish(context)
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
        let reach = derivatives_compared(smoothness);
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
        Chain { order, lengths, bases, original: points.clone(), points, movable, smoothness }
    }

    /// The `k`-th derivative at an end, as factors of the curve's control points.
    fn row(&self, curve: usize, k: usize, side: Side) -> Vec<f64> {
        derivative_row(&self.bases[curve], self.order, self.lengths[curve], k, side)
    }

    /// Its value now.
    fn value(&self, curve: usize, row: &[f64]) -> Point<D> {
        let first = curve * (self.order + 1);
        row.iter()
            .zip(&self.points[first..])
            .fold(Point::ZERO, |sum, (&factor, &p)| sum + p * factor)
    }

    /// Adds `weight` times a component of an end derivative to a condition: to its terms where
    /// points may move. The value it has for the original points goes to the other side.
    fn add(&self, condition: &mut Condition, curve: usize, row: &[f64], weight: Point<D>) {
        for (j, &factor) in row.iter().enumerate() {
            let point = curve * (self.order + 1) + j;
            for axis in 0..D {
                let c = factor * weight[axis];
                condition.right -= c * self.original[point][axis];
                if self.movable[point] && c != 0.0 {
                    condition.terms.push((point * D + axis, c));
                }
            }
        }
    }

    /// The conditions of one joint for a given link, linear in the moves from the original points.
    fn linked(&self, left: usize, link: Link) -> Vec<Condition> {
        let right = left + 1;
        let mut conditions = Vec::new();
        for k in 0..=derivatives_compared(self.smoothness) {
            let (before, after) = (self.row(left, k, Side::End), self.row(right, k, Side::Start));
            let slower = self.row(left, 1, Side::End);
            for axis in (0..D).map(unit_vector::<D>) {
                let mut condition = Condition::default();
                self.add(&mut condition, right, &after, axis);
                self.add(&mut condition, left, &before, axis * -link.r.powi(k as i32));
                if k == 2 && link.s != 0.0 {
                    self.add(&mut condition, left, &slower, axis * -link.s);
                }
                conditions.push(condition);
            }
        }
        conditions
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

    /// The conditions that the curves meet.
    fn meeting(&self, left: usize) -> Vec<Condition> {
        let (before, after) = (self.row(left, 0, Side::End), self.row(left + 1, 0, Side::Start));
        let along = |axis| {
            let mut condition = Condition::default();
            self.add(&mut condition, left + 1, &after, axis);
            self.add(&mut condition, left, &before, axis * -1.0);
            condition
        };
        (0..D).map(unit_vector::<D>).map(along).collect()
    }

    /// The second of them, for one normal, linearised: r and s move with C'(right) and C'(left).
    fn bend(&self, left: usize, normal: Point<D>, tangent: Point<D>, ratio: f64) -> Condition {
        let right = left + 1;
        let [before1, before2] = [1, 2].map(|k| self.row(left, k, Side::End));
        let [after1, after2] = [1, 2].map(|k| self.row(right, k, Side::Start));
        let speed = self.value(left, &before1).norm();
        let (a, b) = (self.value(left, &before2), self.value(right, &after2));
        let s = tangent.dot(b - a * (ratio * ratio)) / speed;
        // d(r^2 n.a) = 2 r (n.a) dr with dr = t.(dC'(right) - r dC'(left)) / speed.
        let turn = 2.0 * ratio * normal.dot(a) / speed;
        let mut condition = Condition::default();
        self.add(&mut condition, right, &after2, normal);
        self.add(&mut condition, left, &before2, normal * -(ratio * ratio));
        self.add(&mut condition, left, &before1, normal * -s + tangent * (turn * ratio));
        self.add(&mut condition, right, &after1, tangent * -turn);
        // The linearised terms vanish at the points as they are now, not at the original ones.
        condition.right += turn * (ratio * speed - tangent.dot(self.value(right, &after1)));
        condition
    }

    fn finish(self, context: &Context) -> Result<Joined<D>, Error> {
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
        let continuity =
            continuity(context, &curve.composite(context)?, false, Tolerance::default())?;
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

fn unit_vector<const D: usize>(axis: usize) -> Point<D> {
    let mut unit = Point::ZERO;
    unit[axis] = 1.0;
    unit
}

/// Unit vectors that complete a unit tangent to an orthonormal basis.
fn normals<const D: usize>(tangent: Point<D>) -> Vec<Point<D>> {
    let mut found: Vec<Point<D>> = vec![tangent];
    let mut axes: Vec<usize> = (0..D).collect();
    // The axes least along the tangent first: nothing is lost in the subtraction.
    axes.sort_by(|&a, &b| tangent[a].abs().total_cmp(&tangent[b].abs()));
    for axis in axes {
        let rest = found.iter().fold(unit_vector(axis), |v, &n| v - n * n.dot(v));
        if found.len() < D && rest.norm() > 0.1 {
            found.extend(rest.unit());
        }
    }
    found.split_off(1)
}

#[cfg(test)]
mod tests;
