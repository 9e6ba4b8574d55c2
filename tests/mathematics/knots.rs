//! What to-bspline makes of the knots it is given, against exact rational arithmetic
//! (tests/vectors/splines.py).

use crate::laws::{
    apart, at, cases, curves_apart, domain, even, law, numbers, plane, points, size,
};
use proptest::collection::vec;
use serde_json::Value;
use springline::core::context::Context;
use springline::core::continuity::{Tolerance, continuity};
use springline::core::curve::{BSpline, Curve, Piecewise};
use springline::core::limits::CONTINUITY_TOLERANCE;
use springline::core::point::{Point, magnitude};
use springline::core::subdivide::{Cuts, Form, subdivide};
use springline::core::to_bspline::{Conversion, KnotStyle, to_bspline};

fn converted(curve: &Curve<2>, style: KnotStyle) -> Conversion<BSpline<2>> {
    to_bspline(&Context::default(), curve, style, CONTINUITY_TOLERANCE).unwrap()
}

fn of_kind(kind: &str) -> Vec<(Curve<2>, Vec<f64>, Vec<Point<2>>)> {
    let chosen: Vec<Value> =
        cases("knots").into_iter().filter(|case| case["kind"] == kind).collect();
    assert!(chosen.len() >= 9, "{kind}");
    chosen
        .iter()
        .map(|case| {
            (plane(&case["curve"]), numbers(&case["knots"]), points(&case["control_points"]))
        })
        .collect()
}

fn bits(points: &[Point<2>]) -> Vec<[u64; 2]> {
    points.iter().map(|p| p.0.map(f64::to_bits)).collect()
}

/// Degree 4 with knots at 0.3 and 0.300001, degree 7 with a span of 1 %, and degree 15 whatever its
/// knots got every inner knot `degree` times, and degree 12 on unit knots lost six digits.
#[test]
fn a_minimal_clamped_b_spline_comes_back_bit_for_bit() {
    for (curve, knots, points) in of_kind("minimal") {
        let found = converted(&curve, KnotStyle::Clamped);
        assert_eq!(found.curve.knots().as_slice(), knots, "degree {}", found.curve.degree());
        assert_eq!(
            bits(found.curve.control_points()),
            bits(&points),
            "degree {}",
            found.curve.degree()
        );
        assert_eq!(found.deviation, 0.0);
    }
}

/// The control points of a result against exact ones, relative to the largest coordinate.
fn error(found: &Conversion<BSpline<2>>, curve: &Curve<2>, expected: &[Point<2>]) -> f64 {
    apart(found.curve.control_points(), expected) / size(curve).max(magnitude(expected))
}

#[test]
fn open_ends_are_clamped_and_inner_knots_stay() {
    let mut worst = 0.0f64;
    for (curve, knots, points) in of_kind("open") {
        let found = converted(&curve, KnotStyle::Clamped);
        assert_eq!(found.curve.knots().as_slice(), knots, "degree {}", found.curve.degree());
        let error = error(&found, &curve, &points);
        assert!(
            error <= 1e-14 && found.deviation <= 1e-14 * size(&curve),
            "degree {}: {error:e}",
            found.curve.degree()
        );
        worst = worst.max(error);
    }
    println!("clamped: {worst:.1e}");
}

#[test]
fn uniform_knots_at_the_ends_of_a_clamped_b_spline() {
    for (curve, knots, points) in of_kind("uniform") {
        let found = converted(&curve, KnotStyle::Uniform);
        assert_eq!(found.curve.knots().as_slice(), knots);
        let error = error(&found, &curve, &points);
        assert!(error <= 1e-14, "degree {}: {error:e}", found.curve.degree());
        let back = converted(&Curve::BSpline(found.curve.clone()), KnotStyle::Uniform);
        assert_eq!(back.curve, found.curve, "bit for bit");
    }
}

#[test]
fn one_copy_too_many_goes_alone() {
    for (curve, knots, points) in of_kind("redundant") {
        let found = converted(&curve, KnotStyle::Clamped);
        assert_eq!(found.curve.knots().as_slice(), knots, "degree {}", found.curve.degree());
        let error = error(&found, &curve, &points);
        assert!(
            error <= 1e-12 && found.deviation <= 1e-14 * size(&curve),
            "degree {}: {error:e}",
            found.curve.degree()
        );
        for joint in found.joints {
            assert_eq!(joint.multiplicity as i32, found.curve.degree() as i32 - joint.continuity);
        }
    }
}

fn pieces_of(curve: &Curve<2>) -> Piecewise<2> {
    subdivide(&Context::default(), curve, &Cuts::Depth(0), Form::Bezier).unwrap().curve
}

/// Each joint of Bezier pieces is judged by itself: some may keep copies that rounding does not
/// allow to remove, and the curve stays what it was to the last digits.
#[test]
fn bezier_pieces_of_a_b_spline_stay_the_curve() {
    let mut worst = [(0.0f64, 0usize); 26];
    for (curve, knots, _) in of_kind("minimal").into_iter().chain(of_kind("open")) {
        let pieces = Curve::Piecewise(pieces_of(&curve));
        let found = converted(&pieces, KnotStyle::Clamped);
        let degree = found.curve.degree();
        let apart = curves_apart(&Curve::BSpline(found.curve.clone()), &pieces);
        assert!(
            apart <= found.deviation + 1e-15 * degree as f64 * size(&curve),
            "{apart:e}, {:e}",
            found.deviation
        );
        assert!(found.deviation <= CONTINUITY_TOLERANCE * size(&curve));
        let more = found.curve.knots().as_slice().len() - knots.len();
        worst[degree] =
            (worst[degree].0.max(found.deviation / size(&curve)), worst[degree].1.max(more));
    }
    for (degree, (deviation, more)) in worst.iter().enumerate().skip(1) {
        println!("degree {degree}: deviation {deviation:.1e}, {more} knots more");
    }
    assert!(worst[..=3].iter().all(|&(deviation, more)| deviation <= 1e-14 && more == 0));
}

/// Six spans, of which one is short; the others join smoothly and keep simple knots.
#[test]
fn a_short_segment_does_not_cost_the_other_joints_their_knots() {
    for degree in [3, 5, 7, 9] {
        let inner = [1.0, 2.0, 3.0, 3.0 + 1e-6, 4.0, 5.0];
        let knots: Vec<f64> = [0.0]
            .repeat(degree + 1)
            .into_iter()
            .chain(inner)
            .chain([6.0].repeat(degree + 1))
            .collect();
        let points = (0..knots.len() - degree - 1)
            .map(|i| Point([i as f64, (i as f64 * 1.7).sin()]))
            .collect();
        let spline = Curve::BSpline(
            BSpline::new(&Context::default(), degree, knots, points, false).unwrap(),
        );
        let pieces = pieces_of(&spline);
        // A corner at 2.
        let mut bent = pieces.control_points().to_vec();
        bent[2 * degree - 1] += Point([0.0, 0.5]);
        let bent = Piecewise::new(
            &Context::default(),
            pieces.bases().clone(),
            degree,
            pieces.breaks().clone(),
            false,
            bent,
        )
        .unwrap();
        let found = converted(&Curve::Piecewise(bent.clone()), KnotStyle::Clamped);
        assert!(found.deviation <= 1e-12 * 12.0, "{:e}", found.deviation);
        let multiplicity =
            |t: f64| found.curve.knots().as_slice().iter().filter(|&&knot| knot == t).count();
        assert_eq!(
            (multiplicity(2.0), multiplicity(5.0)),
            (degree, 1),
            "degree {degree}: {:?}",
            found.curve.knots()
        );
        assert!(
            curves_apart(&Curve::BSpline(found.curve), &Curve::Piecewise(bent)) <= 1e-12 * 12.0
        );
    }
}

/// Points moved a little, so that a knot is almost superfluous: the deviation is a bound, and a
/// close one.
#[test]
fn the_deviation_bounds_what_removal_moves() {
    law(60, (1usize..8, vec(-1.0..1.0, 40), -9.0..-4.0), |(degree, numbers, exponent)| {
        let knots: Vec<f64> = [0.0]
            .repeat(degree + 1)
            .into_iter()
            .chain([1.0, 2.5, 3.0])
            .chain([4.0].repeat(degree + 1))
            .collect();
        let line = |i: usize| knots[i + 1..=i + degree].iter().sum::<f64>() / degree as f64;
        let moved = |i: usize| Point([line(i), 10f64.powf(exponent) * numbers[i]]);
        let points = (0..degree + 4).map(moved).collect();
        let curve = Curve::BSpline(
            BSpline::new(&Context::default(), degree, knots.clone(), points, false).unwrap(),
        );
        let found = to_bspline(&Context::default(), &curve, KnotStyle::Clamped, 0.9).unwrap();
        let parameters = even(&curve, 400);
        let measured =
            apart(&at(&curve, &parameters), &at(&Curve::BSpline(found.curve.clone()), &parameters));
        assert!(
            measured <= found.deviation * (1.0 + 1e-9) + 1e-15 * size(&curve),
            "{measured:e} {:e}",
            found.deviation
        );
        assert!(
            found.deviation <= 40.0 * measured + 1e-14 * size(&curve),
            "{measured:e} {:e}",
            found.deviation
        );
    });
}

#[test]
fn a_periodic_b_spline_comes_back_bit_for_bit() {
    for degree in 1..=15 {
        let count = degree + 3;
        let knots: Vec<f64> =
            (0..count + 2 * degree + 1).map(|i| i as f64 - degree as f64).collect();
        let points: Vec<_> = (0..count + degree)
            .map(|i| ((i % count) as f64 * 2.4).sin_cos())
            .map(|(y, x)| Point([x, y]))
            .collect();
        let curve = Curve::BSpline(
            BSpline::new(&Context::default(), degree, knots.clone(), points.clone(), true).unwrap(),
        );
        for style in [KnotStyle::Periodic, KnotStyle::Uniform] {
            let found = converted(&curve, style);
            assert_eq!(
                (found.curve.knots().as_slice(), bits(found.curve.control_points())),
                (&knots[..], bits(&points)),
                "{style:?}"
            );
        }
        // Clamped and back.
        let clamped = converted(&curve, KnotStyle::Clamped);
        let inner = |knots: &[f64]| {
            knots.iter().copied().filter(|&t| t > 0.0 && t < count as f64).collect::<Vec<_>>()
        };
        assert_eq!(inner(clamped.curve.knots().as_slice()), inner(&knots), "degree {degree}");
        assert!(clamped.deviation <= 1e-14, "{:e}", clamped.deviation);
        assert_eq!(domain(&Curve::BSpline(clamped.curve)), domain(&curve));
    }
}

/// Differences within a span of 1e-6 made jumps of the second derivative out of rounding.
#[test]
fn continuity_sees_no_jumps_at_the_simple_knots_of_a_short_span() {
    let knots = vec![0.0, 0.0, 0.0, 0.0, 0.0, 0.3, 0.300001, 0.7, 1.0, 1.0, 1.0, 1.0, 1.0];
    let points = (0..8).map(|i| Point([f64::from(i), f64::from(i * i % 5)])).collect();
    let curve =
        Curve::<2>::BSpline(BSpline::new(&Context::default(), 4, knots, points, false).unwrap());
    let report = continuity(
        &Context::default(),
        &curve.composite(&Context::default()).unwrap(),
        false,
        Tolerance::default(),
    )
    .unwrap();
    for joint in report.joints {
        assert!(
            joint.first_derivative_jump < 1e-13 && joint.second_derivative_jump < 1e-11,
            "{joint:?}"
        );
    }
}
