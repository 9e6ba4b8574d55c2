//! Convex combinations of points: the one that gives a target and is nearest to a preferred one.

use crate::core::linear::quadratic_program::normalized;
use nalgebra::{DMatrix, DVector};

use crate::core::linear::singular_values::decomposed;
use crate::core::point::Point;

/// Steps smaller than this, and multipliers above its negative, are rounding. Points are of size 1.
const SMALL: f64 = 1e-13;

/// Weights `m_j >= 0` with sum 1 of points of size about 1, such that `sum_j m_j P_j` is nearest to
/// the target; among those, nearest to `preferred`. Unique, whatever the number of points.
pub(super) fn nearest_combination<const D: usize>(
    points: &[Point<D>],
    target: Point<D>,
    preferred: &[f64],
) -> Vec<f64> {
    let columns = homogeneous(points);
    let goal = DVector::from_fn(D + 1, |a, _| if a < D { target[a] } else { 1.0 });
    let start = normalized(nonnegative_least_squares(&columns, &goal));
    normalized(pulled_towards(&columns, preferred, start))
}

/// One column `(P_j, 1)` per point.
fn homogeneous<const D: usize>(points: &[Point<D>]) -> DMatrix<f64> {
    DMatrix::from_fn(D + 1, points.len(), |a, j| if a < D { points[j][a] } else { 1.0 })
}

/// `min |A x - b|` with `x >= 0` by active sets: Lawson and Hanson 1974, algorithm NNLS (23.10).
fn nonnegative_least_squares(a: &DMatrix<f64>, b: &DVector<f64>) -> Vec<f64> {
    let mut x = DVector::zeros(a.ncols());
    let mut positive = vec![false; a.ncols()];
    for _ in 0..4 * a.ncols() {
        let gradient = a.tr_mul(&(b - a * &x));
        let candidates = (0..a.ncols()).filter(|&j| !positive[j]);
        let Some(enter) = candidates.max_by(|&i, &j| gradient[i].total_cmp(&gradient[j])) else {
            break;
        };
        if gradient[enter] <= SMALL {
            break;
        }
        positive[enter] = true;
        step_back_to_positive(a, b, &mut x, &mut positive);
    }
    x.iter().copied().collect()
}

/// The inner loop of NNLS: moves to the least-squares solution of the positive columns, dropping
/// those that would turn negative on the way.
fn step_back_to_positive(
    a: &DMatrix<f64>,
    b: &DVector<f64>,
    x: &mut DVector<f64>,
    positive: &mut [bool],
) {
    for _ in 0..=a.ncols() {
        let chosen = selected(positive, true);
        let solution = least_norm(&a.select_columns(&chosen), b);
        let blocking = chosen.iter().zip(solution.iter()).filter(|&(_, &s)| s <= 0.0);
        let Some(step) = blocking
            .map(|(&j, &s)| x[j] / (x[j] - s))
            .filter(|r| r.is_finite())
            .min_by(f64::total_cmp)
        else {
            chosen.iter().zip(solution.iter()).for_each(|(&j, &s)| x[j] = s.max(0.0));
            return;
        };
        for (&j, &s) in chosen.iter().zip(solution.iter()) {
            x[j] += step * (s - x[j]);
            if x[j] <= SMALL * SMALL || (s <= 0.0 && x[j] <= SMALL) {
                x[j] = 0.0;
                positive[j] = false;
            }
        }
    }
}

/// Positions of the entries with this value.
fn selected(flags: &[bool], value: bool) -> Vec<usize> {
    (0..flags.len()).filter(|&j| flags[j] == value).collect()
}

/// The least-squares solution of least norm; directions that only rounding spans are left out.
fn least_norm(a: &DMatrix<f64>, b: &DVector<f64>) -> DVector<f64> {
    let Some(svd) = decomposed(a.clone(), true) else { return DVector::zeros(a.ncols()) };
    let threshold = svd.singular_values.max() * SMALL;
    svd.solve(b, threshold).unwrap_or_else(|_| DVector::zeros(a.ncols()))
}

/// `min |m - preferred|` with `A m` as it is and `m >= 0`: a primal active-set method from a
/// feasible start (Nocedal and Wright 2006, algorithm 16.3). Stops early only if it runs in a
/// circle.
fn pulled_towards(a: &DMatrix<f64>, preferred: &[f64], start: Vec<f64>) -> Vec<f64> {
    let mut m = start;
    let mut free: Vec<bool> = m.iter().map(|&x| x > 0.0).collect();
    for _ in 0..8 * m.len() {
        let chosen = selected(&free, true);
        let transposed = a.select_columns(&chosen).transpose();
        let wanted = DVector::from_fn(chosen.len(), |k, _| preferred[chosen[k]] - m[chosen[k]]);
        let multipliers = least_norm(&transposed, &wanted);
        let step = wanted - transposed * &multipliers;
        if step.amax() <= SMALL {
            // The gradient of the Lagrangian must not pull a weight at 0 upwards.
            let pull = |j: usize| m[j] - preferred[j] + a.column(j).dot(&multipliers);
            let held =
                selected(&free, false).into_iter().min_by(|&i, &j| pull(i).total_cmp(&pull(j)));
            match held {
                Some(j) if pull(j) < -SMALL => free[j] = true,
                _ => break,
            }
        } else {
            advance(&mut m, &mut free, &chosen, &step);
        }
    }
    m
}

/// Goes along the step until a weight becomes 0, which is then held there.
fn advance(m: &mut [f64], free: &mut [bool], chosen: &[usize], step: &DVector<f64>) {
    let limit = |k: usize| if step[k] < 0.0 { m[chosen[k]] / -step[k] } else { f64::INFINITY };
    let blocking = (0..chosen.len()).min_by(|&k, &l| limit(k).total_cmp(&limit(l)));
    let length = blocking.map_or(1.0, |k| limit(k).min(1.0));
    let blocked = blocking.filter(|&k| limit(k) <= 1.0);
    chosen.iter().zip(step.iter()).for_each(|(&j, &s)| m[j] = (m[j] + length * s).max(0.0));
    if let Some(k) = blocked {
        m[chosen[k]] = 0.0;
        free[chosen[k]] = false;
    }
}

#[cfg(test)]
mod tests {
    use super::super::reduced::combine;
    use super::*;

    const SQUARE: [Point<2>; 5] = [
        Point([0.0, 0.0]),
        Point([1.0, 0.0]),
        Point([1.0, 1.0]),
        Point([0.0, 1.0]),
        Point([0.5, 0.5]),
    ];

    #[test]
    fn targets_inside_are_met_and_the_preferred_weights_win() {
        let preferred = [0.1, 0.4, 0.2, 0.2, 0.1];
        let target = combine(&preferred, &SQUARE);
        let m = nearest_combination(&SQUARE, target, &preferred);
        assert!(m.iter().zip(preferred).all(|(a, b)| (a - b).abs() < 1e-14), "{m:?}");
    }

    #[test]
    fn a_vertex_takes_all_weight_and_an_outside_target_its_nearest_point() {
        let even = [0.2; 5];
        assert_eq!(nearest_combination(&SQUARE, SQUARE[2], &even), [0.0, 0.0, 1.0, 0.0, 0.0]);
        let m = nearest_combination(&SQUARE, Point([0.3, -1e-12]), &even);
        assert!(combine(&m, &SQUARE).distance(Point([0.3, 0.0])) < 2e-12);
    }

    /// The conditions of Karush, Kuhn and Tucker, over many targets.
    #[test]
    fn the_combination_is_the_nearest() {
        let preferred = [0.6, 0.0, 0.3, 0.0, 0.1];
        for k in 0..100 {
            let target = Point([(k % 10) as f64 / 9.0, (k / 10) as f64 / 9.0]);
            let m = nearest_combination(&SQUARE, target, &preferred);
            assert!(combine(&m, &SQUARE).distance(target) < 1e-13, "target {target:?}");
            let distance =
                |m: &[f64]| m.iter().zip(preferred).map(|(a, b)| (a - b) * (a - b)).sum::<f64>();
            // The two ways to change weights without moving the target.
            for way in [
                [1.0, -1.0, 1.0, -1.0, 0.0],
                [0.5, 0.0, 0.5, 0.0, -1.0],
                [0.5, -1.0, 0.5, -1.0, 1.0],
                [1.0, -2.0, 1.0, -2.0, 2.0],
            ] {
                for h in [1e-4, -1e-4] {
                    let moved: Vec<f64> = m.iter().zip(way).map(|(m, w)| m + h * w).collect();
                    assert!(
                        moved.iter().any(|&x| x < 0.0) || distance(&moved) >= distance(&m) - 1e-12,
                        "target {target:?} {m:?}"
                    );
                }
            }
        }
    }
}
