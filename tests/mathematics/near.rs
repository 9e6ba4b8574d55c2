//! Curves of tolerance fits stay near their points between them.

use springline::core::basis::{Basis, Bezier};
use springline::core::context::Context;
use springline::core::curve::Composite;
use springline::core::fit::{Ends, Fit, Options, Solve, fit};
use springline::core::parameterization::Parameterization;
use springline::core::point::Point;

/// Random numbers that are the same in every run (SplitMix64: Steele, Lea and Flood 2014).
struct Random(u64);

impl Random {
    fn bits(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mixed = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        let mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    /// In [0, 1).
    fn unit(&mut self) -> f64 {
        (self.bits() >> 11) as f64 / (1u64 << 53) as f64
    }

    /// In [-1, 1).
    fn signed(&mut self) -> f64 {
        2.0 * self.unit() - 1.0
    }

    fn below(&mut self, count: usize) -> usize {
        (self.bits() % count as u64) as usize
    }

    fn vector<const D: usize>(&mut self) -> Point<D> {
        Point(std::array::from_fn(|_| self.signed()))
    }
}

const KINDS: [&str; 7] = [
    "random walk",
    "uniform random",
    "points in clusters",
    "zigzag",
    "nearly repeated",
    "smooth with noise",
    "parameters in clusters",
];

fn points<const D: usize>(kind: usize, count: usize, random: &mut Random) -> Vec<Point<D>> {
    let mut at = Point::ZERO;
    let turn = random.vector::<D>();
    let mut next = |i: usize| {
        at = match kind {
            0 => at + random.vector(),
            2 if random.below(4) > 0 => at + random.vector() * 10f64.powf(-6.0 * random.unit()),
            3 => Point(std::array::from_fn(|k| {
                if k == 0 {
                    i as f64
                } else {
                    f64::from(i.is_multiple_of(2)) * 3.0 + 0.1 * random.signed()
                }
            })),
            4 if i % 3 == 1 => at + random.vector() * 10f64.powf(-12.0 * random.unit()),
            5 => Point(std::array::from_fn(|k| {
                (i as f64 * (0.2 + 0.3 * turn[k])).sin() + 0.05 * random.signed()
            })),
            _ => random.vector(),
        };
        at
    };
    (0..count).map(&mut next).collect()
}

fn parameters(kind: usize, count: usize, random: &mut Random) -> Parameterization {
    let mut t = 0.0;
    let mut values = vec![t];
    while kind == 6 && values.len() < count {
        t += 10f64.powf(-6.0 * random.unit());
        values.push(t);
    }
    match random.below(3) {
        _ if kind == 6 => Parameterization::Given(values),
        0 => Parameterization::Uniform,
        1 => Parameterization::Centripetal,
        _ => Parameterization::ChordLength,
    }
}

/// The lowest and the highest coordinates.
fn corners<const D: usize>(points: &[Point<D>]) -> [Point<D>; 2] {
    let corner = |pick: fn(f64, f64) -> f64| {
        points.iter().fold(points[0], |c, p| Point(std::array::from_fn(|k| pick(c[k], p[k]))))
    };
    [corner(f64::min), corner(f64::max)]
}

fn samples<const D: usize>(curve: &Composite<D>, each: usize) -> Vec<Point<D>> {
    let evaluator = curve.evaluator(&Context::default()).unwrap();
    let at = |k: usize, i: usize| {
        evaluator.within(k, i as f64 / each as f64, (each - i) as f64 / each as f64)
    };
    (0..curve.breaks().segments()).flat_map(|k| (0..=each).map(move |i| at(k, i))).collect()
}

/// How far a curve leaves the box of the points: the distance in diagonals, and the largest of each
/// axis in its extent.
fn leaves<const D: usize>(curve: &Composite<D>, points: &[Point<D>]) -> [f64; 2] {
    let [low, high] = corners(points);
    let diagonal = low.distance(high);
    samples(curve, 40).into_iter().fold([0.0f64; 2], |[far, axis], p| {
        let out = Point::<D>(std::array::from_fn(|k| (low[k] - p[k]).max(p[k] - high[k]).max(0.0)));
        let most = (0..D).map(|k| out[k] / (high[k] - low[k])).fold(0.0, f64::max);
        [far.max(out.norm() / diagonal), axis.max(most)]
    })
}

fn tolerance_fit<const D: usize>(
    points: Vec<Point<D>>,
    parameters: Parameterization,
    ends: Ends,
    tolerance: f64,
) -> Fit<D> {
    let solve = Solve::Tolerance { basis: Basis::Bezier(Bezier), tolerance };
    fit(
        &Context::default(),
        points,
        Options { weights: None, parameters, ends, parameter_correction: false, solve },
    )
    .unwrap()
}

struct Case {
    kind: usize,
    segments: usize,
    leaves: [f64; 2],
    between: f64,
}

fn case<const D: usize>(kind: usize, random: &mut Random) -> Case {
    let count = 4 + random.below(47);
    let points = points::<D>(kind, count, random);
    let parameters = parameters(kind, count, random);
    let ends = if random.below(2) == 0 { Ends::Free } else { Ends::Interpolate };
    let [low, high] = corners(&points);
    let tolerance = low.distance(high) * 10f64.powf(-6.0 * random.unit());
    let fit = tolerance_fit(points.clone(), parameters, ends, tolerance);
    assert!(fit.error.max <= tolerance);
    let curve = fit.curve.composite(&Context::default()).unwrap();
    Case {
        kind,
        segments: curve.breaks().segments(),
        leaves: leaves(&curve, &points),
        between: fit.between / low.distance(high),
    }
}

/// Ten thousand sets of 4 to 50 points in the plane and in space, tolerances from a millionth of
/// their size to all of it, every parameterization: no curve leaves the box of its points by more
/// than half its diagonal.
#[test]
fn no_curve_runs_away() {
    let count = if cfg!(debug_assertions) { 3_000 } else { 10_000 };
    let mut random = Random(7);
    let cases: Vec<Case> = (0..count)
        .map(|i| {
            if i % 2 == 0 {
                case::<2>(i / 2 % KINDS.len(), &mut random)
            } else {
                case::<3>(i / 2 % KINDS.len(), &mut random)
            }
        })
        .collect();
    println!(
        "{:24} {:>6} {:>9} {:>12} {:>12} {:>12} {:>8}",
        "points", "cases", "segments", "leaves box", "leaves axis", "between", "axis>.5"
    );
    for (kind, name) in KINDS.iter().enumerate() {
        let of = || cases.iter().filter(|case| case.kind == kind);
        let worst = |value: &dyn Fn(&Case) -> f64| of().map(value).fold(0.0, f64::max);
        let segments: usize = of().map(|case| case.segments).sum();
        let (far, axis, between) =
            (worst(&|c| c.leaves[0]), worst(&|c| c.leaves[1]), worst(&|c| c.between));
        let beyond = of().filter(|case| case.leaves[1] > 0.5).count();
        println!(
            "{name:24} {:6} {segments:9} {far:12.3} {axis:12.3} {between:12.3} {beyond:8}",
            of().count()
        );
    }
    assert!(cases.iter().all(|case| case.leaves[0] <= 0.5));
}

/// Ten points and a tolerance that once gave y from -55 to 413.
#[test]
fn ten_points_that_were_left_by_hundreds() {
    let points = [
        [0.2, 2.3],
        [1.6, 0.1],
        [2.6, 1.4],
        [3.4, 2.5],
        [4.2, 0.6],
        [4.3, 1.6],
        [4.3, 0.6],
        [5.7, 1.2],
        [9.4, 2.1],
        [9.9, 1.8],
    ];
    let points: Vec<_> = points.into_iter().map(Point).collect();
    let fit = tolerance_fit(points.clone(), Parameterization::ChordLength, Ends::Interpolate, 0.3);
    let curve = fit.curve.composite(&Context::default()).unwrap();
    let [far, axis] = leaves(&curve, &points);
    println!(
        "{} segments, error {}, between {}, leaves {far} {axis}",
        curve.breaks().segments(),
        fit.error.max,
        fit.between
    );
    assert!(fit.between < 1.0 && axis < 0.5);
}
