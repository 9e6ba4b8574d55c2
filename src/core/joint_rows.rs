//! Derivatives at the ends of a segment as combinations of its control points.

use super::basis::Basis;
use super::bezier_form::binomials;

/// The two ends of a segment.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Side {
    /// Its start.
    Start,
    /// Its end.
    End,
}

/// The `k`-th derivative at one end of a segment over an interval of this length: one factor for
/// each control point.
///
/// `d! / (d - k)! / length^k` times the `k`-th difference of the Bezier points there, through the
/// shape matrix. Cheng et al. 2021 eq. (15), with the factor `1 / (1 + 2 beta)` that it lacks, and
/// eq. (16) are the cubic Beta-Bezier case.
pub(crate) fn derivative_row(
    basis: &Basis,
    order: usize,
    length: f64,
    k: usize,
    side: Side,
) -> Vec<f64> {
    let matrix = basis.shape_matrix(order);
    let degree = matrix.degree();
    let mut row = vec![0.0; order + 1];
    if k > degree {
        return row;
    }
    let scale: f64 = (0..k).map(|i| (degree - i) as f64 / length).product();
    for (i, binomial) in binomials(k).iter().enumerate() {
        let (bezier, sign) = match side {
            Side::Start => (i, if (k - i).is_multiple_of(2) { 1.0 } else { -1.0 }),
            Side::End => (degree - i, if i.is_multiple_of(2) { 1.0 } else { -1.0 }),
        };
        for (entry, m) in row.iter_mut().zip(matrix.row(bezier)) {
            *entry += scale * sign * binomial * m;
        }
    }
    row
}

/// The same of a rational segment with these weights, which stay: by the quotient rule the
/// derivatives of the curve are combinations of its control points too.
pub(crate) fn rational_row(
    basis: &Basis,
    order: usize,
    length: f64,
    k: usize,
    side: Side,
    weights: &[f64],
) -> Vec<f64> {
    let mut rows: Vec<Vec<f64>> = Vec::with_capacity(k + 1);
    let mut slopes = Vec::with_capacity(k + 1);
    for i in 0..=k {
        let mut row = derivative_row(basis, order, length, i, side);
        row.iter_mut().zip(weights).for_each(|(factor, w)| *factor *= w);
        slopes.push(row.iter().sum::<f64>());
        let binomials = binomials(i);
        for j in 1..=i {
            let factor = binomials[j] * slopes[j];
            row.iter_mut().zip(&rows[i - j]).for_each(|(a, b)| *a -= factor * b);
        }
        row.iter_mut().for_each(|factor| *factor /= slopes[0]);
        rows.push(row);
    }
    rows.pop().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::basis::Beta;

    /// The right side of Cheng et al. 2021 eq. (15) over 1 + 2 beta (the factor that the paper
    /// leaves out).
    fn equation_15(b: f64) -> [f64; 4] {
        let a = b / (1.0 + b);
        let [p1, p2, p3] = [3.0, 3.0 * a, 2.0 * a * b].map(|x| x / (1.0 + 2.0 * b));
        [-(p1 + p2 + p3), p1, p2, p3]
    }

    /// Six times the right side of Cheng et al. 2021 eq. (16).
    fn equation_16(b: f64) -> [f64; 4] {
        let common = 6.0 / ((1.0 + b) * (1.0 + 2.0 * b));
        [1.0 + b, -2.0 - b, 1.0 - b, b].map(|x| x * common)
    }

    /// At the start of a rational quadratic `C' = 2 w1 / w0 (P1 - P0)`, and `C''` is known from
    /// there (Farin 2002 section 13.4).
    #[test]
    fn rational_rows_are_the_derivatives_at_the_start() {
        let basis = Basis::Bezier(crate::core::basis::Bezier);
        let w = [2.0, 3.0, 5.0];
        let row = |k| rational_row(&basis, 2, 1.0, k, Side::Start, &w);
        let r = w[1] / w[0];
        let first = [-2.0 * r, 2.0 * r, 0.0];
        // C'' = 2 w2 / w0 (P2 - P0) + (4 w1 / w0 - 8 (w1 / w0)^2) (P1 - P0).
        let (a, b) = (4.0 * r - 8.0 * r * r, 2.0 * w[2] / w[0]);
        for (k, expected) in [(0, [1.0, 0.0, 0.0]), (1, first), (2, [-a - b, a, b])] {
            let off = row(k).iter().zip(expected).map(|(x, y)| (x - y).abs()).fold(0.0, f64::max);
            assert!(off < 1e-13, "{k}: {:?} {expected:?}", row(k));
        }
    }

    #[test]
    fn cubic_rows_are_equations_15_and_16() {
        for b in [0.0, 0.5, 1.0, 7.0] {
            let basis = Basis::Beta(Beta::from_beta(b).unwrap());
            for (k, expected) in [(1, equation_15(b)), (2, equation_16(b))] {
                let start = derivative_row(&basis, 3, 1.0, k, Side::Start);
                let end = derivative_row(&basis, 3, 1.0, k, Side::End);
                let sign = if k == 1 { -1.0 } else { 1.0 };
                for j in 0..4 {
                    assert!(
                        (start[j] - expected[j]).abs() < 1e-14,
                        "beta {b}, order {k}, point {j}"
                    );
                    assert!(
                        (end[3 - j] - sign * expected[j]).abs() < 1e-14,
                        "beta {b}, order {k}, point {j} at the end"
                    );
                }
            }
        }
    }
}
