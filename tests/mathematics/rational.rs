//! Curves with weights, against exact results, closed forms, and laws.

use std::f64::consts::{PI, SQRT_2};

use crate::laws::{cases, numbers, points};
use serde_json::Value;
use springline::api::wire::{self, AnyDimensioned, Dimensioned};
use springline::core::basis::{AlphaBeta, Basis, Beta, Bezier};
use springline::core::context::Context;
use springline::core::continuity::Tolerance;
use springline::core::curve::{BSpline, Bases, Curve, Single};
use springline::core::evaluate::{Quantities, Samples, Sampling};
use springline::core::fault::Fault;
use springline::core::point::Point;
use springline::core::rational::{self, AnyCurve, Rational};
use springline::core::smoothness::Smoothness;
use springline::core::subdivide::{Cuts, Form};
use springline::core::to_bspline::KnotStyle;
use springline::core::weights::Weights;

type P = Point<2>;
type Plane = Rational<2, 3>;

fn parse(value: &Value) -> AnyDimensioned {
    let context = Context::default();
    let text = value.to_string();
    let curve: wire::Curve = wire::Reading::new(&context).from_slice(text.as_bytes()).unwrap();
    curve.parse(&context).unwrap()
}

fn curvature() -> Quantities {
    Quantities { curvature: true, ..Quantities::default() }
}

fn sampled<const D: usize, const H: usize>(
    curve: &Rational<D, H>,
    sampling: &Sampling,
    derivatives: usize,
) -> Samples<D> {
    let context = Context::default();
    rational::evaluate(&context, curve, sampling, derivatives, curvature()).unwrap()
}

/// How many roundings the points, derivatives and curvatures of a case are off, at most.
fn roundings<const D: usize, const H: usize>(curve: &AnyCurve<D, H>, case: &Value) -> f64 {
    let AnyCurve::Rational(curve) = curve else { panic!("weights of {case}") };
    let found = sampled(curve, &Sampling::Parameters(numbers(&case["parameters"])), 3);
    let expected = case["expected"].as_array().unwrap();
    let scales = case["scale"].as_array().unwrap();
    let curvatures = numbers(&case["curvature"]);
    let off = |i: usize| {
        let (jet, scale): (Vec<Point<D>>, _) = (points(&expected[i]), numbers(&scales[i]));
        let at = |k: usize| if k == 0 { found.points[i] } else { found.derivatives[k - 1][i] };
        let of_jet = (0..4).map(|k| (at(k) - jet[k]).max_abs() / scale[k]);
        let of_curvature = (found.frames.curvatures[i].abs() - curvatures[i].abs()) / scale[4];
        of_jet.chain([of_curvature.abs()]).fold(0.0, f64::max) / f64::EPSILON
    };
    (0..expected.len()).map(off).fold(0.0, f64::max)
}

#[test]
fn members_of_every_family_with_weights_over_twelve_decades_are_exact() {
    let cases = cases("rational");
    assert!(cases.len() >= 200);
    let worst = cases
        .iter()
        .map(|case| match parse(&case["curve"]) {
            Dimensioned::Plane(curve) => roundings(&curve, case),
            Dimensioned::Space(curve) => roundings(&curve, case),
        })
        .fold(0.0, f64::max);
    println!("{worst:.1} roundings");
    assert!(worst <= 8.0, "{worst} roundings");
}

/// The largest error of control points relative to their size, and of weights to each.
fn split_error<const D: usize, const H: usize>(curve: &AnyCurve<D, H>, case: &Value) -> f64 {
    let AnyCurve::Rational(curve) = curve else { panic!("weights of {case}") };
    let cuts = Cuts::Parameters(vec![case["at"].as_f64().unwrap()]);
    let found = rational::subdivide(&Context::default(), curve, &cuts, Form::Bezier).unwrap();
    let half = |side: &str| {
        let control_points: Vec<Point<D>> = points(&case[side]["control_points"]);
        (control_points, numbers(&case[side]["weights"]))
    };
    let ((mut q, mut w), (right, weights)) = (half("left"), half("right"));
    q.extend(&right[1..]);
    w.extend(&weights[1..]);
    let size = q.iter().map(|p| p.max_abs()).fold(0.0, f64::max);
    let points = found.curve.curve().control_points();
    assert_eq!(points.len(), q.len());
    let of_points = points.iter().zip(&q).map(|(&a, &b)| (a - b).max_abs() / size);
    let of_weights = found.curve.weights().as_slice().iter().zip(&w);
    of_points.chain(of_weights.map(|(a, b)| (a / b - 1.0).abs())).fold(0.0, f64::max)
}

#[test]
fn halves_are_exact_in_points_and_weights() {
    let cases = cases("rational_split");
    assert!(cases.len() >= 60);
    for case in &cases {
        let error = match parse(&case["curve"]) {
            Dimensioned::Plane(curve) => split_error(&curve, case),
            Dimensioned::Space(curve) => split_error(&curve, case),
        };
        assert!(error < 1e-14, "{error:e} in {case}");
    }
}

/// A circle as a NURBS curve of degree 2.
fn circle(centre: P, radius: f64, corners: &[([f64; 2], f64)], knots: &[f64]) -> Plane {
    let points = corners.iter().map(|&(p, _)| centre + Point(p) * radius).collect();
    let context = Context::default();
    let curve = BSpline::new(&context, 2, knots.to_vec(), points, true).unwrap();
    let weights = corners.iter().map(|&(_, w)| w).collect();
    Rational::new(&context, Curve::BSpline(curve), weights).unwrap()
}

/// Four quarters: 9 points.
fn quarters(centre: P, radius: f64) -> Plane {
    let (s, h) = (0.5 * SQRT_2, 1.0);
    let corners = [
        ([h, 0.0], 1.0),
        ([h, h], s),
        ([0.0, h], 1.0),
        ([-h, h], s),
        ([-h, 0.0], 1.0),
        ([-h, -h], s),
        ([0.0, -h], 1.0),
        ([h, -h], s),
        ([h, 0.0], 1.0),
    ];
    circle(centre, radius, &corners, &[0., 0., 0., 1., 1., 2., 2., 3., 3., 4., 4., 4.])
}

/// Three thirds: 7 points on a triangle.
fn thirds(centre: P, radius: f64) -> Plane {
    let r = 3f64.sqrt();
    let corners = [
        ([0.0, -1.0], 1.0),
        ([r, -1.0], 0.5),
        ([0.5 * r, 0.5], 1.0),
        ([0.0, 2.0], 0.5),
        ([-0.5 * r, 0.5], 1.0),
        ([-r, -1.0], 0.5),
        ([0.0, -1.0], 1.0),
    ];
    circle(centre, radius, &corners, &[0., 0., 0., 1., 1., 2., 2., 3., 3., 3.])
}

/// One segment of degree 5 that runs around once with positive weights, the least degree for that
/// (Chou 1995).
fn once_around() -> Plane {
    let points = [[1.0, 0.0], [1.0, 4.0], [-3.0, 2.0], [-3.0, -2.0], [1.0, -4.0], [1.0, 0.0]];
    let weights = [1.0, 0.2, 0.2, 0.2, 0.2, 1.0];
    let context = Context::default();
    let curve = Single::new(&context, Basis::Bezier(Bezier), points.map(Point).to_vec()).unwrap();
    Rational::new(&context, Curve::Single(curve), weights.to_vec()).unwrap()
}

#[test]
fn a_circle_is_round() {
    let around = Sampling::Count(100_000);
    let far = Point([1e6, -2e6]);
    for (curve, centre, radius) in [
        (quarters(Point::ZERO, 1.0), Point::ZERO, 1.0),
        (quarters(Point::ZERO, 3e-7), Point::ZERO, 3e-7),
        (thirds(Point::ZERO, 1.0), Point::ZERO, 1.0),
        (once_around(), Point::ZERO, 1.0),
        (quarters(far, 0.125), far, 0.125),
    ] {
        let found = sampled(&curve, &around, 1);
        // The coordinates themselves are rounded.
        let unit = f64::EPSILON * (centre.max_abs() + radius);
        for (&p, &bend) in found.points.iter().zip(&found.frames.curvatures) {
            let off = (p.distance(centre) - radius).abs();
            assert!(off <= 4.0 * unit, "{off:e} of {radius} at {p:?}");
            assert!((bend.abs() * radius - 1.0).abs() < 1e-12, "{bend} of 1 / {radius}");
        }
    }
}

/// The arc of a conic with these end points, between their tangents, of this weight.
fn conic(points: [[f64; 2]; 3], weight: f64) -> Plane {
    let context = Context::default();
    let curve = Single::new(&context, Basis::Bezier(Bezier), points.map(Point).to_vec()).unwrap();
    Rational::new(&context, Curve::Single(curve), vec![1.0, weight, 1.0]).unwrap()
}

#[test]
fn conics_lie_on_their_equations() {
    let around = Sampling::Count(10_000);
    let check = |curve: Plane, equation: &dyn Fn(f64, f64) -> f64| {
        for p in sampled(&curve, &around, 0).points {
            assert!(equation(p[0], p[1]).abs() < 4e-15, "{p:?}: {:e}", equation(p[0], p[1]));
        }
    };
    let (a, b) = (3.0, 0.5);
    check(conic([[a, 0.0], [a, b], [0.0, b]], 0.5 * SQRT_2), &|x, y| {
        (x / a) * (x / a) + (y / b) * (y / b) - 1.0
    });
    // Half of x^2 - y^2 = 1 between (cosh 1, -+sinh 1), whose tangents meet at (1 / cosh 1, 0).
    let (c, s) = (1f64.cosh(), 1f64.sinh());
    check(conic([[c, -s], [1.0 / c, 0.0], [c, s]], c), &|x, y| x * x - y * y - 1.0);
    // Beside weights that make it rational, a parabola: (1, 2, 4) is a change of parameter.
    let context = Context::default();
    let points = [[-1.0, 1.0], [0.0, -1.0], [1.0, 1.0]].map(Point).to_vec();
    let curve = Single::new(&context, Basis::Bezier(Bezier), points).unwrap();
    let curve = Rational::new(&context, Curve::Single(curve), vec![1.0, 2.0, 4.0]).unwrap();
    check(curve, &|x, y| y - x * x);
}

#[test]
fn a_polyline_within_a_tolerance_is_within_it() {
    let context = Context::default();
    for decades in [0, 3, 6] {
        let w = 10f64.powi(decades);
        for weights in [vec![1.0, w, 1.0 / w, 1.0], vec![1.0 / w, w, w, 1.0 / w]] {
            let points = [[0.0, 0.0], [1.0, 3.0], [4.0, -2.0], [5.0, 1.0]].map(Point).to_vec();
            let curve = Single::new(&context, Basis::Bezier(Bezier), points).unwrap();
            let curve: Plane = match AnyCurve::new(&context, Curve::Single(curve), weights) {
                Ok(AnyCurve::Rational(curve)) => curve,
                Ok(AnyCurve::Polynomial(_)) => continue,
                Err(error) => panic!("{error}"),
            };
            let tolerance = 1e-3;
            let polyline = sampled(&curve, &Sampling::Tolerance(tolerance), 0);
            let (t, p) = (&polyline.parameters, &polyline.points);
            let dense = (0..100_000).map(|i| f64::from(i) / 99_999.0);
            // Extreme weights put nearly all of the curve near the ends of the domain.
            let dense: Vec<f64> = dense
                .map(|x| if x < 0.5 { 4.0 * x.powi(3) } else { 1.0 - 4.0 * (1.0 - x).powi(3) })
                .collect();
            let samples = sampled(&curve, &Sampling::Parameters(dense.clone()), 0);
            let mut worst: f64 = 0.0;
            for (&s, &q) in dense.iter().zip(&samples.points) {
                let i = t.partition_point(|&knot| knot <= s).clamp(1, t.len() - 1);
                let (a, b) = (p[i - 1], p[i]);
                let along = b - a;
                let u = ((q - a).dot(along) / along.dot(along)).clamp(0.0, 1.0);
                worst = worst.max(q.distance(a + along * u));
            }
            assert!(worst <= tolerance * (1.0 + 1e-9), "{decades}: {worst:e}");
        }
    }
}

/// A quarter circle in other families and forms is the same quarter circle.
#[test]
fn a_circle_stays_one_in_every_form() {
    let context = Context::default();
    let whole = quarters(Point::ZERO, 1.0);
    let round = |curve: &Plane| {
        for p in sampled(curve, &Sampling::Count(1_000), 0).points {
            assert!((p.norm() - 1.0).abs() < 1e-14, "{p:?}");
        }
    };
    let cut = rational::subdivide(&context, &whole, &Cuts::Depth(3), Form::Auto).unwrap();
    assert!(!cut.in_family);
    round(&cut.curve);
    let back = rational::to_bspline(&context, &cut.curve, KnotStyle::Clamped, 1e-9).unwrap();
    assert!(back.deviation < 1e-14, "{:e}", back.deviation);
    round(&back.curve);
    // The cuts between quarters are no knots any more, and the quarters are those that were cut.
    assert_eq!(back.curve.curve().control_points().len(), 9);
    for basis in [
        Basis::Beta(Beta::from_beta(0.7).unwrap()),
        Basis::AlphaBeta(AlphaBeta::new(0.5, 2.5).unwrap()),
    ] {
        let quarter = conic([[1.0, 0.0], [1.0, 1.0], [0.0, 1.0]], 0.5 * SQRT_2);
        let order = Some(3);
        round(&rational::convert(&context, &quarter, basis, order).unwrap().curve);
    }
}

#[test]
fn a_weight_that_would_not_be_positive_is_refused_or_bezier() {
    let context = Context::default();
    // A third of an end edge is but a tenth of it here, so the way back goes ten times as far.
    let basis = Basis::AlphaBeta(AlphaBeta::new(1.0, 0.3).unwrap());
    let points = [[0.0, 0.0], [1.0, 2.0], [3.0, 2.0], [4.0, 0.0]].map(Point).to_vec();
    let curve = Single::new(&context, basis.clone(), points).unwrap();
    let weights = vec![1.0, 1.0, 1e-3, 1e-3];
    let curve: Plane = Rational::new(&context, Curve::Single(curve), weights).unwrap();
    let cuts = Cuts::Parameters(vec![0.5]);
    let auto = rational::subdivide(&context, &curve, &cuts, Form::Auto).unwrap();
    assert!(!auto.in_family);
    let error = rational::subdivide(&context, &curve, &cuts, Form::Family).unwrap_err();
    assert_eq!(error.place.to_string(), "/form");
    assert!(matches!(error.fault, Fault::UnsuitableCurve(_)), "{error}");
    let line = conic([[0.0, 0.0], [1.0, 1.0], [2.0, 0.0]], 1e-4);
    let error = rational::convert(&context, &line, basis, Some(3)).unwrap_err();
    assert_eq!(error.place.to_string(), "/basis");
}

#[test]
fn scaling_all_weights_changes_nothing_but_last_digits() {
    let context = Context::default();
    let curve = quarters(Point([0.25, 3.0]), 2.0);
    let (outline, weights) = curve.clone().into_parts();
    let around = Sampling::Count(1_000);
    let before = sampled(&curve, &around, 2);
    for factor in [2f64.powi(900), 2f64.powi(-900), 3.0, 1e-7] {
        let scaled = weights.as_slice().iter().map(|w| w * factor).collect();
        let other: Plane = Rational::new(&context, outline.clone(), scaled).unwrap();
        let after = sampled(&other, &around, 2);
        let close = |a: &[P], b: &[P]| a.iter().zip(b).all(|(a, b)| a.distance(*b) < 1e-13);
        assert!(close(&before.points, &after.points), "{factor}");
        assert!(close(&before.derivatives[1], &after.derivatives[1]), "{factor}");
        if factor.log2().fract() == 0.0 {
            assert_eq!(before.points, after.points);
        }
    }
}

#[test]
fn smoothness_is_that_of_the_curve_not_of_its_coordinates() {
    let context = Context::default();
    let report = |curve: Plane| {
        let any = AnyCurve::Rational(curve);
        rational::continuity(&context, &any, Tolerance::default()).unwrap().1
    };
    // Its parameter runs equally fast on both sides of a joint, but its homogeneous curve turns.
    let found = report(quarters(Point::ZERO, 1.0));
    assert_eq!(found.joints.len(), 4);
    for joint in found.joints {
        assert_eq!((joint.parametric, joint.geometric), (Smoothness::C1, Smoothness::G2));
    }
    // A corner stays one.
    let points = [[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [1.0, 2.0], [0.0, 2.0]].map(Point).to_vec();
    let knots = vec![0., 0., 0., 1., 1., 2., 2., 2.];
    let bent = BSpline::new(&context, 2, knots, points, false).unwrap();
    let bent: Plane =
        Rational::new(&context, Curve::BSpline(bent), vec![1.0, 2.0, 1.0, 3.0, 1.0]).unwrap();
    assert_eq!(report(bent).class, Smoothness::G1);
}

#[test]
fn the_circumference_by_speeds_is_two_pi() {
    let count = 4_000;
    let found = sampled(&quarters(Point::ZERO, 1.0), &Sampling::Count(count + 1), 1);
    // Simpson's rule on the speeds: the integrand is smooth within each quarter.
    let h = 4.0 / count as f64;
    let speed = |i: usize| found.derivatives[0][i].norm();
    let sum: f64 =
        (0..count / 2).map(|i| speed(2 * i) + 4.0 * speed(2 * i + 1) + speed(2 * i + 2)).sum();
    assert!((sum * h / 3.0 - 2.0 * PI).abs() < 1e-11, "{:e}", sum * h / 3.0 - 2.0 * PI);
}

fn arc(points: [[f64; 2]; 4], weights: [f64; 4]) -> (Single<2>, Option<Weights>) {
    let context = Context::default();
    let curve = Single::new(&context, Basis::Bezier(Bezier), points.map(Point).to_vec()).unwrap();
    (curve, Some(Weights::new(weights.to_vec(), 4).unwrap()))
}

#[test]
fn rational_curves_join_with_the_class_asked_for() {
    let context = Context::default();
    let curves = || {
        vec![
            arc([[0.0, 0.0], [1.0, 1.0], [2.0, 1.2], [3.0, 0.5]], [1.0, 2.0, 0.5, 3.0]),
            arc([[3.0, 0.5], [4.0, -0.5], [5.0, -1.0], [6.0, 0.0]], [0.5, 1.0, 4.0, 1.0]),
            (arc([[6.0, 0.0], [7.0, 1.2], [8.0, 1.0], [9.0, 0.0]], [1.0; 4]).0, None),
        ]
    };
    for smoothness in
        [Smoothness::C0, Smoothness::G1, Smoothness::C1, Smoothness::G2, Smoothness::C2]
    {
        let joined =
            rational::join::<2, 3>(&context, curves(), smoothness, Default::default()).unwrap();
        let AnyCurve::Rational(whole) = &joined.curve else { panic!("weights") };
        for joint in &joined.continuity.joints {
            let reached = match smoothness {
                Smoothness::G1 | Smoothness::G2 => joint.geometric,
                _ => joint.parametric,
            };
            assert!(reached >= smoothness, "{smoothness:?}: {joint:?}");
        }
        // One factor for all weights of a curve changes no curve: ratios inside each are as given.
        let weights = whole.weights().as_slice();
        for (i, (_, given)) in curves().into_iter().enumerate() {
            let given = given.map_or_else(|| vec![1.0; 4], Weights::into_vec);
            for k in 0..4 {
                let ratio = weights[3 * i + k] / weights[3 * i];
                assert!((ratio / (given[k] / given[0]) - 1.0).abs() < 1e-14);
            }
        }
        // By differences of points, not by the quotient rule: no corner.
        if smoothness >= Smoothness::G1 {
            for t in [1.0, 2.0] {
                let h = 1e-6;
                let places = Sampling::Parameters(vec![t - h, t, t + h]);
                let p = sampled(whole, &places, 0).points;
                let (a, b) = ((p[1] - p[0]).unit().unwrap(), (p[2] - p[1]).unit().unwrap());
                assert!(a.distance(b) < 1e-4, "{smoothness:?} at {t}: {a:?} {b:?}");
            }
        }
    }
}

#[test]
fn a_rational_curve_bends_by_its_shape_parameters_and_stays_smooth() {
    let context = Context::default();
    let curves = vec![
        arc([[0.0, 0.0], [1.0, 1.0], [2.0, 1.2], [3.0, 0.5]], [1.0, 2.0, 0.5, 3.0]),
        arc([[3.0, 0.5], [4.0, -0.5], [5.0, -1.0], [6.0, 0.0]], [0.5, 1.0, 4.0, 1.0]),
    ];
    let joined =
        rational::join::<2, 3>(&context, curves, Smoothness::C1, Default::default()).unwrap();
    let AnyCurve::Rational(curve) = joined.curve else { panic!("weights") };
    let bases = || Bases::Common(Basis::Beta(Beta::from_beta(0.4).unwrap()));
    let bend = |keep| rational::reshape(&context, &curve, bases(), keep).unwrap();
    let plain = bend(Smoothness::C0);
    assert_eq!(plain.points_moved, 0.0);
    assert!(plain.curve_moved > 0.01 && plain.continuity.joints[0].parametric == Smoothness::C0);
    for keep in [Smoothness::C1, Smoothness::G1] {
        let kept = bend(keep);
        assert_eq!(kept.curve.weights(), curve.weights());
        assert!(kept.continuity.joints[0].class >= keep, "{keep:?} {:?}", kept.continuity);
        assert!(kept.points_moved > 0.0);
    }
    let nearly = Bases::Common(Basis::Beta(Beta::from_beta(0.02).unwrap()));
    let same = rational::reshape(&context, &curve, nearly, Smoothness::C2).unwrap();
    assert!(same.curve_moved < 1e-13, "{:e}", same.curve_moved);
    assert_ne!(same.curve.weights(), curve.weights());
    let far = rational::reshape(&context, &curve, bases(), Smoothness::C2).unwrap_err();
    assert_eq!(far.place.to_string(), "/keep");
}

/// Weights make no difference to what an affine map does: points map, and the map of the curve is
/// the curve of the mapped points.
#[test]
fn an_affine_map_of_the_points_is_one_of_the_curve() {
    let context = Context::default();
    let map = |p: P| Point([0.5 * p[0] - 2.0 * p[1] + 7.0, p[0] + 0.25 * p[1] - 3.0]);
    for basis in [
        Basis::Bezier(Bezier),
        Basis::Beta(Beta::from_beta(0.7).unwrap()),
        Basis::AlphaBeta(AlphaBeta::new(0.5, 2.5).unwrap()),
    ] {
        let points = [[0.0, 0.0], [1.0, 3.0], [4.0, -2.0], [5.0, 1.0]].map(Point);
        let of = |points: Vec<P>| -> Plane {
            let curve = Single::new(&context, basis.clone(), points).unwrap();
            Rational::new(&context, Curve::Single(curve), vec![1.0, 20.0, 0.05, 3.0]).unwrap()
        };
        let around = Sampling::Count(1_000);
        let plain = sampled(&of(points.to_vec()), &around, 0).points;
        let mapped = sampled(&of(points.map(map).to_vec()), &around, 0).points;
        for (&p, q) in plain.iter().zip(mapped) {
            assert!(map(p).distance(q) < 1e-14, "{p:?} {q:?}");
        }
    }
}

/// The size of all weights of a curve means nothing, not even where products of it overflow.
#[test]
fn weights_as_large_or_small_as_doubles_join_and_bend() {
    let context = Context::default();
    let curves = |[a, b]: [f64; 2]| {
        vec![
            arc(
                [[0.0, 0.0], [1.0, 1.0], [2.0, 1.2], [3.0, 0.5]],
                [1.0, 2.0, 0.5, 1.0].map(|w| w * a),
            ),
            arc(
                [[3.0, 0.5], [4.0, -0.5], [5.0, -1.0], [6.0, 0.0]],
                [0.5, 1.0, 2.0, 1.0].map(|w| w * b),
            ),
        ]
    };
    for smoothness in [Smoothness::C1, Smoothness::G2] {
        let join =
            |sizes| rational::join::<2, 3>(&context, curves(sizes), smoothness, Default::default());
        let plain = join([1.0, 1.0]).unwrap();
        for sizes in [[1e300, 1e-300], [1e-300, 1e300], [8e307, 8e307], [1e-308, 1.0]] {
            let joined = join(sizes).unwrap();
            for (a, b) in joined.moved.concat().iter().zip(plain.moved.concat()) {
                assert!((a - b).abs() < 1e-9, "{sizes:?}: {a} {b}");
            }
            let AnyCurve::Rational(curve) = joined.curve else { panic!("weights") };
            let bases = Bases::Common(Basis::Beta(Beta::from_beta(0.4).unwrap()));
            let bent = rational::reshape(&context, &curve, bases, Smoothness::G1).unwrap();
            assert!(bent.continuity.class >= Smoothness::G1);
        }
    }
}

#[test]
fn curves_whose_weights_would_differ_too_much_do_not_join() {
    let points = [[0.0, 0.0], [1.0, 1.0], [2.0, 1.2], [3.0, 0.5]];
    let steep = || arc(points, [1.0, 1.0, 1.0, 1e10]);
    let curves = vec![steep(), steep(), steep()];
    let context = Context::default();
    let error = rational::join::<2, 3>(&context, curves, Smoothness::C0, Default::default());
    let error = error.unwrap_err();
    assert_eq!(error.place.to_string(), "/curves");
    assert!(matches!(error.fault, Fault::UnsuitableCurve(_)), "{error}");
}
