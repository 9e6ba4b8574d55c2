//! Linear least squares by orthogonal rotations, one row at a time.
//!
//! Rows are rotated into an upper triangle `R` as they arrive (Givens 1958; Golub and Van Loan,
//! Matrix Computations, 5.2.5; for bands Lawson and Hanson 1974, chapter 27). The normal equations,
//! which would square the condition number, are never formed.

use nalgebra::DMatrix;

use super::point::Point;
use super::singular_values::decomposed;

/// Singular values below this many roundings of the largest, times columns, count as zero.
const ROUNDINGS: f64 = 8.0;

/// The problem `min sum_i w_i |a_i x - b_i|^2` with right-hand sides and unknowns in `D` dimensions.
///
/// O(columns * band) memory. A row costs O(band^2) where rows come in the order of their first
/// column, and in any order O(columns * band).
#[derive(Debug, Clone)]
pub struct LeastSquares<const D: usize> {
    columns: usize,
    band: usize,
    /// Row `k` holds `R[k][k] .. R[k][k + band - 1]`.
    triangle: Vec<f64>,
    right: Vec<Point<D>>,
    row: Vec<f64>,
}

/// Fewer independent equations than unknowns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Deficient {
    /// How many unknowns the rows determine.
    pub rank: usize,
    /// How many there are.
    pub columns: usize,
}

impl<const D: usize> LeastSquares<D> {
    /// For rows whose coefficients lie within `band` neighbouring columns.
    pub fn banded(columns: usize, band: usize) -> Self {
        let band = band.min(columns);
        LeastSquares { columns, band, triangle: vec![0.0; columns * band], right: vec![Point::ZERO; columns], row: vec![0.0; band] }
    }

    /// For rows with coefficients anywhere.
    pub fn dense(columns: usize) -> Self {
        Self::banded(columns, columns)
    }

    /// Adds the equation `sum_k coefficients[k] x[first + k] = right` with a weight that is not negative.
    /// At most `band` coefficients, none beyond the last column.
    pub fn push(&mut self, first: usize, coefficients: &[f64], right: Point<D>, weight: f64) {
        let root = weight.sqrt();
        self.row.fill(0.0);
        for (entry, c) in self.row.iter_mut().zip(coefficients) {
            *entry = c * root;
        }
        let mut right = right * root;
        let mut length = coefficients.len().min(self.band);
        for k in first..self.columns {
            if self.row[0] != 0.0 {
                self.rotate(k, &mut right);
                length = self.band;
            }
            if length <= 1 {
                break;
            }
            self.row.copy_within(1.., 0);
            self.row[self.band - 1] = 0.0;
            if self.row[..length].iter().all(|&x| x == 0.0) {
                break;
            }
        }
    }

    /// Rotates the row against row `k` of the triangle so that its first entry vanishes.
    fn rotate(&mut self, k: usize, right: &mut Point<D>) {
        let pivot = &mut self.triangle[k * self.band..(k + 1) * self.band];
        let length = pivot[0].hypot(self.row[0]);
        let (c, s) = (pivot[0] / length, self.row[0] / length);
        for (p, r) in pivot.iter_mut().zip(&mut self.row).take(self.columns - k) {
            (*p, *r) = (c * *p + s * *r, c * *r - s * *p);
        }
        (self.right[k], *right) = (self.right[k] * c + *right * s, *right * c - self.right[k] * s);
    }

    /// Row `k` of the triangle from its diagonal on, and its right-hand side: the same problem in
    /// as many equations as unknowns.
    pub fn reduced(&self, k: usize) -> (&[f64], Point<D>) {
        let entries = &self.triangle[k * self.band..(k + 1) * self.band];
        (&entries[..self.band.min(self.columns - k)], self.right[k])
    }

    /// The unknowns. O(columns * band), for dense problems O(columns^3) for the rank.
    ///
    /// # Errors
    /// [`Deficient`]: the rows leave some combination of unknowns free, up to rounding. Columns are
    /// compared by direction, so that their scales do not matter.
    pub fn solve(&self) -> Result<Vec<Point<D>>, Deficient> {
        let rank = if self.band == self.columns { self.rank_by_singular_values() } else { self.rank_by_diagonal() };
        if rank < self.columns {
            return Err(Deficient { rank, columns: self.columns });
        }
        let mut solution = self.right.clone();
        for k in (0..self.columns).rev() {
            let (row, right) = self.reduced(k);
            let known = row[1..].iter().zip(&solution[k + 1..]).fold(right, |rest, (&r, &x)| rest - x * r);
            solution[k] = known.map(|x| x / row[0]);
        }
        Ok(solution)
    }

    /// The entry of the triangle in row `i` and column `j`.
    fn entry(&self, i: usize, j: usize) -> f64 {
        if i <= j && j < i + self.band { self.triangle[i * self.band + j - i] } else { 0.0 }
    }

    /// The length of a column, which rotations do not change.
    fn column_norm(&self, j: usize) -> f64 {
        let entries = ((j + 1).saturating_sub(self.band)..=j).map(|i| self.entry(i, j));
        entries.fold(0.0, f64::hypot)
    }

    fn rank_by_singular_values(&self) -> usize {
        if self.columns == 0 {
            return 0;
        }
        let norms: Vec<f64> = (0..self.columns).map(|j| self.column_norm(j)).collect();
        let unit = |i, j| if norms[j] > 0.0 { self.entry(i, j) / norms[j] } else { 0.0 };
        let Some(svd) = decomposed(DMatrix::from_fn(self.columns, self.columns, unit), false) else { return 0 };
        let values = svd.singular_values;
        let threshold = values.max() * f64::EPSILON * ROUNDINGS * self.columns as f64;
        values.iter().filter(|&&s| s > threshold).count()
    }

    /// `|R[k][k]|` is the part of column `k` that the columns before it do not span.
    fn rank_by_diagonal(&self) -> usize {
        let threshold = f64::EPSILON * ROUNDINGS * self.band as f64;
        (0..self.columns).filter(|&k| self.entry(k, k).abs() > threshold * self.column_norm(k)).count()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Numbers in [-1, 1) that look random and are always the same.
    fn number(i: usize) -> f64 {
        let mixed = (i as u64 + 1).wrapping_mul(0x9e37_79b9_7f4a_7c15);
        let mixed = (mixed ^ (mixed >> 29)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        (mixed >> 11) as f64 / (1u64 << 52) as f64 - 1.0
    }

    fn coefficients(i: usize, count: usize) -> Vec<f64> {
        (0..count).map(|k| number(31 * i + k)).collect()
    }

    #[test]
    fn residuals_are_orthogonal_to_every_column() {
        for (columns, band) in [(5, 5), (12, 4)] {
            let rows: Vec<_> = (0..60).map(|i| (i * (columns - band + 1) / 60, coefficients(i, band), number(i + 7000))).collect();
            let weight = |i: usize| 0.5 + (i % 3) as f64;
            let mut problem = LeastSquares::<1>::banded(columns, band);
            for (i, (first, a, b)) in rows.iter().enumerate() {
                problem.push(*first, a, Point([*b]), weight(i));
            }
            let x = problem.solve().unwrap();
            let mut gradient = vec![0.0; columns];
            for (i, (first, a, b)) in rows.iter().enumerate() {
                let residual = a.iter().enumerate().map(|(k, a)| a * x[first + k][0]).sum::<f64>() - b;
                a.iter().enumerate().for_each(|(k, a)| gradient[first + k] += weight(i) * a * residual);
            }
            assert!(gradient.iter().all(|g| g.abs() < 1e-13), "{gradient:?}");
        }
    }

    #[test]
    fn the_order_of_the_rows_does_not_matter() {
        let mut forward = LeastSquares::<1>::banded(9, 3);
        let mut backward = forward.clone();
        let push = |problem: &mut LeastSquares<1>, i: usize| problem.push(i % 7, &coefficients(i, 3), Point([number(i + 50)]), 1.0);
        (0..40).for_each(|i| push(&mut forward, i));
        (0..40).rev().for_each(|i| push(&mut backward, i));
        let (x, y) = (forward.solve().unwrap(), backward.solve().unwrap());
        assert!(x.iter().zip(&y).all(|(a, b)| a.distance(*b) < 1e-13));
    }

    #[test]
    fn deficiency_is_counted_and_scale_is_no_deficiency() {
        for band in [3, 2] {
            let mut problem = LeastSquares::<1>::banded(3, band);
            for i in 0..10 {
                let a = coefficients(i, 2);
                problem.push(0, &a, Point([1.0]), 1.0);
            }
            assert_eq!(problem.solve().unwrap_err(), Deficient { rank: 2, columns: 3 }, "band {band}");
            problem.push(1, &[0.5, 1e-200], Point([0.5 + 1e-200]), 1.0);
            assert!(problem.solve().is_ok());
        }
        let mut parallel = LeastSquares::<1>::dense(2);
        for i in 0..1000 {
            parallel.push(0, &[0.1 * number(i), 0.3 * number(i)], Point([number(i + 3)]), 1.0);
        }
        assert_eq!(parallel.solve().unwrap_err().rank, 1);
    }

    /// A Vandermonde matrix of condition 1e8: normal equations would leave no digit.
    #[test]
    fn ill_conditioned_problems_keep_their_digits() {
        let mut problem = LeastSquares::<1>::dense(11);
        for i in 0..40 {
            let t = i as f64 / 39.0;
            let powers: Vec<f64> = (0..11).map(|k| t.powi(k)).collect();
            problem.push(0, &powers, Point([powers.iter().sum()]), 1.0);
        }
        assert!(problem.solve().unwrap().iter().all(|x| (x[0] - 1.0).abs() < 1e-7));
    }
}
