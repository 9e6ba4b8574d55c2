//! Fits, against exact solutions and against what is known of their results.

use serde_json::Value;
use springline::core::basis::{
    AlphaBeta, Basis, Beta, Bezier, Quasi, ShapeMatrix, ShapeParameters,
};
use springline::core::context::Context;
use springline::core::curve::{Curve, Single};
use springline::core::error::Error;
use springline::core::fault::Fault;
use springline::core::fit::{Ends, Family, Fit, Options, Solve, fit};
use springline::core::parameterization::Parameterization;
use springline::core::point::Point;

type P = Point<2>;

fn options<const D: usize>(
    parameters: Parameterization,
    ends: Ends,
    solve: Solve<D>,
) -> Options<D> {
    Options { weights: None, parameters, ends, parameter_correction: false, solve }
}

/// Numbers in [-1, 1) that look random and are always the same.
fn number(i: usize) -> f64 {
    let mixed = (i as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
    let mixed = (mixed ^ (mixed >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    (mixed >> 11) as f64 / (1u64 << 52) as f64 - 1.0
}

fn steps(count: usize) -> Vec<f64> {
    (0..count).map(|i| i as f64 / (count - 1) as f64).collect()
}

fn sample<const D: usize>(curve: &Curve<D>, parameters: &[f64]) -> Vec<Point<D>> {
    let composite = curve.composite(&Context::default()).unwrap();
    let evaluator = composite.evaluator(&Context::default()).unwrap();
    parameters.iter().map(|&t| evaluator.at(t)).collect()
}

fn segment(basis: Basis, points: &[P]) -> Curve<2> {
    Curve::Single(Single::new(&Context::default(), basis, points.to_vec()).unwrap())
}

fn single<const D: usize>(fit: &Fit<D>) -> &Single<D> {
    match &fit.curve {
        Curve::Single(single) => single,
        other => panic!("not a single segment: {other:?}"),
    }
}

fn distance<const D: usize>(a: &[Point<D>], b: &[Point<D>]) -> f64 {
    assert_eq!(a.len(), b.len());
    a.iter().zip(b).map(|(a, &b)| a.distance(b)).fold(0.0, f64::max)
}

fn noisy_arc(count: usize) -> Vec<P> {
    let on_arc = |i: usize| {
        Point([(3.0 * i as f64 / count as f64).cos(), 2.0 * (3.0 * i as f64 / count as f64).sin()])
    };
    (0..count).map(|i| on_arc(i) + Point([number(i), number(i + 1000)]) * 0.02).collect()
}

fn rank_deficient<const D: usize>(result: Result<Fit<D>, Error>, place: &str, word: &str) {
    let error = result.unwrap_err();
    assert_eq!(error.place.to_string(), place, "{error}");
    assert!(matches!(&error.fault, Fault::RankDeficient(text) if text.contains(word)), "{error}");
}

fn cubic_points() -> Vec<P> {
    vec![Point([0.0, 0.0]), Point([1.0, 3.0]), Point([4.0, 3.5]), Point([5.0, -1.0])]
}

fn beta(b: f64) -> Basis {
    Basis::Beta(Beta::from_beta(b).unwrap())
}

fn matrix_basis(rows: &[&[f64]]) -> Basis {
    Basis::Quasi(
        Quasi::new(
            &Context::default(),
            ShapeParameters::Matrix { rows: rows.iter().map(|r| r.to_vec()).collect() },
        )
        .unwrap(),
    )
}

mod vectors {
    use super::*;

    fn numbers(value: &Value) -> Vec<f64> {
        value.as_array().unwrap().iter().map(|x| x.as_f64().unwrap()).collect()
    }

    fn points<const D: usize>(value: &Value) -> Vec<Point<D>> {
        value
            .as_array()
            .unwrap()
            .iter()
            .map(numbers)
            .map(|p| Point(p.try_into().unwrap()))
            .collect()
    }

    fn basis(value: &Value) -> Basis {
        let field = |name: &str| value[name].as_f64().unwrap();
        match value["family"].as_str().unwrap() {
            "beta-bezier" => beta(field("beta")),
            "alpha-beta-bezier" => {
                Basis::AlphaBeta(AlphaBeta::new(field("alpha"), field("beta")).unwrap())
            }
            "quasi-bezier" => {
                let shape = &value["shape"];
                let upper_rows =
                    shape["upper_rows"].as_array().unwrap().iter().map(numbers).collect();
                let degree = shape["degree"].as_u64().unwrap() as usize;
                Basis::Quasi(
                    Quasi::new(
                        &Context::default(),
                        ShapeParameters::Symmetric { degree, upper_rows },
                    )
                    .unwrap(),
                )
            }
            other => panic!("{other}"),
        }
    }

    /// The largest deviation, relative to the largest coordinate of the control polygon.
    fn deviation<const D: usize>(case: &Value) -> f64 {
        let ends = if case["ends"] == "free" { Ends::Free } else { Ends::Interpolate };
        let solve = Solve::ControlPoints {
            basis: basis(&case["basis"]),
            order: case["order"].as_u64().unwrap() as usize,
        };
        let parameters = Parameterization::Given(numbers(&case["parameters"]));
        let fit = fit(
            &Context::default(),
            points::<D>(&case["points"]),
            options(parameters, ends, solve),
        )
        .unwrap();
        let expected = points::<D>(&case["control_points"]);
        let off = [
            distance(single(&fit).control_points(), &expected),
            (fit.error.max - case["max_error"].as_f64().unwrap()).abs(),
            (fit.error.rms - case["rms_error"].as_f64().unwrap()).abs(),
        ];
        off.into_iter().fold(0.0, f64::max) / springline::core::point::magnitude(&expected)
    }

    #[test]
    fn control_points_and_errors_agree_with_exact_ones() {
        let cases: Value = serde_json::from_str(include_str!("../vectors/fit.json")).unwrap();
        let spatial = |case: &Value| case["points"][0].as_array().unwrap().len() == 3;
        let deviations =
            cases.as_array().unwrap().iter().map(|case| {
                if spatial(case) { deviation::<3>(case) } else { deviation::<2>(case) }
            });
        let worst = deviations.fold(0.0, f64::max);
        println!("worst relative deviation {worst:e}");
        assert!(worst <= 1e-11, "{worst:e}");
    }
}

mod control_points {
    use super::*;

    #[test]
    fn exact_data_give_the_polygon_back() {
        let bases =
            [Basis::Bezier(Bezier), beta(0.7), Basis::AlphaBeta(AlphaBeta::new(0.1, 2.0).unwrap())];
        for basis in bases {
            let curve = segment(basis.clone(), &cubic_points());
            let parameters: Vec<f64> = steps(30).iter().map(|u| u * basis.length()).collect();
            for ends in [Ends::Free, Ends::Interpolate] {
                let solve = Solve::ControlPoints { basis: basis.clone(), order: 3 };
                let fit = fit(
                    &Context::default(),
                    sample(&curve, &parameters),
                    options(Parameterization::Given(parameters.clone()), ends, solve),
                )
                .unwrap();
                assert!(
                    distance(single(&fit).control_points(), &cubic_points()) < 1e-12,
                    "{}",
                    basis.name()
                );
                assert!(fit.error.max < 1e-14 && fit.converged && fit.iterations == 1);
            }
        }
    }

    /// The normal equations, which the solver never forms, hold at its solution.
    #[test]
    fn residuals_are_orthogonal_to_the_basis() {
        let points = noisy_arc(50);
        let weights: Vec<f64> = (0..50).map(|i| 1.5 + number(i)).collect();
        let basis = beta(1.3);
        let solve = Solve::ControlPoints { basis: basis.clone(), order: 4 };
        let options = Options {
            weights: Some(weights.clone()),
            ..options(Parameterization::ChordLength, Ends::Free, solve)
        };
        let fit = fit(&Context::default(), points.clone(), options).unwrap();
        let residuals: Vec<_> = sample(&fit.curve, &fit.parameters)
            .into_iter()
            .zip(&points)
            .map(|(c, &p)| c - p)
            .collect();
        for j in 0..=4 {
            let unit: Vec<_> = (0..=4).map(|i| Point([f64::from(i == j)])).collect();
            let column = sample(
                &Curve::Single(Single::new(&Context::default(), basis.clone(), unit).unwrap()),
                &fit.parameters,
            );
            let gradient = (0..50)
                .fold(Point::ZERO, |sum, i| sum + residuals[i] * (weights[i] * column[i][0]));
            assert!(gradient.norm() < 1e-13, "column {j}: {gradient:?}");
        }
    }

    #[test]
    fn a_weight_counts_like_repeated_points() {
        let points = noisy_arc(20);
        let weights: Vec<f64> = (0..20).map(|i| (1 + i % 3) as f64).collect();
        let repeat = |i: usize| std::iter::repeat_n(i, 1 + i % 3);
        let solve = || Solve::ControlPoints { basis: Basis::Bezier(Bezier), order: 3 };
        let values = steps(20);
        let weighted = Options {
            weights: Some(weights),
            ..options(Parameterization::Given(values.clone()), Ends::Interpolate, solve())
        };
        let repeated = options(
            Parameterization::Given((0..20).flat_map(repeat).map(|i| values[i]).collect()),
            Ends::Interpolate,
            solve(),
        );
        let a = fit(&Context::default(), points.clone(), weighted).unwrap();
        let b = fit(
            &Context::default(),
            (0..20).flat_map(repeat).map(|i| points[i]).collect(),
            repeated,
        )
        .unwrap();
        assert!(distance(single(&a).control_points(), single(&b).control_points()) < 1e-13);
        let even = fit(
            &Context::default(),
            points,
            options(Parameterization::Given(values), Ends::Interpolate, solve()),
        )
        .unwrap();
        assert!(
            distance(single(&a).control_points(), single(&even).control_points()) > 1e-4,
            "weights have an effect"
        );
    }

    #[test]
    fn reversed_points_give_the_reversed_curve() {
        let points = noisy_arc(40);
        let reversed: Vec<_> = points.iter().rev().copied().collect();
        for ends in [Ends::Free, Ends::Interpolate] {
            let run = |points: Vec<P>| {
                let solve = Solve::ControlPoints { basis: beta(0.5), order: 4 };
                fit(
                    &Context::default(),
                    points,
                    options(Parameterization::Centripetal, ends, solve),
                )
                .unwrap()
            };
            let back: Vec<_> =
                single(&run(reversed.clone())).control_points().iter().rev().copied().collect();
            assert!(distance(single(&run(points.clone())).control_points(), &back) < 1e-12);
        }
    }

    #[test]
    fn deficiency_is_named() {
        let points = noisy_arc(6);
        let run = |basis, order, values: [f64; 6]| {
            fit(
                &Context::default(),
                points.clone(),
                options(
                    Parameterization::Given(values.to_vec()),
                    Ends::Free,
                    Solve::ControlPoints { basis, order },
                ),
            )
        };
        let bezier = Basis::Bezier(Bezier);
        rank_deficient(
            run(bezier.clone(), 3, [0.0, 0.0, 0.5, 0.5, 1.0, 1.0]),
            "/solve/order",
            "3 distinct parameters that bear on 4",
        );
        rank_deficient(
            run(bezier, 6, [0.0, 0.2, 0.4, 0.6, 0.8, 1.0]),
            "/solve/order",
            "6 distinct",
        );
        let straight = Basis::Beta(Beta::from_lambda(0.0).unwrap());
        rank_deficient(
            run(straight, 3, [0.0, 0.2, 0.4, 0.6, 0.8, 1.0]),
            "/solve/basis",
            "straight limit",
        );
    }

    #[test]
    fn faults_have_places() {
        let place = |points: usize, options: Options<2>| {
            fit(&Context::default(), noisy_arc(points), options).unwrap_err().place.to_string()
        };
        let solve = |order| Solve::ControlPoints { basis: Basis::Bezier(Bezier), order };
        let plain = |solve| options(Parameterization::ChordLength, Ends::Interpolate, solve);
        let weighted =
            |weights: &[f64]| Options { weights: Some(weights.to_vec()), ..plain(solve(1)) };
        assert_eq!(place(1, plain(solve(1))), "/points");
        assert_eq!(place(3, weighted(&[1.0, 0.0, 1.0])), "/weights/1");
        assert_eq!(place(3, weighted(&[1.0, 1.0])), "/weights");
        assert_eq!(place(5, plain(solve(65))), "/solve/order");
        assert_eq!(place(5, plain(solve(0))), "/solve/order");
        let rows: &[&[f64]] = &[&[0.9, 0.1], &[0.5, 0.5], &[0.0, 1.0]];
        assert_eq!(
            place(5, plain(Solve::ControlPoints { basis: matrix_basis(rows), order: 1 })),
            "/solve/basis"
        );
        let tolerance = Solve::Tolerance { basis: Basis::Bezier(Bezier), tolerance: 0.1 };
        assert_eq!(
            place(9, Options { parameter_correction: true, ..plain(tolerance) }),
            "/parameter correction"
        );
        let mut bad = noisy_arc(5);
        bad[3] = Point([f64::NAN, 0.0]);
        assert_eq!(
            fit(&Context::default(), bad, plain(solve(2))).unwrap_err().place.to_string(),
            "/points/3"
        );
    }

    #[test]
    fn one_edge_between_fixed_ends_needs_no_solving() {
        let points = noisy_arc(4);
        let solve = Solve::ControlPoints { basis: Basis::Bezier(Bezier), order: 1 };
        let fit = fit(
            &Context::default(),
            points.clone(),
            options(Parameterization::Uniform, Ends::Interpolate, solve),
        )
        .unwrap();
        assert_eq!(single(&fit).control_points(), [points[0], points[3]]);
    }
}

mod correction {
    use super::*;

    #[test]
    fn the_rms_never_rises_and_falls_where_it_can() {
        let solves: [fn() -> Solve<2>; 4] = [
            || Solve::ControlPoints { basis: Basis::Bezier(Bezier), order: 3 },
            || Solve::ControlPoints {
                basis: Basis::AlphaBeta(AlphaBeta::new(0.5, 1.0).unwrap()),
                order: 3,
            },
            || Solve::Shape { family: Family::Beta, control_points: cubic_points() },
            || Solve::Both { family: Family::Quasi { degree: 4 }, order: 3 },
        ];
        let curve = segment(beta(0.4), &cubic_points());
        for (k, solve) in solves.iter().enumerate() {
            for ends in [Ends::Free, Ends::Interpolate] {
                let uneven: Vec<f64> = steps(25).iter().map(|u| u * u).collect();
                let mut points = sample(&curve, &uneven);
                (1..24).for_each(|i| points[i] += Point([number(i), number(i + 99)]) * 0.01);
                let run = |parameter_correction| {
                    let options = Options {
                        parameter_correction,
                        ..options(Parameterization::Uniform, ends, solve())
                    };
                    fit(&Context::default(), points.clone(), options).unwrap()
                };
                let (plain, corrected) = (run(false), run(true));
                assert!(
                    corrected.error.rms < 0.8 * plain.error.rms,
                    "{k} {ends:?}: {:?} {:?}",
                    plain.error,
                    corrected.error
                );
                assert!(corrected.iterations > 1);
                if ends == Ends::Interpolate {
                    let on = sample(&corrected.curve, &corrected.parameters);
                    assert_eq!((on[0], on[24]), (points[0], points[24]));
                }
            }
        }
    }
}

mod shape {
    use super::*;

    fn run(family: Family, polygon: &[P], points: Vec<P>, ends: Ends) -> Result<Fit<2>, Error> {
        let values = steps(points.len());
        fit(
            &Context::default(),
            points,
            options(
                Parameterization::Given(values),
                ends,
                Solve::Shape { family, control_points: polygon.to_vec() },
            ),
        )
    }

    #[test]
    fn beta_is_recovered() {
        let polygon: Vec<_> = (0..7).map(|i| Point([i as f64, 3.0 * number(i)])).collect();
        for order in [2, 3, 6] {
            for b in [0.0, 1e-3, 0.3, 1.0, 4.2, 250.0] {
                let points = sample(&segment(beta(b), &polygon[..=order]), &steps(40));
                let fit = run(Family::Beta, &polygon[..=order], points, Ends::Interpolate).unwrap();
                let Basis::Beta(found) = single(&fit).basis() else { panic!() };
                assert!(
                    (found.beta() - b).abs() <= 1e-10 * (1.0 + b) * (1.0 + b),
                    "order {order}, {b}: {found:?}"
                );
                assert!(fit.error.max < 1e-12);
            }
        }
        let chord =
            sample(&segment(Basis::Beta(Beta::from_lambda(0.0).unwrap()), &polygon), &steps(20));
        let fit = run(Family::Beta, &polygon, chord, Ends::Free).unwrap();
        assert!(matches!(single(&fit).basis(), Basis::Beta(b) if b.lambda() == Some(0.0)));
        assert!(fit.at_bound);
    }

    #[test]
    fn the_best_beta_is_no_worse_than_any_other() {
        let mut points = sample(&segment(beta(0.8), &cubic_points()), &steps(30));
        points.iter_mut().enumerate().for_each(|(i, p)| *p += Point([number(i), number(i + 77)]));
        let best = run(Family::Beta, &cubic_points(), points.clone(), Ends::Free).unwrap();
        for k in 0..1000 {
            let other =
                sample(&segment(beta(k as f64 / (1000 - k) as f64), &cubic_points()), &steps(30));
            let squares: f64 = other.iter().zip(&points).map(|(c, &p)| c.distance(p).powi(2)).sum();
            assert!(best.error.rms <= (squares / 30.0).sqrt() * (1.0 + 1e-12), "k {k}");
        }
    }

    #[test]
    fn s_is_recovered_and_held_to_its_range() {
        for s in [0.01, 1.0, 2.0, 2.9] {
            let points = sample(
                &segment(Basis::AlphaBeta(AlphaBeta::new(1.0, s).unwrap()), &cubic_points()),
                &steps(40),
            );
            let fit = run(Family::AlphaBeta, &cubic_points(), points, Ends::Interpolate).unwrap();
            let Basis::AlphaBeta(found) = single(&fit).basis() else { panic!() };
            assert!(
                (found.beta() - s).abs() < 1e-13 && found.alpha() == 1.0 && !fit.at_bound,
                "{s}: {found:?}"
            );
        }
        let beyond: Vec<_> = cubic_points().iter().map(|&p| p * 2.0).collect();
        let bent = sample(
            &segment(
                Basis::Bezier(Bezier),
                &[cubic_points()[0], beyond[1], beyond[2], cubic_points()[3]],
            ),
            &steps(40),
        );
        let fit = run(Family::AlphaBeta, &cubic_points(), bent, Ends::Free).unwrap();
        assert!(fit.at_bound);
        assert!(matches!(single(&fit).basis(), Basis::AlphaBeta(b) if b.beta() == 3.0));
    }

    #[test]
    fn shapes_without_influence_are_deficient() {
        let p = cubic_points();
        let doubled = [p[0], p[0], p[3], p[3]];
        rank_deficient(
            run(Family::AlphaBeta, &doubled, noisy_arc(9), Ends::Free),
            "/solve/control points",
            "no influence",
        );
        rank_deficient(
            run(Family::Beta, &[p[0], p[3]], noisy_arc(9), Ends::Free),
            "/solve/control points",
            "no influence",
        );
        let thirds: Vec<_> = (0..4).map(|i| p[0].lerp(p[3], i as f64 / 3.0)).collect();
        rank_deficient(
            run(Family::Beta, &thirds, noisy_arc(9), Ends::Free),
            "/solve/control points",
            "no influence",
        );
        rank_deficient(
            run(Family::Quasi { degree: 5 }, &p, noisy_arc(4), Ends::Free),
            "/solve/degree",
            "4 distinct",
        );
        rank_deficient(
            run(Family::Quasi { degree: 3 }, &[p[0]; 4], noisy_arc(9), Ends::Free),
            "/solve/control points",
            "no influence",
        );
    }

    #[test]
    fn shape_faults_have_places() {
        let place = |family, polygon: &[P], ends| {
            run(family, polygon, noisy_arc(20), ends).unwrap_err().place.to_string()
        };
        let p = cubic_points();
        assert_eq!(place(Family::Bezier, &p, Ends::Free), "/solve/family");
        assert_eq!(place(Family::AlphaBeta, &p[..3], Ends::Free), "/solve/control points");
        assert_eq!(place(Family::Quasi { degree: 2 }, &p, Ends::Free), "/solve/degree");
        assert_eq!(place(Family::Quasi { degree: 65 }, &p, Ends::Free), "/solve/degree");
        assert_eq!(place(Family::Beta, &p, Ends::Interpolate), "/ends");
    }

    fn quintic() -> Basis {
        let rows: &[&[f64]] = &[
            &[1.0, 0.0, 0.0, 0.0],
            &[0.4, 0.6, 0.0, 0.0],
            &[0.1, 0.5, 0.3, 0.1],
            &[0.2, 0.2, 0.5, 0.1],
            &[0.0, 0.0, 0.7, 0.3],
            &[0.0, 0.0, 0.0, 1.0],
        ];
        matrix_basis(rows)
    }

    /// In the plane many matrices give one curve; the curve comes back, from its rows on the hull
    /// too.
    #[test]
    fn the_curve_of_a_matrix_is_recovered() {
        let points = sample(&segment(quintic(), &cubic_points()), &steps(40));
        for ends in [Ends::Free, Ends::Interpolate] {
            let fit =
                run(Family::Quasi { degree: 5 }, &cubic_points(), points.clone(), ends).unwrap();
            println!("{ends:?} {:e}", fit.error.max);
            assert!(fit.error.max < 1e-10, "{:?}", fit.error);
        }
    }

    /// Four points in space that are no plane leave one matrix only.
    #[test]
    fn in_space_the_matrix_itself_is_recovered() {
        let polygon = [
            Point([0.0, 0.0, 0.0]),
            Point([1.0, 3.0, 1.0]),
            Point([4.0, 3.0, -1.0]),
            Point([5.0, -1.0, 2.0]),
        ];
        let curve =
            Curve::Single(Single::new(&Context::default(), quintic(), polygon.to_vec()).unwrap());
        let solve =
            Solve::Shape { family: Family::Quasi { degree: 5 }, control_points: polygon.to_vec() };
        let fit = fit(
            &Context::default(),
            sample(&curve, &steps(40)),
            options(Parameterization::Uniform, Ends::Interpolate, solve),
        )
        .unwrap();
        let (found, sought) = (single(&fit).basis().shape_matrix(3), quintic().shape_matrix(3));
        assert!((found.dense() - sought.dense()).amax() < 1e-10, "{found:?}");
    }

    /// Where elevation gives the data, elevation is the matrix of choice among the many.
    #[test]
    fn ties_break_towards_degree_elevation() {
        let polygon: Vec<_> = (0..6).map(|i| Point([i as f64, number(i)])).collect();
        let points = sample(&segment(Basis::Bezier(Bezier), &polygon), &steps(40));
        let fit = run(Family::Quasi { degree: 7 }, &polygon, points, Ends::Free).unwrap();
        let off =
            single(&fit).basis().shape_matrix(5).dense() - ShapeMatrix::elevation(7, 5).dense();
        assert!(off.amax() < 1e-10, "{off}");
    }

    /// On a line with vertices 0 and 1 the data ask for `Q_1 = 3/2`; the best allowed is 1, and the
    /// best `Q_2` beside it is a quotient of sums. All digits, where an interior-point method gives
    /// half.
    #[test]
    fn a_binding_hull_is_met_to_all_digits() {
        let bernstein = |u: f64| (3.0 * u * (1.0 - u) * (1.0 - u), 3.0 * u * u * (1.0 - u));
        let points = steps(30)
            .iter()
            .map(|&u| Point([1.5 * bernstein(u).0 + 0.5 * bernstein(u).1 + u * u * u]))
            .collect();
        let products = steps(30)
            .iter()
            .map(|&u| bernstein(u))
            .fold((0.0, 0.0), |(ab, bb), (a, b)| (ab + a * b, bb + b * b));
        let solve = Solve::Shape {
            family: Family::Quasi { degree: 3 },
            control_points: vec![Point([0.0]), Point([1.0])],
        };
        let fit = fit(
            &Context::default(),
            points,
            options(Parameterization::Given(steps(30)), Ends::Interpolate, solve),
        )
        .unwrap();
        let matrix = single(&fit).basis().shape_matrix(1);
        assert!((matrix.row(1)[1] - 1.0).abs() < 1e-13, "{matrix:?}");
        assert!(
            (matrix.row(2)[1] - (0.5 + 0.5 * products.0 / products.1)).abs() < 1e-13,
            "{matrix:?}"
        );
    }

    /// Data that pull the curve out of the hull: no feasible change of one weight improves the fit.
    #[test]
    fn the_constrained_matrix_is_optimal() {
        let mut fitted = 0;
        for seed in 0..12 {
            let polygon: Vec<_> = (0..5)
                .map(|i| Point([number(seed * 11 + i), number(seed * 13 + i + 500)]))
                .collect();
            let points: Vec<_> = (0..50)
                .map(|i| Point([1.5 * number(i / 5 + seed), 1.5 * number(i / 7 + seed + 300)]))
                .collect();
            let Ok(best) = run(Family::Quasi { degree: 6 }, &polygon, points.clone(), Ends::Free)
            else {
                continue;
            };
            fitted += 1;
            let matrix = single(&best).basis().shape_matrix(4);
            let rms = |m: ShapeMatrix| {
                let curve = Curve::Single(
                    Single::new(&Context::default(), Basis::Bezier(Bezier), m.apply(&polygon))
                        .unwrap(),
                );
                let squares: f64 = sample(&curve, &steps(50))
                    .iter()
                    .zip(&points)
                    .map(|(c, &p)| c.distance(p).powi(2))
                    .sum();
                (squares / 50.0).sqrt()
            };
            for (i, from, to) in (0..7).flat_map(|i| (0..25).map(move |k| (i, k / 5, k % 5))) {
                for h in [1e-3, 1e-5] {
                    let shift = h * matrix.row(i)[from];
                    let moved = ShapeMatrix::from_fn(7, 5, |r, c| {
                        matrix.row(r)[c]
                            + if r == i {
                                f64::from(c == to) * shift - f64::from(c == from) * shift
                            } else {
                                0.0
                            }
                    });
                    assert!(
                        rms(moved) >= best.error.rms * (1.0 - 1e-12),
                        "seed {seed}, row {i}: {from} to {to}"
                    );
                }
            }
        }
        assert!(fitted >= 4, "only {fitted} of the polygons kept the rank of their matrix");
    }
}

mod both {
    use super::*;

    fn run(family: Family, points: Vec<P>, ends: Ends) -> Result<Fit<2>, Error> {
        fit(
            &Context::default(),
            points,
            options(Parameterization::ChordLength, ends, Solve::Both { family, order: 3 }),
        )
    }

    #[test]
    fn it_is_no_worse_than_control_points_alone() {
        for ends in [Ends::Free, Ends::Interpolate] {
            let points: Vec<_> = (0..60)
                .map(|i| i as f64 / 10.0)
                .map(|t| Point([t, (2.0 * t).sin() + 0.3 * (5.0 * t).cos()]))
                .collect();
            let cubic = Solve::ControlPoints { basis: Basis::Bezier(Bezier), order: 3 };
            let alone = fit(
                &Context::default(),
                points.clone(),
                options(Parameterization::ChordLength, ends, cubic),
            )
            .unwrap();
            let both = run(Family::Quasi { degree: 6 }, points, ends).unwrap();
            println!(
                "{ends:?}: {:e} to {:e} in {} rounds",
                alone.error.rms, both.error.rms, both.iterations
            );
            assert!(both.error.rms < 0.9 * alone.error.rms && both.iterations > 1);
        }
    }

    #[test]
    fn a_cubic_is_returned_as_itself() {
        let values = steps(40);
        let points = sample(&segment(Basis::Bezier(Bezier), &cubic_points()), &values);
        let solve = Solve::Both { family: Family::Quasi { degree: 5 }, order: 3 };
        let fit = fit(
            &Context::default(),
            points,
            options(Parameterization::Given(values), Ends::Interpolate, solve),
        )
        .unwrap();
        assert!(
            distance(single(&fit).control_points(), &cubic_points()) < 1e-12
                && fit.error.max < 1e-13
        );
        assert!(single(&fit).basis().shape_matrix(3).properties().degenerates_to_bernstein);
    }

    #[test]
    fn families_that_span_all_polynomials_are_deficient() {
        for family in [Family::Bezier, Family::Beta, Family::AlphaBeta] {
            rank_deficient(
                run(family, noisy_arc(20), Ends::Free),
                "/solve/family",
                "cannot determine the shape",
            );
        }
        rank_deficient(
            run(Family::Quasi { degree: 3 }, noisy_arc(20), Ends::Free),
            "/solve/degree",
            "degree = order",
        );
        rank_deficient(
            run(Family::Quasi { degree: 4 }, noisy_arc(3), Ends::Free),
            "/solve/order",
            "3 distinct",
        );
    }
}

mod tolerance {
    use std::f64::consts::TAU;
    use std::sync::Arc;
    use std::sync::atomic::{AtomicUsize, Ordering};

    use springline::core::cancellation::Cancellation;

    use super::*;

    fn run<const D: usize>(
        basis: Basis,
        points: Vec<Point<D>>,
        parameters: Parameterization,
        ends: Ends,
        tolerance: f64,
    ) -> Result<Fit<D>, Error> {
        fit(
            &Context::default(),
            points,
            options(parameters, ends, Solve::Tolerance { basis, tolerance }),
        )
    }

    fn wave(count: usize) -> Vec<P> {
        (0..count)
            .map(|i| 20.0 * i as f64 / (count - 1) as f64)
            .map(|t| Point([t, 3.0 * (t * t / 8.0).sin()]))
            .collect()
    }

    fn segments<const D: usize>(fit: &Fit<D>) -> usize {
        fit.curve.composite(&Context::default()).unwrap().breaks().segments()
    }

    #[test]
    fn the_tolerance_holds_when_measured_again() {
        for basis in
            [Basis::Bezier(Bezier), beta(1.0), Basis::AlphaBeta(AlphaBeta::new(0.5, 2.0).unwrap())]
        {
            for ends in [Ends::Free, Ends::Interpolate] {
                let mut last = usize::MAX;
                for tolerance in [1e-6, 1e-4, 1e-2, 1.0, 100.0] {
                    let points = wave(300);
                    let fit = run(
                        basis.clone(),
                        points.clone(),
                        Parameterization::ChordLength,
                        ends,
                        tolerance,
                    )
                    .unwrap();
                    let off = distance(&sample(&fit.curve, &fit.parameters), &points);
                    assert!(off <= tolerance && off == fit.error.max && fit.converged);
                    println!(
                        "{} {ends:?} {tolerance:e}: {} segments, {} rounds, {off:e}",
                        basis.name(),
                        segments(&fit),
                        fit.iterations
                    );
                    assert!(segments(&fit) <= last, "a larger tolerance needs no more segments");
                    last = segments(&fit);
                    if ends == Ends::Interpolate {
                        let on = sample(&fit.curve, &fit.parameters);
                        assert_eq!((on[0], on[299]), (points[0], points[299]));
                    }
                }
                assert_eq!(last, 1);
            }
        }
    }

    #[test]
    fn segments_join_with_two_derivatives() {
        let fit =
            run(beta(0.5), wave(200), Parameterization::ChordLength, Ends::Free, 1e-3).unwrap();
        let first = fit
            .curve
            .composite(&Context::default())
            .unwrap()
            .derivative(&Context::default())
            .unwrap();
        for curve in [first.clone(), first.derivative(&Context::default()).unwrap()] {
            for k in 1..curve.breaks().segments() {
                let (before, after) = (curve.segment(k - 1), curve.segment(k));
                assert!(before[before.len() - 1].distance(after[0]) < 1e-9 * curve.magnitude());
            }
        }
    }

    /// A single cubic comes back as itself, and so does a spline of three with known joints.
    #[test]
    fn exact_data_come_back() {
        let parameters = steps(60);
        let points = sample(&segment(Basis::Bezier(Bezier), &cubic_points()), &parameters);
        let fit = run(
            Basis::Bezier(Bezier),
            points,
            Parameterization::Given(parameters),
            Ends::Interpolate,
            1e-9,
        )
        .unwrap();
        let Curve::Piecewise(curve) = &fit.curve else { panic!() };
        assert!(distance(curve.control_points(), &cubic_points()) < 1e-12);
        assert_eq!(fit.locally_minimal, Some(true));
    }

    /// The definition of local minimality, checked with an implementation of its own: dense least
    /// squares in truncated powers, without each joint in turn.
    #[test]
    fn no_joint_can_be_left_out() {
        let points = wave(80);
        let tolerance = 0.02;
        let fit = run(
            Basis::Bezier(Bezier),
            points.clone(),
            Parameterization::ChordLength,
            Ends::Free,
            tolerance,
        )
        .unwrap();
        assert_eq!(fit.locally_minimal, Some(true));
        let composite = fit.curve.composite(&Context::default()).unwrap();
        let breaks = composite.breaks().as_slice();
        let end = breaks[breaks.len() - 1];
        let worst = |joints: &[f64]| {
            let row = |t: f64| {
                let powers = (0..4).map(|k| (t / end).powi(k));
                powers
                    .chain(joints.iter().map(|&joint| ((t - joint) / end).max(0.0).powi(3)))
                    .collect::<Vec<_>>()
            };
            let mut problem =
                springline::core::linear::least_squares::LeastSquares::<2>::dense(4 + joints.len());
            points
                .iter()
                .zip(&fit.parameters)
                .for_each(|(&p, &t)| problem.push(0, &row(t), p, 1.0));
            let x = problem.solve().unwrap();
            let at = |t: f64| row(t).iter().zip(&x).fold(Point::ZERO, |sum, (&r, &x)| sum + x * r);
            points.iter().zip(&fit.parameters).map(|(&p, &t)| at(t).distance(p)).fold(0.0, f64::max)
        };
        let inner = &breaks[1..breaks.len() - 1];
        assert!(inner.len() > 3 && (worst(inner) - fit.error.max).abs() < 1e-6);
        for k in 0..inner.len() {
            let fewer: Vec<f64> = inner
                .iter()
                .enumerate()
                .filter(|&(i, _)| i != k)
                .map(|(_, &joint)| joint)
                .collect();
            assert!(worst(&fewer) > tolerance, "joint {k} of {}", inner.len());
        }
    }

    #[test]
    fn noise_ends_at_interpolation() {
        for count in [4, 5, 6, 7, 50] {
            for ends in [Ends::Free, Ends::Interpolate] {
                let points: Vec<_> = (0..count)
                    .map(|i| Point([number(i), number(i + 100), number(i + 200)]))
                    .collect();
                let fit = run(Basis::Bezier(Bezier), points, Parameterization::Uniform, ends, 1e-9)
                    .unwrap();
                assert!(fit.error.max < 1e-9 && segments(&fit) <= count - 3, "{count} {ends:?}");
            }
        }
    }

    #[test]
    fn given_parameters_are_the_domain() {
        let parameters: Vec<f64> = steps(50).iter().map(|u| -3.0 + 10.0 * u).collect();
        let fit = run(
            Basis::Bezier(Bezier),
            wave(50),
            Parameterization::Given(parameters),
            Ends::Free,
            0.1,
        )
        .unwrap();
        assert_eq!(
            fit.curve.composite(&Context::default()).unwrap().breaks().domain(),
            (-3.0, 7.0)
        );
    }

    #[test]
    fn reversed_points_give_the_reversed_curve() {
        let points: Vec<_> = (0..121)
            .map(|i| i as f64 / 10.0)
            .map(|t| Point([t, t.sin() + (0.3 * t * t).cos()]))
            .collect();
        let run = |points: Vec<P>| {
            run(Basis::Bezier(Bezier), points, Parameterization::Uniform, Ends::Free, 0.01).unwrap()
        };
        let (forward, backward) =
            (run(points.clone()), run(points.iter().rev().copied().collect()));
        let Curve::Piecewise(a) = &forward.curve else { panic!() };
        let Curve::Piecewise(b) = &backward.curve else { panic!() };
        let back: Vec<_> = b.control_points().iter().rev().copied().collect();
        assert!(distance(a.control_points(), &back) < 1e-9);
    }

    #[test]
    fn what_cannot_be_met_is_said() {
        let error = |points: Vec<P>, parameters, tolerance| {
            run(Basis::Bezier(Bezier), points, parameters, Ends::Free, tolerance).unwrap_err()
        };
        let mut split: Vec<f64> = steps(20);
        split[10] = split[9];
        let unmet = error(wave(20), Parameterization::Given(split), 1e-3);
        assert!(
            matches!(unmet.fault, Fault::ToleranceNotMet { best, .. } if best > 1e-3),
            "{unmet}"
        );
        assert_eq!(unmet.place.to_string(), "/solve/tolerance");
        for tolerance in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(matches!(
                error(wave(20), Parameterization::Uniform, tolerance).fault,
                Fault::OutOfRange { .. }
            ));
        }
        assert!(matches!(
            error(wave(20), Parameterization::Uniform, 1e-17).fault,
            Fault::ToleranceTooSmall { .. }
        ));
        let straight = Basis::Beta(Beta::from_lambda(0.0).unwrap());
        let no_way_back =
            run(straight, wave(30), Parameterization::Uniform, Ends::Free, 1.0).unwrap_err();
        assert_eq!(no_way_back.place.to_string(), "/solve/basis");
    }

    /// Work is counted in checkpoints.
    #[test]
    fn work_is_in_proportion_to_the_points() {
        let work = |count: usize| {
            let passed = Arc::new(AtomicUsize::new(0));
            let counter = passed.clone();
            let cancel = Cancellation::when(move || {
                counter.fetch_add(1, Ordering::Relaxed);
                false
            });
            let options = options(
                Parameterization::ChordLength,
                Ends::Interpolate,
                Solve::Tolerance { basis: Basis::Bezier(Bezier), tolerance: 1e-2 },
            );
            fit(&Context::until(&cancel), wave(count), options).unwrap();
            passed.load(Ordering::Relaxed)
        };
        let (some, twice) = (work(2_000), work(4_000));
        println!("{some} checkpoints for 2,000 points, {twice} for 4,000");
        assert!(twice < 3 * some, "{some}, {twice}");
    }

    #[test]
    fn two_points_give_a_line_and_three_a_parabola() {
        let points = vec![Point([1.0, 2.0, 0.0]), Point([4.0, -2.0, 1.0]), Point([5.0, 6.0, -3.0])];
        for ends in [Ends::Free, Ends::Interpolate] {
            for basis in [Basis::Bezier(Bezier), beta(1.0)] {
                let line =
                    run(basis.clone(), points[..2].to_vec(), Parameterization::Uniform, ends, 1e-9)
                        .unwrap();
                let third = sample(&line.curve, &[0.25]);
                assert!(
                    third[0].distance(points[0].lerp(points[1], 0.25)) < 1e-13
                        && line.between < 1e-13
                );
                let parabola = run(
                    basis.clone(),
                    points.clone(),
                    Parameterization::Given(vec![0.0, 1.0, 4.0]),
                    ends,
                    1e-9,
                )
                .unwrap();
                // Lagrange's formula at 2.
                let expected = points[0] * -0.5 + points[1] * (4.0 / 3.0) + points[2] * (1.0 / 6.0);
                assert!(sample(&parabola.curve, &[2.0])[0].distance(expected) < 1e-13);
                assert!(
                    (segments(&line), segments(&parabola)) == (1, 1)
                        && parabola.locally_minimal == Some(true)
                );
            }
        }
        // Two parameters for three points: a line as close as can be, where that is close enough.
        let doubled = Parameterization::Given(vec![0.0, 1.0, 1.0]);
        let line =
            run(Basis::Bezier(Bezier), points.clone(), doubled.clone(), Ends::Free, 5.0).unwrap();
        assert!((line.error.max - points[1].distance(points[2]) / 2.0).abs() < 1e-13);
        let unmet = run(Basis::Bezier(Bezier), points, doubled, Ends::Free, 1.0).unwrap_err();
        assert!(matches!(unmet.fault, Fault::ToleranceNotMet { segments: 1, .. }), "{unmet}");
    }

    /// The four cubic B-splines that count at `t` on equally spaced breaks, by their definition
    /// (Cox 1972, de Boor 1972).
    fn on_equal_breaks(t: f64, count: usize) -> Vec<f64> {
        let knot = |i: usize| (i as f64 - 3.0).clamp(0.0, count as f64) / count as f64;
        let span = 3 + ((t * count as f64) as usize).min(count - 1);
        let mut values: Vec<f64> = (0..count + 6).map(|i| f64::from(i == span)).collect();
        for degree in 1..=3 {
            for i in 0..count + 6 - degree {
                let part = |x: f64, from: usize, to: usize| {
                    if knot(to) > knot(from) { x / (knot(to) - knot(from)) } else { 0.0 }
                };
                values[i] = part(t - knot(i), i, i + degree) * values[i]
                    + part(knot(i + degree + 1) - t, i + 1, i + degree + 1) * values[i + 1];
            }
        }
        values.truncate(count + 3);
        values
    }

    /// The fewest segments with equally spaced joints that hold the tolerance, at parameters in [0,
    /// 1].
    fn equal_spacing_needs(
        points: &[P],
        parameters: &[f64],
        tolerance: f64,
        most: usize,
    ) -> Option<usize> {
        (1..=most).find(|&count| {
            let mut problem =
                springline::core::linear::least_squares::LeastSquares::<2>::dense(count + 3);
            let rows: Vec<_> = parameters.iter().map(|&t| on_equal_breaks(t, count)).collect();
            rows.iter().zip(points).for_each(|(row, &p)| problem.push(0, row, p, 1.0));
            let Ok(x) = problem.solve() else { return false };
            let value =
                |row: &Vec<f64>| row.iter().zip(&x).fold(Point::ZERO, |sum, (&r, &x)| sum + x * r);
            rows.iter().zip(points).all(|(row, &p)| value(row).distance(p) <= tolerance)
        })
    }

    #[test]
    fn smooth_data_take_no_more_segments_than_equal_spacing() {
        type ShapeParameters = fn(f64) -> P;
        let shapes: [(&str, ShapeParameters); 6] = [
            ("circle", |u| Point([0.5 * (TAU * u).cos(), 0.5 * (TAU * u).sin()])),
            ("ellipse", |u| Point([3.0 * (TAU * u).cos(), (TAU * u).sin()])),
            ("lissajous", |u| Point([(18.0 * u).sin(), (12.0 * u).sin()])),
            ("spiral", |u| Point([6.0 * u * (18.0 * u).cos(), 6.0 * u * (18.0 * u).sin()])),
            ("bump", |u| Point([2.0 * u, (-100.0 * (u - 0.3) * (u - 0.3)).exp()])),
            ("sine", |u| Point([2.0 * u, (9.0 * u).sin()])),
        ];
        for (name, shape) in shapes {
            for tolerance in [1e-2, 1e-3, 1e-4, 1e-5] {
                let points: Vec<P> = steps(400).into_iter().map(shape).collect();
                let fit = run(
                    Basis::Bezier(Bezier),
                    points.clone(),
                    Parameterization::ChordLength,
                    Ends::Free,
                    tolerance,
                )
                .unwrap();
                let end = fit.parameters[399];
                let parameters: Vec<f64> = fit.parameters.iter().map(|t| t / end).collect();
                let equal = equal_spacing_needs(&points, &parameters, tolerance, segments(&fit));
                println!(
                    "{name} {tolerance:e}: {} segments, equal spacing {equal:?}",
                    segments(&fit)
                );
                assert!(equal.is_none_or(|equal| segments(&fit) <= equal), "{name} {tolerance:e}");
                assert!(name != "circle" || tolerance > 1e-5 || segments(&fit) <= 19);
            }
        }
    }
}

/// `between` of every kind of fit, against its definition sampled densely.
#[test]
fn between_is_the_distance_from_the_polyline() {
    let solves: [fn() -> Solve<2>; 4] = [
        || Solve::ControlPoints { basis: beta(0.8), order: 5 },
        || Solve::Shape { family: Family::Beta, control_points: cubic_points() },
        || Solve::Both { family: Family::Quasi { degree: 4 }, order: 3 },
        || Solve::Tolerance { basis: Basis::Bezier(Bezier), tolerance: 0.05 },
    ];
    for (k, solve) in solves.iter().enumerate() {
        let fit = fit(
            &Context::default(),
            noisy_arc(12),
            options(Parameterization::Centripetal, Ends::Free, solve()),
        )
        .unwrap();
        let mut largest = 0.0f64;
        for (ends, t) in noisy_arc(12).windows(2).zip(fit.parameters.windows(2)) {
            let between: Vec<f64> =
                steps(2001).iter().map(|u| t[0] * (1.0 - u) + t[1] * u).collect();
            let along = ends[1] - ends[0];
            for p in sample(&fit.curve, &between) {
                let share = ((p - ends[0]).dot(along) / along.dot(along)).clamp(0.0, 1.0);
                largest = largest.max(p.distance(ends[0].lerp(ends[1], share)));
            }
        }
        assert!((fit.between - largest).abs() < 1e-6 * largest, "{k}: {} {largest}", fit.between);
    }
}

/// Coordinates at the end of the range of a double end in an error, not in a hang or in NaN.
#[test]
fn overflow_is_an_error() {
    let huge: Vec<P> = (0..20)
        .map(|i| Point([if i % 2 == 0 { 1.7e308 } else { -1.7e308 }, number(i) * 1.7e308]))
        .collect();
    let solves: [Solve<2>; 6] = [
        Solve::ControlPoints { basis: Basis::Bezier(Bezier), order: 3 },
        Solve::Shape { family: Family::Beta, control_points: huge[..4].to_vec() },
        Solve::Shape { family: Family::AlphaBeta, control_points: huge[..4].to_vec() },
        Solve::Shape { family: Family::Quasi { degree: 4 }, control_points: huge[..4].to_vec() },
        Solve::Both { family: Family::Quasi { degree: 4 }, order: 3 },
        Solve::Tolerance { basis: Basis::Bezier(Bezier), tolerance: 1e300 },
    ];
    for solve in solves {
        for ends in [Ends::Free, Ends::Interpolate] {
            if let Ok(fit) = fit(
                &Context::default(),
                huge.clone(),
                options(Parameterization::Uniform, ends, solve.clone()),
            ) {
                assert!(fit.error.max.is_finite() && fit.error.rms.is_finite(), "{solve:?}");
            }
        }
    }
}
