//! The conditions of a joint, linear in the moves of control points.

use super::Chain;
use super::directions::unit_vector;
use crate::core::joint_rows::{Side, derivative_row, rational_row};
use crate::core::linear::least_change::Condition;
use crate::core::point::Point;

/// How derivatives after a joint follow from those before it: `C' = r c'` and `C'' = r^2 c'' + s
/// c'`.
#[derive(Debug, Clone, Copy)]
pub(super) struct Link {
    pub(super) r: f64,
    pub(super) s: f64,
}

impl<const D: usize> Chain<D> {
    /// The `k`-th derivative at an end, as factors of the curve's control points.
    pub(super) fn row(&self, curve: usize, k: usize, side: Side) -> Vec<f64> {
        let (basis, length) = (&self.bases[curve], self.lengths[curve]);
        match &self.weights {
            None => derivative_row(basis, self.order, length, k, side),
            Some(weights) => {
                let first = curve * (self.order + 1);
                let weights = &weights[first..=first + self.order];
                rational_row(basis, self.order, length, k, side, weights)
            }
        }
    }

    /// Its value now.
    pub(super) fn value(&self, curve: usize, row: &[f64]) -> Point<D> {
        let first = curve * (self.order + 1);
        row.iter()
            .zip(&self.points[first..])
            .fold(Point::ZERO, |sum, (&factor, &p)| sum + p * factor)
    }

    /// Adds `weight` times a component of an end derivative to a condition: to its terms where
    /// points may move. The value it has for the original points goes to the other side.
    pub(super) fn add(
        &self,
        condition: &mut Condition,
        curve: usize,
        row: &[f64],
        weight: Point<D>,
    ) {
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
    pub(super) fn linked(&self, left: usize, link: Link) -> Vec<Condition> {
        let right = left + 1;
        let mut conditions = Vec::new();
        for k in 0..=self.smoothness.order() {
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

    /// The conditions that the curves meet.
    pub(super) fn meeting(&self, left: usize) -> Vec<Condition> {
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
    pub(super) fn bend(
        &self,
        left: usize,
        normal: Point<D>,
        tangent: Point<D>,
        ratio: f64,
    ) -> Condition {
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
}
