//! Limits that an operator lowered: refused above, accepted at, with the lowered number in the
//! message.

use std::fmt::Display;

use springline::api::error::Error as Located;
use springline::api::json::from_bytes;
use springline::api::operations::Operation;
use springline::api::operations::continuity::ContinuityOperation;
use springline::api::operations::interpolate::Interpolate;
use springline::core::basis::{Basis, Bezier, Quasi, ShapeParameters};
use springline::core::basis_functions::basis_functions;
use springline::core::context::Context;
use springline::core::convert::convert;
use springline::core::curve::{BSpline, Bases, Curve, Single};
use springline::core::error::Error;
use springline::core::evaluate::{Quantities, Sampling, evaluate};
use springline::core::fault::Fault;
use springline::core::fit::{Ends, Options, Solve, fit};
use springline::core::interpolate::{End, EndConditions, interpolate};
use springline::core::knots::Breaks;
use springline::core::limits::{CEILING, Limits};
use springline::core::parameterization::Parameterization;
use springline::core::point::Point;
use springline::core::subdivide::{Cuts, Form, subdivide};
use springline::core::surface::{self, Places, Surface, SurfaceQuantities};
use springline::core::to_bspline::{KnotStyle, to_bspline};

const LOW: Limits = Limits {
    degree: 5,
    control_points: 61,
    data_points: 41,
    samples: 30,
    answer_points: 100,
    segments: 16,
};

/// Held to these.
fn low() -> Context {
    Context::within(LOW.checked().unwrap())
}

#[test]
fn what_is_no_limit_is_refused() {
    let refused = |limits: Limits| limits.checked().unwrap_err();
    let names = |limits, name: &str| {
        let Fault::OutOfRange { what, .. } = refused(limits) else { panic!("{name}") };
        assert_eq!(what, name);
    };
    names(Limits { degree: 65, ..CEILING }, "degree");
    names(Limits { degree: 2, ..CEILING }, "degree");
    names(Limits { control_points: 400_001, ..CEILING }, "control_points");
    names(Limits { data_points: 100_001, ..CEILING }, "data_points");
    names(Limits { samples: 1, ..CEILING }, "samples");
    names(Limits { answer_points: 1_000_001, ..CEILING }, "answer_points");
    names(Limits { segments: 0, ..CEILING }, "segments");
    let text = refused(Limits { segments: 100_001, ..CEILING }).to_string();
    assert_eq!(text, "segments is 100001; allowed is 2 <= segments <= 100000");
    assert_eq!(Context::default().limits, CEILING);
}

/// Passes at the limit, and above it is refused with this limit, in the message too, at this place.
fn bounded<T, E: Into<Located> + Display>(
    place: &str,
    limit: usize,
    at: Result<T, E>,
    above: Result<T, E>,
) {
    if let Err(error) = at {
        panic!("at the limit: {error}");
    }
    let Err(error) = above else { panic!("nothing refused above {limit} at {place}") };
    let error: Located = error.into();
    let springline::api::error::Fault::Core(fault) = &error.fault else { panic!("{error}") };
    assert!(matches!(fault, Fault::TooLarge { most, .. } if *most == limit), "{error}");
    assert!(error.to_string().contains(&format!("the limit is {limit}.")), "{error}");
    assert_eq!(error.place.to_string(), place, "{error}");
}

fn bezier() -> Basis {
    Basis::Bezier(Bezier)
}

fn points(count: usize) -> Vec<Point<2>> {
    (0..count).map(|i| i as f64).map(|t| Point([t, (t * 0.7).sin()])).collect()
}

fn single(degree: usize) -> Result<Curve<2>, Error> {
    Single::new(&low(), bezier(), points(degree + 1)).map(Curve::Single)
}

fn bspline(degree: usize, count: usize) -> Result<Curve<2>, Error> {
    let knots = (0..count + degree + 1).map(|i| i as f64).collect();
    BSpline::new(&low(), degree, knots, points(count), false).map(Curve::BSpline)
}

#[test]
fn degree() {
    bounded("/control_points", 6, single(5), single(6));
    let curve = single(5).unwrap();
    let derivatives =
        |order| evaluate(&low(), &curve, &Sampling::Count(2), order, Quantities::default());
    bounded("/derivatives", 5, derivatives(5), derivatives(6));
    let quasi =
        |order: usize| Quasi::new(&low(), ShapeParameters::Elevation { lambdas: vec![0.0; order] });
    bounded("/lambdas", 4, quasi(4), quasi(5));
    let rows = |count: usize| {
        (0..count).map(|i| (0..count).map(|j| f64::from(i == j)).collect()).collect()
    };
    let matrix = |count| Quasi::new(&low(), ShapeParameters::Matrix { rows: rows(count) });
    bounded("/rows", 6, matrix(6), matrix(7));
    // An order is no count of something given: out of range.
    let raised = convert(&low(), &curve, bezier(), Some(6)).unwrap_err();
    assert!(
        matches!(&raised.fault, Fault::OutOfRange { allowed, .. } if allowed == "1 <= order <= 5"),
        "{raised}"
    );
    assert_eq!(bspline(6, 7).unwrap_err().place.to_string(), "/degree");
}

#[test]
fn control_points() {
    bounded("/control_points", 61, bspline(3, 61), bspline(3, 62));
    let curve = bspline(5, 17).unwrap();
    let in_order = |order| convert(&low(), &curve, bezier(), Some(order));
    bounded(
        "/control_points",
        61,
        in_order(5),
        convert(&low(), &bspline(5, 18).unwrap(), bezier(), Some(5)),
    );
    let elevated = |segments: usize| {
        let curve = bspline(1, segments + 1).unwrap();
        to_bspline(
            &low(),
            &convert(&low(), &curve, bezier(), Some(5))?.curve,
            KnotStyle::Clamped,
            1e-9,
        )
    };
    bounded("/control_points", 61, elevated(12), elevated(13));
    let net = |rows: usize, columns: usize| {
        let row = |i| (0..columns).map(|j| Point([i as f64, j as f64, 0.0])).collect();
        Surface::new(&low(), bezier(), bezier(), (0..rows).map(row).collect())
    };
    bounded("/control_net", 61, net(6, 6), net(8, 8));
    let patch = net(6, 6).unwrap();
    let cut = |us: &[f64]| surface::subdivide(&low(), &patch, us, &[], Form::Bezier);
    bounded("/at", 61, cut(&[]), cut(&[0.5]));
}

#[test]
fn segments() {
    let breaks = |count| Breaks::new(&low(), (0..=count).map(f64::from).collect());
    bounded("", 16, breaks(16), breaks(17));
    let spans = |count: usize| bspline(3, count + 3).unwrap().composite(&low());
    bounded("/knots", 16, spans(16), spans(17));
    let curve = single(3).unwrap();
    let cut = |cuts| subdivide(&low(), &curve, &cuts, Form::Auto);
    bounded("/at/depth", 16, cut(Cuts::Depth(4)), cut(Cuts::Depth(5)));
    let parameters =
        |count: u32| Cuts::Parameters((1..=count).map(|i| f64::from(i) / 20.0).collect());
    bounded("/at/values", 15, cut(parameters(15)), cut(parameters(16)));
    bounded("/at/tolerance", 16, cut(Cuts::Flatness(0.1)), cut(Cuts::Flatness(1e-6)));
    let bases = |count: usize| {
        let list = vec![r#"{"family":"bezier"}"#; count].join(",");
        let body = format!(r#"{{"points":[[0,0],[1,1],[2,0]],"bases":[{list}]}}"#);
        Interpolate::compute(&low(), from_bytes(&low(), body.as_bytes()).unwrap())
    };
    assert!(
        bases(16).unwrap_err().to_string().contains("expected is 2"),
        "16 bases are read, and then do not fit 2 segments"
    );
    bounded("/bases", 16, bases(2), bases(17));
    let curves = |count: usize| {
        let list = vec![r#"{"family":"bezier","control_points":[[0,0],[1,1]]}"#; count].join(",");
        ContinuityOperation::compute(
            &low(),
            from_bytes(&low(), format!(r#"{{"curves":[{list}]}}"#).as_bytes()).unwrap(),
        )
    };
    bounded("/curves", 16, curves(16), curves(17));
}

#[test]
fn data_points() {
    let line = |count| {
        let solve = Solve::ControlPoints { basis: bezier(), order: 3 };
        let options = Options {
            weights: None,
            parameters: Parameterization::Uniform,
            ends: Ends::Free,
            parameter_correction: false,
            solve,
        };
        fit(&low(), points(count), options)
    };
    bounded("/points", 41, line(41), line(42));
}

/// Data whose curve would be larger than a curve may be.
#[test]
fn data_that_make_too_large_a_curve() {
    let open = EndConditions::Open(End::Natural, End::Natural);
    let through = |count| {
        interpolate(
            &low(),
            &points(count),
            open,
            Bases::Common(bezier()),
            &Parameterization::Uniform,
        )
    };
    bounded("/points", 16, through(17), through(18));
    let within = |tolerance| {
        let solve = Solve::Tolerance { basis: bezier(), tolerance };
        let options = Options {
            weights: None,
            parameters: Parameterization::Uniform,
            ends: Ends::Free,
            parameter_correction: false,
            solve,
        };
        let noisy = (0..41).map(|i| Point([f64::from(i), f64::from(i * i % 7)])).collect();
        fit(&low(), noisy, options)
    };
    bounded("/solve/tolerance", 16, within(5.0), within(1e-3));
}

#[test]
fn samples() {
    let curve = single(3).unwrap();
    let at = |sampling| evaluate(&low(), &curve, &sampling, 0, Quantities::default());
    bounded("/sampling/count", 30, at(Sampling::Count(30)), at(Sampling::Count(31)));
    let values = |count| Sampling::Parameters(vec![0.5; count]);
    bounded("/sampling/values", 30, at(values(30)), at(values(31)));
    bounded("/sampling/tolerance", 29, at(Sampling::Tolerance(0.1)), at(Sampling::Tolerance(1e-6)));
    let functions = |count| basis_functions(&low(), &bezier(), 1, count);
    bounded("/count", 30, functions(30), functions(31));
    let net = vec![
        vec![Point([0.0, 0.0, 0.0]), Point([0.0, 1.0, 0.0])],
        vec![Point([1.0, 0.0, 0.0]), Point([1.0, 1.0, 1.0])],
    ];
    let patch = Surface::new(&low(), bezier(), bezier(), net).unwrap();
    let places =
        |places| surface::evaluate(&low(), &patch, &places, 0, SurfaceQuantities::default());
    bounded("/at", 30, places(Places::Grid(5, 6)), places(Places::Grid(4, 8)));
    let pairs = |count| Places::Parameters(vec![[0.5; 2]; count]);
    bounded("/at/values", 30, places(pairs(30)), places(pairs(31)));
    let mesh = |tolerance| surface::tessellate(&low(), &patch, tolerance);
    bounded("/tolerance", 30, mesh(0.1), mesh(1e-4));
}

#[test]
fn answer_points() {
    let curve = single(3).unwrap();
    let at = |count| evaluate(&low(), &curve, &Sampling::Count(count), 4, Quantities::default());
    bounded("", 100, at(20), at(21));
    let functions = |count| basis_functions(&low(), &bezier(), 4, count);
    bounded("/count", 100, functions(20), functions(21));
    let net = vec![
        vec![Point([0.0, 0.0, 0.0]), Point([0.0, 1.0, 0.0])],
        vec![Point([1.0, 0.0, 0.0]), Point([1.0, 1.0, 1.0])],
    ];
    let patch = Surface::new(&low(), bezier(), bezier(), net).unwrap();
    let places = |rows, columns| {
        surface::evaluate(
            &low(),
            &patch,
            &Places::Grid(rows, columns),
            2,
            SurfaceQuantities::default(),
        )
    };
    bounded("/at", 100, places(4, 4), places(4, 5));
}
