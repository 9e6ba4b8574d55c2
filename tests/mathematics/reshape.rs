//! Laws of reshaping: joints stay, the class to keep is kept, and inner control points move the
//! least.

use crate::laws::{any, apart, curves_apart, law, single, size};
use proptest::collection::vec;
use proptest::prelude::*;
use springline::core::basis::{AlphaBeta, Basis, Beta, Bezier, Quasi, ShapeParameters};
use springline::core::context::Context;
use springline::core::curve::{Bases, Curve, Piecewise};
use springline::core::interpolate::{End, EndConditions, interpolate};
use springline::core::knots::Breaks;
use springline::core::parameterization::Parameterization;
use springline::core::point::Point;
use springline::core::reshape::reshape;
use springline::core::smoothness::Smoothness;

fn beta(beta: f64) -> Basis {
    Basis::Beta(Beta::from_beta(beta).unwrap())
}

fn yang_zeng() -> Basis {
    Basis::Quasi(
        Quasi::new(
            &Context::default(),
            ShapeParameters::Elevation { lambdas: vec![0.3, 0.0, -0.3] },
        )
        .unwrap(),
    )
}

fn bases(segments: usize) -> impl Strategy<Value = Bases> {
    let each = vec(any::cubic_with_way_back(), segments).prop_map(Bases::PerSegment);
    prop_oneof![any::cubic_with_way_back().prop_map(Bases::Common), each]
}

/// An interpolant, and new bases for it.
fn problem() -> impl Strategy<Value = (Curve<2>, Bases)> {
    (4usize..12, any::<bool>()).prop_flat_map(|(count, closed)| {
        let segments = count - usize::from(!closed);
        (any::points::<2>(count), bases(segments), bases(segments)).prop_map(
            move |(points, old, new)| {
                let shape = if closed {
                    EndConditions::Closed
                } else {
                    EndConditions::Open(End::Natural, End::Natural)
                };
                let curve = interpolate(
                    &Context::default(),
                    &points,
                    shape,
                    old,
                    &Parameterization::ChordLength,
                )
                .unwrap()
                .curve;
                (Curve::Piecewise(curve), new)
            },
        )
    })
}

#[test]
fn a_kept_class_is_kept_and_joints_stay() {
    law(60, problem(), |(curve, new)| {
        for (keep, class) in [(Smoothness::G1, Smoothness::G1), (Smoothness::C1, Smoothness::C1)] {
            let bent = reshape(&Context::default(), &curve, new.clone(), keep).unwrap();
            assert!(bent.continuity.class >= class, "{keep:?}: {:?}", bent.continuity.worst());
            let joints = |curve: &Curve<2>| {
                curve.control_points().iter().copied().step_by(3).collect::<Vec<_>>()
            };
            assert_eq!(joints(&curve), joints(&bent.curve));
            let moved = apart(curve.control_points(), bent.curve.control_points());
            assert!((moved - bent.points_moved).abs() <= 1e-14 * size(&curve));
        }
    });
}

#[test]
fn nothing_kept_leaves_the_points() {
    law(40, problem(), |(curve, new)| {
        let bent = reshape(&Context::default(), &curve, new, Smoothness::C0).unwrap();
        assert_eq!(curve.control_points(), bent.curve.control_points());
        assert_eq!(bent.points_moved, 0.0);
        assert!(bent.continuity.class >= Smoothness::C0);
    });
}

#[test]
fn a_new_beta_breaks_tangents_and_a_new_alpha_beta_does_not() {
    let points = [[0.0, 0.0], [2.0, 1.0], [3.0, 4.0], [-1.0, 3.0], [-2.0, 1.0]].map(Point);
    let alpha_beta = |b| Basis::AlphaBeta(AlphaBeta::new(0.8, b).unwrap());
    let class = |old: Basis, new: Basis| {
        let curve = interpolate(
            &Context::default(),
            &points,
            EndConditions::Closed,
            Bases::Common(old),
            &Parameterization::Uniform,
        )
        .unwrap()
        .curve;
        reshape(&Context::default(), &Curve::Piecewise(curve), Bases::Common(new), Smoothness::C0)
            .unwrap()
            .continuity
            .class
    };
    assert_eq!(class(beta(1.0), beta(3.0)), Smoothness::C0);
    assert!(class(alpha_beta(3.0), alpha_beta(1.5)) >= Smoothness::C1);
    let curve = interpolate(
        &Context::default(),
        &points,
        EndConditions::Closed,
        Bases::Common(alpha_beta(3.0)),
        &Parameterization::Uniform,
    )
    .unwrap()
    .curve;
    let mixed = Bases::PerSegment((1..=5).map(|i| alpha_beta(0.5 * f64::from(i))).collect());
    let bent =
        reshape(&Context::default(), &Curve::Piecewise(curve), mixed, Smoothness::C0).unwrap();
    assert!(bent.continuity.joints.iter().all(|joint| joint.geometric >= Smoothness::G1));
}

#[test]
fn c2_kept_is_the_same_curve() {
    law(60, problem(), |(curve, new)| {
        let same = reshape(&Context::default(), &curve, new, Smoothness::C2).unwrap();
        assert!(curves_apart(&curve, &same.curve) <= 1e-10 * size(&curve).max(size(&same.curve)));
        assert!(same.curve_moved <= 1e-10 * size(&curve).max(size(&same.curve)));
    });
}

#[test]
fn c2_cannot_be_kept_in_a_lower_degree() {
    let points = [[0.0, 0.0], [1.0, 2.0], [3.0, -1.0], [4.0, 0.0]].map(Point).to_vec();
    let error = reshape(
        &Context::default(),
        &single(yang_zeng(), points.clone()),
        Bases::Common(Basis::Bezier(Bezier)),
        Smoothness::C2,
    )
    .unwrap_err();
    assert_eq!(error.place.to_string(), "/keep", "{error}");
    let breaks = Breaks::new(&Context::default(), vec![0.0, 1.0]).unwrap();
    let curve = Curve::Piecewise(
        Piecewise::new(&Context::default(), Bases::Common(yang_zeng()), 3, breaks, false, points)
            .unwrap(),
    );
    let error =
        reshape(&Context::default(), &curve, Bases::Common(beta(1.0)), Smoothness::C2).unwrap_err();
    assert_eq!(error.place.to_string(), "/keep", "{error}");
}

#[test]
fn curve_moved_is_the_largest_distance() {
    law(40, problem(), |(curve, new)| {
        let bent = reshape(&Context::default(), &curve, new, Smoothness::C0).unwrap();
        let (old, new) = (
            curve.composite(&Context::default()).unwrap(),
            bent.curve.composite(&Context::default()).unwrap(),
        );
        let segments = 0..old.breaks().segments();
        let (old, new) = (
            old.evaluator(&Context::default()).unwrap(),
            new.evaluator(&Context::default()).unwrap(),
        );
        let at = |i: usize, u: f64| old.within(i, u, 1.0 - u).distance(new.within(i, u, 1.0 - u));
        let sampled = segments
            .flat_map(|i| (0..=500).map(move |k| (i, f64::from(k) / 500.0)))
            .map(|(i, u)| at(i, u))
            .fold(0.0, f64::max);
        assert!(sampled <= bent.curve_moved * (1.0 + 2e-9) + 1e-13 * size(&curve));
        assert!(
            sampled >= bent.curve_moved * (1.0 - 1e-3) - 1e-13 * size(&curve),
            "{sampled} of {}",
            bent.curve_moved
        );
    });
}

/// End derivatives of a beta-bezier segment over length 1 (Cheng et al. 2021 eq. (15), mended) at
/// its start.
fn start_row(b: f64) -> [f64; 4] {
    let a = b / (1.0 + b);
    let [p1, p2, p3] = [3.0, 3.0 * a, 2.0 * a * b].map(|x| x / (1.0 + 2.0 * b));
    [-(p1 + p2 + p3), p1, p2, p3]
}

#[test]
fn c1_is_kept_by_the_least_change() {
    let case = (any::points::<2>(6), any::<bool>(), vec(0.0..4.0, 6));
    law(60, case, |(points, closed, betas)| {
        let n = points.len() - usize::from(!closed);
        let shape = if closed {
            EndConditions::Closed
        } else {
            EndConditions::Open(End::Natural, End::Natural)
        };
        let old = interpolate(
            &Context::default(),
            &points,
            shape,
            Bases::Common(beta(1.0)),
            &Parameterization::Uniform,
        )
        .unwrap()
        .curve;
        // The rule may scale the domain; with equal intervals the length does not matter to the
        // conditions.
        let new = Bases::PerSegment(betas[..n].iter().map(|&b| beta(b)).collect());
        let p = old.control_points().to_vec();
        let bent =
            reshape(&Context::default(), &Curve::Piecewise(old), new, Smoothness::C1).unwrap();
        let joints = if closed { n } else { n - 1 };
        let mut full = nalgebra::DMatrix::<f64>::zeros(joints, 3 * n + 1);
        for j in 0..joints {
            let (left, right) = (j, (j + 1) % n);
            let (before, after) = (start_row(betas[left]), start_row(betas[right]));
            for c in 0..4 {
                full[(j, 3 * left + 3 - c)] += before[c];
                full[(j, 3 * right + c)] += after[c];
            }
        }
        let free = nalgebra::DMatrix::from_fn(joints, 3 * n + 1, |i, j| {
            if j % 3 == 0 { 0.0 } else { full[(i, j)] }
        });
        let inverse = free.pseudo_inverse(1e-12).unwrap();
        for axis in 0..2 {
            let now = nalgebra::DVector::from_iterator(p.len(), p.iter().map(|p| p[axis]));
            let change = -&inverse * (&full * now);
            for (i, q) in bent.curve.control_points().iter().enumerate() {
                assert!((p[i][axis] + change[i] - q[axis]).abs() < 1e-9, "point {i}");
            }
        }
    });
}

#[test]
fn a_hundred_thousand_points_are_reshaped() {
    for count in [1_000, 100_000] {
        let at = |i: usize| Point([i as f64, (i as f64 * 0.7).sin()]);
        let points: Vec<_> = (0..count).map(at).collect();
        let shape = EndConditions::Open(End::Natural, End::Natural);
        let curve = interpolate(
            &Context::default(),
            &points,
            shape,
            Bases::Common(beta(1.0)),
            &Parameterization::Uniform,
        )
        .unwrap()
        .curve;
        let bent = reshape(
            &Context::default(),
            &Curve::Piecewise(curve),
            Bases::Common(beta(2.0)),
            Smoothness::C1,
        )
        .unwrap();
        assert!(bent.continuity.class >= Smoothness::C1);
        assert_eq!(bent.continuity.joints.len(), count - 2);
    }
}

#[test]
fn lines_have_nothing_to_keep_a_corner_with() {
    // A quadratic chain has one inner point a segment: with fixed joints C1 at both ends is too
    // much.
    let points =
        [[0.0, 0.0], [1.0, 1.0], [2.0, 0.0], [3.0, -1.0], [4.0, 0.0], [5.0, 1.0], [6.0, 0.0]]
            .map(Point)
            .to_vec();
    let breaks = Breaks::new(&Context::default(), vec![0.0, 1.0, 2.0, 3.0]).unwrap();
    let curve = |order, points, breaks, closed| {
        Curve::Piecewise(
            Piecewise::new(
                &Context::default(),
                Bases::Common(beta(0.0)),
                order,
                breaks,
                closed,
                points,
            )
            .unwrap(),
        )
    };
    let open = curve(2, points, breaks.clone(), false);
    assert!(
        reshape(&Context::default(), &open, Bases::Common(beta(1.0)), Smoothness::C1).is_ok(),
        "one inner point more than joints"
    );
    let straight = [[0.0, 0.0], [1.0, 0.0], [2.0, 0.0], [3.0, 0.0]].map(Point).to_vec();
    let other = curve(
        1,
        straight,
        Breaks::new(&Context::default(), vec![0.0, 1.0, 2.0, 3.0]).unwrap(),
        false,
    );
    assert!(
        reshape(&Context::default(), &other, Bases::Common(beta(1.0)), Smoothness::C1).is_ok(),
        "order 1 has no shape"
    );
}

#[test]
fn a_joint_that_cannot_stay_smooth_is_named() {
    let points = [[0.0, 0.0], [1.0, 2.0], [3.0, -1.0], [4.0, 0.0]].map(Point);
    let shape = EndConditions::Open(End::Natural, End::Natural);
    let curve = interpolate(
        &Context::default(),
        &points,
        shape,
        Bases::Common(beta(1.0)),
        &Parameterization::Uniform,
    )
    .unwrap()
    .curve;
    // In the straight limit inner control points move nothing.
    let straight = Bases::Common(Basis::Beta(Beta::from_lambda(0.0).unwrap()));
    for keep in [Smoothness::C1, Smoothness::G1] {
        let error =
            reshape(&Context::default(), &Curve::Piecewise(curve.clone()), straight.clone(), keep)
                .unwrap_err();
        assert_eq!(error.place.to_string(), "/keep");
        assert!(error.to_string().contains("the joint"), "{error}");
    }
}

#[test]
fn counts_and_kinds_are_checked() {
    let points = [[0.0, 0.0], [1.0, 2.0], [3.0, -1.0], [4.0, 0.0]].map(Point).to_vec();
    let curve = single(Basis::Bezier(Bezier), points);
    let place = |error: springline::core::error::Error| error.place.to_string();
    assert_eq!(
        place(
            reshape(
                &Context::default(),
                &curve,
                Bases::PerSegment(vec![beta(1.0); 2]),
                Smoothness::C0
            )
            .unwrap_err()
        ),
        "/bases"
    );
    let endless = Basis::Beta(Beta::from_lambda(0.0).unwrap());
    assert_eq!(
        place(
            reshape(&Context::default(), &curve, Bases::Common(endless), Smoothness::C2)
                .unwrap_err()
        ),
        "/keep"
    );
}
