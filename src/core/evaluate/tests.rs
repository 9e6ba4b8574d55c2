use super::*;
use crate::core::basis::{Basis, Bezier};
use crate::core::curve::Single;

fn bezier<const D: usize>(points: &[[f64; D]]) -> Curve<D> {
    let points = points.iter().map(|&p| Point(p)).collect();
    Curve::Single(Single::new(&Context::default(), Basis::Bezier(Bezier), points).unwrap())
}

fn sampled<const D: usize>(
    curve: &Curve<D>,
    at: &[f64],
    derivatives: usize,
    quantities: Quantities,
) -> Samples<D> {
    let sampling = Sampling::Parameters(at.to_vec());
    evaluate(&Context::default(), curve, &sampling, derivatives, quantities).unwrap()
}

/// `x = t`, `y = t^3`.
#[test]
fn a_cubic_graph_has_the_curvature_and_the_speed_of_the_formula() {
    let curve = bezier(&[[0.0, 0.0], [1.0 / 3.0, 0.0], [2.0 / 3.0, 0.0], [1.0, 1.0]]);
    let at = [0.0, 0.25, 0.5, 0.75, 1.0];
    let wanted = Quantities { curvature: true, speed: true, ..Quantities::default() };
    let samples = sampled(&curve, &at, 0, wanted);
    for (i, t) in at.into_iter().enumerate() {
        let speed = (1.0 + 9.0 * t.powi(4)).sqrt();
        assert_eq!(samples.frames.speeds[i], speed);
        let curvature = 6.0 * t / speed.powi(3);
        assert!((samples.frames.curvatures[i] - curvature).abs() <= f64::EPSILON);
    }
}

/// All numbers are short binary fractions, so both ways are exact.
#[test]
fn points_and_derivatives_are_those_of_the_triangle_of_de_casteljau() {
    let polygon = [[0.0, 1.0], [2.0, 5.0], [3.0, -4.0], [7.0, 0.5], [8.0, 2.0]];
    let (curve, t) = (bezier(&polygon), 0.375);
    let samples = sampled(&curve, &[t], 2, Quantities::default());
    let mut triangle = vec![polygon.map(Point).to_vec()];
    for _ in 1..polygon.len() {
        let row = triangle.last().unwrap();
        triangle.push(row.windows(2).map(|pair| pair[0].lerp(pair[1], t)).collect());
    }
    assert_eq!(samples.points, triangle[4]);
    let [before, last] = [&triangle[2], &triangle[3]];
    assert_eq!(samples.derivatives[0], [(last[1] - last[0]) * 4.0]);
    let second = (before[2] - before[1]) - (before[1] - before[0]);
    assert_eq!(samples.derivatives[1], [second * 12.0]);
}

#[test]
fn what_has_no_frame_is_named() {
    let all =
        Quantities { tangent: true, normal: true, curvature: true, torsion: true, speed: true };
    let stops = bezier(&[[0.0, 0.0, 1.0], [0.0, 0.0, 1.0], [1.0, 2.0, 0.0], [3.0, 1.0, 1.0]]);
    let frames = sampled(&stops, &[0.0, 0.5], 0, all).frames;
    assert_eq!(frames.degenerate, [Degenerate { index: 0, zero_speed: true }]);
    assert_eq!((frames.tangents[0], frames.speeds[0]), (Point::ZERO, 0.0));
    let straight = bezier(&[[0.0, 0.0, 0.0], [1.0, 2.0, 2.0]]);
    let frames = sampled(&straight, &[0.5], 0, all).frames;
    assert_eq!(frames.degenerate, [Degenerate { index: 0, zero_speed: false }]);
    assert_eq!((frames.normals[0], frames.torsions[0], frames.speeds[0]), (Point::ZERO, 0.0, 3.0));
}

#[test]
fn a_refused_sample_is_placed() {
    let curve = bezier(&[[0.0, 0.0], [1.0, 2.0], [2.0, 0.0]]);
    let place = |sampling, derivatives, quantities| {
        let found = evaluate(&Context::default(), &curve, &sampling, derivatives, quantities);
        found.unwrap_err().place.to_string()
    };
    let none = Quantities::default();
    assert_eq!(place(Sampling::Parameters(vec![0.5, 1.5]), 0, none), "/sampling/parameters/1");
    assert_eq!(place(Sampling::Count(1), 0, none), "/sampling/count");
    assert_eq!(place(Sampling::Tolerance(1e-20), 0, none), "/sampling/tolerance");
    assert_eq!(place(Sampling::Count(2), 65, none), "/derivatives");
    let torsion = Quantities { torsion: true, ..none };
    assert_eq!(place(Sampling::Count(2), 0, torsion), "/quantities");
}
