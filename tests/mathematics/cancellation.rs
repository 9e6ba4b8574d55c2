//! A computation that nobody waits for any more ends soon, wherever it is: every operation at about
//! its largest input.
//!
//! Soon is counted in checkpoints, of which there are as many on any machine. `cargo test --release
//! --test mathematics cancellation:: -- --ignored --nocapture` prints how far apart they are in
//! time.

use std::sync::{Arc, Mutex, OnceLock};
use std::time::{Duration, Instant};

use springline::api::operations::Operation;
use springline::api::operations::continuity::ContinuityOperation;
use springline::api::operations::interpolate::Interpolate;
use springline::api::operations::reshape::Reshape;
use springline::core::basis::{Basis, Beta, Bezier};
use springline::core::basis_functions::basis_functions;
use springline::core::cancellation::Cancellation;
use springline::core::context::Context;
use springline::core::continuity::{Tolerance, continuity};
use springline::core::convert::convert;
use springline::core::curve::{BSpline, Bases, Composite, Curve, Piecewise, Single};
use springline::core::error::Error;
use springline::core::evaluate::{Quantities, Sampling, evaluate};
use springline::core::fault::Fault;
use springline::core::fit::{Ends, Family, Options, Solve, fit};
use springline::core::interpolate::{End, EndConditions, interpolate};
use springline::core::join::{Movable, join};
use springline::core::knots::Breaks;
use springline::core::parameterization::Parameterization;
use springline::core::point::Point;
use springline::core::rational::AnyCurve;
use springline::core::reshape::reshape;
use springline::core::smoothness::Smoothness;
use springline::core::subdivide::{Cuts, Form, subdivide};
use springline::core::surface::{self, Places, Surface, SurfaceQuantities};
use springline::core::to_bspline::{KnotStyle, to_bspline};
use springline::draw::{Curves, Mark, Picture, Show, draw};

type P = Point<3>;
type Run = Box<dyn Fn(&Context) -> Outcome>;

/// What became of a computation.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Outcome {
    Done,
    Refused,
    Cancelled,
}

impl<T, E: Into<springline::api::error::Error>> From<Result<T, E>> for Outcome {
    fn from(result: Result<T, E>) -> Self {
        match result.map_err(Into::into) {
            Ok(_) => Outcome::Done,
            Err(error) if error.fault == Fault::Cancelled.into() => Outcome::Cancelled,
            Err(_) => Outcome::Refused,
        }
    }
}

/// What is run, and how to prepare it.
struct Case {
    name: &'static str,
    prepare: fn() -> Run,
}

/// A computation whose result is not looked at.
fn run<T>(computation: impl Fn(&Context) -> Result<T, Error> + 'static) -> Run {
    Box::new(move |context| computation(context).into())
}

// ---- inputs

/// Numbers in [-1, 1) that look random and are always the same.
fn number(i: usize) -> f64 {
    let mixed = (i as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let mixed = (mixed ^ (mixed >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    (mixed >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

/// A walk without repetition, with noise of this size.
fn walk(count: usize, noise: f64) -> Vec<P> {
    let at = |i: usize| {
        let t = i as f64 / count as f64;
        Point([30.0 * t, (40.0 * t).sin(), (23.0 * t).cos()])
            + Point([0, 1, 2].map(|k| noise * number(3 * i + k)))
    };
    (0..count).map(at).collect()
}

/// A basis like no other, near Bezier's, so that it has a way back at any order.
fn beta(i: usize) -> Basis {
    Basis::Beta(Beta::from_beta(1e-5 * (1.0 + i as f64 * 1e-6)).unwrap())
}

fn different(count: usize) -> Bases {
    Bases::PerSegment((0..count).map(beta).collect())
}

fn bezier() -> Basis {
    Basis::Bezier(Bezier)
}

fn even(count: usize) -> Breaks {
    Breaks::new(&Context::default(), (0..=count).map(|i| i as f64).collect()).unwrap()
}

fn piecewise(bases: Bases, order: usize, segments: usize) -> Curve<3> {
    Curve::Piecewise(
        Piecewise::new(
            &Context::default(),
            bases,
            order,
            even(segments),
            false,
            walk(segments * order + 1, 1e-3),
        )
        .unwrap(),
    )
}

/// As many segments of order 64 as a curve can have, and all of them different.
fn wide() -> Curve<3> {
    static WIDE: OnceLock<Curve<3>> = OnceLock::new();
    WIDE.get_or_init(|| piecewise(different(6_249), 64, 6_249)).clone()
}

/// As many segments as a curve can have.
fn long() -> Curve<3> {
    piecewise(Bases::Common(beta(0)), 3, 100_000)
}

fn bspline(degree: usize, spans: usize) -> Curve<3> {
    let knots = (0..=spans + 2 * degree).map(|i| i as f64).collect();
    Curve::BSpline(
        BSpline::new(&Context::default(), degree, knots, walk(spans + degree, 1e-3), false)
            .unwrap(),
    )
}

fn single() -> Curve<3> {
    Curve::Single(Single::new(&Context::default(), beta(0), walk(65, 0.5)).unwrap())
}

fn patch() -> Surface {
    let row =
        |i: usize| (0..65).map(|j| Point([i as f64, j as f64, 9.0 * number(65 * i + j)])).collect();
    Surface::new(&Context::default(), beta(0), beta(1), (0..65).map(row).collect()).unwrap()
}

fn fitting(points: Vec<P>, ends: Ends, parameter_correction: bool, solve: Solve<3>) -> Run {
    run(move |context| {
        let options = Options {
            weights: None,
            parameters: Parameterization::ChordLength,
            ends,
            parameter_correction,
            solve: solve.clone(),
        };
        fit(context, points.clone(), options)
    })
}

fn picture(curves: Vec<Curve<3>>, surfaces: Vec<Surface>) -> Run {
    let marks = |count| (0..count).map(|i| Mark { label: None, color: i % 8, dashes: i }).collect();
    let picture = Picture {
        curve_marks: marks(curves.len()),
        surface_marks: marks(surfaces.len()),
        curves: Curves::Space(curves.into_iter().map(AnyCurve::Polynomial).collect()),
        surfaces,
        show: Show { polygon: true, joints: true, comb: true, axes: true, legend: true },
        comb_scale: None,
        size: [4_000, 4_000],
        title: "All".into(),
    };
    run(move |context| draw(context, &picture))
}

/// An operation as the service runs it, from the bytes of a request.
fn request<Request, Answer>(
    body: String,
    operation: fn(&Context, Request) -> Result<Answer, springline::api::error::Error>,
) -> Run
where
    Request: springline::api::json::Request + 'static,
    Answer: 'static,
{
    Box::new(move |context| match springline::api::json::from_bytes(context, body.as_bytes()) {
        Ok(request) => operation(context, request).into(),
        Err(problem) if problem.code() == "deadline" => Outcome::Cancelled,
        Err(_) => Outcome::Refused,
    })
}

fn joined(list: impl Iterator<Item = String>) -> String {
    list.collect::<Vec<_>>().join(",")
}

// ---- cases

const CASES: &[Case] = &[
    Case {
        name: "evaluate: 200,000 samples with frames, degree 64",
        prepare: || {
            let all = Quantities {
                tangent: true,
                normal: true,
                curvature: true,
                torsion: true,
                speed: true,
            };
            let curve = single();
            run(move |context| evaluate(context, &curve, &Sampling::Count(200_000), 2, all))
        },
    },
    Case {
        name: "evaluate: B-spline of degree 64 with 100,000 spans, 8 derivatives",
        prepare: || {
            let curve = bspline(64, 100_000);
            run(move |context| {
                evaluate(context, &curve, &Sampling::Count(100_000), 8, Quantities::default())
            })
        },
    },
    Case {
        name: "evaluate: 6,249 bases of order 64",
        prepare: || {
            let curve = wide();
            run(move |context| {
                evaluate(context, &curve, &Sampling::Count(2), 0, Quantities::default())
            })
        },
    },
    Case {
        name: "evaluate: by tolerance",
        prepare: || {
            let curve = wide();
            run(move |context| {
                evaluate(context, &curve, &Sampling::Tolerance(1e-7), 0, Quantities::default())
            })
        },
    },
    Case {
        name: "subdivide: 100,000 parameters, degree 64",
        prepare: || {
            let curve = single();
            let cuts = Cuts::Parameters((1..99_999).map(|i| i as f64 / 1e5).collect());
            run(move |context| subdivide(context, &curve, &cuts, Form::Auto))
        },
    },
    Case {
        name: "subdivide: to a depth, 96,000 pieces of degree 64",
        prepare: || {
            let curve = piecewise(Bases::Common(beta(0)), 64, 3_000);
            run(move |context| subdivide(context, &curve, &Cuts::Depth(5), Form::Auto))
        },
    },
    Case {
        name: "subdivide: to a flatness",
        prepare: || {
            let curve = wide();
            run(move |context| subdivide(context, &curve, &Cuts::Flatness(1e-7), Form::Auto))
        },
    },
    Case {
        name: "to-bspline: B-spline of degree 64 with 100,000 spans",
        prepare: || {
            let curve = bspline(64, 100_000);
            run(move |context| to_bspline(context, &curve, KnotStyle::Clamped, 1e-9))
        },
    },
    Case {
        name: "to-bspline: 6,000 segments of degree 64, all knots",
        prepare: || {
            let curve = piecewise(Bases::Common(bezier()), 64, 6_000);
            run(move |context| to_bspline(context, &curve, KnotStyle::Clamped, 1e-9))
        },
    },
    Case {
        name: "interpolate: 100,000 points, as many bases",
        prepare: || {
            let points = walk(100_000, 1e-3);
            run(move |context| {
                interpolate(
                    context,
                    &points,
                    EndConditions::Closed,
                    different(100_000),
                    &Parameterization::ChordLength,
                )
            })
        },
    },
    Case {
        name: "interpolate: 100,000 points, not a knot",
        prepare: || {
            let points = walk(100_000, 1e-3);
            let shape = EndConditions::Open(End::NotAKnot, End::NotAKnot);
            run(move |context| {
                interpolate(
                    context,
                    &points,
                    shape,
                    Bases::Common(bezier()),
                    &Parameterization::ChordLength,
                )
            })
        },
    },
    Case {
        name: "fit: 100,000 noisy points by tolerance",
        prepare: || {
            let solve = Solve::Tolerance { basis: bezier(), tolerance: 1e-3 };
            fitting(walk(100_000, 1e-3), Ends::Interpolate, false, solve)
        },
    },
    Case {
        name: "fit: 100,000 smooth points by tolerance",
        prepare: || {
            fitting(
                walk(100_000, 0.0),
                Ends::Free,
                false,
                Solve::Tolerance { basis: beta(0), tolerance: 1e-9 },
            )
        },
    },
    Case {
        name: "fit: 100,000 points, control points of order 40, corrected",
        prepare: || {
            fitting(
                walk(100_000, 1e-2),
                Ends::Interpolate,
                true,
                Solve::ControlPoints { basis: bezier(), order: 40 },
            )
        },
    },
    Case {
        name: "fit: 100,000 points, shape of a beta-bezier of order 64",
        prepare: || {
            let solve = Solve::Shape { family: Family::Beta, control_points: walk(65, 0.3) };
            fitting(walk(100_000, 1e-2), Ends::Free, true, solve)
        },
    },
    Case {
        name: "fit: 100,000 points, shape of a quasi-bezier of degree 40",
        prepare: || {
            let solve = Solve::Shape {
                family: Family::Quasi { degree: 40 },
                control_points: walk(41, 0.3),
            };
            fitting(walk(100_000, 1e-2), Ends::Free, true, solve)
        },
    },
    Case {
        name: "fit: 100,000 points, both, order 30 and degree 36",
        prepare: || {
            fitting(
                walk(100_000, 1e-2),
                Ends::Interpolate,
                true,
                Solve::Both { family: Family::Quasi { degree: 36 }, order: 30 },
            )
        },
    },
    Case {
        name: "reshape: 6,249 bases of order 64, nothing kept",
        prepare: || {
            let curve = piecewise(Bases::Common(bezier()), 64, 6_249);
            run(move |context| reshape(context, &curve, different(6_249), Smoothness::C0))
        },
    },
    Case {
        name: "reshape: 6,249 bases of order 64, C1 kept",
        prepare: || {
            let curve =
                convert(&Context::default(), &bspline(3, 6_249), bezier(), Some(64)).unwrap().curve;
            run(move |context| reshape(context, &curve, different(6_249), Smoothness::C1))
        },
    },
    Case {
        name: "reshape: 80,000 bases of order 4, C1 kept",
        prepare: || {
            let curve =
                convert(&Context::default(), &bspline(3, 80_000), bezier(), Some(4)).unwrap().curve;
            run(move |context| reshape(context, &curve, different(80_000), Smoothness::C1))
        },
    },
    Case {
        name: "join: 1,000 curves of order 64, G2",
        prepare: || {
            let curves: Vec<_> = (0..1_000)
                .map(|i| {
                    Single::new(&Context::default(), beta(i), walk(65, 0.1 + 1e-4 * i as f64))
                        .unwrap()
                })
                .collect();
            run(move |context| join(context, curves.clone(), Smoothness::G2, Movable::Both))
        },
    },
    Case {
        name: "convert: 100,000 cubics",
        prepare: || {
            let curve = long();
            run(move |context| convert(context, &curve, beta(7), None))
        },
    },
    Case {
        name: "convert: 6,249 cubics to order 64",
        prepare: || {
            let curve = piecewise(Bases::Common(bezier()), 3, 6_249);
            run(move |context| convert(context, &curve, beta(7), Some(64)))
        },
    },
    Case {
        name: "continuity: 100,000 joints of degree 64",
        prepare: || {
            let composite: Composite<3> =
                bspline(64, 100_000).composite(&Context::default()).unwrap();
            run(move |context| continuity(context, &composite, false, Tolerance::default()))
        },
    },
    Case {
        name: "basis functions: 15,000 samples of order 64",
        prepare: || run(|context| basis_functions(context, &beta(0), 64, 15_384)),
    },
    Case {
        name: "surface evaluate: 400 x 400, second derivatives",
        prepare: || {
            let surface = patch();
            let all =
                SurfaceQuantities { normal: true, mean_curvature: true, gaussian_curvature: true };
            run(move |context| {
                surface::evaluate(context, &surface, &Places::Grid(378, 377), 2, all)
            })
        },
    },
    Case {
        name: "surface subdivide: 90 pieces of degree 64",
        prepare: || {
            let surface = patch();
            let cuts =
                |count: usize| (1..count).map(|i| i as f64 / count as f64).collect::<Vec<_>>();
            run(move |context| {
                surface::subdivide(context, &surface, &cuts(10), &cuts(9), Form::Auto)
            })
        },
    },
    Case {
        name: "surface subdivide: 99,000 pieces of degree 1",
        prepare: || {
            let net = [[0.0, 1.0], [2.0, 5.0]]
                .map(|row| row.map(|z| Point([z, z * z, 1.0])).to_vec())
                .to_vec();
            let surface = Surface::new(&Context::default(), bezier(), bezier(), net).unwrap();
            let cuts =
                |count: usize| (1..count).map(|i| i as f64 / count as f64).collect::<Vec<_>>();
            run(move |context| {
                surface::subdivide(context, &surface, &cuts(330), &cuts(300), Form::Auto)
            })
        },
    },
    Case {
        name: "surface tessellate: 190,000 vertices",
        prepare: || {
            let surface = patch();
            // Vertices are in inverse proportion to the tolerance.
            let coarse = 1e3;
            let tolerance = coarse
                * surface::tessellate(&Context::default(), &surface, coarse).unwrap().points.len()
                    as f64
                / 190_000.0;
            run(move |context| surface::tessellate(context, &surface, tolerance))
        },
    },
    Case {
        name: "render: 19,999 segments of degree 20",
        prepare: || picture(vec![piecewise(Bases::Common(beta(0)), 20, 19_999)], Vec::new()),
    },
    Case { name: "render: 6,249 bases of order 64", prepare: || picture(vec![wide()], Vec::new()) },
    Case {
        name: "render: 16 surfaces of degree 64",
        prepare: || picture(Vec::new(), (0..16).map(|_| patch()).collect()),
    },
    Case {
        name: "request: 100,000 shape matrices of order 63",
        prepare: || {
            let basis = |i: usize| {
                let zeros = ",0".repeat(62);
                format!(
                    r#"{{"family":"quasi-bezier","shape":{{"kind":"elevation","lambdas":[0.{i:06}{zeros}]}}}}"#
                )
            };
            let bases = joined((0..100_000).map(basis));
            let curve = r#"{"family":"bezier","control_points":[[0,0],[1,1]]}"#;
            request(format!(r#"{{"curve":{curve},"bases":[{bases}]}}"#), Reshape::compute)
        },
    },
    Case {
        name: "request: continuity of 50,000 beta-bezier curves of order 64",
        prepare: || {
            let points = joined((0..65).map(|i| format!("[{i},{}]", i % 7)));
            let curve = |i: usize| {
                format!(r#"{{"family":"beta-bezier","beta":{i},"control_points":[{points}]}}"#)
            };
            let curves = joined((0..50_000).map(curve));
            request(
                format!(r#"{{"curves":[{curves}],"closed":true,"report":"summary"}}"#),
                ContinuityOperation::compute,
            )
        },
    },
    Case {
        name: "request: reading 1,500,000 points",
        prepare: || {
            let points = joined(
                walk(15_000, 1e-3)
                    .into_iter()
                    .map(|p| format!("[{:.3},{:.4},{:.4}]", p[0], p[1], p[2])),
            );
            let points = joined((0..100).map(|_| points.clone()));
            request(format!(r#"{{"points":[{points}]}}"#), Interpolate::compute)
        },
    },
];

// ---- checkpoints

/// A run with its checkpoints counted.
struct Counted {
    outcome: Outcome,
    /// Checkpoints passed in all.
    passed: usize,
    whole: Duration,
    /// The longest way from one checkpoint to the next, and from the last to the end.
    longest: Duration,
    /// From the checkpoint that told it to end.
    rest: Duration,
}

/// Runs a case that is cancelled at this checkpoint, counted from 1; at none if it has not so many.
fn cancelled_at(case: &Run, checkpoint: usize) -> Counted {
    let passages = Arc::new(Mutex::new(Passages {
        passed: 0,
        last: Instant::now(),
        longest: Duration::ZERO,
        told: None,
    }));
    let watched = passages.clone();
    let context =
        Context::until(&Cancellation::when(move || watched.lock().unwrap().pass(checkpoint)));
    let started = Instant::now();
    let outcome = case(&context);
    let mut passages = passages.lock().unwrap();
    let passed = passages.passed;
    passages.pass(checkpoint);
    let ended = passages.last;
    let rest = passages.told.map_or(Duration::ZERO, |told| ended - told);
    Counted { outcome, passed, longest: passages.longest, whole: ended - started, rest }
}

/// Checkpoints as they are passed.
struct Passages {
    passed: usize,
    last: Instant,
    longest: Duration,
    /// When it was told to end.
    told: Option<Instant>,
}

impl Passages {
    /// One more; whether it is this one.
    fn pass(&mut self, which: usize) -> bool {
        let before = std::mem::replace(&mut self.last, Instant::now());
        self.longest = self.longest.max(self.last - before);
        self.passed += 1;
        let is_it = self.passed == which;
        if is_it {
            self.told = Some(self.last);
        }
        is_it
    }
}

/// Of the largest cases every one has more checkpoints than this.
const LEAST: usize = 100;
/// So many more may follow the one that told a computation to end.
const FEW: usize = 2;
/// A drawing cannot fail: it goes on to its end, writing nothing, and asks at every coordinate.
const DRAWING: usize = 1_000_000;

#[test]
fn a_cancelled_computation_ends_at_its_next_checkpoints() {
    for case in CASES {
        let computation = (case.prepare)();
        let most = if case.name.starts_with("render") { DRAWING } else { FEW };
        for checkpoint in [1, LEAST / 2, 10 * LEAST] {
            let Counted { outcome, passed, .. } = cancelled_at(&computation, checkpoint);
            if passed < checkpoint {
                assert!(
                    outcome != Outcome::Cancelled && passed > LEAST,
                    "{}: {outcome:?} after {passed} checkpoints",
                    case.name
                );
            } else {
                assert_eq!(outcome, Outcome::Cancelled, "{}: at {checkpoint}", case.name);
                assert!(
                    passed <= checkpoint + most,
                    "{}: went on for {} checkpoints",
                    case.name,
                    passed - checkpoint
                );
            }
        }
    }
}

#[test]
#[ignore = "a measurement: run it optimised and alone"]
fn how_soon_a_cancelled_computation_ends() {
    const MOMENTS: usize = 12;
    println!(
        "{:75} {:>11} {:>11} {:>14} {:>11}",
        "", "whole", "checkpoints", "furthest apart", "cancelled"
    );
    for case in CASES {
        let computation = (case.prepare)();
        let whole = cancelled_at(&computation, usize::MAX);
        // From the checkpoint that told it to end.
        let rest = |k: usize| cancelled_at(&computation, (whole.passed * k / MOMENTS).max(1)).rest;
        let latest = (0..MOMENTS).map(rest).max().unwrap_or_default();
        let ms = |time: Duration| format!("{:.1} ms", time.as_secs_f64() * 1e3);
        let refused = if whole.outcome == Outcome::Done { "" } else { " (refused)" };
        println!(
            "{:75} {:>11} {:>11} {:>14} {:>11}{refused}",
            case.name,
            ms(whole.whole),
            whole.passed,
            ms(whole.longest),
            ms(latest)
        );
    }
}
