//! Where the papers are wrong or silent, one test for each point that a client must be told.

use crate::laws::{any, apart, curves_apart, jets, law, single};
use proptest::collection::vec;
use springline::core::basis::{
    AlphaBeta, Basis, Beta, Bezier, Quasi, ShapeMatrix, ShapeParameters,
};
use springline::core::bezier_form::split;
use springline::core::context::Context;
use springline::core::continuity::{Report, Tolerance, continuity};
use springline::core::curve::{Bases, Curve, Piecewise};
use springline::core::fault::Fault;
use springline::core::interpolate::{End, EndConditions, Interpolant, interpolate};
use springline::core::limits::CONTINUITY_TOLERANCE;
use springline::core::parameterization::Parameterization;
use springline::core::point::Point;
use springline::core::smoothness::Smoothness;
use springline::core::subdivide::{Cuts, Form, subdivide};
use springline::core::to_bspline::{KnotStyle, to_bspline};

fn beta(beta: f64) -> Basis {
    Basis::Beta(Beta::from_beta(beta).unwrap())
}

fn alpha_beta(alpha: f64, beta: f64) -> Basis {
    Basis::AlphaBeta(AlphaBeta::new(alpha, beta).unwrap())
}

fn quasi(rows: Vec<Vec<f64>>) -> Basis {
    Basis::Quasi(Quasi::new(&Context::default(), ShapeParameters::Matrix { rows }).unwrap())
}

fn closed_through(points: &[Point<2>], bases: Bases) -> Interpolant<2> {
    interpolate(
        &Context::default(),
        points,
        EndConditions::Closed,
        bases,
        &Parameterization::Uniform,
    )
    .unwrap()
}

fn betas() -> impl proptest::strategy::Strategy<Value = Vec<f64>> {
    vec(0.1..4.0, 6)
}

// ---- 1: mixed betas, Cheng et al. 2021 eq. (15)

/// The bracket of eq. (15) at the joint `p[3]`, for the segment that ends there; the derivative but
/// for a factor.
fn bracket(p: [Point<2>; 4], b: f64) -> Point<2> {
    let a = b / (1.0 + b);
    (p[3] - p[2]) * 3.0 + (p[3] - p[1]) * (3.0 * a) + (p[3] - p[0]) * (2.0 * a * b)
}

/// The two sides of eq. (15) at the joint after a segment, as printed.
fn sides_of_equation_15(curve: &Piecewise<2>, betas: &[f64], segment: usize) -> [Point<2>; 2] {
    let left = curve.polygon(segment).try_into().unwrap();
    let right: [Point<2>; 4] = curve.polygon(segment + 1).try_into().unwrap();
    let backwards = [right[3], right[2], right[1], right[0]];
    [bracket(left, betas[segment]), bracket(backwards, betas[segment + 1]) * -1.0]
}

#[test]
fn equation_15_holds_with_a_factor_that_the_paper_leaves_out() {
    law(60, (any::points::<2>(6), betas()), |(points, betas)| {
        let result =
            closed_through(&points, Bases::PerSegment(betas.iter().map(|&b| beta(b)).collect()));
        assert_eq!(result.continuity.class, Smoothness::C2, "mixed betas stay C2");
        for i in 0..5 {
            let [left, right] = sides_of_equation_15(&result.curve, &betas, i);
            let (corrected, other) =
                (left * (1.0 / (1.0 + 2.0 * betas[i])), right * (1.0 / (1.0 + 2.0 * betas[i + 1])));
            assert!(corrected.distance(other) < 1e-10 * (1.0 + corrected.norm()));
            let slope = jets(&Curve::Piecewise(result.curve.clone()), &[(i + 1) as f64], 1)[1][0];
            assert!(
                corrected.distance(slope) < 1e-10 * (1.0 + slope.norm()),
                "it is the derivative"
            );
            let unequal = 2.0 * (betas[i] - betas[i + 1]).abs() * slope.norm();
            assert!(
                (left.distance(right) - unequal).abs() < 1e-9 * (1.0 + left.norm()),
                "as printed it fails by exactly this"
            );
        }
    });
}

// ---- 2: the interpolant does not depend on beta

#[test]
fn the_c2_interpolant_is_the_same_curve_for_every_beta() {
    let ends = EndConditions::Open(End::Natural, End::Derivative(Point([1.0, -2.0])));
    law(60, (any::points::<2>(7), betas()), |(points, betas)| {
        let mixed = Bases::PerSegment(betas.iter().map(|&b| beta(b)).collect());
        let all = [Bases::Common(Basis::Bezier(Bezier)), Bases::Common(beta(betas[0])), mixed];
        let curves = all.map(|bases| {
            interpolate(&Context::default(), &points, ends, bases, &Parameterization::ChordLength)
                .unwrap()
                .curve
        });
        let [reference, global, mixed] = curves.map(Curve::Piecewise);
        let size = crate::laws::size(&reference);
        assert!(
            curves_apart(&reference, &global) < 1e-13 * size
                && curves_apart(&reference, &mixed) < 1e-13 * size
        );
        assert!(
            apart(crate::laws::control_points(&reference), crate::laws::control_points(&mixed))
                > 1e-3,
            "control points differ"
        );
    });
}

// ---- 3: changing shape parameters with the control points fixed

/// The continuity of the interpolant in one basis after another basis is put in its place.
fn reshaped(points: &[Point<2>], from: Basis, to: impl Fn(usize) -> Basis) -> Report {
    let curve = closed_through(points, Bases::Common(from)).curve;
    let bases = Bases::PerSegment((0..points.len()).map(to).collect());
    let other = Piecewise::new(
        &Context::default(),
        bases,
        3,
        curve.breaks().clone(),
        true,
        curve.control_points().to_vec(),
    )
    .unwrap();
    continuity(
        &Context::default(),
        &other.composite(&Context::default()).unwrap(),
        true,
        Tolerance::default(),
    )
    .unwrap()
}

#[test]
fn a_reshaped_beta_bezier_composite_is_only_c0() {
    let worst = std::cell::Cell::new(0.0f64);
    law(60, any::points::<2>(7), |points| {
        let report = reshaped(&points, Basis::Bezier(Bezier), |_| beta(1.0));
        assert!(
            report.joints.iter().all(|joint| joint.class == Smoothness::C0),
            "{:?}",
            report.class
        );
        worst.set(worst.get().max(report.worst().unwrap().tangent_angle.unwrap()));
    });
    assert!(worst.get() > 2.5, "tangents turn by up to 170 degrees, here {} rad", worst.get());
}

/// A quasi-Bezier basis tangent to its end edges whose end derivatives are `degree (1 - m)` times
/// the end edges.
fn tangent_quasi(m: f64, degree: usize) -> Basis {
    let rest = 1.0 - m;
    let ends = [vec![1.0, 0.0, 0.0, 0.0], vec![m, rest, 0.0, 0.0]];
    let middle = (degree == 4).then(|| vec![0.0, 0.5, 0.5, 0.0]);
    let mirrored = ends.iter().rev().map(|row| row.iter().rev().copied().collect());
    quasi(ends.iter().cloned().chain(middle).chain(mirrored).collect())
}

#[test]
fn reshaped_alpha_beta_and_quasi_composites_stay_g1() {
    law(40, any::points::<2>(6), |points| {
        let of = |i: usize| 0.3 + 0.1 * i as f64;
        let mixed = reshaped(&points, Basis::Bezier(Bezier), |i| alpha_beta(1.0, 3.0 * of(i)));
        assert!(
            mixed.joints.iter().all(
                |joint| joint.geometric >= Smoothness::G1 && joint.parametric == Smoothness::C0
            )
        );
        let quasi = reshaped(&points, alpha_beta(0.9, 2.5), |i| {
            tangent_quasi(of(i), if i % 2 == 0 { 3 } else { 4 })
        });
        assert!(
            quasi.joints.iter().all(
                |joint| joint.geometric >= Smoothness::G1 && joint.parametric == Smoothness::C0
            )
        );
    });
}

#[test]
fn a_reshape_with_equal_end_factors_stays_c1() {
    law(40, any::points::<2>(6), |points| {
        // s = alpha beta = 1.2 on every segment, as alpha-beta and as quasi-Bezier of degree 3 and
        // 4.
        let equal = |i: usize| match i % 3 {
            0 => alpha_beta(0.6, 2.0),
            1 => tangent_quasi(0.6, 3),
            _ => tangent_quasi(0.7, 4),
        };
        let report = reshaped(&points, Basis::Bezier(Bezier), equal);
        assert!(
            report.joints.iter().all(|joint| joint.parametric == Smoothness::C1),
            "{:?}",
            report.class
        );
    });
}

#[test]
fn alpha_also_scales_the_parameter() {
    let points = vec![Point([0.0, 0.0]), Point([1.0, 2.0]), Point([3.0, 2.0]), Point([4.0, -1.0])];
    for (alpha, beta) in [(1.0, 3.0), (0.5, 2.0), (0.25, 0.3)] {
        let jet = jets(&single(alpha_beta(alpha, beta), points.clone()), &[0.0, alpha], 1);
        assert!(jet[1][0].distance((points[1] - points[0]) * beta) < 1e-14);
        assert!(jet[1][1].distance((points[3] - points[2]) * beta) < 1e-14);
    }
}

// ---- 4: the halves of a subdivision

#[test]
fn the_halves_of_section_4_are_bezier_curves() {
    law(60, (any::points::<2>(4), 0.2..4.0), |(points, b)| {
        let matrix = beta(b).shape_matrix(3);
        let curve = single(beta(b), points.clone());
        let cut = |form| {
            subdivide(&Context::default(), &curve, &Cuts::Parameters(vec![0.5]), form)
                .unwrap()
                .curve
        };
        let (left, right) = split(&matrix.apply(&points), 0.5);
        let (bezier, family) = (cut(Form::Bezier), cut(Form::Family));
        assert!(
            apart(bezier.polygon(0), &left) < 1e-14 * 10.0
                && apart(bezier.polygon(1), &right) < 1e-13
        );
        // As Beta-Bezier curves the halves have P' = M^-1 Q'.
        assert!(apart(&matrix.apply(family.polygon(0)), &left) < 1e-12 * 10.0);
        assert!(apart(&matrix.apply(family.polygon(1)), &right) < 1e-12 * 10.0);
        // Read as Beta-Bezier control points, {Q} give another curve.
        assert!(apart(&matrix.apply(&left), &left) > 1e-6);
    });
}

// ---- facts

#[test]
fn condition_numbers_are_as_stated() {
    let stated = [
        (3, 1.0, 7.0),
        (3, 10.0, 3e2),
        (3, 100.0, 3e4),
        (5, 1.0, 2e2),
        (5, 10.0, 5e5),
        (5, 100.0, 4e9),
        (10, 1.0, 6e6),
        (10, 10.0, 1e15),
    ];
    for (order, b, expected) in stated {
        let condition = beta(b).shape_matrix(order).condition();
        // Stated to one digit; above 1e13 rounding of M itself blurs the smallest singular value.
        let off = if expected > 1e13 { 2.0 } else { 0.5 };
        let one_digit = 10f64.powf(f64::log10(expected).floor());
        assert!(
            (condition - expected).abs() <= off * one_digit,
            "order {order}, beta {b}: {condition:e}, not {expected:e}"
        );
    }
}

#[test]
fn a_basis_worse_than_1e8_is_refused_with_its_condition_number() {
    assert!(
        matches!(beta(100.0).way_back(&Context::default(), 5), Err(Fault::IllConditioned { condition }) if condition > 1e9)
    );
    assert!(
        beta(10.0).way_back(&Context::default(), 5).is_ok()
            && beta(1.0).way_back(&Context::default(), 10).is_ok()
    );
}

#[test]
fn equation_26_gives_the_uniform_control_points() {
    law(60, (any::points::<2>(4), 0.0..5.0), |(p, b)| {
        let q = beta(b).shape_matrix(3).apply(&p);
        let expected = [
            p[0] * 6.0 - q[1] * 7.0 + q[2] * 2.0,
            q[1] * 2.0 - q[2],
            q[2] * 2.0 - q[1],
            p[3] * 6.0 - q[2] * 7.0 + q[1] * 2.0,
        ];
        let spline = to_bspline(
            &Context::default(),
            &single(beta(b), p),
            KnotStyle::Uniform,
            CONTINUITY_TOLERANCE,
        )
        .unwrap()
        .curve;
        assert!(apart(spline.control_points(), &expected) < 1e-12);
        assert_eq!(spline.knots().as_slice(), [-3.0, -2.0, -1.0, 0.0, 1.0, 2.0, 3.0, 4.0]);
    });
}

#[test]
fn yang_and_zeng_is_a_quasi_bezier_basis() {
    let lambdas = [0.5, -0.2, 0.2, -0.5];
    let matrix = Basis::Quasi(
        Quasi::new(&Context::default(), ShapeParameters::Elevation { lambdas: lambdas.to_vec() })
            .unwrap(),
    )
    .shape_matrix(4);
    assert_eq!((matrix.degree(), matrix.order()), (5, 4));
    for (i, lambda) in (1..=4).zip(lambdas) {
        assert!((matrix.row(i)[i - 1] - (i as f64 - lambda) / 5.0).abs() < 1e-16);
    }
    assert!(matrix.properties().symmetric);
    let straight = Basis::Quasi(
        Quasi::new(&Context::default(), ShapeParameters::Elevation { lambdas: vec![0.0; 4] })
            .unwrap(),
    )
    .shape_matrix(4);
    assert!(
        straight
            .rows()
            .flatten()
            .zip(ShapeMatrix::elevation(5, 4).rows().flatten())
            .all(|(a, b)| (a - b).abs() < 1e-15)
    );
}

/// Wu's basis at an order, from its seed by eq. (36).
fn wu(l: f64, order: usize) -> ShapeMatrix {
    let first = (1.0 - l) / 3.0;
    let seed = vec![
        vec![1.0, 0.0, 0.0],
        vec![first, 1.0 - first, 0.0],
        vec![0.0, 1.0 - first, first],
        vec![0.0, 0.0, 1.0],
    ];
    Basis::Quasi(Quasi::new(&Context::default(), ShapeParameters::Recursive { seed }).unwrap())
        .shape_matrix(order)
}

#[test]
fn wu_is_a_quasi_bezier_basis_by_equation_36() {
    for order in 2..10 {
        assert_eq!(wu(0.4, order).degree(), order + 1);
        assert!(wu(0.0, order).properties().degenerates_to_bernstein, "l = 0 is the Bezier curve");
        let properties = wu(0.4, order).properties();
        assert!(
            properties.symmetric
                && properties.partition_of_unity
                && !properties.degenerates_to_bernstein
        );
    }
    // Eq. (36) by what it means: basis functions one order up are (1 - t) b_j + t b_(j-1).
    let (low, high) = (wu(0.4, 4), wu(0.4, 5));
    let value = |m: &ShapeMatrix, j: usize, t: f64| {
        let column: Vec<_> = m.rows().map(|row| Point([row[j]])).collect();
        springline::core::bezier_form::evaluate(&column, t)[0]
    };
    for (j, t) in [(1, 0.2), (2, 0.5), (4, 0.9)] {
        let expected = (1.0 - t) * value(&low, j, t) + t * value(&low, j - 1, t);
        assert!((value(&high, j, t) - expected).abs() < 1e-15);
    }
}

#[test]
fn the_middle_row_of_an_even_degree_is_not_free() {
    let symmetric = |rows: Vec<Vec<f64>>| {
        Quasi::new(&Context::default(), ShapeParameters::Symmetric { degree: 4, upper_rows: rows })
    };
    let (first, mirrored) = (vec![0.25, 0.75, 0.0], vec![0.25, 0.5, 0.25]);
    assert!(symmetric(vec![first.clone(), mirrored.clone()]).is_ok());
    let lopsided = symmetric(vec![first.clone(), vec![0.3, 0.5, 0.2]]).unwrap_err();
    assert_eq!(lopsided.place.to_string(), "/upper rows/1/0");
    // Eq. (30) would have ceil((d + 1) / 2) = 3 free rows.
    assert!(matches!(
        symmetric(vec![first.clone(), mirrored, first]).unwrap_err().fault,
        Fault::WrongCount { expected: 2, .. }
    ));
}

#[test]
fn equation_29_does_not_imply_full_rank() {
    // Symmetric, non-negative, row sums 1, tangent at the ends: and yet nothing depends on the
    // middle control point.
    let upper_rows = vec![vec![0.25, 0.75, 0.0, 0.0, 0.0], vec![0.25, 0.25, 0.0, 0.25, 0.25]];
    let error =
        Quasi::new(&Context::default(), ShapeParameters::Symmetric { degree: 4, upper_rows })
            .unwrap_err();
    assert_eq!(error.fault, Fault::ShapeRank { rank: 4, columns: 5 });
}
