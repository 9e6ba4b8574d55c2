//! How far two curves are apart at equal parameters.

use super::bezier_form::{elevate, split};
use super::curve::{Composite, Segment};
use super::error::Error;
use super::point::Point;
use crate::core::context::{Context, Pace};

/// The largest distance between two curves of as many segments, compared segment by segment at
/// equal fractions of their intervals; exact to 1e-9 of its value, by bisection on the bounds that
/// Bezier points give.
pub(crate) fn largest_distance<const D: usize>(
    context: &Context,
    a: &Composite<D>,
    b: &Composite<D>,
) -> Result<f64, Error> {
    let mut pace = context.pace();
    let mut pairs = a.locals().zip(b.locals());
    pairs.try_fold(0.0, |largest, (p, q)| largest_norm(difference(p, q), largest, &mut pace))
}

/// The Bezier points of the difference of two segments.
fn difference<const D: usize>(p: Segment<D>, q: Segment<D>) -> Vec<Point<D>> {
    let degree = p.points.len().max(q.points.len()) - 1;
    let between = p.origin - q.origin;
    elevate(p.points, degree)
        .into_iter()
        .zip(elevate(q.points, degree))
        .map(|(p, q)| between + (p - q))
        .collect()
}

/// The largest distance of a Bezier curve from the origin, or `known` if that is larger.
fn largest_norm<const D: usize>(
    points: Vec<Point<D>>,
    known: f64,
    pace: &mut Pace<'_>,
) -> Result<f64, Error> {
    /// Enough for any curve that is not constant; a piece beyond it is within rounding of its
    /// bound.
    const PIECES: usize = 10_000;
    let mut largest = known;
    let mut pieces = vec![points];
    let mut count = 0;
    while let Some(points) = pieces.pop() {
        pace.step()?;
        let bound = points.iter().map(|p| p.norm()).fold(0.0, f64::max);
        largest = largest.max(points[0].norm()).max(points[points.len() - 1].norm());
        if bound <= largest * (1.0 + 1e-9) {
            continue;
        }
        count += 1;
        if count > PIECES {
            return Ok(bound);
        }
        let (left, right) = split(&points, 0.5);
        pieces.extend([left, right]);
    }
    Ok(largest)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_largest_norm_of_an_arch_is_at_its_top() {
        let arch = vec![Point([0.0, 0.0]), Point([0.0, 4.0]), Point([0.0, 0.0])];
        let largest =
            |points, known| largest_norm(points, known, &mut Context::default().pace()).unwrap();
        assert!((largest(arch.clone(), 0.0) - 2.0).abs() < 2e-9);
        assert_eq!(largest(arch, 5.0), 5.0);
        assert_eq!(largest(vec![Point([3.0, 4.0]); 4], 0.0), 5.0);
    }
}
