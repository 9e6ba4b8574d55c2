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
