//! Parameter correction, against a dense solver of its own, differences, and what is known of the
//! data.

use nalgebra::{DMatrix, DVector};
use springline::core::basis::{Basis, Bezier};
use springline::core::context::Context;
use springline::core::curve::Curve;
use springline::core::fit::{Ends, Family, Fit, Options, STATIONARY, Solve, fit};
use springline::core::parameterization::Parameterization;
use springline::core::point::Point;

type P = Point<2>;

/// Numbers in [-1, 1) that look random and are always the same.
fn number(i: usize) -> f64 {
    let mixed = (i as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let mixed = (mixed ^ (mixed >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    (mixed >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

/// A NACA four-digit airfoil with a closed trailing edge, from there over the upper side and back
/// (Jacobs, Ward and Pinkerton 1933): `naca(4, 4, 12, n)` is NACA 4412.
fn naca(camber: usize, place: usize, thickness: usize, count: usize) -> Vec<P> {
    let (m, p, t) = (camber as f64 / 100.0, place as f64 / 10.0, thickness as f64 / 100.0);
    let point = |k: usize| {
        let angle = 2.0 * std::f64::consts::PI * k as f64 / (count - 1) as f64;
        let x = 0.5 + 0.5 * angle.cos();
        let [a, b, c, d, e] = [0.2969, -0.1260, -0.3516, 0.2843, -0.1036];
        let half = 5.0 * t * (a * x.sqrt() + x * (b + x * (c + x * (d + x * e))));
        let (q, before) = if x < p { (p, true) } else { (1.0 - p, false) };
        let line = m / (q * q) * (if before { 0.0 } else { 1.0 - 2.0 * p } + 2.0 * p * x - x * x);
        let slope = (2.0 * m / (q * q) * (p - x)).atan();
        let side = if angle < std::f64::consts::PI { 1.0 } else { -1.0 };
        Point([x - side * half * slope.sin(), line + side * half * slope.cos()])
    };
    (0..count).map(point).collect()
}

/// Points of a Bezier curve at uneven parameters, moved by noise except at the ends.
fn hidden(order: usize, seed: usize, count: usize, noise: f64) -> (Vec<P>, Vec<f64>) {
    let polygon: Vec<_> = (0..=order).map(|i| Point([i as f64, 2.0 * number(seed + i)])).collect();
    let u: Vec<f64> = (0..count)
        .map(|i| i as f64 / (count - 1) as f64)
        .map(|u| u * u * (1.8 - 0.8 * u))
        .collect();
    let at = |t: f64| {
        bernstein(order, t).iter().zip(&polygon).fold(Point::ZERO, |sum, (&b, &p)| sum + p * b)
    };
    let moved = |i: usize| Point([number(seed + 31 * i), number(seed + 77 * i + 5)]) * noise;
    let off = |i: usize| if i == 0 || i == count - 1 { Point::ZERO } else { moved(i) };
    (u.iter().enumerate().map(|(i, &t)| at(t) + off(i)).collect(), u)
}

/// By the recursion, unlike the service.
fn bernstein(order: usize, t: f64) -> Vec<f64> {
    let mut values = vec![1.0];
    for _ in 0..order {
        let mut next = vec![0.0; values.len() + 1];
        for (i, b) in values.iter().enumerate() {
            next[i] += b * (1.0 - t);
            next[i + 1] += b * t;
        }
        values = next;
    }
    values
}

fn options(order: usize, ends: Ends, parameter_correction: bool) -> Options<2> {
    let solve = Solve::ControlPoints { basis: Basis::Bezier(Bezier), order };
    Options {
        weights: None,
        parameters: Parameterization::ChordLength,
        ends,
        parameter_correction,
        solve,
    }
}

fn polygon(fit: &Fit<2>) -> &[P] {
    let Curve::Single(single) = &fit.curve else { panic!() };
    single.control_points()
}

/// Bezier curve and parameters together, by dense steps of Levenberg and Marquardt in all unknowns
/// at once: no elimination, no solving in between, no second derivatives.
struct Dense<'a> {
    points: &'a [P],
    order: usize,
    ends: Ends,
}

impl Dense<'_> {
    fn inner(&self, count: usize) -> std::ops::Range<usize> {
        if self.ends == Ends::Interpolate { 1..count - 1 } else { 0..count }
    }

    fn residual(&self, t: &[f64], q: &[P]) -> DVector<f64> {
        let off = |i: usize| {
            let at = bernstein(self.order, t[i])
                .iter()
                .zip(q)
                .fold(Point::ZERO, |sum, (&b, &p)| sum + p * b);
            at - self.points[i]
        };
        DVector::from_iterator(2 * t.len(), (0..t.len()).flat_map(|i| off(i).0))
    }

    fn jacobian(&self, t: &[f64], q: &[P]) -> DMatrix<f64> {
        let (parameters, polygon) = (self.inner(t.len()), self.inner(q.len()));
        let mut jacobian = DMatrix::zeros(2 * t.len(), parameters.len() + 2 * polygon.len());
        for i in 0..t.len() {
            let lower = bernstein(self.order - 1, t[i]);
            let steps =
                q.windows(2).zip(&lower).map(|(q, &b)| (q[1] - q[0]) * (b * self.order as f64));
            let tangent = steps.fold(Point::ZERO, |sum, v| sum + v);
            let basis = bernstein(self.order, t[i]);
            for a in 0..2 {
                if parameters.contains(&i) {
                    jacobian[(2 * i + a, i - parameters.start)] = tangent[a];
                }
                for k in polygon.clone() {
                    jacobian[(2 * i + a, parameters.len() + 2 * (k - polygon.start) + a)] =
                        basis[k];
                }
            }
        }
        jacobian
    }

    /// The root of the mean square that it ends with.
    fn descend(&self, mut t: Vec<f64>, mut q: Vec<P>) -> f64 {
        let (mut damping, mut residual) = (1e-3, self.residual(&t, &q));
        for _ in 0..400 {
            let jacobian = self.jacobian(&t, &q);
            let (mut normal, right) = (jacobian.tr_mul(&jacobian), -jacobian.tr_mul(&residual));
            (0..normal.nrows()).for_each(|k| normal[(k, k)] += damping * normal[(k, k)] + 1e-14);
            let step = normal.cholesky().unwrap().solve(&right);
            let (mut next_t, mut next_q) = (t.clone(), q.clone());
            let (parameters, polygon) = (self.inner(t.len()), self.inner(q.len()));
            parameters
                .clone()
                .zip(step.iter())
                .for_each(|(i, s)| next_t[i] = (t[i] + s).clamp(0.0, 1.0));
            for (j, k) in polygon.enumerate() {
                next_q[k] +=
                    Point([step[parameters.len() + 2 * j], step[parameters.len() + 2 * j + 1]]);
            }
            let next = self.residual(&next_t, &next_q);
            if next.norm() < residual.norm() {
                (t, q, residual, damping) = (next_t, next_q, next, damping / 3.0);
            } else {
                damping *= 4.0;
            }
        }
        residual.norm() / (t.len() as f64).sqrt()
    }
}

fn data() -> Vec<(String, Vec<P>)> {
    let mut sets = Vec::new();
    for (m, p, t) in [(0, 4, 12), (2, 4, 12), (4, 4, 15), (6, 3, 9), (2, 6, 18)] {
        sets.push((format!("NACA {m}{p}{t:02}"), naca(m, p, t, 41)));
    }
    for (order, seed) in [(3, 1), (4, 60), (5, 200), (6, 330)] {
        sets.push((format!("noisy Bezier of order {order}"), hidden(order, seed, 40, 0.02).0));
    }
    let spiral = |i: usize| i as f64 / 39.0 * 6.0;
    sets.push((
        "spiral".into(),
        (0..40).map(spiral).map(|a| Point([a * a.cos(), a * a.sin()])).collect(),
    ));
    let bell = |i: usize| i as f64 / 20.0 - 1.0;
    sets.push((
        "bell".into(),
        (0..41).map(bell).map(|x| Point([x, 1.0 / (1.0 + 25.0 * x * x)])).collect(),
    ));
    sets
}

#[test]
fn no_dense_solver_finds_better() {
    for (name, points) in data() {
        for order in 3..=7 {
            for ends in [Ends::Interpolate, Ends::Free] {
                let [plain, best] = [false, true].map(|on| {
                    fit(&Context::default(), points.clone(), options(order, ends, on)).unwrap()
                });
                let dense = Dense { points: &points, order, ends };
                let from_start = dense.descend(plain.parameters.clone(), polygon(&plain).to_vec());
                let from_best = dense.descend(best.parameters.clone(), polygon(&best).to_vec());
                let what = format!(
                    "{name}, order {order}, {ends:?}: {:e}, {:?}",
                    best.error.rms, best.gradient
                );
                assert!(best.error.rms <= plain.error.rms, "{what}");
                assert!(
                    best.error.rms <= 1.01 * from_start,
                    "{what}, from the start {from_start:e}"
                );
                assert!(best.error.rms <= 1.01 * from_best, "{what}, from there {from_best:e}");
            }
        }
    }
}

/// The nearest place on the curve: of many, then walked downhill from there.
fn nearest_foot(at: impl Fn(f64) -> P, p: P) -> f64 {
    let places = (0..=400).map(|k| f64::from(k) / 400.0);
    let mut t = places.min_by(|&a, &b| at(a).distance(p).total_cmp(&at(b).distance(p))).unwrap();
    for h in [1e-3, 1e-4, 1e-5, 1e-6] {
        for step in [h, -h] {
            while at((t + step).clamp(0.0, 1.0)).distance(p) < at(t).distance(p) {
                t = (t + step).clamp(0.0, 1.0);
            }
        }
    }
    t
}

/// Nearest feet and solves in turn, from the plain fit and from what correction found.
#[test]
fn nearest_feet_and_solves_in_turn_find_no_better() {
    for (name, points) in data() {
        for order in [3, 5] {
            let run = |on| {
                fit(&Context::default(), points.clone(), options(order, Ends::Interpolate, on))
                    .unwrap()
            };
            let best = run(true);
            for mut turn in [run(false), best.clone()] {
                for _ in 0..60 {
                    let q = polygon(&turn).to_vec();
                    let at = |t: f64| {
                        bernstein(order, t)
                            .iter()
                            .zip(&q)
                            .fold(Point::ZERO, |sum, (&b, &p)| sum + p * b)
                    };
                    let mut t: Vec<f64> = points.iter().map(|&p| nearest_foot(at, p)).collect();
                    (t[0], t[points.len() - 1]) = (0.0, 1.0);
                    let given = Options {
                        parameters: Parameterization::Given(t),
                        ..options(order, Ends::Interpolate, false)
                    };
                    let Ok(next) = fit(&Context::default(), points.clone(), given) else { break };
                    turn = next;
                    assert!(
                        best.error.rms <= turn.error.rms * 1.001,
                        "{name}, order {order}: {:?} {:?}",
                        best.error,
                        turn.error
                    );
                }
            }
        }
    }
}

/// The weighted sum of squares of the best curve for given parameters.
fn squares(points: &[P], weights: &[f64], parameters: &[f64], order: usize, ends: Ends) -> f64 {
    let given = Options {
        weights: Some(weights.to_vec()),
        parameters: Parameterization::Given(parameters.to_vec()),
        ..options(order, ends, false)
    };
    let fit = fit(&Context::default(), points.to_vec(), given).unwrap();
    let q = polygon(&fit);
    let off = |(&t, &p): (&f64, &P)| {
        let at = bernstein(order, t).iter().zip(q).fold(Point::ZERO, |sum, (&b, &q)| sum + q * b);
        (at - p).dot(at - p)
    };
    parameters.iter().zip(points).map(off).zip(weights).map(|(square, w)| w * square).sum()
}

#[test]
fn a_converged_fit_is_stationary_by_differences() {
    let mut converged = 0;
    for (name, points) in data() {
        for ends in [Ends::Interpolate, Ends::Free] {
            let weights: Vec<f64> = (0..points.len()).map(|i| 1.5 + number(i)).collect();
            let weighted = Options { weights: Some(weights.clone()), ..options(4, ends, true) };
            let best = fit(&Context::default(), points.clone(), weighted).unwrap();
            assert_eq!(best.converged, best.gradient <= best.gradient_tolerance, "{name}");
            assert!(best.parameters.iter().all(|t| (0.0..=1.0).contains(t)), "{name}");
            assert_eq!(best.ordered, best.parameters.is_sorted(), "{name}");
            if !best.converged {
                continue;
            }
            converged += 1;
            let whole = squares(&points, &weights, &best.parameters, 4, ends);
            let last = points.len() - 1;
            for i in 0..=last {
                let moved = |h: f64| {
                    let mut t = best.parameters.clone();
                    t[i] += h;
                    squares(&points, &weights, &t, 4, ends)
                };
                let (t, h) = (best.parameters[i], 1e-5);
                // Differences of size h see the gradient up to the rounding and the third
                // derivative of the sum.
                let tiny = 1e-4 * whole;
                match (ends, i) {
                    (Ends::Interpolate, 0) => {}
                    (Ends::Interpolate, i) if i == last => {}
                    _ if t < h => assert!(moved(h) >= whole * (1.0 - 1e-6), "{name} {i}"),
                    _ if t > 1.0 - h => assert!(moved(-h) >= whole * (1.0 - 1e-6), "{name} {i}"),
                    _ => {
                        let slope = (moved(h) - moved(-h)) / (2.0 * h);
                        let speed = (moved(h) + moved(-h) - 2.0 * whole).abs() / (h * h);
                        let cosine = slope / (speed * whole).sqrt();
                        assert!(
                            cosine.abs() < 1e-4 || slope.abs() < tiny,
                            "{name} {ends:?} {i}: {slope:e} {cosine:e}"
                        );
                    }
                }
            }
        }
    }
    assert!(converged >= 16, "only {converged} of 22 converged");
}

/// How far parameters can be off, to first order, for offsets of this length: that over the least
/// singular value of what parameters and control points together do to the offsets, at the hidden
/// curve.
fn told_apart(points: &[P], u: &[f64], order: usize, length: f64) -> f64 {
    let given = Options {
        parameters: Parameterization::Given(u.to_vec()),
        ..options(order, Ends::Interpolate, false)
    };
    let known = fit(&Context::default(), points.to_vec(), given).unwrap();
    let dense = Dense { points, order, ends: Ends::Interpolate };
    length / dense.jacobian(u, polygon(&known)).singular_values().min()
}

#[test]
fn a_curve_sampled_at_unknown_parameters_comes_back() {
    for order in 2..=6 {
        for ends in [Ends::Interpolate, Ends::Free] {
            let (points, u) = hidden(order, 40 * order, 50, 0.0);
            let best =
                fit(&Context::default(), points.clone(), options(order, ends, true)).unwrap();
            assert!(best.error.max < 1e-8 && best.ordered, "{order} {ends:?}: {:?}", best.error);
            assert!(
                order == 6 || (best.converged && best.error.max < 1e-13),
                "{order} {ends:?}: {:?}",
                best.error
            );
            // With free ends the curve may be a longer or shorter piece of the same polynomial.
            if ends == Ends::Interpolate {
                let off =
                    best.parameters.iter().zip(&u).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
                // At order 6 a hundredth in a parameter may move the offsets by some 1e-9 only.
                let most = if order < 6 {
                    1e-10
                } else {
                    told_apart(&points, &u, order, best.error.rms * 50f64.sqrt())
                };
                assert!(off <= most, "{order}: parameters off by {off:e}, not {most:e}");
            }
        }
    }
}

#[test]
fn noise_is_fitted_no_worse_than_by_the_hidden_curve() {
    for order in 3..=6 {
        let (points, u) = hidden(order, 9 * order, 60, 0.01);
        let known = Options {
            parameters: Parameterization::Given(u),
            ..options(order, Ends::Interpolate, false)
        };
        let known = fit(&Context::default(), points.clone(), known).unwrap();
        let best =
            fit(&Context::default(), points, options(order, Ends::Interpolate, true)).unwrap();
        assert!(best.error.rms < known.error.rms, "{order}: {:?} {:?}", best.error, known.error);
    }
}

/// This airfoil stopped at 100 rounds with several times the distance it can have.
#[test]
fn an_airfoil_ends_at_its_minimum() {
    let best =
        fit(&Context::default(), naca(4, 4, 12, 81), options(5, Ends::Interpolate, true)).unwrap();
    assert!(best.converged && best.ordered, "{:?}", best.gradient);
    assert!(best.gradient_tolerance == Some(STATIONARY));
    assert!(best.error.rms < 4e-4, "{:?}", best.error);
}

#[test]
fn the_unit_and_the_place_of_the_data_do_not_matter() {
    let points = naca(2, 4, 12, 41);
    let reference =
        fit(&Context::default(), points.clone(), options(4, Ends::Interpolate, true)).unwrap();
    for (scale, shift) in [(2f64.powi(400), 0.0), (2f64.powi(-400), 0.0), (1.0, 1024.0)] {
        let moved = points.iter().map(|&p| p * scale + Point([shift, -shift])).collect();
        let best = fit(&Context::default(), moved, options(4, Ends::Interpolate, true)).unwrap();
        assert!(
            (best.error.rms / scale / reference.error.rms - 1.0).abs() < 1e-6,
            "{scale:e} {shift}: {:?}",
            best.error
        );
        assert!(best.converged, "{scale:e} {shift}: {:?}", best.gradient);
    }
}

#[test]
fn many_points_take_the_start_that_few_of_them_show() {
    let few =
        fit(&Context::default(), naca(4, 4, 12, 81), options(5, Ends::Interpolate, true)).unwrap();
    let many = fit(&Context::default(), naca(4, 4, 12, 4_001), options(5, Ends::Interpolate, true))
        .unwrap();
    assert!(many.converged && many.ordered);
    assert!((many.error.rms / few.error.rms - 1.0).abs() < 0.1, "{:?} {:?}", many.error, few.error);
}

#[test]
fn shapes_are_found_with_their_parameters() {
    let control_points =
        vec![Point([0.0, 0.0]), Point([1.0, 3.0]), Point([4.0, 3.0]), Point([5.0, 0.0])];
    let pulled = [control_points[0], Point([0.6, 1.8]), Point([4.4, 1.8]), control_points[3]];
    let u = |i: usize| (i as f64 / 29.0).powi(2);
    let at =
        |t: f64| bernstein(3, t).iter().zip(&pulled).fold(Point::ZERO, |sum, (&b, &p)| sum + p * b);
    let noise =
        |i: usize| if i == 0 || i == 29 { Point::ZERO } else { Point([number(i), number(i + 40)]) };
    for size in [0.03, 0.003] {
        let points: Vec<_> = (0..30).map(|i| at(u(i)) + noise(i) * size).collect();
        let spread = size * ((0..30).map(|i| noise(i).dot(noise(i))).sum::<f64>() / 30.0).sqrt();
        for ends in [Ends::Free, Ends::Interpolate] {
            // No curve of its degree is nearer.
            let nearest =
                fit(&Context::default(), points.clone(), options(5, ends, true)).unwrap().error.rms;
            for family in [Family::Beta, Family::AlphaBeta, Family::Quasi { degree: 5 }] {
                let run = |parameter_correction| {
                    let solve = Solve::Shape { family, control_points: control_points.clone() };
                    let options = Options { ends, solve, ..options(3, ends, parameter_correction) };
                    fit(&Context::default(), points.clone(), options).unwrap()
                };
                let (plain, best) = (run(false), run(true));
                let (before, after) = (plain.error.rms, best.error.rms);
                let what = format!(
                    "{family:?} {ends:?} {size}: {before:e} {after:e}, at least {nearest:e}, noise {spread:e}"
                );
                // With little noise a shape matrix may still creep along a valley after the last
                // round.
                assert!(
                    best.converged || (size < 0.01 && matches!(family, Family::Quasi { .. })),
                    "{what}: {:?}",
                    best.gradient
                );
                assert!(after >= 0.99 * nearest, "{what}");
                // The hidden curve is of these families, and the noise is its distance.
                assert!(family == Family::Beta || after < spread, "{what}");
                // With much noise a curve of degree 5 follows it without correction, and not even
                // the nearest gains a quarter: there half of what can be gained, elsewhere a fifth.
                let most =
                    if nearest > 0.75 * before { 0.5 * (before + nearest) } else { 0.8 * before };
                assert!(after <= most, "{what}");
            }
        }
    }
}

#[test]
fn an_order_that_is_broken_is_said() {
    let points = hidden(3, 1, 10, 0.0).0;
    let mut values: Vec<f64> = (0..10).map(|i| f64::from(i) / 9.0).collect();
    values.swap(4, 5);
    let given =
        Options { parameters: Parameterization::Given(values), ..options(3, Ends::Free, false) };
    assert!(!fit(&Context::default(), points.clone(), given).unwrap().ordered);
    let plain = fit(&Context::default(), points, options(3, Ends::Free, false)).unwrap();
    assert!(plain.ordered && plain.gradient.is_none() && plain.gradient_tolerance.is_none());
}
