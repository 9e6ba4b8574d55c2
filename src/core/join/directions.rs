//! Directions across a curve.

use crate::core::point::Point;

/// The unit vector along an axis.
pub(super) fn unit_vector<const D: usize>(axis: usize) -> Point<D> {
    let mut unit = Point::ZERO;
    unit[axis] = 1.0;
    unit
}

/// Unit vectors that complete a unit tangent to an orthonormal basis.
pub(super) fn normals<const D: usize>(tangent: Point<D>) -> Vec<Point<D>> {
    let mut found: Vec<Point<D>> = vec![tangent];
    let mut axes: Vec<usize> = (0..D).collect();
    // The axes least along the tangent first: nothing is lost in the subtraction.
    axes.sort_by(|&a, &b| tangent[a].abs().total_cmp(&tangent[b].abs()));
    for axis in axes {
        let rest = found.iter().fold(unit_vector(axis), |v, &n| v - n * n.dot(v));
        if found.len() < D && rest.norm() > 0.1 {
            found.extend(rest.unit());
        }
    }
    found.split_off(1)
}
