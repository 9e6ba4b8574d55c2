//! Small curves far from the origin, against exact rational arithmetic (tests/vectors/splines.py).
//!
//! A curve is what its doubles say. So derivatives and what is made of them must be right to
//! rounding in the size of the features, as near the origin; only points are rounded in units of
//! their coordinates.

use crate::laws::{cases, numbers, parse};
use serde_json::Value;
use springline::api::wire::Dimensioned;
use springline::core::context::Context;
use springline::core::continuity::{Tolerance, continuity};
use springline::core::curve::Curve;
use springline::core::evaluate::{Quantities, Sampling, evaluate};
use springline::core::point::Point;

/// The largest errors found, relative to what they may be in units of rounding: of points,
/// derivatives, speed, curvature and torsion.
#[derive(Debug, Default)]
struct Errors([f64; 5]);

impl Errors {
    fn note(&mut self, which: usize, error: f64, scale: f64) {
        let relative = if error == 0.0 { 0.0 } else { error / scale };
        self.0[which] = self.0[which].max(if relative.is_nan() { f64::INFINITY } else { relative });
    }
}

fn jet<const D: usize>(sample: &Value) -> Vec<Point<D>> {
    sample["jet"].as_array().unwrap().iter().map(crate::laws::point).collect()
}

fn measure<const D: usize>(curve: &Curve<D>, case: &Value, errors: &mut Errors) {
    let samples = case["samples"].as_array().unwrap();
    let parameters: Vec<f64> =
        samples.iter().map(|sample| sample["parameter"].as_f64().unwrap()).collect();
    let quantities =
        Quantities { speed: true, curvature: true, torsion: D == 3, ..Quantities::default() };
    let found =
        evaluate(&Context::default(), curve, &Sampling::Parameters(parameters), 3, quantities)
            .unwrap();
    for (i, sample) in samples.iter().enumerate() {
        let (expected, scales) = (jet::<D>(sample), numbers(&sample["scales"]));
        errors.note(
            0,
            found.points[i].distance(expected[0]),
            scales[0] + expected[0].norm() * f64::EPSILON / 1e-14,
        );
        for k in 1..=3 {
            errors.note(1, found.derivatives[k - 1][i].distance(expected[k]), scales[k]);
        }
        shape(&found.frames, i, sample, &expected, &scales, errors);
    }
}

/// Errors of shape follow from those of the derivatives, to first order.
fn shape<const D: usize>(
    frames: &springline::core::evaluate::Frames<D>,
    i: usize,
    sample: &Value,
    jet: &[Point<D>],
    scales: &[f64],
    errors: &mut Errors,
) {
    if sample["shape"].is_null() {
        return;
    }
    let expected = numbers(&sample["shape"]);
    let (speed, bend) = (expected[0], jet[2].norm());
    errors.note(2, (frames.speeds[i] - speed).abs(), scales[1]);
    let of_curvature = (scales[2] + 3.0 * bend * scales[1] / speed) / speed / speed;
    errors.note(3, (frames.curvatures[i] - expected[1]).abs(), of_curvature);
    let degenerate = frames.degenerate.iter().any(|place| place.index == i);
    if let ([_, curvature, torsion], false) = (&expected[..], degenerate) {
        let area = curvature * speed.powi(3);
        let of_area = scales[1] * bend + speed * scales[2];
        let of_determinant = of_area * jet[3].norm() + speed * bend * scales[3];
        let of_torsion = of_determinant / area / area + 2.0 * torsion.abs() * of_area / area;
        errors.note(4, (frames.torsions[i] - torsion).abs(), of_torsion);
    }
}

/// Curvature was off by 4.7 % for a B-spline with features of 1e-6 at 1e6.
#[test]
fn derivatives_and_shape_have_the_digits_of_the_features() {
    let mut by_family: std::collections::BTreeMap<String, Errors> = Default::default();
    let cases = cases("far");
    assert!(cases.len() > 200);
    for case in &cases {
        let errors =
            by_family.entry(case["curve"]["family"].as_str().unwrap().to_owned()).or_default();
        match parse(&case["curve"]) {
            Dimensioned::Plane(curve) => measure(&curve, case, errors),
            Dimensioned::Space(curve) => measure(&curve, case, errors),
        }
    }
    println!("{by_family:#?}");
    for (family, errors) in by_family {
        assert!(errors.0.iter().all(|&error| error <= 1e-14), "{family}: {errors:?}");
    }
}

/// A curve moved by a vector that all its points take without rounding has the same derivatives,
/// bit for bit, wherever both places allow an origin nearby.
#[test]
fn derivatives_do_not_depend_on_the_place() {
    let knots = vec![0.0, 0.0, 0.0, 0.0, 1.0, 1.5, 2.0, 4.0, 4.0, 4.0, 4.0];
    let at = |place: f64| {
        let points = (0..7)
            .map(|i| {
                Point([
                    place + f64::from(i * 3 % 5) / 1024.0,
                    place - f64::from(i * i % 7) / 1024.0,
                ])
            })
            .collect();
        let curve = springline::core::curve::BSpline::new(
            &Context::default(),
            3,
            knots.clone(),
            points,
            false,
        )
        .unwrap();
        let quantities =
            Quantities { speed: true, curvature: true, normal: true, ..Quantities::default() };
        evaluate(
            &Context::default(),
            &Curve::<2>::BSpline(curve),
            &Sampling::Count(50),
            3,
            quantities,
        )
        .unwrap()
    };
    let (near, far) = (at(1.0), at(1e6));
    assert_eq!(near.derivatives, far.derivatives);
    assert_eq!(near.frames, far.frames);
}

/// Jumps are those of the curve: none for simple knots, far away as near.
#[test]
fn jumps_are_measured_in_the_size_of_the_features() {
    for case in cases("far")
        .iter()
        .filter(|case| case["curve"]["family"] == "bspline" && case["curve"]["degree"] == 5)
    {
        let (report, composite) = match parse(&case["curve"]) {
            Dimensioned::Plane(curve) => report(&curve),
            Dimensioned::Space(curve) => report(&curve),
        };
        for joint in report {
            assert!(joint.first_derivative_jump <= 1e-13 * composite[0], "{joint:?} {composite:?}");
            assert!(
                joint.second_derivative_jump <= 1e-13 * composite[1],
                "{joint:?} {composite:?}"
            );
        }
    }
}

/// The joints of a curve, with the largest first and second derivatives.
fn report<const D: usize>(
    curve: &Curve<D>,
) -> (Vec<springline::core::continuity::Joint>, [f64; 2]) {
    let composite = curve.composite(&Context::default()).unwrap();
    let first = composite.derivative(&Context::default()).unwrap();
    let sizes = [first.magnitude(), first.derivative(&Context::default()).unwrap().magnitude()];
    (
        continuity(&Context::default(), &composite, false, Tolerance::default()).unwrap().joints,
        sizes,
    )
}
