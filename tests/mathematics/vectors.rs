//! The core against exact results, rounded to the nearest double (tests/vectors/README.md).

use crate::laws::{at, cases, control_points, domain, jets, numbers, parse, points};
use serde_json::Value;
use springline::api::wire::Dimensioned;
use springline::core::basis::{Basis, Beta};
use springline::core::context::Context;
use springline::core::curve::{Bases, Curve};
use springline::core::interpolate::{End, EndConditions, Interpolant, interpolate};
use springline::core::limits::CONTINUITY_TOLERANCE;
use springline::core::parameterization::Parameterization;
use springline::core::point::{Point, magnitude};
use springline::core::subdivide::{Cuts, Form, subdivide};
use springline::core::to_bspline::{KnotStyle, to_bspline};

/// Measures every case of a file and holds the worst to a tolerance.
fn hold(file: &str, tolerance: f64, error: impl Fn(&Value) -> f64) {
    let cases = cases(file);
    assert!(cases.len() > 30, "{file} has only {} cases", cases.len());
    let errors: Vec<f64> = cases.iter().map(error).collect();
    let worst = (0..errors.len()).max_by(|&i, &j| errors[i].total_cmp(&errors[j])).unwrap();
    println!(
        "{file}: {} cases, worst relative error {:.2e} in case {worst}",
        cases.len(),
        errors[worst]
    );
    assert!(
        errors[worst] <= tolerance,
        "{file}: {:.3e} in case {worst}: {}",
        errors[worst],
        cases[worst]["curve"]
    );
}

/// Measures a curve in the plane or in space.
macro_rules! in_its_dimension {
    ($measure:ident, $case:ident) => {
        match parse(&$case["curve"]) {
            Dimensioned::Plane(curve) => $measure(&curve, $case),
            Dimensioned::Space(curve) => $measure(&curve, $case),
        }
    };
}

/// The largest difference of coordinates.
fn difference<const D: usize>(some: &[Point<D>], others: &[Point<D>]) -> f64 {
    assert_eq!(some.len(), others.len());
    some.iter()
        .zip(others)
        .map(|(&p, &q)| (p - q).max_abs())
        .fold(0.0, |worst, d| if d.is_nan() { f64::INFINITY } else { worst.max(d) })
}

/// Errors of `k`-th derivatives are relative to the polygon's size times `d! / (d - k)! (2 /
/// length)^k`.
fn evaluation<const D: usize>(curve: &Curve<D>, case: &Value) -> f64 {
    let orders = case["derivatives"].as_u64().unwrap() as usize;
    let (a, b) = domain(curve);
    assert_eq!([a, b], numbers(&case["domain"])[..]);
    let degree = curve.composite(&Context::default()).unwrap().degree();
    let lists = jets(curve, &numbers(&case["parameters"]), orders);
    let expected: Vec<Vec<Point<D>>> =
        case["expected"].as_array().unwrap().iter().map(points).collect();
    let order = |k: usize| {
        let scale: f64 =
            (0..k).map(|i| degree.saturating_sub(i).max(1) as f64 * 2.0 / (b - a)).product();
        let expected: Vec<_> = expected.iter().map(|jet| jet[k]).collect();
        difference(&lists[k], &expected) / (scale * magnitude(control_points(curve)))
    };
    (0..=orders).map(order).fold(0.0, f64::max)
}

#[test]
fn evaluate_to_1e_14() {
    hold("evaluate", 1e-14, |case| in_its_dimension!(evaluation, case));
}

fn subdivision<const D: usize>(curve: &Curve<D>, case: &Value) -> f64 {
    let t = case["at"].as_f64().unwrap();
    let expected: Vec<Point<D>> = points(&case["bezier"]);
    let size = magnitude(control_points(curve));
    let cut =
        subdivide(&Context::default(), curve, &Cuts::Parameters(vec![t]), Form::Bezier).unwrap();
    let joint = [expected[expected.len() / 2]];
    let of_joint = difference(&cut.split_points, &joint).max(difference(&at(curve, &[t]), &joint));
    of_joint.max(difference(cut.curve.control_points(), &expected)) / size
}

#[test]
fn subdivide_to_1e_14() {
    hold("subdivide", 1e-14, |case| in_its_dimension!(subdivision, case));
}

/// Uniform control points lie up to 15 times as far out as Bezier points: their errors are relative
/// to both polygons.
fn conversion<const D: usize>(curve: &Curve<D>, case: &Value) -> f64 {
    let convert =
        |style| to_bspline(&Context::default(), curve, style, CONTINUITY_TOLERANCE).unwrap().curve;
    let (uniform, clamped) = (convert(KnotStyle::Uniform), convert(KnotStyle::Clamped));
    let expected: Vec<Point<D>> = points(&case["uniform_control_points"]);
    let size = magnitude(control_points(curve));
    let of_uniform =
        difference(uniform.control_points(), &expected) / size.max(magnitude(&expected));
    of_uniform.max(difference(clamped.control_points(), &points(&case["bezier"])) / size)
}

#[test]
fn to_bspline_to_1e_14() {
    hold("to_bspline", 1e-14, |case| in_its_dimension!(conversion, case));
}

fn interpolant<const D: usize>(case: &Value) -> Interpolant<D> {
    let end = |value: &Value| match value["kind"].as_str().unwrap() {
        "natural" => End::Natural,
        "not-a-knot" => End::NotAKnot,
        _ => End::Derivative(crate::laws::point(&value["vector"])),
    };
    let closed = case["closed"].as_bool().unwrap();
    let shape = if closed {
        EndConditions::Closed
    } else {
        EndConditions::Open(end(&case["start"]), end(&case["end"]))
    };
    let rule = match case["parameterization"].as_str().unwrap() {
        "uniform" => Parameterization::Uniform,
        "chord-length" => Parameterization::ChordLength,
        "centripetal" => Parameterization::Centripetal,
        other => panic!("{other}"),
    };
    let bases = numbers(&case["betas"])
        .into_iter()
        .map(|beta| Basis::Beta(Beta::from_beta(beta).unwrap()))
        .collect();
    interpolate(
        &Context::default(),
        &points(&case["points"]),
        shape,
        Bases::PerSegment(bases),
        &rule,
    )
    .unwrap()
}

/// Bezier points are computed from the control points returned, so their errors are relative to
/// those.
fn interpolation<const D: usize>(case: &Value) -> f64 {
    let flat = |segments: &Value| {
        segments.as_array().unwrap().iter().flat_map(points::<D>).collect::<Vec<_>>()
    };
    let curve = interpolant::<D>(case).curve;
    let knots = numbers(&case["knots"]);
    let of_knots = curve
        .breaks()
        .as_slice()
        .iter()
        .zip(&knots)
        .map(|(a, b)| (a - b).abs())
        .fold(0.0, f64::max);
    let polygons: Vec<_> = (0..knots.len() - 1).flat_map(|i| curve.polygon(i).to_vec()).collect();
    let bezier: Vec<_> =
        curve.composite(&Context::default()).unwrap().segments().flatten().collect();
    let expected = flat(&case["beta_segments"]);
    let of_points =
        difference(&polygons, &expected).max(difference(&bezier, &flat(&case["bezier_segments"])));
    (of_knots / knots[knots.len() - 1]).max(of_points / magnitude(&expected))
}

#[test]
fn interpolate_to_1e_13() {
    hold("interpolate", 1e-13, |case| match numbers(&case["points"][0]).len() {
        2 => interpolation::<2>(case),
        _ => interpolation::<3>(case),
    });
}
