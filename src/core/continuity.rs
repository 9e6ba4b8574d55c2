//! How smoothly segments join, measured joint by joint.

use super::curve::Composite;
use super::error::Error;
use super::limits;
use super::point::{Point, magnitude};
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

/// A composite and one of its derivatives, to compare neighbouring ends.
struct Jet<'a, const D: usize> {
    curve: &'a Composite<D>,
    order: usize,
    derivative: &'a Composite<D>,
}

/// One order of derivative on both sides of a joint.
struct Sides<const D: usize> {
    left: Point<D>,
    right: Point<D>,
    /// The largest value of this derivative's control vectors nearby: what a relative tolerance refers to.
    scale: f64,
    /// What rounding alone may make of the difference.
    rounding: f64,
}

impl<const D: usize> Sides<D> {
    fn jump(&self) -> f64 {
        self.left.distance(self.right)
    }

    fn allowed(&self, tolerance: f64) -> f64 {
        tolerance * self.scale + self.rounding
    }

    fn agree(&self, tolerance: f64) -> bool {
        // An allowance that overflows says nothing; ends that coincide agree whatever their scale.
        let (jump, allowed) = (self.jump(), self.allowed(tolerance));
        jump == 0.0 || (allowed.is_finite() && jump <= allowed)
    }
}

impl<const D: usize> Jet<'_, D> {
    /// The derivative at the end of segment `left` and at the start of segment `right`.
    fn sides(&self, left: usize, right: usize) -> Sides<D> {
        let (before, after) = (self.derivative.segment(left), self.derivative.segment(right));
        let scale = match self.order {
            0 => extent(before).max(extent(after)),
            _ => magnitude(before).max(magnitude(after)),
        };
        let rounding = self.rounding(left, scale).max(self.rounding(right, scale));
        Sides { left: before[before.len() - 1], right: after[0], scale, rounding }
    }

    /// The rounding error of the derivative on one segment: that of its Bezier points, and that of
    /// the length of its interval, which is the difference of two rounded knots.
    fn rounding(&self, segment: usize, scale: f64) -> f64 {
        let (curve, k) = (self.curve, self.order);
        let (a, b) = curve.breaks().interval(segment);
        let of_points = derivative_size(magnitude(curve.segment(segment)), curve.degree(), k, b - a);
        let of_length = k as f64 * scale * (a.abs().max(b.abs()) / (b - a));
        64.0 * f64::EPSILON * (of_points + of_length)
    }
}

/// `size d! / (d - k)! (2 / length)^k`: how large a `k`-th derivative can be for points of this size. Rounding
/// errors of derivatives are measured in it. Overflows only where its value does.
pub(crate) fn derivative_size(size: f64, degree: usize, k: usize, length: f64) -> f64 {
    (0..k).fold(size, |size, i| size * degree.saturating_sub(i) as f64 * 2.0 / length)
}

/// The largest distance of a point from the first one.
fn extent<const D: usize>(points: &[Point<D>]) -> f64 {
    points.iter().map(|p| p.distance(points[0])).fold(0.0, f64::max)
}

/// The pairs of segments that meet, with the parameter where they do; with the seam of a closed curve at the end.
fn joints<const D: usize>(composite: &Composite<D>, closed: bool) -> impl Iterator<Item = (usize, usize, f64)> {
    let knots = composite.breaks().as_slice();
    let count = composite.breaks().segments();
    let inner = (1..count).map(|i| (i - 1, i, knots[i]));
    inner.chain(closed.then(|| (count - 1, 0, knots[count])))
}

/// Measures every joint. O(segments).
///
/// # Errors
/// [`Fault::Cancelled`](super::error::Fault).
pub fn continuity<const D: usize>(composite: &Composite<D>, closed: bool, tolerance: Tolerance) -> Result<Report, Error> {
    let first = composite.derivative()?;
    let second = first.derivative()?;
    let jet = |order, derivative| Jet { curve: composite, order, derivative };
    let jets = [jet(0, composite), jet(1, &first), jet(2, &second)];
    let measure = |(left, right, parameter)| measure(&jets, left, right, parameter, tolerance);
    let joints = work::collect(joints(composite, closed).map(measure))?;
    let class = joints.iter().map(|joint| joint.class).min().unwrap_or(Class::C2);
    Ok(Report { class, joints, tolerance })
}

/// The number of derivatives that agree at every joint, from none (-1: not even the points) to the degree.
pub(crate) fn parametric_orders<const D: usize>(composite: &Composite<D>, closed: bool, tolerance: f64) -> Result<Vec<(f64, i32)>, Error> {
    let joints: Vec<_> = joints(composite, closed).collect();
    let mut found: Vec<_> = joints.iter().map(|&(_, _, parameter)| (parameter, -1)).collect();
    let mut smooth: Vec<usize> = (0..joints.len()).collect();
    let mut derivative = None;
    let mut pace = Pace::default();
    for order in 0..=composite.degree() {
        let mut smoother = Vec::with_capacity(smooth.len());
        let jet = Jet { curve: composite, order, derivative: derivative.as_ref().unwrap_or(composite) };
        for joint in smooth {
            pace.step()?;
            if jet.sides(joints[joint].0, joints[joint].1).agree(tolerance) {
                found[joint].1 = order as i32;
                smoother.push(joint);
            }
        }
        if smoother.is_empty() {
            break;
        }
        smooth = smoother;
        // One derivative at a time: all of them together can be gigabytes.
        derivative = Some(jet.derivative.derivative()?);
    }
    Ok(found)
}

fn measure<const D: usize>(jets: &[Jet<D>; 3], left: usize, right: usize, parameter: f64, tolerance: Tolerance) -> Joint {
    let [position, first, second] = jets.each_ref().map(|jet| jet.sides(left, right));
    let shape = shape(&first, &second, tolerance.relative);
    let meets = position.jump() <= position.allowed(tolerance.relative) + tolerance.gap;
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
        position_gap: position.jump(),
        tangent_angle: shape.as_ref().map(|s| s.angle),
        first_derivative_jump: first.jump(),
        second_derivative_jump: second.jump(),
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
    let slowest = first.left.norm().min(first.right.norm());
    if slowest <= first.rounding {
        return None;
    }
    let (left, right) = (first.left.unit()?, first.right.unit()?);
    let turn = left.distance(right);
    let curvature = |velocity: Point<D>, tangent: Point<D>, acceleration: Point<D>| {
        let normal = acceleration - tangent * tangent.dot(acceleration);
        let speed = velocity.norm();
        normal.map(|x| x / speed / speed)
    };
    let jump = curvature(first.left, left, second.left).distance(curvature(first.right, right, second.right));
    // A tangent turned by a rounding error turns the curvature vector with it.
    let allowed = (second.allowed(tolerance) + second.scale * (first.rounding / slowest)) / slowest / slowest;
    Some(Shape {
        angle: 2.0 * (0.5 * turn).min(1.0).asin(),
        curvature_jump: jump,
        g1: turn <= tolerance + first.rounding / slowest,
        g2: jump <= allowed,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::knots::Breaks;

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
    fn a_cusp_has_no_tangent() {
        let left = line(&[[0.0, 0.0], [1.0, 1.0], [1.0, 1.0]]);
        let right = line(&[[1.0, 1.0], [1.0, 1.0], [2.0, 0.0]]);
        let joint = classes(&[0.0, 1.0, 2.0], &[left, right]);
        assert_eq!((joint.tangent_angle, joint.class), (None, Class::C1));
    }
}
