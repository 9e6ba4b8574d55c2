//! What the test binaries share: reference vectors, JSON curves, seeded laws, and measures.
#![allow(dead_code, reason = "each test binary uses a part of it")]

pub mod any;

use proptest::strategy::Strategy;
use proptest::test_runner::{Config, RngSeed, TestError, TestRunner};
use serde_json::Value;
use springline::api::wire::{self as wire, Dimensioned};
use springline::core::basis::Basis;
use springline::core::context::Context;
use springline::core::curve::{Composite, Curve, Single};
use springline::core::evaluate::{Quantities, Sampling, evaluate};
use springline::core::point::{Point, magnitude};
use springline::core::rational::AnyCurve;

/// The cases of one file of reference vectors.
pub fn cases(file: &str) -> Vec<Value> {
    let path = format!("{}/tests/vectors/{file}.json", env!("CARGO_MANIFEST_DIR"));
    serde_json::from_str(&std::fs::read_to_string(path).unwrap()).unwrap()
}

/// A curve without weights in the JSON of the API.
pub fn parse(value: &Value) -> Dimensioned {
    let context = Context::default();
    let text = value.to_string();
    let curve: wire::Curve = wire::Reading::new(&context).from_slice(text.as_bytes()).unwrap();
    match curve.parse(&context).unwrap() {
        Dimensioned::Plane(AnyCurve::Polynomial(curve)) => Dimensioned::Plane(curve),
        Dimensioned::Space(AnyCurve::Polynomial(curve)) => Dimensioned::Space(curve),
        weighted => panic!("a curve without weights was expected: {weighted:?}"),
    }
}

/// A plane curve in the JSON of the API.
pub fn plane(value: &Value) -> Curve<2> {
    let Dimensioned::Plane(curve) = parse(value) else {
        panic!("a plane curve was expected: {value}")
    };
    curve
}

pub fn numbers(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
}

pub fn point<const D: usize>(value: &Value) -> Point<D> {
    Point(numbers(value).try_into().unwrap())
}

pub fn points<const D: usize>(value: &Value) -> Vec<Point<D>> {
    value.as_array().unwrap().iter().map(point).collect()
}

/// Runs a law on a fixed number of cases, the same ones every time; `PROPTEST_RNG_SEED` chooses
/// others. A failure prints the smallest counterexample found and the seed.
pub fn law<S: Strategy>(cases: u32, strategy: S, law: impl Fn(S::Value)) {
    let default = Config::default();
    let seed = if let RngSeed::Fixed(seed) = default.rng_seed { seed } else { 2021 };
    let config = Config {
        cases,
        failure_persistence: None,
        rng_seed: RngSeed::Fixed(seed),
        max_shrink_iters: 500,
        ..default
    };
    let holds = |value| {
        law(value);
        Ok(())
    };
    match TestRunner::new(config).run(&strategy, holds) {
        Ok(()) => {}
        Err(TestError::Fail(why, value)) => {
            panic!("{why}\nsmallest counterexample: {value:?}\nseed: PROPTEST_RNG_SEED={seed}")
        }
        Err(TestError::Abort(why)) => panic!("{why}\nseed: PROPTEST_RNG_SEED={seed}"),
    }
}

/// The points of a curve at parameters.
pub fn at<const D: usize>(curve: &Curve<D>, parameters: &[f64]) -> Vec<Point<D>> {
    if parameters.is_empty() {
        return vec![];
    }
    evaluate(
        &Context::default(),
        curve,
        &Sampling::Parameters(parameters.to_vec()),
        0,
        Quantities::default(),
    )
    .unwrap()
    .points
}

/// `lists[k][i]`: derivative `k` at parameter `i`.
pub fn jets<const D: usize>(
    curve: &Curve<D>,
    parameters: &[f64],
    orders: usize,
) -> Vec<Vec<Point<D>>> {
    let samples = evaluate(
        &Context::default(),
        curve,
        &Sampling::Parameters(parameters.to_vec()),
        orders,
        Quantities::default(),
    )
    .unwrap();
    std::iter::once(samples.points).chain(samples.derivatives).collect()
}

pub fn domain<const D: usize>(curve: &Curve<D>) -> (f64, f64) {
    curve.composite(&Context::default()).unwrap().breaks().domain()
}

/// `count + 1` parameters from end to end.
pub fn even<const D: usize>(curve: &Curve<D>, count: usize) -> Vec<f64> {
    let (a, b) = domain(curve);
    (0..=count).map(|i| (a + (b - a) * i as f64 / count as f64).clamp(a, b)).collect()
}

pub fn single<const D: usize>(basis: Basis, points: Vec<Point<D>>) -> Curve<D> {
    Curve::Single(Single::new(&Context::default(), basis, points).unwrap())
}

pub fn control_points<const D: usize>(curve: &Curve<D>) -> &[Point<D>] {
    match curve {
        Curve::Single(curve) => curve.control_points(),
        Curve::Piecewise(curve) => curve.control_points(),
        Curve::BSpline(curve) => curve.control_points(),
    }
}

/// The largest absolute coordinate of a control point or Bezier point.
pub fn size<const D: usize>(curve: &Curve<D>) -> f64 {
    curve.composite(&Context::default()).unwrap().magnitude().max(magnitude(control_points(curve)))
}

/// The largest distance between points of two lists of equal length; NaN counts as infinite.
pub fn apart<const D: usize>(some: &[Point<D>], others: &[Point<D>]) -> f64 {
    assert_eq!(some.len(), others.len());
    let distance = |(p, q): (&Point<D>, &Point<D>)| (*p - *q).norm();
    some.iter()
        .zip(others)
        .map(distance)
        .fold(0.0, |worst, d| if d.is_nan() { f64::INFINITY } else { worst.max(d) })
}

/// The largest distance between two curves at parameters inside every segment of both, and away
/// from joints.
pub fn curves_apart<const D: usize>(one: &Curve<D>, other: &Curve<D>) -> f64 {
    let parameters = inner_parameters(&one.composite(&Context::default()).unwrap())
        .chain(inner_parameters(&other.composite(&Context::default()).unwrap()))
        .collect::<Vec<_>>();
    apart(&at(one, &parameters), &at(other, &parameters))
}

/// Five parameters inside each segment.
pub fn inner_parameters<const D: usize>(
    composite: &Composite<D>,
) -> impl Iterator<Item = f64> + '_ {
    let inside = move |(a, b): (f64, f64)| [0.07, 0.3, 0.5, 0.77, 0.98].map(|u| a + u * (b - a));
    (0..composite.breaks().segments()).flat_map(move |i| inside(composite.breaks().interval(i)))
}

/// The distance from a point to the segment between two others.
pub fn to_segment<const D: usize>(p: Point<D>, a: Point<D>, b: Point<D>) -> f64 {
    let edge = b - a;
    let length = edge.norm();
    if length == 0.0 {
        return p.distance(a);
    }
    let along = edge.map(|x| x / length);
    p.distance(a + along * (p - a).dot(along).clamp(0.0, length))
}
