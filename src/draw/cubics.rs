//! Segments as SVG can draw them: of degree 1, 2 or 3.

use crate::core::bezier_form::split;
use crate::core::point::{Point, magnitude};

/// How far a cubic may be from a segment of higher degree, in pixels: the precision of the
/// coordinates written.
pub const TOLERANCE: f64 = 0.01;

/// Halvings after which a piece is taken as it is: it is then far below a pixel in all but made-up
/// cases.
const DEPTH: usize = 12;

/// The segment itself up to degree 3. Above, cubics with its end points and end tangents, as many
/// as the tolerance needs.
pub fn drawable(bezier: &[Point<2>]) -> Vec<Vec<Point<2>>> {
    let mut pieces = Vec::new();
    collect(bezier, DEPTH, &mut pieces);
    pieces
}

fn collect(bezier: &[Point<2>], depth: usize, pieces: &mut Vec<Vec<Point<2>>>) {
    if bezier.len() <= 4 {
        return pieces.push(bezier.to_vec());
    }
    if depth == 0 || distance_to_hermite(bezier) <= TOLERANCE {
        return pieces.push(hermite(bezier));
    }
    let (left, right) = split(bezier, 0.5);
    collect(&left, depth - 1, pieces);
    collect(&right, depth - 1, pieces);
}

/// The cubic with the same end points and end derivatives.
fn hermite(bezier: &[Point<2>]) -> Vec<Point<2>> {
    let degree = bezier.len() - 1;
    let third = degree as f64 / 3.0;
    let (first, last) = (bezier[0], bezier[degree]);
    vec![
        first,
        first + (bezier[1] - first) * third,
        last + (bezier[degree - 1] - last) * third,
        last,
    ]
}

/// A bound on the distance between a segment and its cubic: the largest fourth derivative / 384, by
/// its Bezier points, once per coordinate.
fn distance_to_hermite(bezier: &[Point<2>]) -> f64 {
    let mut differences = bezier.to_vec();
    for _ in 0..4 {
        differences = differences.windows(2).map(|pair| pair[1] - pair[0]).collect();
    }
    let degree = bezier.len() - 1;
    let factor: f64 = (degree - 3..=degree).map(|k| k as f64).product();
    magnitude(&differences) * factor / 384.0 * std::f64::consts::SQRT_2
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::bezier_form::evaluate;

    #[test]
    fn low_degrees_stay_as_they_are() {
        let points: Vec<_> = (0..4).map(|i| Point([f64::from(i), f64::from(i * i)])).collect();
        for count in 2..=4 {
            assert_eq!(drawable(&points[..count]), [points[..count].to_vec()]);
        }
    }

    #[test]
    fn high_degrees_are_within_the_tolerance_at_equal_parameters() {
        let at = |i: u32| Point([f64::from(i) * 40.0, 250.0 + 240.0 * (f64::from(i) * 2.3).sin()]);
        for degree in [4, 5, 9, 20, 64] {
            let curve: Vec<_> = (0..=degree).map(at).collect();
            let left = split(&split(&curve, 0.5).0, 0.5).0;
            let pieces = drawable(&curve);
            assert!(pieces.len() < 200, "{degree}: {}", pieces.len());
            // Halving is even along the way to each piece, so a quarter that is refined evenly can
            // be compared directly.
            for (bezier, whole) in [(&curve, &pieces), (&left, &drawable(&left))] {
                assert_eq!(whole[0][0], bezier[0]);
                assert_eq!(whole[whole.len() - 1][3], bezier[bezier.len() - 1]);
                assert!(whole.windows(2).all(|pair| pair[0][3] == pair[1][0]));
            }
            check(&curve, DEPTH);
        }
    }

    fn check(bezier: &[Point<2>], depth: usize) {
        if distance_to_hermite(bezier) > TOLERANCE {
            assert!(depth > 0);
            let (left, right) = split(bezier, 0.5);
            check(&left, depth - 1);
            return check(&right, depth - 1);
        }
        let cubic = hermite(bezier);
        for i in 0..=16 {
            let u = f64::from(i) / 16.0;
            assert!(evaluate(bezier, u).distance(evaluate(&cubic, u)) <= TOLERANCE);
        }
    }
}
