//! Moving control points so that curves join smoothly.

use super::basis::Basis;
use super::continuity::{Class, Report, Tolerance, continuity};
use super::curve::{Bases, Piecewise, Single};
use super::error::{At, Error, Fault, at_least, at_most};
use super::joint_rows::{Side, derivative_row};
use super::knots::Breaks;
use super::least_change::{Condition, least_change};
use super::limits;
use super::point::{Point, magnitude};

/// Curves in one join.
pub const CURVES: usize = 1000;

/// The smoothness wanted at every joint.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Smoothness {
    /// The curves meet.
    C0,
    /// Their tangents agree.
    G1,
    /// Their first derivatives agree.
    C1,
    /// Their tangents and curvatures agree.
    G2,
    /// Their first and second derivatives agree.
    C2,
}

/// Which control points next to a joint may move: as many on a side as derivatives are compared, and the end itself.
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

impl Smoothness {
    /// How many derivatives are compared.
    fn order(self) -> usize {
        match self {
            Smoothness::C0 => 0,
            Smoothness::G1 | Smoothness::C1 => 1,
            Smoothness::G2 | Smoothness::C2 => 2,
        }
    }

    fn geometric(self) -> bool {
        matches!(self, Smoothness::G1 | Smoothness::G2)
    }

    fn met_by(self, report: &Report) -> bool {
        report.joints.iter().all(|joint| match self {
            Smoothness::C0 => joint.parametric >= Class::C0,
            Smoothness::C1 => joint.parametric >= Class::C1,
            Smoothness::C2 => joint.parametric >= Class::C2,
            Smoothness::G1 => joint.geometric >= Class::G1,
            Smoothness::G2 => joint.geometric >= Class::G2,
        })
    }
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

/// Joins curves of one order, laid end to end over their own domains, by the least sum of squared moves. For C classes the conditions
/// are linear, and the answer is the minimum. For G classes the ratio of speeds is free too; the conditions are then met by a sequence of
/// linear ones, each from where the last one led, and the answer is a local minimum. O(curves) a step.
///
/// # Errors
/// At `curves`: fewer than 2 or more than [`CURVES`], different orders, a basis that does not start and end at its control points.
/// At `smoothness`: a class that the points allowed to move cannot reach, with the joint.
pub fn join<const D: usize>(curves: Vec<Single<D>>, smoothness: Smoothness, movable: Movable) -> Result<Joined<D>, Error> {
    check(&curves).at("curves")?;
    let mut chain = Chain::new(curves, smoothness, movable);
    // Linear conditions need one step; the rest are for directions that turn, and for rounding.
    let steps = if smoothness.geometric() { 50 } else { 2 };
    let mut last = f64::INFINITY;
    for _ in 0..steps {
        let step = chain.step()?;
        if step <= 4.0 * f64::EPSILON * magnitude(&chain.points) || (step >= last && step <= 1e-13 * magnitude(&chain.points)) {
            break;
        }
        last = step;
    }
    chain.finish()
}

fn check<const D: usize>(curves: &[Single<D>]) -> Result<(), Error> {
    at_least("curves", curves.len(), 2)?;
    at_most("curves", curves.len(), CURVES, "Join them in groups")?;
    let expected = curves[0].order() + 1;
    for (i, curve) in curves.iter().enumerate() {
        if curve.order() + 1 != expected {
            let rule = "joined curves have one order, that of the first; convert them to one first";
            let count = curve.order() + 1;
            return Err(Fault::WrongCount { what: "control points", count, expected, rule }.at("control_points").at(i));
        }
        curve.basis().joinable(curve.order()).at(i)?;
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
            let leads = curve + 1 < count && order - point <= reach && movable != Movable::Following;
            follows || leads
        };
        let movable = (0..count * (order + 1)).map(|i| may_move(i / (order + 1), i % (order + 1))).collect();
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
        row.iter().zip(&self.points[first..]).fold(Point::ZERO, |sum, (&factor, &p)| sum + p * factor)
    }

    /// Adds `weight` times a component of an end derivative to a condition: to its terms where points may move. The value it has for
    /// the original points goes to the other side.
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

    /// The conditions of one joint, linear in the moves from the original points.
    fn conditions(&self, left: usize) -> Result<Vec<Condition>, Error> {
        let right = left + 1;
        let axes = (0..D).map(unit_vector::<D>);
        let mut conditions = Vec::new();
        let parametric = if self.smoothness.geometric() { 0 } else { self.smoothness.order() };
        for k in 0..=parametric {
            let (before, after) = (self.row(left, k, Side::End), self.row(right, k, Side::Start));
            for axis in axes.clone() {
                let mut condition = Condition::default();
                self.add(&mut condition, right, &after, axis);
                self.add(&mut condition, left, &before, axis * -1.0);
                conditions.push(condition);
            }
        }
        if self.smoothness.geometric() {
            self.geometric(left, &mut conditions)?;
        }
        Ok(conditions)
    }

    /// The components across the tangent `t` of: C'(right) = r C'(left), and C''(right) = r^2 C''(left) + s C'(left), with `r` and `s` as
    /// they are now. Along the tangent both are met by the choice of `r` and `s`, which follow the moves to first order.
    fn geometric(&self, left: usize, conditions: &mut Vec<Condition>) -> Result<(), Error> {
        let right = left + 1;
        let rows = |k: usize| (self.row(left, k, Side::End), self.row(right, k, Side::Start));
        let (before1, after1) = rows(1);
        let (v, w) = (self.value(left, &before1), self.value(right, &after1));
        let Some((tangent, speed)) = v.unit().map(|t| (t, v.norm())) else {
            let why =
                format!("curve {left} has no tangent at its end (its first derivative vanishes there), so nothing can be tangent to it");
            return Err(Fault::UnsuitableCurve(why).at(left).at("curves"));
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
        Ok(())
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

    /// Solves for the moves from the original points; returns how far the points went from where they were.
    fn step(&mut self) -> Result<f64, Error> {
        let joints: Vec<_> = (0..self.bases.len() - 1).map(|left| self.conditions(left)).collect::<Result<_, _>>()?;
        let change = least_change(self.points.len() * D, joints.concat(), 0);
        let mut step = 0.0;
        for (i, point) in self.points.iter_mut().enumerate() {
            let moved = self.original[i] + Point(std::array::from_fn(|axis| change.values[i * D + axis]));
            step = f64::max(step, moved.distance(*point));
            *point = moved;
        }
        Ok(step)
    }

    fn finish(self) -> Result<Joined<D>, Error> {
        let per_curve = self.order + 1;
        let moves: Vec<f64> = self.points.iter().zip(&self.original).map(|(p, q)| p.distance(*q)).collect();
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
        let gaps = (1..self.bases.len()).map(|i| self.points[i * per_curve - 1].distance(self.points[i * per_curve]));
        let gap = gaps.fold(0.0, f64::max);
        let curve = Piecewise::new(Bases::PerSegment(self.bases), self.order, Breaks::new(joints)?, false, points)?;
        let continuity = continuity(&curve.composite(), false, Tolerance::default());
        let together = gap <= limits::CONTINUITY_TOLERANCE * magnitude(curve.control_points());
        if !(together && smoothness.met_by(&continuity)) {
            return Err(Fault::UnsuitableCurve(impossible(smoothness, &continuity)).at("smoothness"));
        }
        let moved = moves.chunks_exact(per_curve).map(<[f64]>::to_vec).collect();
        Ok(Joined { curve, moved, continuity })
    }
}

fn impossible(smoothness: Smoothness, report: &Report) -> String {
    let worst = report.joints.iter().min_by_key(|joint| joint.class);
    let at = worst.map_or(String::new(), |joint| format!("; {} was reached at the joint {:?}", joint.class.name(), joint.parameter));
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
