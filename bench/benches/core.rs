//! The core against plain loops, kurbo and curvo. Within a group everything is measured in turn,
//! round by round; the first is the measure.

use std::hint::black_box;
use std::time::Instant;

use kurbo::ParamCurve;
use springline::core::basis::{Basis, Beta, Bezier};
use springline::core::context::Context;
use springline::core::curve::{BSpline, Bases, Curve, Single};
use springline::core::evaluate::{Quantities, Sampling, evaluate};
use springline::core::fit::{self, Ends, Solve};
use springline::core::interpolate::{End, EndConditions, interpolate};
use springline::core::linear::least_squares::LeastSquares;
use springline::core::parameterization::Parameterization;
use springline::core::point::Point;
use springline::core::rational::{self, Rational};
use springline::core::subdivide::{Cuts, Form, subdivide};

const ROUNDS: usize = 11;

type Work<'a> = (&'a str, Box<dyn FnMut() + 'a>);

/// Prints nanoseconds for each of `per` things, and the ratio to the first.
fn group(title: &str, per: usize, mut works: Vec<Work>) -> Vec<f64> {
    println!("\n{title}");
    let repeats: Vec<usize> = works.iter_mut().map(|(_, work)| repeats(work)).collect();
    let mut times = vec![Vec::new(); works.len()];
    for _ in 0..ROUNDS {
        for (i, (_, work)) in works.iter_mut().enumerate() {
            times[i].push(time(work, repeats[i]) / per as f64);
        }
    }
    let medians: Vec<f64> = times.into_iter().map(median).collect();
    for ((name, _), median) in works.iter().zip(&medians) {
        println!("  {name:<58}{median:>12.2} ns{:>9.2}", median / medians[0]);
    }
    medians
}

/// As often as takes some milliseconds.
fn repeats(work: &mut dyn FnMut()) -> usize {
    let once = time(work, 1);
    ((4e6 / once) as usize).clamp(1, 100_000)
}

fn time(work: &mut dyn FnMut(), repeats: usize) -> f64 {
    let start = Instant::now();
    (0..repeats).for_each(|_| work());
    start.elapsed().as_secs_f64() * 1e9 / repeats as f64
}

fn median(mut values: Vec<f64>) -> f64 {
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

const CUBIC: [[f64; 3]; 4] = [[0.0, 0.0, 1.0], [1.0, 3.0, 2.0], [4.0, 3.0, 0.0], [5.0, 0.0, 2.0]];

fn points<const D: usize>(rows: &[[f64; D]]) -> Vec<Point<D>> {
    rows.iter().map(|row| Point(*row)).collect()
}

/// The limit: Horner's scheme in powers, coordinates in arrays of their own.
fn powers(t: &[f64], out: &mut [Vec<f64>; 3]) {
    for (k, out) in out.iter_mut().enumerate() {
        let [p, q, r, s] = CUBIC.map(|point| point[k]);
        let (a, b, c, d) = (p, 3.0 * (q - p), 3.0 * (r - 2.0 * q + p), s - 3.0 * r + 3.0 * q - p);
        for (x, &t) in out.iter_mut().zip(t) {
            *x = ((d * t + c) * t + b) * t + a;
        }
    }
}

/// The same limit at any degree: coefficients of powers, 16 parameters at a time.
fn horner(coefficients: &[[f64; 3]], t: &[f64], out: &mut [Vec<f64>; 3]) {
    for (k, out) in out.iter_mut().enumerate() {
        for (out, t) in out.chunks_mut(16).zip(t.chunks(16)) {
            let (mut sum, mut lanes) = ([0.0; 16], [0.0; 16]);
            lanes[..t.len()].copy_from_slice(t);
            for c in coefficients.iter().rev() {
                sum.iter_mut().zip(&lanes).for_each(|(sum, t)| *sum = *sum * t + c[k]);
            }
            out.copy_from_slice(&sum[..t.len()]);
        }
    }
}

fn cubics(count: usize) {
    let values: Vec<f64> = (0..count).map(|i| i as f64 / (count - 1) as f64).collect();
    let sampling = Sampling::Parameters(values.clone());
    let of =
        |basis| Curve::Single(Single::new(&Context::default(), basis, points(&CUBIC)).unwrap());
    let (bezier, beta) =
        (of(Basis::Bezier(Bezier)), of(Basis::Beta(Beta::from_beta(1.0).unwrap())));
    let kurbo = kurbo::CubicBez::new((0.0, 0.0), (1.0, 3.0), (4.0, 3.0), (5.0, 0.0));
    let nurbs = curvo::prelude::NurbsCurve3D::<f64>::try_new(
        3,
        CUBIC.map(|p| nalgebra::Point4::new(p[0], p[1], p[2], 1.0)).to_vec(),
        vec![0.0, 0.0, 0.0, 0.0, 1.0, 1.0, 1.0, 1.0],
    )
    .unwrap();
    let mut out = [const { Vec::new() }; 3].map(|_: Vec<f64>| vec![0.0; count]);
    let ours = |curve: &Curve<3>| {
        drop(black_box(
            evaluate(&Context::default(), black_box(curve), &sampling, 0, Quantities::default())
                .unwrap(),
        ))
    };
    let weighted =
        Rational::<3, 4>::new(&Context::default(), bezier.clone(), vec![1.0, 0.5, 2.0, 1.0])
            .unwrap();
    let with_weights = |curve: &Rational<3, 4>| {
        drop(black_box(
            rational::evaluate(
                &Context::default(),
                black_box(curve),
                &sampling,
                0,
                Quantities::default(),
            )
            .unwrap(),
        ))
    };
    group(
        &format!("a cubic at {count} parameters, ns a point"),
        count,
        vec![
            (
                "limit: powers, one array for each coordinate",
                Box::new(|| powers(black_box(&values), black_box(&mut out))),
            ),
            (
                "the same into new arrays, as a call must",
                Box::new(|| {
                    let mut new = [0; 3].map(|_| vec![0.0; count]);
                    powers(black_box(&values), &mut new);
                    black_box(new);
                }),
            ),
            ("springline, bezier", Box::new(|| ours(&bezier))),
            ("springline, beta-bezier", Box::new(|| ours(&beta))),
            ("springline, bezier with weights", Box::new(|| with_weights(&weighted))),
            ("kurbo, 2D", Box::new(|| values.iter().for_each(|&t| _ = black_box(kurbo.eval(t))))),
            ("curvo", Box::new(|| values.iter().for_each(|&t| _ = black_box(nurbs.point_at(t))))),
        ],
    );
}

fn degrees() {
    println!("\ngrowth with the degree, 1,000 samples, ns a point");
    let values: Vec<f64> = (0..1_000).map(|i| f64::from(i) / 999.0).collect();
    let mut out = [0; 3].map(|_| vec![0.0; 1_000]);
    let times: Vec<(f64, f64)> = [2usize, 3, 4, 5, 6, 7, 8, 16, 32, 64]
        .into_iter()
        .map(|degree| {
            let polygon: Vec<Point<3>> = (0..=degree)
                .map(|i| Point([i as f64, (i as f64).sin(), (i as f64).cos()]))
                .collect();
            let coefficients: Vec<[f64; 3]> = polygon.iter().map(|p| p.0).collect();
            let curve = Curve::Single(
                Single::new(&Context::default(), Basis::Bezier(Bezier), polygon).unwrap(),
            );
            let works: Vec<Work> = vec![
                (
                    "limit: powers",
                    Box::new(|| {
                        horner(black_box(&coefficients), black_box(&values), black_box(&mut out))
                    }),
                ),
                (
                    "springline",
                    Box::new(|| {
                        drop(black_box(
                            evaluate(
                                &Context::default(),
                                &curve,
                                &Sampling::Count(1_000),
                                0,
                                Quantities::default(),
                            )
                            .unwrap(),
                        ))
                    }),
                ),
            ];
            (degree as f64, group(&format!("degree {degree}"), 1_000, works)[1])
        })
        .collect();
    println!("  exponent {:.2}", exponent(&times[6..]));
}

/// The slope of log time over log size.
fn exponent(times: &[(f64, f64)]) -> f64 {
    let logs: Vec<(f64, f64)> = times.iter().map(|(size, time)| (size.ln(), time.ln())).collect();
    let n = logs.len() as f64;
    let (mx, my) =
        (logs.iter().map(|l| l.0).sum::<f64>() / n, logs.iter().map(|l| l.1).sum::<f64>() / n);
    logs.iter().map(|l| (l.0 - mx) * (l.1 - my)).sum::<f64>()
        / logs.iter().map(|l| (l.0 - mx).powi(2)).sum::<f64>()
}

fn bsplines(count: usize) {
    let polygon: Vec<Point<3>> =
        (0..16).map(|i| f64::from(i)).map(|i| Point([i, i.sin(), i.cos()])).collect();
    let knots: Vec<f64> = (0..20).map(|i| f64::from(i.clamp(3, 16) - 3)).collect();
    let curve =
        Curve::BSpline(BSpline::new(&Context::default(), 3, knots, polygon, false).unwrap());
    let values: Vec<f64> = (0..count).map(|i| 13.0 * i as f64 / (count - 1) as f64).collect();
    // The measure has its spans in powers beforehand.
    let spans: Vec<[[f64; 4]; 3]> =
        (0..13).map(|i| [0.1, 0.2, 0.3].map(|k| [i as f64, k, 0.5, -k])).collect();
    let mut out = vec![[0.0; 3]; count];
    let sampling = Sampling::Parameters(values.clone());
    group(
        &format!("a B-spline of 16 control points at {count} parameters, ns a point"),
        count,
        vec![
            (
                "measure: powers of each span, ready",
                Box::new(|| {
                    for (x, &t) in out.iter_mut().zip(black_box(&values)) {
                        let span = (t as usize).min(12);
                        let u = t - span as f64;
                        *x = spans[span].map(|[a, b, c, d]| ((d * u + c) * u + b) * u + a);
                    }
                    black_box(&mut out);
                }),
            ),
            (
                "springline",
                Box::new(|| {
                    drop(black_box(
                        evaluate(&Context::default(), &curve, &sampling, 0, Quantities::default())
                            .unwrap(),
                    ))
                }),
            ),
        ],
    );
}

fn splits() {
    let curve = Curve::Single(
        Single::new(&Context::default(), Basis::Bezier(Bezier), points(&CUBIC)).unwrap(),
    );
    let kurbo = kurbo::CubicBez::new((0.0, 0.0), (1.0, 3.0), (4.0, 3.0), (5.0, 0.0));
    let cuts = Cuts::Parameters(vec![0.37]);
    group(
        "a cubic cut at 0.37, ns a cut",
        1,
        vec![
            (
                "measure: de Casteljau, the control points alone",
                Box::new(|| {
                    drop(black_box(springline::core::bezier_form::split(
                        &points(&CUBIC),
                        black_box(0.37),
                    )))
                }),
            ),
            (
                "springline, the operation",
                Box::new(|| {
                    drop(black_box(
                        subdivide(&Context::default(), &curve, &cuts, Form::Bezier).unwrap(),
                    ))
                }),
            ),
            (
                "kurbo, 2D",
                Box::new(|| {
                    _ = black_box((
                        kurbo.subsegment(0.0..black_box(0.37)),
                        kurbo.subsegment(0.37..1.0),
                    ))
                }),
            ),
        ],
    );
}

fn wave(count: usize) -> Vec<Point<2>> {
    (0..count)
        .map(|i| i as f64 * 0.1)
        .map(|t| Point([t + 0.03 * (7.0 * t).sin(), (1.3 * t).sin()]))
        .collect()
}

/// Chord lengths, the natural spline's tridiagonal system by Thomas, Bezier points out: nothing
/// checked, nothing measured.
fn thomas(data: &[Point<2>]) -> Vec<[f64; 2]> {
    let n = data.len();
    let h: Vec<f64> =
        data.windows(2).map(|p| (p[1].0[0] - p[0].0[0]).hypot(p[1].0[1] - p[0].0[1])).collect();
    let slope = |i: usize, k: usize| (data[i + 1].0[k] - data[i].0[k]) / h[i];
    let (mut c, mut d) = (vec![0.0; n], vec![[0.0; 2]; n]);
    c[0] = 0.5;
    d[0] = [0, 1].map(|k| 1.5 * slope(0, k));
    for i in 1..n {
        let (a, b, e, r) = if i + 1 < n {
            (
                h[i],
                2.0 * (h[i - 1] + h[i]),
                h[i - 1],
                [0, 1].map(|k| 3.0 * (h[i] * slope(i - 1, k) + h[i - 1] * slope(i, k))),
            )
        } else {
            (1.0, 2.0, 0.0, [0, 1].map(|k| 3.0 * slope(i - 1, k)))
        };
        let m = 1.0 / (b - a * c[i - 1]);
        c[i] = e * m;
        d[i] = [0, 1].map(|k| (r[k] - a * d[i - 1][k]) * m);
    }
    for i in (0..n - 1).rev() {
        d[i] = [0, 1].map(|k| d[i][k] - c[i] * d[i + 1][k]);
    }
    let mut out = Vec::with_capacity(3 * n);
    for i in 0..n - 1 {
        let (p, q, s) = (data[i].0, data[i + 1].0, h[i] / 3.0);
        out.extend([p, [0, 1].map(|k| p[k] + d[i][k] * s), [0, 1].map(|k| q[k] - d[i + 1][k] * s)]);
    }
    out
}

fn splines(count: usize) -> f64 {
    let data = wave(count);
    let ours = || {
        let shape = EndConditions::Open(End::Natural, End::Natural);
        black_box(
            interpolate(
                &Context::default(),
                black_box(&data),
                shape,
                Bases::Common(Basis::Bezier(Bezier)),
                &Parameterization::ChordLength,
            )
            .unwrap(),
        );
    };
    group(
        &format!("the natural spline through {count} points, ns a point"),
        count,
        vec![
            (
                "measure: the tridiagonal solve, nothing checked",
                Box::new(|| drop(black_box(thomas(black_box(&data))))),
            ),
            ("springline, continuity measured", Box::new(ours)),
        ],
    )[1]
}

fn fits(count: usize) -> f64 {
    let data = wave(count);
    let ours = || {
        let solve = Solve::ControlPoints { basis: Basis::Bezier(Bezier), order: 15 };
        let options = fit::Options {
            weights: None,
            parameters: Parameterization::ChordLength,
            ends: Ends::Interpolate,
            parameter_correction: false,
            solve,
        };
        black_box(fit::fit(&Context::default(), data.clone(), options).unwrap());
    };
    // One pass of normal equations over a dense row of 16 values and two right-hand sides: what the
    // same data cost without QR.
    let normal = || {
        let (mut gram, mut right) = ([[0.0; 16]; 16], [[0.0; 2]; 16]);
        for (i, p) in data.iter().enumerate() {
            let row = springline::core::bezier_form::bernstein(
                15,
                i as f64 / count as f64,
                1.0 - i as f64 / count as f64,
            );
            for a in 0..16 {
                for b in 0..=a {
                    gram[a][b] += row[a] * row[b];
                }
                right[a] = [0, 1].map(|k| right[a][k] + row[a] * p[k]);
            }
        }
        black_box((gram, right));
    };
    group(
        &format!("least squares of {count} points, 16 control points, ns a point"),
        count,
        vec![
            ("measure: one pass of normal equations", Box::new(normal)),
            ("springline, by QR, error measured", Box::new(ours)),
        ],
    )[1]
}

/// Rows of a cubic spline, ten in each segment.
fn bands(count: usize) {
    let rows: Vec<[f64; 4]> = (0..count)
        .map(|i| (i % 10) as f64 / 10.0)
        .map(|u| (u, 1.0 - u))
        .map(|(u, v)| [v * v * v, 3.0 * u * v * v, 3.0 * u * u * v, u * u * u])
        .collect();
    let data = wave(count);
    let columns = count / 10 + 4;
    let normal = || {
        let (mut gram, mut right) = (vec![[0.0; 4]; columns], vec![[0.0; 2]; columns]);
        for (i, (row, p)) in black_box(&rows).iter().zip(&data).enumerate() {
            for a in 0..4 {
                for b in a..4 {
                    gram[i / 10 + a][b - a] += row[a] * row[b];
                }
                right[i / 10 + a] = [0, 1].map(|k| right[i / 10 + a][k] + row[a] * p[k]);
            }
        }
        black_box((gram, right));
    };
    let ours = || {
        let mut problem = LeastSquares::<2>::banded(columns, 4);
        black_box(&rows)
            .iter()
            .zip(&data)
            .enumerate()
            .for_each(|(i, (row, &p))| problem.push(i / 10, row, p, 1.0));
        black_box(problem);
    };
    group(
        &format!("least squares of {count} rows within a band of 4, ns a row"),
        count,
        vec![
            ("measure: one pass of normal equations", Box::new(normal)),
            ("springline, by reflections", Box::new(ours)),
        ],
    );
}

fn main() {
    for count in [100, 1_000, 10_000, 100_000] {
        cubics(count);
    }
    degrees();
    for count in [1_000, 100_000] {
        bsplines(count);
    }
    splits();
    let sizes = [1_000usize, 10_000, 100_000];
    let spline = sizes.map(|count| (count as f64, splines(count) * count as f64));
    println!("  growth with the points: exponent {:.2}", exponent(&spline));
    let fit = sizes.map(|count| (count as f64, fits(count) * count as f64));
    println!("  growth with the points: exponent {:.2}", exponent(&fit));
    for count in [1_000, 100_000] {
        bands(count);
    }
}
