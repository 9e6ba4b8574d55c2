//! Extreme but valid input: nothing panics, hangs, answers NaN, or blames the wrong thing.

use crate::laws::{apart, at, curves_apart, domain, even, single, size};
use springline::core::basis::{AlphaBeta, Basis, Beta, Bezier, Quasi, ShapeParameters};
use springline::core::context::Context;
use springline::core::continuity::{Tolerance, continuity};
use springline::core::curve::{BSpline, Bases, Curve, Piecewise, Single};
use springline::core::evaluate::{Quantities, Sampling, evaluate};
use springline::core::fault::Fault;
use springline::core::interpolate::{End, EndConditions, interpolate};
use springline::core::knots::Breaks;
use springline::core::limits::CONTINUITY_TOLERANCE;
use springline::core::parameterization::Parameterization;
use springline::core::point::Point;
use springline::core::smoothness::Smoothness;
use springline::core::subdivide::{Cuts, Form, subdivide};
use springline::core::to_bspline::{KnotStyle, to_bspline};

const ALL: Quantities =
    Quantities { tangent: true, normal: true, curvature: true, torsion: true, speed: true };
const OPEN: EndConditions<2> = EndConditions::Open(End::Natural, End::Natural);

fn bezier() -> Bases {
    Bases::Common(Basis::Bezier(Bezier))
}

fn piecewise<const D: usize>(
    order: usize,
    knots: Vec<f64>,
    closed: bool,
    points: Vec<Point<D>>,
) -> Curve<D> {
    Curve::Piecewise(
        Piecewise::new(
            &Context::default(),
            bezier(),
            order,
            Breaks::new(&Context::default(), knots).unwrap(),
            closed,
            points,
        )
        .unwrap(),
    )
}

/// Points that wander, deterministic and without repetition.
fn wander(count: usize, scale: f64) -> Vec<Point<2>> {
    (0..count)
        .map(|i| i as f64)
        .map(|i| {
            Point([scale * (i * 0.618).sin(), scale * ((i * i * 0.37).cos() + i / count as f64)])
        })
        .collect()
}

fn bases_of_degree_64() -> Vec<(Basis, usize)> {
    let rows = |n: usize| (0..=n).map(|i| (0..=n).map(|j| f64::from(i == j)).collect()).collect();
    let seed =
        vec![vec![1.0, 0.0, 0.0], vec![0.2, 0.8, 0.0], vec![0.0, 0.8, 0.2], vec![0.0, 0.0, 1.0]];
    vec![
        (Basis::Bezier(Bezier), 64),
        (Basis::Beta(Beta::from_beta(0.5).unwrap()), 64),
        (Basis::Beta(Beta::from_beta(1e300).unwrap()), 64),
        (Basis::Beta(Beta::from_beta(1e-300).unwrap()), 64),
        (Basis::Beta(Beta::from_lambda(1e-300).unwrap()), 64),
        (Basis::Beta(Beta::from_lambda(0.0).unwrap()), 64),
        (
            Basis::Quasi(
                Quasi::new(&Context::default(), ShapeParameters::Matrix { rows: rows(64) })
                    .unwrap(),
            ),
            64,
        ),
        (
            Basis::Quasi(
                Quasi::new(&Context::default(), ShapeParameters::Recursive { seed }).unwrap(),
            ),
            63,
        ),
        (
            Basis::Quasi(
                Quasi::new(
                    &Context::default(),
                    ShapeParameters::Elevation { lambdas: vec![0.0; 63] },
                )
                .unwrap(),
            ),
            63,
        ),
    ]
}

// ---- degree 64

#[test]
fn degree_64_evaluates_subdivides_and_converts_in_every_family() {
    for (basis, order) in bases_of_degree_64() {
        let curve = single(basis.clone(), wander(order + 1, 1.0));
        let samples =
            evaluate(&Context::default(), &curve, &Sampling::Count(9), 64, Quantities::default())
                .unwrap();
        assert!(samples.derivatives.iter().flatten().all(|p| p.is_finite()), "{}", basis.name());
        for cuts in [Cuts::Depth(2), Cuts::Flatness(1e-3), Cuts::Parameters(vec![1e-9, 0.3, 0.999])]
        {
            let pieces = subdivide(&Context::default(), &curve, &cuts, Form::Auto).unwrap();
            let accuracy = 1e-13 * pieces.condition;
            assert!(
                curves_apart(&Curve::Piecewise(pieces.curve), &curve) < accuracy,
                "{}",
                basis.name()
            );
        }
        let spline =
            to_bspline(&Context::default(), &curve, KnotStyle::Clamped, CONTINUITY_TOLERANCE)
                .unwrap();
        assert!(curves_apart(&Curve::BSpline(spline.curve), &curve) < 1e-13);
        let uniform =
            to_bspline(&Context::default(), &curve, KnotStyle::Uniform, CONTINUITY_TOLERANCE);
        assert!(
            uniform.is_err()
                || basis == Basis::Beta(Beta::from_lambda(0.0).unwrap())
                || uniform.unwrap().deviation < 1e-8
        );
    }
}

#[test]
fn a_b_spline_of_degree_64_is_the_partition_of_unity() {
    let ones = vec![Point([1.0, 1.0]); 80];
    let knots = (0..145).map(|i| f64::from(i) * 0.37).collect();
    let curve = Curve::BSpline(BSpline::new(&Context::default(), 64, knots, ones, false).unwrap());
    assert!(at(&curve, &even(&curve, 50)).iter().all(|p| p.distance(Point([1.0, 1.0])) < 1e-12));
}

// ---- coordinates

#[test]
fn scaling_by_powers_of_two_scales_every_answer() {
    for (basis, order) in bases_of_degree_64() {
        let points = wander(order + 1, 1.0);
        let unit = single(basis.clone(), points.clone());
        for exponent in [-900, -300, 300, 900, 1022] {
            let scale = 2f64.powi(exponent);
            let scaled = single(basis.clone(), points.iter().map(|&p| p * scale).collect());
            let parameters = even(&unit, 16);
            let expected: Vec<_> = at(&unit, &parameters).into_iter().map(|p| p * scale).collect();
            assert!(
                apart(&at(&scaled, &parameters), &expected) <= 1e-15 * scale,
                "{} 2^{exponent}",
                basis.name()
            );
        }
    }
}

#[test]
fn tiny_curves_have_the_shape_of_large_ones() {
    let points = wander(8, 1.0);
    let frames = |scale: f64| {
        let points = points
            .iter()
            .map(|p| Point([p[0] * scale, p[1] * scale, p[0] * p[1] * scale]))
            .collect();
        evaluate(
            &Context::default(),
            &single(Basis::Bezier(Bezier), points),
            &Sampling::Count(20),
            0,
            ALL,
        )
        .unwrap()
        .frames
    };
    let unit = frames(1.0);
    for exponent in [-900, -400, 400, 900] {
        let scale = 2f64.powi(exponent);
        let scaled = frames(scale);
        assert_eq!(scaled.tangents, unit.tangents);
        assert_eq!(scaled.normals, unit.normals);
        assert!(scaled.degenerate.is_empty());
        assert!(
            scaled
                .curvatures
                .iter()
                .zip(&unit.curvatures)
                .all(|(a, b)| (a * scale / b - 1.0).abs() < 1e-12)
        );
        assert!(
            scaled
                .torsions
                .iter()
                .zip(&unit.torsions)
                .all(|(a, b)| (a * scale / b - 1.0).abs() < 1e-9)
        );
    }
}

#[test]
fn far_from_the_origin_curves_keep_what_doubles_hold() {
    let offset = Point([1e15, -1e15]);
    let near = single(Basis::Beta(Beta::from_beta(1.0).unwrap()), wander(4, 1000.0));
    let far = single(
        Basis::Beta(Beta::from_beta(1.0).unwrap()),
        wander(4, 1000.0).into_iter().map(|p| p + offset).collect(),
    );
    let expected: Vec<_> = at(&near, &even(&near, 20)).into_iter().map(|p| p + offset).collect();
    assert!(apart(&at(&far, &even(&far, 20)), &expected) < 2.0);
    assert!(
        evaluate(&Context::default(), &far, &Sampling::Tolerance(1e-3), 0, Quantities::default())
            .is_err()
    );
}

#[test]
fn interpolants_of_tiny_and_huge_points_scale() {
    let unit = interpolate(
        &Context::default(),
        &wander(9, 1.0),
        OPEN,
        bezier(),
        &Parameterization::ChordLength,
    )
    .unwrap();
    for exponent in [-900, -300, 300, 900] {
        let scale = 2f64.powi(exponent);
        let points: Vec<_> = wander(9, 1.0).into_iter().map(|p| p * scale).collect();
        let scaled = interpolate(
            &Context::default(),
            &points,
            OPEN,
            bezier(),
            &Parameterization::ChordLength,
        )
        .unwrap();
        assert!(
            unit.curve
                .control_points()
                .iter()
                .zip(scaled.curve.control_points())
                .all(|(&p, &q)| p * scale == q)
        );
        assert_eq!(scaled.continuity.class, Smoothness::C2);
    }
}

#[test]
fn ends_that_coincide_meet_however_large_the_curve() {
    let big = 1.7e308;
    let curve = piecewise(
        2,
        vec![0.0, 1.0, 2.0],
        false,
        [-big, big, -big, big, -big].map(|x| Point([x, -x])).to_vec(),
    );
    let result =
        to_bspline(&Context::default(), &curve, KnotStyle::Clamped, CONTINUITY_TOLERANCE).unwrap();
    assert_eq!((result.joints[0].continuity, result.joints[0].multiplicity), (0, 2));
}

// ---- degenerate shapes

#[test]
fn a_curve_that_is_one_point_answers_everything() {
    for closed in [false, true] {
        let curve = piecewise(3, vec![0.0, 1.0, 3.0], closed, vec![Point([2.0, -1.0, 5.0]); 7]);
        let samples = evaluate(&Context::default(), &curve, &Sampling::Count(5), 3, ALL).unwrap();
        assert!(samples.points.iter().all(|p| p.distance(Point([2.0, -1.0, 5.0])) < 1e-15 * 8.0));
        assert!(samples.derivatives.iter().flatten().all(|v| *v == Point::ZERO));
        assert_eq!(samples.frames.degenerate.len(), 5);
        assert!(samples.frames.degenerate.iter().all(|d| d.zero_speed));
        assert_eq!(
            evaluate(&Context::default(), &curve, &Sampling::Tolerance(1e-6), 0, ALL)
                .unwrap()
                .points
                .len(),
            3
        );
        assert_eq!(
            subdivide(&Context::default(), &curve, &Cuts::Flatness(1e-6), Form::Auto)
                .unwrap()
                .curve
                .breaks()
                .segments(),
            2
        );
        for style in [KnotStyle::Clamped, KnotStyle::Periodic] {
            let result = to_bspline(&Context::default(), &curve, style, CONTINUITY_TOLERANCE);
            assert!(result.is_ok() || style == KnotStyle::Periodic && !closed, "{result:?}");
        }
    }
}

#[test]
fn equal_points_interpolate_to_a_point_where_knots_do_not_need_distances() {
    let points = [Point([1.0, 2.0]); 5];
    for shape in [OPEN, EndConditions::Closed, EndConditions::Open(End::NotAKnot, End::NotAKnot)] {
        let result =
            interpolate(&Context::default(), &points, shape, bezier(), &Parameterization::Uniform)
                .unwrap();
        assert!(result.curve.control_points().iter().all(|&p| p == points[0]));
        assert_eq!(result.continuity.class, Smoothness::C2);
        let error = interpolate(
            &Context::default(),
            &points,
            shape,
            bezier(),
            &Parameterization::ChordLength,
        )
        .unwrap_err();
        assert_eq!(error.place.to_string(), "/points/1");
    }
}

#[test]
fn a_cusp_has_points_but_no_frame() {
    // (t^2, t^3) over [-1, 1].
    let cusp = vec![
        Point([1.0, -1.0]),
        Point([-1.0 / 3.0, 1.0]),
        Point([-1.0 / 3.0, -1.0]),
        Point([1.0, 1.0]),
    ];
    let quantities = Quantities { torsion: false, ..ALL };
    let samples = evaluate(
        &Context::default(),
        &single(Basis::Bezier(Bezier), cusp),
        &Sampling::Count(5),
        1,
        quantities,
    )
    .unwrap();
    let degenerate = &samples.frames.degenerate;
    assert_eq!((degenerate.len(), degenerate[0].index, degenerate[0].zero_speed), (1, 2, true));
    assert!(samples.frames.curvatures.iter().all(|k| k.is_finite()));
}

#[test]
fn straight_space_curves_have_a_tangent_but_no_normal() {
    let line: Vec<_> =
        (0..4).map(|i| Point([f64::from(i), 2.0 * f64::from(i), -f64::from(i)])).collect();
    let frames = evaluate(
        &Context::default(),
        &single(Basis::Bezier(Bezier), line),
        &Sampling::Count(5),
        0,
        ALL,
    )
    .unwrap()
    .frames;
    assert_eq!(frames.degenerate.len(), 5);
    assert!(frames.degenerate.iter().all(|d| !d.zero_speed));
}

#[test]
fn the_smallest_closed_curves_convert() {
    let loops = [
        piecewise(1, vec![0.0, 1.0], true, vec![Point([1.0, 1.0]); 2]),
        piecewise(
            1,
            vec![0.0, 1.0, 2.0],
            true,
            vec![Point([0.0, 0.0]), Point([1.0, 1.0]), Point([0.0, 0.0])],
        ),
        piecewise(
            3,
            vec![0.0, 1.0],
            true,
            vec![Point([0.0, 0.0]), Point([1.0, 0.0]), Point([0.0, 1.0]), Point([0.0, 0.0])],
        ),
    ];
    for curve in loops {
        for style in [KnotStyle::Clamped, KnotStyle::Periodic] {
            let spline = Curve::BSpline(
                to_bspline(&Context::default(), &curve, style, CONTINUITY_TOLERANCE).unwrap().curve,
            );
            assert!(curves_apart(&spline, &curve) < 1e-14);
        }
    }
}

// ---- knots and parameters

/// Two lines with a jump of 1 between them, at the knot 1.
fn jump() -> Curve<2> {
    let points = vec![Point([0.0, 0.0]), Point([1.0, 0.0]), Point([1.0, 1.0]), Point([2.0, 1.0])];
    Curve::BSpline(
        BSpline::new(&Context::default(), 1, vec![0.0, 0.0, 1.0, 1.0, 2.0, 2.0], points, false)
            .unwrap(),
    )
}

#[test]
fn a_jump_is_evaluated_from_the_right_reported_and_converted() {
    let curve = jump();
    assert_eq!(
        at(&curve, &[0.5, 1.0, 2.0]),
        [Point([0.5, 0.0]), Point([1.0, 1.0]), Point([2.0, 1.0])]
    );
    assert_eq!(
        continuity(
            &Context::default(),
            &curve.composite(&Context::default()).unwrap(),
            false,
            Tolerance::default()
        )
        .unwrap()
        .class,
        Smoothness::Discontinuous
    );
    let result =
        to_bspline(&Context::default(), &curve, KnotStyle::Clamped, CONTINUITY_TOLERANCE).unwrap();
    assert_eq!((result.joints[0].continuity, result.joints[0].multiplicity), (-1, 2));
    assert_eq!(Curve::BSpline(result.curve), curve);
    assert!(subdivide(&Context::default(), &curve, &Cuts::Depth(1), Form::Auto).is_err());
}

#[test]
fn a_tolerance_was_promised_across_a_jump() {
    let error = evaluate(
        &Context::default(),
        &jump(),
        &Sampling::Tolerance(0.01),
        0,
        Quantities::default(),
    )
    .unwrap_err();
    assert_eq!(error.place.to_string(), "/curve");
}

#[test]
fn knots_further_apart_than_any_double_gave_a_wrong_curve() {
    let far = 1.7e308;
    let knots = vec![-far, -far, -far, 0.0, 1.0, far, far, far];
    let points = wander(4, 1.0);
    let error = BSpline::new(&Context::default(), 3, knots, points, false).unwrap_err();
    assert_eq!(error.fault, Fault::Overflow);
}

#[test]
fn knots_very_close_and_very_far_apart_stay_exact() {
    for gap in [5e-324, 1e-300, 1e-16, 1e16, 1e300] {
        let curve = Curve::BSpline(
            BSpline::new(
                &Context::default(),
                2,
                vec![0.0, 0.0, 0.0, gap, 1e307, 1e307, 1e307],
                wander(4, 1.0),
                false,
            )
            .unwrap(),
        );
        let samples =
            evaluate(&Context::default(), &curve, &Sampling::Count(9), 0, Quantities::default())
                .unwrap();
        assert!(samples.points.iter().all(|p| p.is_finite()), "{gap}");
        let result =
            to_bspline(&Context::default(), &curve, KnotStyle::Clamped, CONTINUITY_TOLERANCE)
                .unwrap();
        assert!(curves_apart(&Curve::BSpline(result.curve), &curve) < 1e-9 * size(&curve), "{gap}");
    }
}

#[test]
fn distances_that_overflow_were_called_repeated_points() {
    let points = [Point([-1.5e308, 0.0]), Point([1.5e308, 0.0]), Point([-1.5e308, 1.0])];
    let error =
        Parameterization::ChordLength.knots(&Context::default(), &points, false).unwrap_err();
    assert_eq!((error.fault, error.place.to_string()), (Fault::Overflow, "/points/1".to_string()));
}

#[test]
fn points_close_for_their_distance_along_the_curve_were_called_repeated() {
    let points = [Point([0.0, 0.0]), Point([1e20, 0.0]), Point([1e20, 1.0])];
    let error =
        Parameterization::ChordLength.knots(&Context::default(), &points, false).unwrap_err();
    assert!(matches!(error.fault, Fault::NotIncreasing { .. }), "{error}");
    assert_eq!(error.place.to_string(), "/points/2");
}

#[test]
fn joints_of_short_segments_were_all_called_smooth() {
    // The scale of the derivatives overflowed, and with it what rounding was allowed to do.
    for length in [1e-160, 1e-300] {
        let corner = vec![
            Point([0.0, 0.0]),
            Point([1.0, 0.0]),
            Point([1.0, 1.0]),
            Point([0.0, 3.0]),
            Point([5.0, 3.0]),
        ];
        let curve = piecewise(2, vec![0.0, length, 2.0 * length], false, corner);
        let result =
            to_bspline(&Context::default(), &curve, KnotStyle::Clamped, CONTINUITY_TOLERANCE)
                .unwrap();
        assert_eq!(
            (result.joints[0].continuity, result.joints[0].multiplicity),
            (0, 2),
            "{length}"
        );
    }
    let bend = [[0.0, 0.0], [1.0, 1.0], [2.0, 1.0], [3.0, 1.0], [4.0, 5.0]]
        .map(|p| Point(p) * 1e-200)
        .to_vec();
    let result = to_bspline(
        &Context::default(),
        &piecewise(2, vec![0.0, 1e-160, 2e-160], false, bend),
        KnotStyle::Clamped,
        CONTINUITY_TOLERANCE,
    )
    .unwrap();
    assert_eq!((result.joints[0].continuity, result.joints[0].multiplicity), (1, 1));
    let wild = wander(129, 1.0);
    let result = to_bspline(
        &Context::default(),
        &piecewise(64, vec![0.0, 1e-6, 2e-6], false, wild),
        KnotStyle::Clamped,
        CONTINUITY_TOLERANCE,
    )
    .unwrap();
    assert_eq!((result.joints[0].continuity, result.joints[0].multiplicity), (0, 64));
}

#[test]
fn halving_an_interval_without_doubles_inside_blamed_a_knot() {
    for start in [0.0, 1e15] {
        let end = if start == 0.0 { 5e-324 } else { start + 1.0 };
        let curve = piecewise(1, vec![start, end], false, wander(2, 1.0));
        let error =
            subdivide(&Context::default(), &curve, &Cuts::Depth(5), Form::Auto).unwrap_err();
        assert_eq!(error.place.to_string(), "/cuts/depth", "{error}");
        assert_eq!(domain(&curve), (start, end));
    }
}

#[test]
fn parameters_one_double_from_a_joint_cut_without_harm() {
    let curve = piecewise(3, vec![0.0, 1.0, 3.0], false, wander(7, 1.0));
    let values = vec![5e-324, 1f64.next_down(), 1.0, 1f64.next_up(), 3f64.next_down()];
    let pieces =
        subdivide(&Context::default(), &curve, &Cuts::Parameters(values.clone()), Form::Bezier)
            .unwrap();
    assert_eq!(pieces.curve.breaks().segments(), 6);
    assert!(apart(&at(&curve, &values), &pieces.split_points) < 1e-14);
}

// ---- shape parameters

#[test]
fn extreme_shape_parameters_are_refused_by_their_condition_where_there_is_no_way_back() {
    for basis in [Beta::from_beta(1e300), Beta::from_beta(1e9), Beta::from_lambda(1e-300)] {
        let fault = Basis::Beta(basis.unwrap()).way_back(&Context::default(), 3).unwrap_err();
        assert!(matches!(fault, Fault::IllConditioned { .. }), "{fault}");
    }
    let flat = Basis::AlphaBeta(AlphaBeta::new(1e-200, 1e-200).unwrap());
    assert!(matches!(flat.way_back(&Context::default(), 3), Err(Fault::IllConditioned { .. })));
    let tiny = Basis::Beta(Beta::from_beta(1e-300).unwrap());
    assert_eq!(
        tiny.way_back(&Context::default(), 3).unwrap().control_points(&wander(4, 1.0)),
        wander(4, 1.0)
    );
    let curve = Curve::Single(Single::new(&Context::default(), flat, wander(4, 1.0)).unwrap());
    assert!(at(&curve, &even(&curve, 10)).iter().all(|p| p.is_finite()));
}

// ---- sizes

#[test]
fn tolerances_too_small_or_too_expensive_are_refused() {
    let curve = single(Basis::Bezier(Bezier), wander(65, 1e6));
    let sample = |tolerance| {
        evaluate(
            &Context::default(),
            &curve,
            &Sampling::Tolerance(tolerance),
            0,
            Quantities::default(),
        )
    };
    for tolerance in [0.0, -1.0, f64::NAN, f64::INFINITY, 1e-300] {
        assert_eq!(sample(tolerance).unwrap_err().place.to_string(), "/sampling/tolerance");
    }
    assert_eq!(sample(1e300).unwrap().points.len(), 2);
}

#[test]
fn one_hundred_thousand_points_interpolate_in_linear_time() {
    let points = wander(100_000, 1.0);
    for shape in [OPEN, EndConditions::Closed] {
        let result =
            interpolate(&Context::default(), &points, shape, bezier(), &Parameterization::Uniform)
                .unwrap();
        assert_eq!(result.continuity.class, Smoothness::C2);
        let curve = Curve::Piecewise(result.curve);
        let samples = evaluate(
            &Context::default(),
            &curve,
            &Sampling::Count(100_000),
            1,
            Quantities::default(),
        )
        .unwrap();
        assert!(samples.points.iter().all(|p| p.is_finite()));
    }
}

#[test]
fn former_joints_were_counted_in_quadratic_time() {
    let points = wander(100_000, 1.0);
    let corners = piecewise(1, (0..100_000).map(f64::from).collect(), false, points);
    let result =
        to_bspline(&Context::default(), &corners, KnotStyle::Clamped, CONTINUITY_TOLERANCE)
            .unwrap();
    assert!(result.joints.iter().all(|joint| joint.multiplicity == 1));
}

#[test]
fn a_basis_was_inverted_again_for_every_piece() {
    let basis = |beta: f64| Basis::Beta(Beta::from_beta(beta).unwrap());
    let bases = Bases::PerSegment(vec![basis(1e-4), basis(2e-4)]);
    let breaks = Breaks::new(&Context::default(), vec![0.0, 1.0, 2.0]).unwrap();
    let curve = Curve::Piecewise(
        Piecewise::new(&Context::default(), bases, 40, breaks, false, wander(81, 1.0)).unwrap(),
    );
    let pieces = subdivide(&Context::default(), &curve, &Cuts::Depth(9), Form::Auto).unwrap();
    assert!(pieces.in_family && pieces.curve.breaks().segments() == 1024);
    let error = subdivide(&Context::default(), &curve, &Cuts::Depth(13), Form::Family).unwrap_err();
    assert!(matches!(error.fault, Fault::TooLarge { .. }), "{error}");
}
