use super::*;
use crate::core::basis::{Basis, Bezier};
use crate::core::curve::{Bases, Piecewise, Single};
use crate::core::knots::Breaks;

const TOLERANCE: f64 = 1e-9;

fn pieces(order: usize, joints: &[f64], points: &[[f64; 2]]) -> Curve<2> {
    let context = Context::default();
    let breaks = Breaks::new(&context, joints.to_vec()).unwrap();
    let bases = Bases::Common(Basis::Bezier(Bezier));
    let points = points.iter().map(|&p| Point(p)).collect();
    Curve::Piecewise(Piecewise::new(&context, bases, order, breaks, false, points).unwrap())
}

fn converted(curve: &Curve<2>, style: KnotStyle) -> Conversion<BSpline<2>> {
    to_bspline(&Context::default(), curve, style, TOLERANCE).unwrap()
}

/// The halves of the cubic with control points (0, 0), (8, 16), (16, -8), (24, 8).
#[test]
fn the_halves_of_a_cubic_are_the_cubic_again() {
    let left = [[0.0, 0.0], [4.0, 8.0], [8.0, 6.0], [12.0, 4.0]];
    let right = [[16.0, 2.0], [20.0, 0.0], [24.0, 8.0]];
    let halves = pieces(3, &[0.0, 0.5, 1.0], &[&left[..], &right[..]].concat());
    let found = converted(&halves, KnotStyle::Clamped);
    assert_eq!(found.curve.knots().as_slice(), [0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0]);
    let cubic = [[0.0, 0.0], [8.0, 16.0], [16.0, -8.0], [24.0, 8.0]].map(Point);
    assert_eq!(found.curve.control_points(), cubic);
    assert_eq!(found.joints, [FormerJoint { parameter: 0.5, continuity: 3, multiplicity: 0 }]);
}

/// `y = t^2`, and from 1 on its tangent.
#[test]
fn a_jump_of_the_second_derivative_is_a_simple_knot() {
    let curve = [[0.0, 0.0], [0.5, 0.0], [1.0, 1.0], [1.5, 2.0], [2.0, 3.0]];
    let found = converted(&pieces(2, &[0.0, 1.0, 2.0], &curve), KnotStyle::Clamped);
    assert_eq!(found.curve.knots().as_slice(), [0.0, 0.0, 0.0, 1.0, 2.0, 2.0, 2.0]);
    let expected = [[0.0, 0.0], [0.5, 0.0], [1.5, 2.0], [2.0, 3.0]].map(Point);
    assert_eq!(found.curve.control_points(), expected);
    assert_eq!(found.joints, [FormerJoint { parameter: 1.0, continuity: 1, multiplicity: 1 }]);
}

/// The blossom of `t^3` is the product of its arguments, that of `t` their mean.
#[test]
fn uniform_control_points_are_values_of_the_blossom() {
    let thirds = [[0.0, 0.0], [1.0 / 3.0, 0.0], [2.0 / 3.0, 0.0], [1.0, 1.0]].map(Point);
    let basis = Basis::Bezier(Bezier);
    let cubic = Curve::Single(Single::new(&Context::default(), basis, thirds.to_vec()).unwrap());
    let found = converted(&cubic, KnotStyle::Uniform);
    assert_eq!(found.curve.knots().as_slice(), [-3.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0, 4.0]);
    let expected = [[-1.0, 0.0], [0.0, 0.0], [1.0, 0.0], [2.0, 6.0]].map(Point);
    assert_eq!(found.curve.control_points(), expected);
}

#[test]
fn a_refused_conversion_is_placed() {
    let line = pieces(1, &[0.0, 1.0, 4.0], &[[0.0, 0.0], [1.0, 0.0], [4.0, 0.0]]);
    let place = |style, tolerance| {
        let found = to_bspline(&Context::default(), &line, style, tolerance);
        found.unwrap_err().place.to_string()
    };
    assert_eq!(place(KnotStyle::Clamped, 0.0), "/tolerance");
    assert_eq!(place(KnotStyle::Periodic, TOLERANCE), "/knots");
    assert_eq!(place(KnotStyle::Uniform, TOLERANCE), "/knots");
}
