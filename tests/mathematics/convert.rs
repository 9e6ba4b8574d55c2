//! Laws of conversion, of continuity reports and of basis functions.

use crate::laws::{any, at, curves_apart, even, law, size};
use proptest::prelude::*;
use springline::core::basis::{Basis, Bezier};
use springline::core::basis_functions::basis_functions;
use springline::core::context::Context;
use springline::core::continuity::{Tolerance, continuity};
use springline::core::convert::convert;
use springline::core::curve::{Composite, Curve, Single};
use springline::core::point::Point;
use springline::core::smoothness::Smoothness;
use springline::core::subdivide::{Cuts, Form, subdivide};

fn bezier() -> Basis {
    Basis::Bezier(Bezier)
}

#[test]
fn a_cubic_is_the_same_curve_in_every_basis_with_a_way_back() {
    let cases = (any::points::<3>(4), any::cubic_with_way_back(), any::cubic_with_way_back());
    law(200, cases, |(points, first, second)| {
        let curve = Curve::Single(Single::new(&Context::default(), first, points).unwrap());
        let converted = convert(&Context::default(), &curve, second, None).unwrap();
        let (old, new) =
            (at(&curve, &even(&curve, 17)), at(&converted.curve, &even(&converted.curve, 17)));
        let apart = old.iter().zip(&new).map(|(p, q)| p.distance(*q)).fold(0.0, f64::max);
        assert!(
            apart <= 1e-14 * converted.condition * size(&curve).max(size(&converted.curve)),
            "{apart:e}"
        );
    });
}

#[test]
fn any_connected_curve_is_bezier_over_the_same_domain() {
    law(200, any::piecewise::<2>(), |curve| {
        let converted = convert(&Context::default(), &curve, bezier(), None).unwrap();
        assert!(curves_apart(&curve, &converted.curve) <= 1e-14 * size(&curve));
        assert_eq!(converted.condition, 1.0);
    });
    law(100, any::bspline::<3>(1..5, 1), |curve| {
        let converted = convert(&Context::default(), &curve, bezier(), None).unwrap();
        assert!(matches!(converted.curve, Curve::Piecewise(_)));
        assert!(curves_apart(&curve, &converted.curve) <= 1e-13 * size(&curve));
    });
}

#[test]
fn raising_the_order_keeps_the_curve_and_lowering_is_refused() {
    law(100, (any::points::<2>(4), 4usize..12), |(points, order)| {
        let curve = Curve::Single(Single::new(&Context::default(), bezier(), points).unwrap());
        let raised = convert(&Context::default(), &curve, bezier(), Some(order)).unwrap().curve;
        assert_eq!(raised.control_points().len(), order + 1);
        assert!(curves_apart(&curve, &raised) <= 1e-14 * size(&curve));
        assert_eq!(
            convert(&Context::default(), &raised, bezier(), Some(3)).unwrap_err().place.to_string(),
            "/order"
        );
    });
}

#[test]
fn cuts_are_c2_joints_whatever_the_family() {
    law(150, (any::one_segment::<2>(2..6), 0.1f64..0.9), |(curve, fraction)| {
        let (a, b) = crate::laws::domain(&curve);
        let cut = subdivide(
            &Context::default(),
            &curve,
            &Cuts::Parameters(vec![a + (b - a) * fraction]),
            Form::Bezier,
        )
        .unwrap()
        .curve;
        let report = continuity(
            &Context::default(),
            &cut.composite(&Context::default()).unwrap(),
            false,
            Tolerance::default(),
        )
        .unwrap();
        assert_eq!(report.joints.len(), 1);
        assert_eq!(report.joints[0].parametric, Smoothness::C2, "{report:?}");
    });
}

#[test]
fn curves_laid_end_to_end_meet_within_the_gap_allowed() {
    let line = |points: [[f64; 2]; 2]| {
        Single::new(&Context::default(), bezier(), points.map(Point).to_vec())
            .unwrap()
            .composite(&Context::default())
            .unwrap()
    };
    let laid = Composite::end_to_end(
        &Context::default(),
        &[line([[0.0, 0.0], [1.0, 0.0]]), line([[1.001, 0.0], [2.0, 0.0]])],
    )
    .unwrap();
    let class = |gap: f64| {
        continuity(&Context::default(), &laid, false, Tolerance { gap, ..Tolerance::default() })
            .unwrap()
            .class
    };
    assert_eq!(class(0.0), Smoothness::Discontinuous);
    assert_eq!(class(0.01), Smoothness::G2);
    assert!(
        (continuity(&Context::default(), &laid, false, Tolerance::default()).unwrap().joints[0]
            .position_gap
            - 0.001)
            .abs()
            < 1e-15
    );
}

#[test]
fn basis_functions_are_convex_weights_that_make_the_curve() {
    let cases = (1usize..6).prop_flat_map(|order| (any::basis(order), any::points::<2>(order + 1)));
    law(150, cases, |(basis, points)| {
        let sampled = basis_functions(&Context::default(), &basis, points.len() - 1, 9).unwrap();
        let curve = Curve::Single(Single::new(&Context::default(), basis, points.clone()).unwrap());
        for (i, expected) in at(&curve, &sampled.parameters).into_iter().enumerate() {
            let weights: Vec<f64> = sampled.values.iter().map(|list| list[i]).collect();
            assert!(weights.iter().all(|&w| (-1e-16..=1.0 + 1e-15).contains(&w)));
            assert!((weights.iter().sum::<f64>() - 1.0).abs() < 1e-14);
            let made = points.iter().zip(&weights).fold(Point::ZERO, |sum, (&p, &w)| sum + p * w);
            assert!(made.distance(expected) <= 1e-14 * size(&curve));
        }
        assert!(sampled.properties.partition_of_unity && sampled.properties.nonnegative);
    });
}
