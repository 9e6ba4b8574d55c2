use super::*;
use crate::core::basis::Bezier;

fn bezier<const D: usize>(points: &[[f64; D]]) -> Single<D> {
    let points = points.iter().map(|&p| Point(p)).collect();
    Single::new(&Context::default(), Basis::Bezier(Bezier), points).unwrap()
}

fn joined(curves: &[Single<2>], smoothness: Smoothness, movable: Movable) -> Joined<Piecewise<2>> {
    join(&Context::default(), curves.to_vec(), smoothness, movable).unwrap()
}

#[test]
fn ends_that_may_both_move_meet_halfway() {
    let lines = [bezier(&[[0.0, 0.0], [2.0, 0.0]]), bezier(&[[2.0, 2.0], [4.0, 2.0]])];
    let both = joined(&lines, Smoothness::C0, Movable::Both);
    assert_eq!(both.curve.control_points(), [[0.0, 0.0], [2.0, 1.0], [4.0, 2.0]].map(Point));
    assert_eq!(both.moved, [[0.0, 1.0], [1.0, 0.0]]);
    let one = joined(&lines, Smoothness::C0, Movable::Following);
    assert_eq!(one.curve.control_points(), [[0.0, 0.0], [2.0, 0.0], [4.0, 2.0]].map(Point));
}

/// C1 is the mirror image of the last edge: `Q1 = 2 P2 - P1`. C2 mirrors the change of the edge
/// before it too: `Q2 = P0 - 4 P1 + 4 P2`.
#[test]
fn the_following_parabola_goes_on_as_the_leading_one() {
    let leading = bezier(&[[0.0, 0.0], [1.0, 1.0], [2.0, 0.0]]);
    let curves = [leading, bezier(&[[2.0, 0.0], [3.0, 0.0], [4.0, 0.0]])];
    let ends = |joined: &Joined<Piecewise<2>>| joined.curve.control_points()[3..].to_vec();
    let first = joined(&curves, Smoothness::C1, Movable::Following);
    assert_eq!(ends(&first), [[3.0, -1.0], [4.0, 0.0]].map(Point));
    let second = joined(&curves, Smoothness::C2, Movable::Following);
    assert_eq!(ends(&second), [[3.0, -1.0], [4.0, -4.0]].map(Point));
}

#[test]
fn normals_complete_a_tangent_to_an_orthonormal_basis() {
    let tangent = Point([2.0 / 7.0, 3.0 / 7.0, -6.0 / 7.0]);
    let [n, m] = normals(tangent)[..] else { panic!("two normals in space") };
    for (product, expected) in [
        (n.dot(n), 1.0),
        (m.dot(m), 1.0),
        (n.dot(m), 0.0),
        (n.dot(tangent), 0.0),
        (m.dot(tangent), 0.0),
    ] {
        assert!((product - expected).abs() <= f64::EPSILON, "{product}");
    }
    assert_eq!(normals(Point([0.0, 1.0])), [Point([1.0, 0.0])]);
}

#[test]
fn a_refused_join_is_placed() {
    let line = bezier(&[[0.0, 0.0], [1.0, 0.0]]);
    let parabola = bezier(&[[1.0, 0.0], [2.0, 1.0], [3.0, 0.0]]);
    let place = |curves: &[&Single<2>], smoothness| {
        let curves = curves.iter().map(|&curve| curve.clone()).collect();
        let found = join(&Context::default(), curves, smoothness, Movable::Following);
        found.unwrap_err().place.to_string()
    };
    assert_eq!(place(&[&line, &line, &parabola], Smoothness::C0), "/curves/2/control points");
    assert_eq!(place(&[&line], Smoothness::C0), "/curves");
    // A curve that stands still has no tangent.
    let still = bezier(&[[0.0, 0.0], [0.0, 0.0]]);
    assert_eq!(place(&[&still, &line], Smoothness::G1), "/curves/0");
}
