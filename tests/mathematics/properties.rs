//! Laws that hold for every curve, on seeded random curves of every kind.

use crate::laws::{
    any, apart, at, control_points, curves_apart, domain, even, jets, law, single, size,
};
use proptest::collection::vec;
use proptest::prelude::*;
use springline::core::basis::{Basis, Bezier};
use springline::core::context::Context;
use springline::core::curve::{BSpline, Curve};
use springline::core::evaluate::{Quantities, Sampling, evaluate};
use springline::core::limits::CONTINUITY_TOLERANCE;
use springline::core::point::Point;
use springline::core::subdivide::{Cuts, Form, subdivide};
use springline::core::to_bspline::{KnotStyle, to_bspline};

// ---- shape matrices

#[test]
fn shape_matrices_are_non_negative_with_rows_that_sum_to_one() {
    let basis = (1usize..64).prop_flat_map(|order| (any::basis(order), Just(order)));
    law(200, basis, |(basis, order)| {
        let degree = basis.degree(&Context::default(), order).unwrap();
        let matrix = basis.shape_matrix(order);
        assert_eq!((matrix.degree(), matrix.order()), (degree, order));
        for row in matrix.rows() {
            assert!(row.iter().all(|&m| (0.0..=1.0 + 1e-14).contains(&m)), "{row:?}");
            assert!((row.iter().sum::<f64>() - 1.0).abs() < 2e-14 * (order + 1) as f64, "{row:?}");
        }
    });
}

#[test]
fn beta_bezier_matrices_keep_their_laws_up_to_degree_64() {
    for exponent in (-308..=308).step_by(28).chain([-8, -1, 0, 1, 8]) {
        for order in [1, 2, 3, 7, 20, 33, 64] {
            let x = 10f64.powi(exponent);
            for basis in [
                springline::core::basis::Beta::from_beta(x),
                springline::core::basis::Beta::from_lambda(x),
            ] {
                let matrix = Basis::Beta(basis.unwrap()).shape_matrix(order);
                let properties =
                    matrix.rows().all(|row| row.iter().all(|m| (0.0..=1.0 + 1e-14).contains(m)));
                assert!(
                    properties && matrix.interpolates_end_points(),
                    "1e{exponent}, order {order}"
                );
                assert!(
                    matrix.rows().all(|row| (row.iter().sum::<f64>() - 1.0).abs() < 1e-12),
                    "1e{exponent}, order {order}"
                );
            }
        }
    }
}

// ---- where the curve lies

#[test]
fn curves_stay_in_the_convex_hull_of_their_control_points() {
    let with_directions = (any::curve::<3>(), vec(any::point::<3>(), 20));
    law(120, with_directions, |(curve, directions)| {
        let samples = at(&curve, &even(&curve, 64));
        for direction in directions {
            let reach = |points: &[Point<3>]| {
                points.iter().map(|p| p.dot(direction)).fold(f64::NEG_INFINITY, f64::max)
            };
            let allowed = 1e-14 * size(&curve) * direction.norm();
            assert!(reach(&samples) <= reach(control_points(&curve)) + allowed);
        }
    });
}

#[test]
fn single_and_piecewise_curves_start_and_end_exactly_at_control_points() {
    law(100, prop_oneof![any::one_segment::<2>(1..64), any::piecewise()], |curve| {
        let (a, b) = domain(&curve);
        let points = control_points(&curve);
        assert_eq!(at(&curve, &[a, b]), [points[0], points[points.len() - 1]]);
    });
}

#[test]
fn piecewise_curves_pass_through_their_joints() {
    law(60, any::piecewise::<2>(), |curve| {
        let Curve::Piecewise(pieces) = &curve else { unreachable!() };
        let joints: Vec<_> =
            pieces.control_points().iter().copied().step_by(pieces.order()).collect();
        assert_eq!(at(&curve, pieces.breaks().as_slice()), joints);
    });
}

fn symmetric_basis(order: usize) -> impl Strategy<Value = Basis> {
    let bezier = Just(Basis::Bezier(Bezier)).boxed();
    let cubic = if order == 3 { any::alpha_beta().boxed() } else { bezier.clone() };
    let wu = if order > 1 { any::wu().boxed() } else { bezier.clone() };
    prop_oneof![bezier, any::beta(), cubic, wu]
}

#[test]
fn a_symmetric_basis_runs_a_reversed_polygon_backwards() {
    let parts =
        (1usize..30).prop_flat_map(|order| (symmetric_basis(order), any::points::<2>(order + 1)));
    law(120, parts, |(basis, points)| {
        let forward = single(basis.clone(), points.clone());
        let backward = single(basis, points.into_iter().rev().collect());
        let (a, b) = domain(&forward);
        let forth = even(&forward, 32);
        let back: Vec<_> = forth.iter().map(|t| (a + (b - t)).clamp(a, b)).collect();
        assert!(
            apart(&at(&forward, &forth), &at(&backward, &back))
                < 1e-13 * size(&forward) * control_points(&forward).len() as f64
        );
    });
}

#[test]
fn curves_move_with_their_control_points_under_affine_maps() {
    let map = (any::point::<2>(), any::point(), any::point());
    law(100, (any::curve::<2>(), map), |(curve, (x_axis, y_axis, origin))| {
        let apply = |p: Point<2>| origin + x_axis * p[0] + y_axis * p[1];
        let moved = with_points(&curve, apply);
        let parameters = even(&curve, 32);
        let expected: Vec<_> = at(&curve, &parameters).into_iter().map(apply).collect();
        assert!(
            apart(&at(&moved, &parameters), &expected)
                < 1e-12 * (1.0 + size(&moved) + 30.0 * size(&curve))
        );
    });
}

/// The same curve with every control point mapped.
fn with_points<const D: usize>(curve: &Curve<D>, map: impl Fn(Point<D>) -> Point<D>) -> Curve<D> {
    let points = control_points(curve).iter().map(|&p| map(p)).collect();
    match curve {
        Curve::Single(c) => single(c.basis().clone(), points),
        Curve::Piecewise(c) => Curve::Piecewise(
            springline::core::curve::Piecewise::new(
                &Context::default(),
                c.bases().clone(),
                c.order(),
                c.breaks().clone(),
                c.closed(),
                points,
            )
            .unwrap(),
        ),
        Curve::BSpline(c) => Curve::BSpline(
            BSpline::new(
                &Context::default(),
                c.degree(),
                c.knots().as_slice().to_vec(),
                points,
                c.closed(),
            )
            .unwrap(),
        ),
    }
}

/// B-spline basis functions by the recursion of Cox and de Boor, from the right at knots.
fn cox_de_boor(knots: &[f64], degree: usize, i: usize, t: f64) -> f64 {
    if degree == 0 {
        return f64::from(knots[i] <= t && t < knots[i + 1]);
    }
    let part =
        |a: f64, b: f64, top: f64, lower: f64| if a < b { top / (b - a) * lower } else { 0.0 };
    let left =
        part(knots[i], knots[i + degree], t - knots[i], cox_de_boor(knots, degree - 1, i, t));
    left + part(
        knots[i + 1],
        knots[i + degree + 1],
        knots[i + degree + 1] - t,
        cox_de_boor(knots, degree - 1, i + 1, t),
    )
}

#[test]
fn b_splines_agree_with_the_recursion_of_cox_and_de_boor() {
    law(80, any::bspline::<2>(1..6, 0), |curve| {
        let Curve::BSpline(spline) = &curve else { unreachable!() };
        let (knots, degree) = (spline.knots().as_slice(), spline.degree());
        let parameters: Vec<_> =
            crate::laws::inner_parameters(&curve.composite(&Context::default()).unwrap()).collect();
        let by_recursion = |&t: &f64| {
            let terms = spline
                .control_points()
                .iter()
                .enumerate()
                .map(|(i, &p)| p * cox_de_boor(knots, degree, i, t));
            terms.fold(Point::ZERO, |sum, p| sum + p)
        };
        let expected: Vec<_> = parameters.iter().map(by_recursion).collect();
        assert!(apart(&at(&curve, &parameters), &expected) < 1e-13 * size(&curve));
    });
}

// ---- derivatives and curvature

#[test]
fn derivatives_agree_with_differences_of_the_derivative_below() {
    law(60, any::curve::<3>(), |curve| {
        let composite = curve.composite(&Context::default()).unwrap();
        for segment in 0..composite.breaks().segments() {
            let (a, b) = composite.breaks().interval(segment);
            let (middle, h) = (a + 0.4 * (b - a), 1e-5 * (b - a));
            let lists = jets(&curve, &[middle - h, middle, middle + h], 4);
            for k in 1..=4 {
                let slope = (lists[k - 1][2] - lists[k - 1][0]).map(|x| x / (2.0 * h));
                let scale = size(&curve)
                    * (0..k)
                        .map(|i| 2.0 * composite.degree().saturating_sub(i).max(1) as f64 / (b - a))
                        .product::<f64>();
                assert!(slope.distance(lists[k][1]) < 1e-7 * scale, "order {k}");
            }
        }
    });
}

const FRAME: Quantities =
    Quantities { tangent: true, normal: true, curvature: true, torsion: false, speed: true };

#[test]
fn the_curvature_of_a_parabola_is_known() {
    let curve = single(
        Basis::Bezier(Bezier),
        vec![Point([-1.0, 1.0]), Point([0.0, -1.0]), Point([1.0, 1.0])],
    );
    let samples = evaluate(&Context::default(), &curve, &Sampling::Count(101), 0, FRAME).unwrap();
    for (i, p) in samples.points.iter().enumerate() {
        let x = p[0];
        let slope = (1.0 + 4.0 * x * x).sqrt();
        assert!((p[1] - x * x).abs() < 1e-15);
        assert!((samples.frames.curvatures[i] - 2.0 / slope.powi(3)).abs() < 1e-13, "x = {x}");
        assert!(samples.frames.tangents[i].distance(Point([1.0, 2.0 * x]) * (1.0 / slope)) < 1e-15);
        assert!(samples.frames.normals[i].distance(Point([-2.0 * x, 1.0]) * (1.0 / slope)) < 1e-15);
        assert!((samples.frames.speeds[i] - 2.0 * slope).abs() < 1e-14);
    }
    let back =
        single(Basis::Bezier(Bezier), control_points(&curve).iter().rev().copied().collect());
    let mirrored = evaluate(&Context::default(), &back, &Sampling::Count(101), 0, FRAME).unwrap();
    assert!(mirrored.frames.curvatures.iter().all(|&k| k < 0.0), "turning right is negative");
}

#[test]
fn curvature_and_torsion_of_the_twisted_cubic_are_known() {
    let third = 1.0 / 3.0;
    let points = vec![
        Point([0.0; 3]),
        Point([third, 0.0, 0.0]),
        Point([2.0 * third, third, 0.0]),
        Point([1.0, 1.0, 1.0]),
    ];
    let curve = single(Basis::Bezier(Bezier), points);
    let samples = evaluate(
        &Context::default(),
        &curve,
        &Sampling::Count(101),
        0,
        Quantities { torsion: true, ..FRAME },
    )
    .unwrap();
    assert!(samples.frames.degenerate.is_empty());
    for (i, &t) in samples.parameters.iter().enumerate() {
        let (speed, area) =
            (1.0 + 4.0 * t * t + 9.0 * t.powi(4), 9.0 * t.powi(4) + 9.0 * t * t + 1.0);
        assert!(
            (samples.frames.curvatures[i] - 2.0 * area.sqrt() / speed.powf(1.5)).abs() < 1e-13,
            "t = {t}"
        );
        assert!((samples.frames.torsions[i] - 3.0 / area).abs() < 1e-12, "t = {t}");
        assert!(samples.frames.tangents[i].dot(samples.frames.normals[i]).abs() < 1e-14);
    }
}

#[test]
fn the_torsion_of_a_mirrored_curve_changes_its_sign() {
    let quantities = Quantities { torsion: true, curvature: true, ..Quantities::default() };
    law(40, any::points::<3>(5), |points| {
        let curve = single(Basis::Bezier(Bezier), points);
        let mirrored = with_points(&curve, |p| Point([p[0], p[1], -p[2]]));
        let [one, other] = [curve, mirrored].map(|c| {
            evaluate(&Context::default(), &c, &Sampling::Count(20), 0, quantities).unwrap().frames
        });
        assert_eq!(one.curvatures, other.curvatures);
        assert!(one.torsions.iter().zip(&other.torsions).all(|(a, b)| *a == -*b));
    });
}

// ---- sampling within a tolerance

/// The largest distance between a curve and its polyline, measured densely inside each piece.
fn polyline_error<const D: usize>(curve: &Curve<D>, parameters: &[f64]) -> f64 {
    let ends = at(curve, parameters);
    let measure = |i: usize| {
        let (a, b) = (parameters[i], parameters[i + 1]);
        let inside: Vec<_> = (0..16).map(|j| a + (b - a) * (j as f64 + 0.5) / 16.0).collect();
        at(curve, &inside)
            .into_iter()
            .map(|p| crate::laws::to_segment(p, ends[i], ends[i + 1]))
            .fold(0.0, f64::max)
    };
    (0..parameters.len() - 1).map(measure).fold(0.0, f64::max)
}

#[test]
fn samples_to_a_tolerance_keep_it_between_samples() {
    law(40, (any::curve::<2>(), -3.0..0.5), |(curve, exponent)| {
        let tolerance = 10f64.powf(exponent);
        let samples = evaluate(
            &Context::default(),
            &curve,
            &Sampling::Tolerance(tolerance),
            0,
            Quantities::default(),
        )
        .unwrap();
        let (a, b) = domain(&curve);
        assert_eq!(
            [samples.parameters[0], samples.parameters[samples.parameters.len() - 1]],
            [a, b]
        );
        let coarse: Vec<_> = samples.parameters.clone();
        let error =
            polyline_error(&curve, if coarse.len() > 400 { &coarse[..400] } else { &coarse });
        assert!(error <= tolerance, "{error} > {tolerance}");
    });
}

#[test]
fn flat_pieces_are_flat_and_not_needlessly_many() {
    law(30, (any::one_segment::<3>(2..9), -2.0..0.5), |(curve, exponent)| {
        let tolerance = 10f64.powf(exponent);
        let flat = subdivide(&Context::default(), &curve, &Cuts::Flatness(tolerance), Form::Bezier)
            .unwrap()
            .curve;
        let error = polyline_error(&curve, flat.breaks().as_slice());
        assert!(error <= tolerance, "{error} > {tolerance}");
        let count = flat.breaks().segments();
        let tenfold = subdivide(
            &Context::default(),
            &curve,
            &Cuts::Flatness(tolerance / 100.0),
            Form::Bezier,
        )
        .unwrap()
        .curve
        .breaks()
        .segments();
        assert!(
            tenfold <= 40 * count,
            "the error falls with the square of the length: {count} pieces, then {tenfold}"
        );
    });
}

// ---- subdivision

fn cuts(domain: (f64, f64), choice: u8, shares: &[f64]) -> Cuts {
    match choice {
        0 => Cuts::Depth(shares.len()),
        1 => Cuts::Flatness(0.1),
        _ => {
            let mut values: Vec<f64> =
                shares.iter().map(|s| domain.0 + s * (domain.1 - domain.0)).collect();
            values.sort_by(f64::total_cmp);
            values.dedup();
            Cuts::Parameters(values)
        }
    }
}

#[test]
fn pieces_run_over_the_curve_they_were_cut_from() {
    let forms = prop_oneof![Just(Form::Auto), Just(Form::Bezier), Just(Form::Family)];
    law(
        250,
        (any::curve::<2>(), 0u8..4, vec(0.01..0.99, 0..5), forms),
        |(curve, choice, shares, form)| {
            let result = subdivide(
                &Context::default(),
                &curve,
                &cuts(domain(&curve), choice, &shares),
                form,
            );
            let Ok(pieces) = result else { return assert_eq!(form, Form::Family, "{result:?}") };
            let accuracy = 1e-13 * size(&curve) * pieces.condition;
            assert_eq!(pieces.in_family, pieces.in_family && form != Form::Bezier);
            assert!(
                apart(&at(&curve, &pieces.split_parameters), &pieces.split_points)
                    < 1e-13 * size(&curve)
            );
            let whole = Curve::Piecewise(pieces.curve);
            assert_eq!(domain(&whole), domain(&curve));
            assert_eq!(whole.closed(), curve.closed());
            assert!(
                curves_apart(&whole, &curve) < accuracy,
                "{} > {accuracy}",
                curves_apart(&whole, &curve)
            );
        },
    );
}

#[test]
fn the_family_form_keeps_the_family() {
    let parts = (any::cubic_with_way_back(), any::points::<2>(4), 0.01..0.99);
    law(60, parts, |(basis, points, share)| {
        let curve = single(basis.clone(), points);
        let t = share * basis.length();
        let pieces =
            subdivide(&Context::default(), &curve, &Cuts::Parameters(vec![t]), Form::Family)
                .unwrap();
        assert!(pieces.in_family);
        assert_eq!(pieces.curve.bases().as_slice(), [basis]);
        assert_eq!(pieces.curve.breaks().segments(), 2);
    });
}

// ---- B-splines

#[test]
fn a_clamped_b_spline_is_the_curve_it_was_made_from() {
    law(150, any::curve::<3>(), |curve| {
        let result =
            to_bspline(&Context::default(), &curve, KnotStyle::Clamped, CONTINUITY_TOLERANCE)
                .unwrap();
        let apart = curves_apart(&Curve::BSpline(result.curve), &curve);
        assert!(apart < 1e-12 * size(&curve), "{apart}");
        assert!(
            result.deviation < 1e-12 * size(&curve)
                && apart <= result.deviation + 1e-14 * size(&curve)
        );
    });
}

#[test]
fn a_b_spline_of_a_b_spline_is_the_same() {
    law(80, any::curve::<2>(), |curve| {
        let once =
            to_bspline(&Context::default(), &curve, KnotStyle::Clamped, CONTINUITY_TOLERANCE)
                .unwrap()
                .curve;
        let twice = to_bspline(
            &Context::default(),
            &Curve::BSpline(once.clone()),
            KnotStyle::Clamped,
            CONTINUITY_TOLERANCE,
        )
        .unwrap()
        .curve;
        assert_eq!(once.knots(), twice.knots());
        assert!(apart(once.control_points(), twice.control_points()) < 1e-11 * size(&curve));
    });
}

#[test]
fn cubics_go_to_uniform_knots_and_back() {
    law(80, any::one_segment::<2>(1..5), |curve| {
        let result =
            to_bspline(&Context::default(), &curve, KnotStyle::Uniform, CONTINUITY_TOLERANCE)
                .unwrap()
                .curve;
        let (degree, knots) = (result.degree(), result.knots().as_slice());
        assert_eq!(knots.len(), 2 * degree + 2);
        let step = domain(&curve).1;
        assert!(
            (0..knots.len()).all(|i| (knots[i] - (i as f64 - degree as f64) * step).abs()
                < 1e-14 * (degree + 1) as f64)
        );
        assert!(curves_apart(&Curve::BSpline(result), &curve) < 1e-11 * size(&curve));
    });
}

/// Bezier pieces of a B-spline with these knots.
fn cut_b_spline(curve: &Curve<2>) -> Curve<2> {
    Curve::Piecewise(
        subdivide(&Context::default(), curve, &Cuts::Depth(0), Form::Bezier).unwrap().curve,
    )
}

#[test]
fn knots_of_lowest_multiplicity_come_back_from_bezier_pieces() {
    law(80, any::bspline::<2>(2..6, 0), |curve| {
        let Curve::BSpline(spline) = &curve else { unreachable!() };
        let found = to_bspline(
            &Context::default(),
            &cut_b_spline(&curve),
            KnotStyle::Clamped,
            CONTINUITY_TOLERANCE,
        )
        .unwrap();
        let (a, b) = domain(&curve);
        let inside =
            |knots: &[f64]| knots.iter().copied().filter(|&t| a < t && t < b).collect::<Vec<_>>();
        assert_eq!(inside(found.curve.knots().as_slice()), inside(spline.knots().as_slice()));
        for joint in &found.joints {
            assert_eq!(joint.multiplicity as i32, spline.degree() as i32 - joint.continuity);
        }
    });
}

#[test]
fn joints_inside_one_polynomial_vanish() {
    law(60, (any::one_segment::<2>(1..6), 1usize..4), |(curve, depth)| {
        let pieces = Curve::Piecewise(
            subdivide(&Context::default(), &curve, &Cuts::Depth(depth), Form::Bezier)
                .unwrap()
                .curve,
        );
        let spline =
            to_bspline(&Context::default(), &pieces, KnotStyle::Clamped, CONTINUITY_TOLERANCE)
                .unwrap()
                .curve;
        assert_eq!(spline.control_points().len(), spline.degree() + 1);
        assert!(curves_apart(&Curve::BSpline(spline), &curve) < 1e-9 * size(&curve));
    });
}

/// Continuing one of 16 pieces of a curve of degree 8 over all of them multiplies rounding errors
/// by 16^8: clamped knots were refused with the advice to ask for clamped knots.
#[test]
fn clamped_knots_were_refused_for_a_finely_cut_curve_of_high_degree() {
    law(40, (any::one_segment::<2>(6..40), 3usize..6), |(curve, depth)| {
        let pieces = Curve::Piecewise(
            subdivide(&Context::default(), &curve, &Cuts::Depth(depth), Form::Bezier)
                .unwrap()
                .curve,
        );
        let result =
            to_bspline(&Context::default(), &pieces, KnotStyle::Clamped, CONTINUITY_TOLERANCE)
                .unwrap();
        let multiplicity =
            |t: f64| result.curve.knots().as_slice().iter().filter(|&&knot| knot == t).count();
        assert!(
            result.joints.iter().all(|joint| joint.multiplicity == multiplicity(joint.parameter))
        );
        assert!(curves_apart(&Curve::BSpline(result.curve), &curve) <= 1e-9 * size(&curve));
    });
}

fn closed_polygon() -> impl Strategy<Value = Curve<2>> {
    any::piecewise::<2>().prop_filter("closed", Curve::closed)
}

#[test]
fn periodic_b_splines_repeat_and_run_over_the_closed_curve() {
    law(60, closed_polygon(), |curve| {
        let spline =
            to_bspline(&Context::default(), &curve, KnotStyle::Periodic, CONTINUITY_TOLERANCE)
                .unwrap()
                .curve;
        check_periodic(&spline);
        assert!(spline.closed());
        assert_eq!(domain(&Curve::BSpline(spline.clone())), domain(&curve));
        assert!(curves_apart(&Curve::BSpline(spline), &curve) < 1e-10 * size(&curve));
    });
}

/// The knots repeat with the length of the domain; the first `degree` control points are the last.
fn check_periodic(spline: &BSpline<2>) {
    let (points, degree) = (spline.control_points(), spline.degree());
    assert_eq!(points[..degree], points[points.len() - degree..]);
    let (a, b) = spline.knots().domain();
    let (knots, period) = (spline.knots().as_slice(), points.len() - degree);
    let repeats = |j: usize| (knots[j + period] - knots[j] - (b - a)).abs() < 1e-13 * (1.0 + b - a);
    assert!((0..knots.len() - period).all(repeats), "{knots:?}");
}
