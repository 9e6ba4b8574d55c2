//! How smoothly segments join, measured joint by joint.

use super::curve::{Composite, Piecewise, Segment};
use super::error::Error;
use super::gaps::{FEW, Gaps, Group, Order, orders, spline_orders};
use super::knots::Breaks;
use super::limits;
use super::point::Point;
use super::smoothness::Smoothness;
use crate::core::context::Context;
use crate::core::linear::lanes::LANES;

/// What counts as agreement.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Tolerance {
    /// Relative: a jump of a derivative counts from this fraction of the derivative's largest value
    /// on the two segments, a gap from this fraction of their extent. Rounding errors are allowed
    /// besides.
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
    pub class: Smoothness,
    /// The highest of discontinuous, C0, C1, C2 met.
    pub parametric: Smoothness,
    /// G1 or G2 where met, else C0 or discontinuous.
    pub geometric: Smoothness,
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
    pub class: Smoothness,
    /// Every joint in order; for a closed curve the last is the seam, at the end parameter.
    pub joints: Vec<Joint>,
    /// The tolerance used.
    pub tolerance: Tolerance,
}

impl Report {
    /// The largest value of each measure over all joints with the lowest classes; none without
    /// joints.
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

/// Measures every joint. O(segments).
///
/// # Errors
/// [`Fault::Cancelled`](super::fault::Fault).
pub fn continuity<const D: usize>(
    context: &Context,
    composite: &Composite<D>,
    closed: bool,
    tolerance: Tolerance,
) -> Result<Report, Error> {
    let breaks = composite.breaks();
    if !composite.is_spline() {
        return measured(
            context,
            breaks,
            |i| orders(composite.local(i), breaks.interval(i)),
            closed,
            tolerance,
        );
    }
    let first = composite.derivative(context)?;
    let second = first.derivative(context)?;
    let gains = [composite.gains(1), composite.gains(2)];
    let orders = |i: usize| {
        let derivatives = [first.local(i), second.local(i)];
        spline_orders(
            composite.local(i),
            derivatives,
            [gains[0][i], gains[1][i]],
            breaks.interval(i),
        )
    };
    measured(context, breaks, orders, closed, tolerance)
}

/// The same of a piecewise curve, without a copy of its points where they are Bezier points.
pub(crate) fn piecewise_continuity<const D: usize>(
    context: &Context,
    curve: &Piecewise<D>,
    tolerance: Tolerance,
) -> Result<Report, Error> {
    if curve.bases().are_identity() {
        // Differences of given points are as exact as those from an origin.
        let segment = |i| Segment { origin: Point::ZERO, points: curve.polygon(i) };
        return measured(
            context,
            curve.breaks(),
            |i| orders(segment(i), curve.breaks().interval(i)),
            curve.closed(),
            tolerance,
        );
    }
    continuity(context, &curve.composite(context)?, curve.closed(), tolerance)
}

/// Compares the ends of neighbours.
pub(crate) fn measured<const D: usize>(
    context: &Context,
    breaks: &Breaks,
    orders: impl Fn(usize) -> [Order<D>; 3],
    closed: bool,
    tolerance: Tolerance,
) -> Result<Report, Error> {
    let (knots, count) = (breaks.as_slice(), breaks.segments());
    let mut joints = Vec::with_capacity(count);
    let mut add =
        |parameter: &f64, gaps: Gaps| joints.push(Joint::new(*parameter, &gaps, tolerance));
    if count <= FEW {
        let segments: Vec<_> = (0..count).map(&orders).collect();
        let pairs = segments.windows(2).zip(&knots[1..]);
        pairs.for_each(|(pair, knot)| {
            add(knot, Gaps::new(&pair[0], &pair[1], tolerance.relative, Point::norm))
        });
    } else {
        let mut group = Group::new();
        for first in (1..count).step_by(LANES) {
            context.checkpoint()?;
            let inner = &knots[first..count.min(first + LANES)];
            (0..=inner.len()).for_each(|l| group.put(l, &orders(first - 1 + l)));
            inner
                .iter()
                .zip(group.gaps(inner.len(), tolerance.relative))
                .for_each(|(knot, gaps)| add(knot, gaps));
        }
    }
    if closed {
        let seam = Gaps::new(&orders(count - 1), &orders(0), tolerance.relative, Point::norm);
        joints.push(Joint::new(knots[count], &seam, tolerance));
    }
    let class = joints.iter().map(|joint| joint.class).min().unwrap_or(Smoothness::C2);
    Ok(Report { class, joints, tolerance })
}

impl Joint {
    /// What the gaps make of a joint.
    fn new(parameter: f64, gaps: &Gaps, tolerance: Tolerance) -> Self {
        let meets = gaps.position.size <= gaps.position.allowed + tolerance.gap;
        let c1 = meets && gaps.first.is_closed();
        let parametric = match () {
            () if c1 && gaps.second.is_closed() => Smoothness::C2,
            () if c1 => Smoothness::C1,
            () if meets => Smoothness::C0,
            () => Smoothness::Discontinuous,
        };
        let [turn, bend] =
            [gaps.tangent, gaps.curvature].map(|gap| gaps.have_tangents().then_some(gap));
        let g1 = turn.is_some_and(|turn| turn.size <= turn.allowed);
        let geometric = match () {
            () if !meets => Smoothness::Discontinuous,
            () if g1 && bend.is_some_and(|bend| bend.size <= bend.allowed) => Smoothness::G2,
            () if g1 => Smoothness::G1,
            () => Smoothness::C0,
        };
        Joint {
            parameter,
            class: parametric.max(geometric),
            parametric,
            geometric,
            position_gap: gaps.position.size,
            tangent_angle: turn.map(|turn| 2.0 * (0.5 * turn.size).min(1.0).asin()),
            first_derivative_jump: gaps.first.size,
            second_derivative_jump: gaps.second.size,
            curvature_jump: bend.map(|bend| bend.size),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn classes(knots: &[f64], segments: &[Vec<Point<2>>]) -> Joint {
        let segments = segments.iter().map(|points| Segment { origin: Point::ZERO, points });
        let composite = Composite::from_segments(
            &Context::default(),
            Breaks::new(&Context::default(), knots.to_vec()).unwrap(),
            segments,
        )
        .unwrap();
        continuity(&Context::default(), &composite, false, Tolerance::default()).unwrap().joints[0]
    }

    fn line(points: &[[f64; 2]]) -> Vec<Point<2>> {
        points.iter().map(|&p| Point(p)).collect()
    }

    #[test]
    fn a_change_of_speed_along_a_line_is_geometric_only() {
        let joint = classes(
            &[0.0, 1.0, 2.0],
            &[line(&[[0.0, 0.0], [1.0, 0.0]]), line(&[[1.0, 0.0], [3.0, 0.0]])],
        );
        assert_eq!(
            (joint.class, joint.parametric, joint.geometric),
            (Smoothness::G2, Smoothness::C0, Smoothness::G2)
        );
        assert_eq!(joint.first_derivative_jump, 1.0);
    }

    #[test]
    fn a_corner_is_c0_with_its_angle() {
        let joint = classes(
            &[0.0, 1.0, 2.0],
            &[line(&[[0.0, 0.0], [1.0, 0.0]]), line(&[[1.0, 0.0], [1.0, 1.0]])],
        );
        assert_eq!(joint.class, Smoothness::C0);
        assert!((joint.tangent_angle.unwrap() - std::f64::consts::FRAC_PI_2).abs() < 1e-15);
    }

    #[test]
    fn a_split_cubic_is_c2_however_short_a_piece() {
        let cubic = line(&[[1e3, 0.0], [1e3 + 1.0, 3.0], [1e3 + 4.0, 3.0], [1e3 + 5.0, -1.0]]);
        for u in [0.5, 1e-3, 1e-5] {
            let (left, right) = crate::core::bezier_form::split(&cubic, u);
            assert_eq!(classes(&[0.0, u, 1.0], &[left, right]).class, Smoothness::C2, "u = {u}");
        }
    }

    #[test]
    fn a_jump_of_the_second_derivative_is_c1_however_short_a_piece() {
        // The same end and tangent, another curvature.
        for h in [1.0, 1e-6] {
            let left = line(&[[0.0, 0.0], [0.5, 0.0], [1.0, 0.0]]);
            let right = line(&[[1.0, 0.0], [1.0 + 0.5 * h, 0.0], [1.0 + h, 0.3 * h * h]]);
            let joint = classes(&[0.0, 1.0, 1.0 + h], &[left, right]);
            assert_eq!((joint.class, joint.geometric), (Smoothness::C1, Smoothness::G1), "h = {h}");
        }
    }

    #[test]
    fn every_joint_is_between_its_own_neighbours() {
        let segments: Vec<_> = (0..5)
            .map(f64::from)
            .map(|x| line(&[[x, 0.0], [x + 0.5, x * x], [x + 1.0, 0.1 * x]]))
            .collect();
        let composite = |knots: &[f64], of: &[usize]| {
            let points = of.iter().flat_map(|&i| segments[i].clone()).collect();
            Composite::from_flat(
                Breaks::new(&Context::default(), knots.to_vec()).unwrap(),
                2,
                points,
            )
        };
        let knots = [0.0, 1.0, 3.0, 3.5, 5.0, 5.25];
        let joints = continuity(
            &Context::default(),
            &composite(&knots, &[0, 1, 2, 3, 4]),
            true,
            Tolerance::default(),
        )
        .unwrap()
        .joints;
        assert_eq!(joints.len(), 5);
        for i in 0..4 {
            let alone = continuity(
                &Context::default(),
                &composite(&knots[i..i + 3], &[i, i + 1]),
                false,
                Tolerance::default(),
            )
            .unwrap()
            .joints[0];
            assert_eq!(joints[i], alone);
        }
        let seam = continuity(
            &Context::default(),
            &composite(&[5.0, 5.25, 6.25], &[4, 0]),
            false,
            Tolerance::default(),
        )
        .unwrap()
        .joints[0];
        assert_eq!(joints[4], seam);
    }

    #[test]
    fn a_cusp_has_no_tangent() {
        let left = line(&[[0.0, 0.0], [1.0, 1.0], [1.0, 1.0]]);
        let right = line(&[[1.0, 1.0], [1.0, 1.0], [2.0, 0.0]]);
        let joint = classes(&[0.0, 1.0, 2.0], &[left, right]);
        assert_eq!((joint.tangent_angle, joint.class), (None, Smoothness::C1));
    }
}
