//! Points relative to an origin near them.
//!
//! A sum of products of coordinates rounds in units of the coordinates; of distances from a point
//! nearby, in units of the distances. So features of size 1e-6 at 1e6 keep all their digits if
//! points are taken relative to one of them first. That must not cost a digit itself.

use super::point::Point;

/// An origin to and from which points move without rounding.
///
/// Coordinate by coordinate, that of the first point where all points are within a factor of two
/// of it: then the differences are doubles, and so are the sums that lead back (Sterbenz 1974,
/// Theorem 4.3.1). Else 0: such points are as far apart as they are
/// from zero, so that no digit is to be won.
pub(crate) fn origin_of<const D: usize>(points: &[Point<D>]) -> Point<D> {
    let first = points[0];
    let mut near = first.map(|x| f64::from(x != 0.0));
    for p in points {
        for k in 0..D {
            let (x, origin) = (p[k] * first[k].signum(), first[k].abs());
            near[k] *= f64::from((0.5 * origin <= x) & (0.5 * x <= origin));
        }
    }
    Point(std::array::from_fn(|k| if near[k] == 1.0 { first[k] } else { 0.0 }))
}

/// The points with their origin, and relative to it.
pub(crate) fn localized<const D: usize>(points: &[Point<D>]) -> (Point<D>, Vec<Point<D>>) {
    let origin = origin_of(points);
    (origin, points.iter().map(|&p| p - origin).collect())
}

/// A point relative to an origin where it was; a zero keeps its sign where the origin is 0.
pub(crate) fn placed<const D: usize>(origin: Point<D>, p: Point<D>) -> Point<D> {
    Point(std::array::from_fn(|k| if origin[k] == 0.0 { p[k] } else { origin[k] + p[k] }))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_way_there_and_back_is_exact() {
        let number = |i: u32| (f64::from(i) * 12.9898).sin() * 43758.5453;
        for scale in [5e-324, 1e-310, 1e-8, 1.0, 1e300] {
            for i in 0..200 {
                let point = |j: u32| {
                    Point([0, 1, 2].map(|k| scale * (number(k) + 0.3 * number(3 * (i + j) + k))))
                };
                let points: Vec<_> = (0..5).map(point).collect();
                let (origin, local) = localized(&points);
                local.iter().zip(&points).for_each(|(&q, &p)| assert_eq!(origin + q, p));
            }
        }
    }

    #[test]
    fn an_origin_is_taken_where_points_are_close_together_only() {
        let origin = |x: [f64; 3]| origin_of(&x.map(|x| Point([x])))[0];
        assert_eq!(origin([1e6, 1e6 + 1e-6, 1e6 - 1e-6]), 1e6);
        assert_eq!(origin([-3.0, -6.0, -1.5]), -3.0);
        assert_eq!(origin([-3.0, -6.1, -3.0]), 0.0);
        assert_eq!(origin([3.0, 1.4, 3.0]), 0.0);
        assert_eq!(origin([1.0, -1.0, 1.0]), 0.0);
        assert_eq!(origin([0.0, 1.0, 2.0]), 0.0);
    }
}
