//! Laws of the C2 interpolant, on seeded random points.

use crate::laws::{any, apart, at, even, jets, law, size};
use proptest::collection::vec;
use proptest::prelude::*;
use springline::core::basis::{Basis, Bezier};
use springline::core::context::Context;
use springline::core::curve::{Bases, Curve};
use springline::core::interpolate::{End, EndConditions, Interpolant, interpolate};
use springline::core::limits::CONTINUITY_TOLERANCE;
use springline::core::parameterization::Parameterization;
use springline::core::point::{Point, magnitude};
use springline::core::smoothness::Smoothness;
use springline::core::to_bspline::{KnotStyle, to_bspline};

fn rule() -> impl Strategy<Value = Parameterization> {
    prop_oneof![
        Just(Parameterization::Uniform),
        Just(Parameterization::ChordLength),
        Just(Parameterization::Centripetal)
    ]
}

fn end() -> impl Strategy<Value = End<2>> {
    prop_oneof![Just(End::Natural), Just(End::NotAKnot), any::point().prop_map(End::Derivative)]
}

fn shape() -> impl Strategy<Value = EndConditions<2>> {
    prop_oneof![1 => Just(EndConditions::Closed), 2 => (end(), end()).prop_map(|(start, end)| EndConditions::Open(start, end))]
}

fn bases(segments: usize) -> impl Strategy<Value = Bases> {
    let each = vec(any::cubic_with_way_back(), segments).prop_map(Bases::PerSegment);
    prop_oneof![any::cubic_with_way_back().prop_map(Bases::Common), each]
}

fn bezier() -> Bases {
    Bases::Common(Basis::Bezier(Bezier))
}

fn through(
    points: &[Point<2>],
    shape: EndConditions<2>,
    rule: &Parameterization,
) -> Interpolant<2> {
    interpolate(&Context::default(), points, shape, bezier(), rule).unwrap()
}

/// Points, a shape, bases for it, and a rule.
fn problem() -> impl Strategy<Value = (Vec<Point<2>>, EndConditions<2>, Bases, Parameterization)> {
    (4usize..20, shape()).prop_flat_map(|(count, shape)| {
        let segments = count - usize::from(shape != EndConditions::Closed);
        (any::points(count), Just(shape), bases(segments), rule())
    })
}

#[test]
fn interpolants_pass_through_their_points_and_are_as_smooth_as_they_say() {
    law(150, problem(), |(points, shape, bases, rule)| {
        let result = interpolate(&Context::default(), &points, shape, bases, &rule).unwrap();
        let curve = Curve::Piecewise(result.curve.clone());
        let knots = result.curve.breaks().as_slice();
        assert!(apart(&at(&curve, &knots[..points.len()]), &points) <= 1e-14 * size(&curve));
        assert_eq!(result.continuity.class, Smoothness::C2, "{:?}", result.continuity.worst());
        assert_eq!(
            result.continuity.joints.len(),
            if shape == EndConditions::Closed { points.len() } else { points.len() - 2 }
        );
        assert_eq!(result.curve.closed(), shape == EndConditions::Closed);
    });
}

#[test]
fn joints_of_an_interpolant_agree_from_both_sides() {
    law(80, problem(), |(points, shape, bases, rule)| {
        let curve = interpolate(&Context::default(), &points, shape, bases, &rule)
            .unwrap()
            .curve
            .composite(&Context::default())
            .unwrap();
        let first = curve.derivative(&Context::default()).unwrap();
        let orders = [curve.clone(), first.clone(), first.derivative(&Context::default()).unwrap()];
        for order in &orders {
            for i in 1..curve.breaks().segments() {
                let (before, after) = (order.segment(i - 1), order.segment(i));
                let scale = magnitude(&before).max(magnitude(&after)) + curve.magnitude();
                assert!(before[before.len() - 1].distance(after[0]) < 1e-9 * scale);
            }
        }
    });
}

#[test]
fn end_conditions_hold() {
    law(100, (any::points::<2>(7), end(), end(), rule()), |(points, start, end, rule)| {
        let curve = through(&points, EndConditions::Open(start, end), &rule).curve;
        let knots = curve.breaks().as_slice().to_vec();
        let curve = Curve::Piecewise(curve);
        let scale = size(&curve)
            / (1..knots.len())
                .map(|i| knots[i] - knots[i - 1])
                .fold(f64::INFINITY, f64::min)
                .min(1.0)
                .powi(3);
        for (condition, t, next) in [(start, knots[0], [0, 1]), (end, knots[6], [4, 5])] {
            let jet = jets(&curve, &[t], 2);
            match condition {
                End::Natural => assert!(jet[2][0].norm() < 1e-12 * scale),
                End::Derivative(vector) => assert!(jet[1][0].distance(vector) < 1e-12 * scale),
                End::NotAKnot => {
                    let third = jets(&curve, &next.map(|i| 0.5 * (knots[i] + knots[i + 1])), 3);
                    assert!(third[3][0].distance(third[3][1]) < 1e-11 * scale);
                }
            }
        }
    });
}

#[test]
fn cubics_are_reproduced_from_their_points() {
    law(
        80,
        (any::points::<2>(4), any::breaks(6), exact_ends()),
        |(coefficients, knots, (start, end))| {
            let cubic = |t: f64| coefficients.iter().rev().fold(Point::ZERO, |sum, &c| sum * t + c);
            let slope = |t: f64| {
                coefficients[1] + coefficients[2] * (2.0 * t) + coefficients[3] * (3.0 * t * t)
            };
            let condition =
                |free: bool, t: f64| if free { End::NotAKnot } else { End::Derivative(slope(t)) };
            let points: Vec<_> = knots.iter().map(|&t| cubic(t)).collect();
            let shape = EndConditions::Open(condition(start, knots[0]), condition(end, knots[6]));
            let curve =
                Curve::Piecewise(through(&points, shape, &Parameterization::Given(knots)).curve);
            let parameters = even(&curve, 40);
            let expected: Vec<_> = parameters.iter().map(|&t| cubic(t)).collect();
            assert!(apart(&at(&curve, &parameters), &expected) < 1e-11 * size(&curve));
        },
    );
}

fn exact_ends() -> impl Strategy<Value = (bool, bool)> {
    (proptest::bool::ANY, proptest::bool::ANY)
}

#[test]
fn two_and_three_points_suffice_where_the_conditions_allow() {
    let [a, b, c] = [Point([0.0, 0.0]), Point([1.0, 2.0]), Point([3.0, 0.0])];
    let line = Curve::Piecewise(
        through(
            &[a, b],
            EndConditions::Open(End::Natural, End::Natural),
            &Parameterization::Uniform,
        )
        .curve,
    );
    assert!(at(&line, &[0.5])[0].distance(Point([0.5, 1.0])) < 1e-15);
    let one = [
        (End::NotAKnot, End::Natural),
        (End::NotAKnot, End::Derivative(b)),
        (End::Natural, End::NotAKnot),
    ];
    for (start, end) in one {
        let result =
            through(&[a, b, c], EndConditions::Open(start, end), &Parameterization::ChordLength);
        let third = jets(&Curve::Piecewise(result.curve), &[0.1, 4.0], 3);
        assert!(third[3][0].distance(third[3][1]) < 1e-13);
    }
    assert!(
        interpolate(
            &Context::default(),
            &[a, b, c],
            EndConditions::Open(End::NotAKnot, End::NotAKnot),
            bezier(),
            &Parameterization::Uniform
        )
        .is_err()
    );
    assert!(
        interpolate(
            &Context::default(),
            &[a, b],
            EndConditions::Open(End::NotAKnot, End::Natural),
            bezier(),
            &Parameterization::Uniform
        )
        .is_err()
    );
    assert_eq!(
        through(&[a, b, c], EndConditions::Closed, &Parameterization::Uniform).continuity.class,
        Smoothness::C2
    );
}

#[test]
fn a_closed_interpolant_does_not_depend_on_its_first_point() {
    law(80, (any::points::<2>(9), 1usize..9, rule()), |(points, shift, rule)| {
        let rotated: Vec<_> = (0..9).map(|i| points[(i + shift) % 9]).collect();
        let [one, other] = [points, rotated].map(|points| {
            through(&points, EndConditions::Closed, &rule)
                .curve
                .composite(&Context::default())
                .unwrap()
        });
        let size = one.magnitude();
        let same =
            |i: usize| apart(&one.segment((i + shift) % 9), &other.segment(i)) < 1e-12 * size;
        assert!((0..9).all(same));
    });
}

#[test]
fn an_open_interpolant_runs_backwards_through_reversed_points() {
    law(60, (any::points::<2>(8), rule()), |(points, rule)| {
        let shape = EndConditions::Open(End::NotAKnot, End::Natural);
        let mirror = EndConditions::Open(End::Natural, End::NotAKnot);
        let one = through(&points, shape, &rule).curve.composite(&Context::default()).unwrap();
        let other = through(&points.into_iter().rev().collect::<Vec<_>>(), mirror, &rule)
            .curve
            .composite(&Context::default())
            .unwrap();
        for i in 0..7 {
            let back: Vec<_> = other.segment(6 - i).iter().rev().copied().collect();
            assert!(apart(&one.segment(i), &back) < 1e-12 * one.magnitude());
        }
    });
}

#[test]
fn interpolants_are_b_splines_with_simple_knots() {
    law(60, problem(), |(points, shape, bases, rule)| {
        let curve = Curve::Piecewise(
            interpolate(&Context::default(), &points, shape, bases, &rule).unwrap().curve,
        );
        let result =
            to_bspline(&Context::default(), &curve, KnotStyle::Clamped, CONTINUITY_TOLERANCE)
                .unwrap();
        let inner =
            result.joints.iter().filter(|joint| joint.parameter < crate::laws::domain(&curve).1);
        assert!(inner.clone().all(|joint| joint.multiplicity <= 1));
        assert!(
            crate::laws::curves_apart(&Curve::BSpline(result.curve), &curve) < 1e-9 * size(&curve)
        );
    });
}

#[test]
fn closed_uniform_interpolants_are_periodic_uniform_b_splines() {
    law(40, (3usize..12).prop_flat_map(any::points::<2>), |points| {
        let curve = Curve::Piecewise(
            through(&points, EndConditions::Closed, &Parameterization::Uniform).curve,
        );
        for style in [KnotStyle::Uniform, KnotStyle::Periodic] {
            let spline =
                to_bspline(&Context::default(), &curve, style, CONTINUITY_TOLERANCE).unwrap().curve;
            assert_eq!(spline.control_points().len(), points.len() + 3);
            assert_eq!(spline.control_points()[..3], spline.control_points()[points.len()..]);
            assert!(
                crate::laws::curves_apart(&Curve::BSpline(spline), &curve) < 1e-12 * size(&curve)
            );
        }
    });
}
