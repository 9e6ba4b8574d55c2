//! What separates neighbouring segments where they meet, one joint at a time or many together.

use super::bezier_form::derivative_size;
use super::bezier_form::difference;
use super::curve::Segment;
use super::point::{Point, is_safe, larger};
use crate::core::linear::lanes::LANES;

/// One order of derivative over one segment.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Order<const D: usize> {
    first: Point<D>,
    last: Point<D>,
    /// The largest value of its control vectors, of the points their extent: what a relative
    /// tolerance refers to.
    scale: f64,
    /// The rounding error that comes from the Bezier points, in roundings.
    of_points: f64,
    /// The relative one that comes from the length of the interval, the difference of two rounded
    /// knots, in roundings.
    of_length: f64,
}

impl<const D: usize> Order<D> {
    /// The points themselves, with their largest coordinate.
    fn of_points(segment: Segment<D>, magnitude: f64) -> Self {
        Order {
            first: segment.first(),
            last: segment.last(),
            scale: extent(segment.points),
            of_points: magnitude,
            of_length: 0.0,
        }
    }

    /// Derivative `k` of a segment, as large as this for points of its size; its control vectors
    /// are still to be added.
    fn new(k: usize, size: f64, (a, b): (f64, f64)) -> Self {
        let of_length = k as f64 * (a.abs().max(b.abs()) / (b - a));
        Order { first: Point::ZERO, last: Point::ZERO, scale: 0.0, of_points: size, of_length }
    }

    /// From the values at both ends, the largest value and the rounding errors, all known.
    pub(crate) fn between(
        first: Point<D>,
        last: Point<D>,
        scale: f64,
        of_points: f64,
        of_length: f64,
    ) -> Self {
        Order { first, last, scale, of_points, of_length }
    }

    fn add(&mut self, i: usize, vector: Point<D>) {
        if i == 0 {
            self.first = vector;
        }
        self.last = vector;
        self.scale = larger(self.scale, vector.max_abs());
    }

    #[inline(always)]
    fn rounding(&self, scale: f64) -> f64 {
        64.0 * f64::EPSILON * (self.of_points + scale * self.of_length)
    }
}

/// One order of derivative on both sides of a joint.
pub(super) struct Sides<const D: usize> {
    left: Point<D>,
    right: Point<D>,
    jump: f64,
    /// The larger of the scales.
    scale: f64,
    /// What rounding alone may make of the jump.
    rounding: f64,
}

impl<const D: usize> Sides<D> {
    /// With the lengths of vectors as `norm` has them.
    #[inline(always)]
    pub(super) fn new(before: &Order<D>, after: &Order<D>, norm: impl Fn(Point<D>) -> f64) -> Self {
        let (left, right, scale) = (before.last, after.first, larger(before.scale, after.scale));
        Sides {
            left,
            right,
            jump: norm(left - right),
            scale,
            rounding: larger(before.rounding(scale), after.rounding(scale)),
        }
    }

    #[inline(always)]
    fn allowed(&self, tolerance: f64) -> f64 {
        tolerance * self.scale + self.rounding
    }

    #[inline(always)]
    pub(super) fn gap(&self, tolerance: f64) -> Gap {
        Gap { size: self.jump, allowed: self.allowed(tolerance) }
    }
}

/// How far apart two things are, and how far they may be.
#[derive(Debug, Clone, Copy)]
pub(super) struct Gap {
    pub(super) size: f64,
    pub(super) allowed: f64,
}

impl Gap {
    pub(super) fn is_closed(self) -> bool {
        // An allowance that overflows says nothing; ends that coincide agree whatever their scale.
        self.size == 0.0 || (self.allowed.is_finite() && self.size <= self.allowed)
    }
}

/// All that is measured at a joint, and nothing decided yet.
#[derive(Debug, Clone, Copy)]
pub(super) struct Gaps {
    pub(super) position: Gap,
    pub(super) first: Gap,
    pub(super) second: Gap,
    /// Between the unit tangents.
    pub(super) tangent: Gap,
    /// Between the curvature vectors.
    pub(super) curvature: Gap,
    /// The rounding error of the tangents.
    blur: f64,
}

impl Gaps {
    /// With the lengths of vectors as `norm` has them. Steps without branches, so that registers
    /// may take many joints at once.
    #[inline(always)]
    pub(super) fn new<const D: usize>(
        before: &[Order<D>; 3],
        after: &[Order<D>; 3],
        tolerance: f64,
        norm: impl Fn(Point<D>) -> f64 + Copy,
    ) -> Self {
        let sides = |k: usize| Sides::new(&before[k], &after[k], norm);
        let (position, first, second) = (sides(0), sides(1), sides(2));
        // The reciprocal of a speed; where that overflows, the speed has no digits left.
        let (left, right) = (1.0 / norm(first.left), 1.0 / norm(first.right));
        let slowness = larger(left, right);
        let curvature = |slowness: f64, tangent: Point<D>, acceleration: Point<D>| {
            acceleration.across(tangent) * slowness * slowness
        };
        let tangents = (first.left * left, first.right * right);
        let blur = first.rounding * slowness;
        // A tangent turned by a rounding error turns the curvature vector with it.
        let allowed = (second.allowed(tolerance) + second.scale * blur) * slowness * slowness;
        let bend =
            curvature(left, tangents.0, second.left) - curvature(right, tangents.1, second.right);
        Gaps {
            position: position.gap(tolerance),
            first: first.gap(tolerance),
            second: second.gap(tolerance),
            tangent: Gap { size: norm(tangents.0 - tangents.1), allowed: tolerance + blur },
            curvature: Gap { size: norm(bend), allowed },
            blur,
        }
    }

    /// Whether no speed vanishes within rounding.
    pub(super) fn have_tangents(&self) -> bool {
        self.blur < 1.0
    }

    /// Whether no length was beyond what is safely squared.
    fn are_numbers(&self) -> bool {
        let sizes = self.position.size
            + self.first.size
            + self.second.size
            + self.tangent.size
            + self.curvature.size;
        !sizes.is_nan()
    }
}

/// Neighbouring segments side by side, for wide registers.
pub(super) struct Group<const D: usize> {
    orders: [Columns<D>; 3],
    gaps: [[f64; LANES]; 11],
}

/// One order of derivative of many segments: each number of [`Order`] in an array of its own.
struct Columns<const D: usize> {
    first: [Column; D],
    last: [Column; D],
    scale: Column,
    of_points: Column,
    of_length: Column,
}

type Column = [f64; LANES + 1];

/// As many segments are faster one at a time.
pub(super) const FEW: usize = 24;

impl<const D: usize> Columns<D> {
    const ZERO: Self = Columns {
        first: [[0.0; LANES + 1]; D],
        last: [[0.0; LANES + 1]; D],
        scale: [0.0; LANES + 1],
        of_points: [0.0; LANES + 1],
        of_length: [0.0; LANES + 1],
    };

    fn put(&mut self, l: usize, order: &Order<D>) {
        (0..D).for_each(|k| (self.first[k][l], self.last[k][l]) = (order.first[k], order.last[k]));
        (self.scale[l], self.of_points[l], self.of_length[l]) =
            (order.scale, order.of_points, order.of_length);
    }

    #[inline(always)]
    fn get(&self, l: usize) -> Order<D> {
        Order {
            first: Point(std::array::from_fn(|k| self.first[k][l])),
            last: Point(std::array::from_fn(|k| self.last[k][l])),
            scale: self.scale[l],
            of_points: self.of_points[l],
            of_length: self.of_length[l],
        }
    }
}

impl<const D: usize> Group<D> {
    /// Room, to be used many times.
    pub(super) fn new() -> Self {
        Group { orders: [Columns::ZERO; 3], gaps: [[0.0; LANES]; 11] }
    }

    /// Segment `l` of the group, up to [`LANES`].
    pub(super) fn put(&mut self, l: usize, orders: &[Order<D>; 3]) {
        self.orders.iter_mut().zip(orders).for_each(|(columns, order)| columns.put(l, order));
    }

    #[inline(always)]
    fn get(&self, l: usize) -> [Order<D>; 3] {
        let [position, first, second] = &self.orders;
        [position.get(l), first.get(l), second.get(l)]
    }

    /// The gaps between the first segments and those after them, with the bits of one joint at a
    /// time.
    pub(super) fn gaps(&mut self, count: usize, tolerance: f64) -> impl Iterator<Item = Gaps> {
        fill(self, count.next_multiple_of(8), tolerance);
        (0..count).map(move |l| {
            let gaps = self.gaps_at(l);
            if gaps.are_numbers() {
                gaps
            } else {
                Gaps::new(&self.get(l), &self.get(l + 1), tolerance, Point::norm)
            }
        })
    }

    #[inline(always)]
    fn put_gaps(&mut self, l: usize, gaps: Gaps) {
        let Gaps { position, first, second, tangent, curvature, blur } = gaps;
        for (k, gap) in [position, first, second, tangent, curvature].into_iter().enumerate() {
            (self.gaps[2 * k][l], self.gaps[2 * k + 1][l]) = (gap.size, gap.allowed);
        }
        self.gaps[10][l] = blur;
    }

    fn gaps_at(&self, l: usize) -> Gaps {
        let gap = |k: usize| Gap { size: self.gaps[2 * k][l], allowed: self.gaps[2 * k + 1][l] };
        Gaps {
            position: gap(0),
            first: gap(1),
            second: gap(2),
            tangent: gap(3),
            curvature: gap(4),
            blur: self.gaps[10][l],
        }
    }
}

#[multiversion::multiversion(targets("x86_64+avx512f+avx512vl+avx512dq+avx512bw", "x86_64+avx2"))]
fn fill<const D: usize>(group: &mut Group<D>, count: usize, tolerance: f64) {
    for l in 0..count.min(LANES) {
        let gaps = Gaps::new(&group.get(l), &group.get(l + 1), tolerance, quick_norm);
        group.put_gaps(l, gaps);
    }
}

/// As [`Point::norm`] where squares are safe or zero; not a number elsewhere.
#[inline(always)]
fn quick_norm<const D: usize>(vector: Point<D>) -> f64 {
    let square = vector.dot(vector);
    let is_zero = vector.0.iter().fold(true, |zero, x| zero & (*x == 0.0));
    if is_safe(square) | is_zero { square.sqrt() } else { f64::NAN }
}

/// The largest distance of a point from the first one.
fn extent<const D: usize>(points: &[Point<D>]) -> f64 {
    let squares = points.iter().map(|&p| (p - points[0]).dot(p - points[0]));
    let largest = squares.fold(0.0, larger);
    if is_safe(largest) {
        largest.sqrt()
    } else {
        points.iter().map(|p| p.distance(points[0])).fold(0.0, f64::max)
    }
}

/// Points and the first two derivatives of one segment.
pub(super) fn orders<const D: usize>(segment: Segment<D>, interval: (f64, f64)) -> [Order<D>; 3] {
    let points = segment.points;
    let (degree, length) = (points.len() - 1, interval.1 - interval.0);
    let magnitude = magnitude_of(segment);
    let order = |k: usize| Order::new(k, derivative_size(magnitude, degree, k, length), interval);
    let (mut first, mut second) = (order(1), order(2));
    let mut before = Point::ZERO;
    for (i, q) in points.windows(2).enumerate() {
        let vector = difference(q[0], q[1], degree, length);
        first.add(i, vector);
        if i > 0 {
            second.add(i - 1, difference(before, vector, degree - 1, length));
        }
        before = vector;
    }
    [Order::of_points(segment, magnitude), first, second]
}

/// The same from the derivatives of a B-spline and their gains (see
/// [`Composite::gains`](super::curve::Composite::gains)).
pub(super) fn spline_orders<const D: usize>(
    segment: Segment<D>,
    derivatives: [Segment<D>; 2],
    gains: [f64; 2],
    interval: (f64, f64),
) -> [Order<D>; 3] {
    let magnitude = magnitude_of(segment);
    let order = |k: usize| {
        let mut order = Order::new(k, magnitude * gains[k - 1], interval);
        derivatives[k - 1].absolute().enumerate().for_each(|(i, vector)| order.add(i, vector));
        order
    };
    [Order::of_points(segment, magnitude), order(1), order(2)]
}

/// The largest absolute coordinate: client and service rounded the points in units of it.
fn magnitude_of<const D: usize>(segment: Segment<D>) -> f64 {
    segment.absolute().fold(0.0, |m, p| larger(m, p.max_abs()))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn many_joints_have_the_bits_of_each_alone() {
        let number = |i: usize| ((i as f64 * 12.9898).sin() * 43758.5453).fract();
        for size in [1.0, 1e-200, 1e200, 1e-320] {
            // Some neighbours meet, some stand still.
            let point =
                |i: usize| {
                    Point([0, 1, 2].map(|k| {
                        if i % 7 == k { 0.0 } else { size * number(3 * (i - i / 11) + k) }
                    }))
                };
            let segment = |i: usize| {
                let points = [0, 1, 2, 3].map(|k| point(3 * i + k));
                orders(Segment { origin: Point::ZERO, points: &points }, (i as f64, i as f64 + 1.0))
            };
            let segments: Vec<_> = (0..=LANES).map(segment).collect();
            for count in [1, 8, 9, LANES] {
                let mut group = Group::<3>::new();
                segments
                    .iter()
                    .take(count + 1)
                    .enumerate()
                    .for_each(|(l, orders)| group.put(l, orders));
                let together: Vec<_> = group.gaps(count, 1e-9).collect();
                assert_eq!(together.len(), count);
                for (l, gaps) in together.iter().enumerate() {
                    let alone = Gaps::new(&segments[l], &segments[l + 1], 1e-9, Point::norm);
                    assert_eq!(
                        format!("{gaps:?}"),
                        format!("{alone:?}"),
                        "joint {l} of {count}, size {size}"
                    );
                }
            }
        }
    }
}
