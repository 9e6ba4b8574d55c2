//! How smoothly segments join, measured joint by joint.

use super::bezier_form::difference;
use super::curve::{Composite, Piecewise};
use super::error::Error;
use super::knots::Breaks;
use super::limits;
use super::point::{Point, is_safe, larger, magnitude};
use super::work::{self, Pace};

/// The smoothness of a joint, from least to most. `G` compares shapes, `C` compares derivatives with
/// respect to the parameter; a `C1` joint may well be `G2`, so the order is a convention: the highest class met is named.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Class {
    /// The segments do not meet.
    Discontinuous,
    /// They meet.
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

impl Class {
    /// The usual name.
    pub fn name(self) -> &'static str {
        match self {
            Class::Discontinuous => "discontinuous",
            Class::C0 => "C0",
            Class::G1 => "G1",
            Class::C1 => "C1",
            Class::G2 => "G2",
            Class::C2 => "C2",
        }
    }
}

/// What counts as agreement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tolerance {
    /// Relative: a jump of a derivative counts from this fraction of the derivative's largest value on the two segments, a gap from
    /// this fraction of their extent. Rounding errors are allowed besides.
    pub relative: f64,
    /// A gap that is allowed besides, in the unit of the coordinates.
    pub gap: f64,
}

impl Default for Tolerance {
    fn default() -> Self {
        Tolerance { relative: limits::CONTINUITY_TOLERANCE, gap: 0.0 }
    }
}

/// What was measured at one joint.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Joint {
    /// The parameter of the joint.
    pub parameter: f64,
    /// The highest class met.
    pub class: Class,
    /// The highest of discontinuous, C0, C1, C2 met.
    pub parametric: Class,
    /// G1 or G2 where met, else C0 or discontinuous.
    pub geometric: Class,
    /// The distance between the two ends.
    pub position_gap: f64,
    /// The angle between the tangents in radians; none where a speed vanishes.
    pub tangent_angle: Option<f64>,
    /// The length of the difference of the first derivatives.
    pub first_derivative_jump: f64,
    /// The length of the difference of the second derivatives.
    pub second_derivative_jump: f64,
    /// The length of the difference of the curvature vectors; none where a speed vanishes.
    pub curvature_jump: Option<f64>,
}

/// The joints of a curve, with the class that all of them meet.
#[derive(Debug, Clone, PartialEq)]
pub struct Report {
    /// The lowest class of any joint; C2 for a curve without joints.
    pub class: Class,
    /// Every joint in order; for a closed curve the last is the seam, at the end parameter.
    pub joints: Vec<Joint>,
    /// The tolerance used.
    pub tolerance: Tolerance,
}

impl Report {
    /// The largest value of each measure over all joints with the lowest classes; none without joints.
    pub fn worst(&self) -> Option<Joint> {
        let larger = |a: Option<f64>, b: Option<f64>| a.into_iter().chain(b).reduce(f64::max);
        self.joints.iter().copied().reduce(|a, b| Joint {
            parameter: a.parameter,
            class: a.class.min(b.class),
            parametric: a.parametric.min(b.parametric),
            geometric: a.geometric.min(b.geometric),
            position_gap: a.position_gap.max(b.position_gap),
            tangent_angle: larger(a.tangent_angle, b.tangent_angle),
            first_derivative_jump: a.first_derivative_jump.max(b.first_derivative_jump),
            second_derivative_jump: a.second_derivative_jump.max(b.second_derivative_jump),
            curvature_jump: larger(a.curvature_jump, b.curvature_jump),
        })
    }
}

/// One order of derivative over one segment.
#[derive(Debug, Clone, Copy)]
struct Order<const D: usize> {
    first: Point<D>,
    last: Point<D>,
    /// The largest value of its control vectors, of the points their extent: what a relative tolerance refers to.
    scale: f64,
    /// The rounding error that comes from the Bezier points, in roundings.
    of_points: f64,
    /// The relative one that comes from the length of the interval, the difference of two rounded knots, in roundings.
    of_length: f64,
}

impl<const D: usize> Order<D> {
    /// The points themselves.
    fn of_points(points: &[Point<D>], magnitude: f64) -> Self {
        let (first, last) = (points[0], points[points.len() - 1]);
        Order { first, last, scale: extent(points), of_points: magnitude, of_length: 0.0 }
    }

    /// Derivative `k` of a segment of a degree whose points have this magnitude; its control vectors are still to be added.
    fn new(k: usize, magnitude: f64, degree: usize, (a, b): (f64, f64)) -> Self {
        let of_length = k as f64 * (a.abs().max(b.abs()) / (b - a));
        let of_points = derivative_size(magnitude, degree, k, b - a);
        Order { first: Point::ZERO, last: Point::ZERO, scale: 0.0, of_points, of_length }
    }

    fn add(&mut self, i: usize, vector: Point<D>) {
        if i == 0 {
            self.first = vector;
        }
        self.last = vector;
        self.scale = larger(self.scale, vector.max_abs());
    }

    fn rounding(&self, scale: f64) -> f64 {
        64.0 * f64::EPSILON * (self.of_points + scale * self.of_length)
    }
}

/// One order of derivative on both sides of a joint.
struct Sides<const D: usize> {
    left: Point<D>,
    right: Point<D>,
    jump: f64,
    /// The larger of the scales.
    scale: f64,
    /// What rounding alone may make of the jump.
    rounding: f64,
}

impl<const D: usize> Sides<D> {
    fn new(before: &Order<D>, after: &Order<D>) -> Self {
        let (left, right, scale) = (before.last, after.first, before.scale.max(after.scale));
        Sides { left, right, jump: left.distance(right), scale, rounding: before.rounding(scale).max(after.rounding(scale)) }
    }

    fn allowed(&self, tolerance: f64) -> f64 {
        tolerance * self.scale + self.rounding
    }

    fn agree(&self, tolerance: f64) -> bool {
        // An allowance that overflows says nothing; ends that coincide agree whatever their scale.
        let allowed = self.allowed(tolerance);
        self.jump == 0.0 || (allowed.is_finite() && self.jump <= allowed)
    }
}

/// `size d! / (d - k)! (2 / length)^k`: how large a `k`-th derivative can be for points of this size. Rounding
/// errors of derivatives are measured in it. Overflows only where its value does.
#[inline]
pub(crate) fn derivative_size(size: f64, degree: usize, k: usize, length: f64) -> f64 {
    (0..k).fold(size, |size, i| size * degree.saturating_sub(i) as f64 * 2.0 / length)
}

/// The largest distance of a point from the first one.
fn extent<const D: usize>(points: &[Point<D>]) -> f64 {
    let squares = points.iter().map(|&p| (p - points[0]).dot(p - points[0]));
    let largest = squares.fold(0.0, larger);
    if is_safe(largest) { largest.sqrt() } else { points.iter().map(|p| p.distance(points[0])).fold(0.0, f64::max) }
}

/// Points and the first two derivatives of one segment.
fn orders<const D: usize>(points: &[Point<D>], interval: (f64, f64)) -> [Order<D>; 3] {
    let (degree, length) = (points.len() - 1, interval.1 - interval.0);
    let size = magnitude(points);
    let [mut first, mut second] = [1, 2].map(|k| Order::new(k, size, degree, interval));
    let mut before = Point::ZERO;
    for (i, q) in points.windows(2).enumerate() {
        let vector = difference(q[0], q[1], degree, length);
        first.add(i, vector);
        if i > 0 {
            second.add(i - 1, difference(before, vector, degree - 1, length));
        }
        before = vector;
    }
    [Order::of_points(points, size), first, second]
}

/// The pairs of segments that meet, with the parameter where they do; with the seam of a closed curve at the end.
fn joints(breaks: &Breaks, closed: bool) -> impl Iterator<Item = (usize, usize, f64)> {
    let (knots, count) = (breaks.as_slice(), breaks.segments());
    let inner = (1..count).map(|i| (i - 1, i, knots[i]));
    inner.chain(closed.then(|| (count - 1, 0, knots[count])))
}

/// Measures every joint. O(segments).
///
/// # Errors
/// [`Fault::Cancelled`](super::error::Fault).
pub fn continuity<const D: usize>(composite: &Composite<D>, closed: bool, tolerance: Tolerance) -> Result<Report, Error> {
    measured(composite.breaks(), |i| composite.segment(i), closed, tolerance)
}

/// The same of a piecewise curve, without a copy of its points where they are Bezier points.
pub(crate) fn piecewise_continuity<const D: usize>(curve: &Piecewise<D>, tolerance: Tolerance) -> Result<Report, Error> {
    if curve.bases().are_identity() {
        return measured(curve.breaks(), |i| curve.polygon(i), curve.closed(), tolerance);
    }
    continuity(&curve.composite()?, curve.closed(), tolerance)
}

fn measured<'a, const D: usize>(
    breaks: &Breaks,
    segment: impl Fn(usize) -> &'a [Point<D>],
    closed: bool,
    tolerance: Tolerance,
) -> Result<Report, Error> {
    let orders = |i: usize| orders(segment(i), breaks.interval(i));
    let first = orders(0);
    let mut before = first;
    let measure = |(_, right, parameter)| {
        let after = if right == 0 { first } else { orders(right) };
        let left = std::mem::replace(&mut before, after);
        measure(&left, &after, parameter, tolerance)
    };
    let joints = work::collect(joints(breaks, closed).map(measure))?;
    let class = joints.iter().map(|joint| joint.class).min().unwrap_or(Class::C2);
    Ok(Report { class, joints, tolerance })
}

/// The number of derivatives that agree at every joint, from none (-1: not even the points) to the degree.
pub(crate) fn parametric_orders<const D: usize>(composite: &Composite<D>, closed: bool, tolerance: f64) -> Result<Vec<(f64, i32)>, Error> {
    let joints: Vec<_> = joints(composite.breaks(), closed).collect();
    let mut found: Vec<_> = joints.iter().map(|&(_, _, parameter)| (parameter, -1)).collect();
    let mut smooth: Vec<usize> = (0..joints.len()).collect();
    let mut derivative = None;
    let mut pace = Pace::default();
    for order in 0..=composite.degree() {
        let mut smoother = Vec::with_capacity(smooth.len());
        let vectors = derivative.as_ref().unwrap_or(composite);
        let over = |segment: usize| {
            let size = magnitude(composite.segment(segment));
            if order == 0 {
                return Order::of_points(composite.segment(segment), size);
            }
            let mut over = Order::new(order, size, composite.degree(), composite.breaks().interval(segment));
            vectors.segment(segment).iter().enumerate().for_each(|(i, &vector)| over.add(i, vector));
            over
        };
        for joint in smooth {
            pace.step()?;
            if Sides::new(&over(joints[joint].0), &over(joints[joint].1)).agree(tolerance) {
                found[joint].1 = order as i32;
                smoother.push(joint);
            }
        }
        if smoother.is_empty() {
            break;
        }
        smooth = smoother;
        // One derivative at a time: all of them together can be gigabytes.
        derivative = Some(vectors.derivative()?);
    }
    Ok(found)
}

fn measure<const D: usize>(before: &[Order<D>; 3], after: &[Order<D>; 3], parameter: f64, tolerance: Tolerance) -> Joint {
    let [position, first, second] = [0, 1, 2].map(|k| Sides::new(&before[k], &after[k]));
    let shape = shape(&first, &second, tolerance.relative);
    let meets = position.jump <= position.allowed(tolerance.relative) + tolerance.gap;
    let c1 = meets && first.agree(tolerance.relative);
    let parametric = match () {
        () if c1 && second.agree(tolerance.relative) => Class::C2,
        () if c1 => Class::C1,
        () if meets => Class::C0,
        () => Class::Discontinuous,
    };
    let geometric = match &shape {
        _ if !meets => Class::Discontinuous,
        Some(shape) if shape.g1 && shape.g2 => Class::G2,
        Some(shape) if shape.g1 => Class::G1,
        _ => Class::C0,
    };
    Joint {
        parameter,
        class: parametric.max(geometric),
        parametric,
        geometric,
        position_gap: position.jump,
        tangent_angle: shape.as_ref().map(|s| s.angle),
        first_derivative_jump: first.jump,
        second_derivative_jump: second.jump,
        curvature_jump: shape.as_ref().map(|s| s.curvature_jump),
    }
}

/// What does not depend on the parameterization.
struct Shape {
    angle: f64,
    curvature_jump: f64,
    g1: bool,
    g2: bool,
}

/// Compares tangents and curvature vectors; none where a speed vanishes within rounding.
fn shape<const D: usize>(first: &Sides<D>, second: &Sides<D>, tolerance: f64) -> Option<Shape> {
    // The reciprocal of a speed; where that overflows, the speed has no digits left.
    let (left, right) = (1.0 / first.left.norm(), 1.0 / first.right.norm());
    let slowness = left.max(right);
    if !slowness.is_finite() || 1.0 <= first.rounding * slowness {
        return None;
    }
    let curvature = |slowness: f64, tangent: Point<D>, acceleration: Point<D>| {
        let normal = acceleration - tangent * tangent.dot(acceleration);
        normal * slowness * slowness
    };
    let tangents = (first.left * left, first.right * right);
    let turn = tangents.0.distance(tangents.1);
    let jump = curvature(left, tangents.0, second.left).distance(curvature(right, tangents.1, second.right));
    // A tangent turned by a rounding error turns the curvature vector with it.
    let allowed = (second.allowed(tolerance) + second.scale * (first.rounding * slowness)) * slowness * slowness;
    Some(Shape {
        angle: 2.0 * (0.5 * turn).min(1.0).asin(),
        curvature_jump: jump,
        g1: turn <= tolerance + first.rounding * slowness,
        g2: jump <= allowed,
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn classes(knots: &[f64], segments: &[Vec<Point<2>>]) -> Joint {
        let composite = Composite::from_segments(Breaks::new(knots.to_vec()).unwrap(), segments.iter().map(Vec::as_slice)).unwrap();
        continuity(&composite, false, Tolerance::default()).unwrap().joints[0]
    }

    fn line(points: &[[f64; 2]]) -> Vec<Point<2>> {
        points.iter().map(|&p| Point(p)).collect()
    }

    #[test]
    fn a_change_of_speed_along_a_line_is_geometric_only() {
        let joint = classes(&[0.0, 1.0, 2.0], &[line(&[[0.0, 0.0], [1.0, 0.0]]), line(&[[1.0, 0.0], [3.0, 0.0]])]);
        assert_eq!((joint.class, joint.parametric, joint.geometric), (Class::G2, Class::C0, Class::G2));
        assert_eq!(joint.first_derivative_jump, 1.0);
    }

    #[test]
    fn a_corner_is_c0_with_its_angle() {
        let joint = classes(&[0.0, 1.0, 2.0], &[line(&[[0.0, 0.0], [1.0, 0.0]]), line(&[[1.0, 0.0], [1.0, 1.0]])]);
        assert_eq!(joint.class, Class::C0);
        assert!((joint.tangent_angle.unwrap() - std::f64::consts::FRAC_PI_2).abs() < 1e-15);
    }

    #[test]
    fn a_split_cubic_is_c2_however_short_a_piece() {
        let cubic = line(&[[1e3, 0.0], [1e3 + 1.0, 3.0], [1e3 + 4.0, 3.0], [1e3 + 5.0, -1.0]]);
        for u in [0.5, 1e-3, 1e-5] {
            let (left, right) = crate::core::bezier_form::split(&cubic, u);
            assert_eq!(classes(&[0.0, u, 1.0], &[left, right]).class, Class::C2, "u = {u}");
        }
    }

    #[test]
    fn a_jump_of_the_second_derivative_is_c1_however_short_a_piece() {
        // The same end and tangent, another curvature.
        for h in [1.0, 1e-6] {
            let left = line(&[[0.0, 0.0], [0.5, 0.0], [1.0, 0.0]]);
            let right = line(&[[1.0, 0.0], [1.0 + 0.5 * h, 0.0], [1.0 + h, 0.3 * h * h]]);
            let joint = classes(&[0.0, 1.0, 1.0 + h], &[left, right]);
            assert_eq!((joint.class, joint.geometric), (Class::C1, Class::G1), "h = {h}");
        }
    }

    #[test]
    fn every_joint_is_between_its_own_neighbours() {
        let segments: Vec<_> = (0..5).map(f64::from).map(|x| line(&[[x, 0.0], [x + 0.5, x * x], [x + 1.0, 0.1 * x]])).collect();
        let composite = |knots: &[f64], of: &[usize]| {
            let points = of.iter().flat_map(|&i| segments[i].clone()).collect();
            Composite::from_flat(Breaks::new(knots.to_vec()).unwrap(), 2, points)
        };
        let knots = [0.0, 1.0, 3.0, 3.5, 5.0, 5.25];
        let joints = continuity(&composite(&knots, &[0, 1, 2, 3, 4]), true, Tolerance::default()).unwrap().joints;
        assert_eq!(joints.len(), 5);
        for i in 0..4 {
            let alone = continuity(&composite(&knots[i..i + 3], &[i, i + 1]), false, Tolerance::default()).unwrap().joints[0];
            assert_eq!(joints[i], alone);
        }
        let seam = continuity(&composite(&[5.0, 5.25, 6.25], &[4, 0]), false, Tolerance::default()).unwrap().joints[0];
        assert_eq!(joints[4], seam);
    }

    #[test]
    fn a_cusp_has_no_tangent() {
        let left = line(&[[0.0, 0.0], [1.0, 1.0], [1.0, 1.0]]);
        let right = line(&[[1.0, 1.0], [1.0, 1.0], [2.0, 0.0]]);
        let joint = classes(&[0.0, 1.0, 2.0], &[left, right]);
        assert_eq!((joint.tangent_angle, joint.class), (None, Class::C1));
    }
}
