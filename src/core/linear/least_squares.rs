//! Linear least squares by orthogonal transformations, as rows arrive.
//!
//! Rows are reflected into an upper triangle `R` a block at a time: dense ones as they come, rows
//! within a band as long as they begin in the same column (Lawson and Hanson 1974, chapter 27). A
//! few rows, or rows that come out of order, are rotated in one by one (Givens 1958; Golub and Van
//! Loan 2013, 5.2.5). The normal equations, which would square the condition
//! number, are never formed.

use nalgebra::DMatrix;

pub use crate::core::linear::householder::Block;
use crate::core::linear::householder::{BAND, Row, absorb, absorb_rows};
use crate::core::linear::lanes::LANES;
use crate::core::linear::singular_values::decomposed;
use crate::core::point::{Point, length};

/// Singular values below this many roundings of the largest, times columns, count as zero.
const ROUNDINGS: f64 = 8.0;

/// The problem `min sum_i w_i |a_i x - b_i|^2` with right-hand sides and unknowns in `D`
/// dimensions.
///
/// O(columns * band) memory. A row costs O(columns^2) in a dense problem; within a band O(1) where
/// rows come in the order of their first column, and in any order O(columns).
#[derive(Debug, Clone)]
pub struct LeastSquares<const D: usize> {
    columns: usize,
    dense: bool,
    /// Row `k` holds `R[k][k] .. R[k][k + band - 1]`; the band of a dense problem is all columns.
    triangle: Vec<f64>,
    right: Vec<Point<D>>,
    /// Dense rows that are not in the triangle yet, and how many.
    waiting: Option<(Block<D>, usize)>,
    /// Rows within the band that are not in the triangle yet, all of which begin in one column. No
    /// row has begun in a later one.
    rows: Vec<Row>,
    first: usize,
}

/// Fewer rows are rotated in sooner than reflected.
const FEW: usize = 3;

/// Fewer independent equations than unknowns.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Deficient {
    /// How many unknowns the rows determine.
    pub rank: usize,
    /// How many there are.
    pub columns: usize,
}

impl<const D: usize> LeastSquares<D> {
    /// For rows whose coefficients lie within `band` neighbouring columns. Dense where that is more
    /// than the width of a cubic spline, or all columns.
    pub fn banded(columns: usize, band: usize) -> Self {
        let dense = band > BAND || band >= columns;
        let width = if dense { columns } else { BAND };
        LeastSquares {
            columns,
            dense,
            triangle: vec![0.0; columns * width],
            right: vec![Point::ZERO; columns],
            waiting: None,
            rows: Vec::new(),
            first: 0,
        }
    }

    /// For rows with coefficients anywhere.
    pub fn dense(columns: usize) -> Self {
        Self::banded(columns, columns)
    }

    /// Adds the equation `sum_k coefficients[k] x[first + k] = right` with a weight that is not
    /// negative. At most `band` coefficients, none beyond the last column.
    pub fn push(&mut self, first: usize, coefficients: &[f64], right: Point<D>, weight: f64) {
        if !self.dense {
            return self.push_banded(first, coefficients, right, weight);
        }
        let (mut block, count) =
            self.waiting.take().unwrap_or_else(|| (Block::zeros(self.columns), 0));
        block.put(count, first, coefficients, right, weight);
        self.waiting = Some((block, count + 1));
        if count + 1 == LANES {
            self.absorb_waiting();
        }
    }

    /// Adds many equations to a dense problem.
    pub fn push_block(&mut self, mut block: Block<D>) {
        absorb(&mut self.triangle, &mut self.right, &mut block);
    }

    fn push_banded(&mut self, first: usize, coefficients: &[f64], right: Point<D>, weight: f64) {
        let (root, mut row) = (weight.sqrt(), Row::default());
        row.iter_mut().zip(coefficients).for_each(|(entry, c)| *entry = c * root);
        row[BAND..].iter_mut().zip(right.0).for_each(|(entry, x)| *entry = x * root);
        if first < self.first {
            return self.rotate(first, &row);
        }
        if first > self.first || self.rows.len() == LANES {
            self.absorb_waiting();
            self.first = first;
        }
        self.rows.push(row);
    }

    fn absorb_waiting(&mut self) {
        if let Some((block, _)) = self.waiting.take() {
            self.push_block(block);
        }
        let mut rows = std::mem::take(&mut self.rows);
        if rows.len() < FEW {
            rows.iter().for_each(|row| self.rotate(self.first, row));
        } else {
            absorb_rows(
                &mut self.triangle.as_chunks_mut().0[self.first..],
                &mut self.right[self.first..],
                &mut rows,
            );
        }
        rows.clear();
        self.rows = rows;
    }

    /// Rotates a row within the band into the triangle.
    fn rotate(&mut self, first: usize, row: &Row) {
        let mut right = Point(std::array::from_fn(|k| row[BAND + k]));
        let mut row: [f64; BAND] = std::array::from_fn(|k| row[k]);
        let pivots = self.triangle.as_chunks_mut().0[first..].iter_mut();
        for (pivot, known) in pivots.zip(&mut self.right[first..]) {
            if row[0] != 0.0 {
                rotate(pivot, &mut row, known, &mut right);
            }
            row = [row[1], row[2], row[3], 0.0];
            if row == [0.0; BAND] {
                break;
            }
        }
    }

    /// The same problem in as many equations as unknowns: the rows of the triangle from the
    /// diagonal on, and their right-hand sides.
    pub fn reduced(&mut self) -> impl Iterator<Item = (&[f64], Point<D>)> {
        self.absorb_waiting();
        (0..self.columns).map(|k| (self.triangle_row(k), self.right[k]))
    }

    fn triangle_row(&self, k: usize) -> &[f64] {
        let band = self.band();
        &self.triangle[k * band..][..band.min(self.columns - k)]
    }

    fn band(&self) -> usize {
        if self.dense { self.columns } else { BAND }
    }

    /// The unknowns. O(columns * band), for dense problems O(columns^3) for the rank.
    ///
    /// # Errors
    /// [`Deficient`]: the rows leave some combination of unknowns free, up to rounding. Columns are
    /// compared by direction, so that their scales do not matter.
    pub fn solve(&mut self) -> Result<Vec<Point<D>>, Deficient> {
        self.solve_with_room(0.0)
    }

    /// The same, but refused as well where the rows only just determine the unknowns: where less
    /// than the part `room` of a column is outside the span of those before it, or, in a dense
    /// problem, a singular value is less than that part of the largest.
    ///
    /// # Errors
    /// [`Deficient`].
    pub fn solve_with_room(&mut self, room: f64) -> Result<Vec<Point<D>>, Deficient> {
        self.absorb_waiting();
        let rank = if self.dense {
            self.rank_by_singular_values(room)
        } else {
            self.rank_by_diagonal(room)
        };
        if rank < self.columns {
            return Err(Deficient { rank, columns: self.columns });
        }
        let mut solution = self.right.clone();
        for k in (0..self.columns).rev() {
            let row = self.triangle_row(k);
            let known = row[1..]
                .iter()
                .zip(&solution[k + 1..])
                .fold(solution[k], |rest, (&r, &x)| rest - x * r);
            solution[k] = known.map(|x| x / row[0]);
        }
        Ok(solution)
    }

    /// The entry of the triangle in row `i` and column `j`.
    fn entry(&self, i: usize, j: usize) -> f64 {
        if i <= j && j < i + self.band() { self.triangle[i * self.band() + j - i] } else { 0.0 }
    }

    /// The length of a column, which rotations do not change.
    fn column_norm(&self, j: usize) -> f64 {
        length(((j + 1).saturating_sub(self.band())..=j).map(|i| self.entry(i, j)))
    }

    fn rank_by_singular_values(&self, room: f64) -> usize {
        if self.columns == 0 {
            return 0;
        }
        let norms: Vec<f64> = (0..self.columns).map(|j| self.column_norm(j)).collect();
        let unit = |i, j| if norms[j] > 0.0 { self.entry(i, j) / norms[j] } else { 0.0 };
        let Some(svd) = decomposed(DMatrix::from_fn(self.columns, self.columns, unit), false)
        else {
            return 0;
        };
        let values = svd.singular_values;
        let threshold = values.max() * room.max(f64::EPSILON * ROUNDINGS * self.columns as f64);
        values.iter().filter(|&&s| s > threshold).count()
    }

    /// `|R[k][k]|` is the part of column `k` that the columns before it do not span.
    fn rank_by_diagonal(&self, room: f64) -> usize {
        let threshold = room.max(f64::EPSILON * ROUNDINGS * self.band() as f64);
        (0..self.columns)
            .filter(|&k| self.entry(k, k).abs() > threshold * self.column_norm(k))
            .count()
    }
}

/// Rotates a row against one of the triangle so that its first entry vanishes.
fn rotate<const D: usize>(
    pivot: &mut [f64; BAND],
    row: &mut [f64; BAND],
    known: &mut Point<D>,
    right: &mut Point<D>,
) {
    let length = Point([pivot[0], row[0]]).norm();
    let (c, s) = (pivot[0] / length, row[0] / length);
    for (p, r) in pivot.iter_mut().zip(row) {
        (*p, *r) = (c * *p + s * *r, c * *r - s * *p);
    }
    (*known, *right) = (*known * c + *right * s, *right * c - *known * s);
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
            let rows: Vec<_> = (0..60)
                .map(|i| (i * (columns - band + 1) / 60, coefficients(i, band), number(i + 7000)))
                .collect();
            let weight = |i: usize| 0.5 + (i % 3) as f64;
            let mut problem = LeastSquares::<1>::banded(columns, band);
            for (i, (first, a, b)) in rows.iter().enumerate() {
                problem.push(*first, a, Point([*b]), weight(i));
            }
            let x = problem.solve().unwrap();
            let mut gradient = vec![0.0; columns];
            for (i, (first, a, b)) in rows.iter().enumerate() {
                let residual =
                    a.iter().enumerate().map(|(k, a)| a * x[first + k][0]).sum::<f64>() - b;
                a.iter()
                    .enumerate()
                    .for_each(|(k, a)| gradient[first + k] += weight(i) * a * residual);
            }
            assert!(gradient.iter().all(|g| g.abs() < 1e-13), "{gradient:?}");
        }
    }

    #[test]
    fn the_order_of_the_rows_does_not_matter() {
        let mut forward = LeastSquares::<1>::banded(9, 3);
        let mut backward = forward.clone();
        let push = |problem: &mut LeastSquares<1>, i: usize| {
            problem.push(i % 7, &coefficients(i, 3), Point([number(i + 50)]), 1.0)
        };
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
            assert_eq!(
                problem.solve().unwrap_err(),
                Deficient { rank: 2, columns: 3 },
                "band {band}"
            );
            problem.push(1, &[0.5, 1e-200], Point([0.5 + 1e-200]), 1.0);
            assert!(problem.solve().is_ok());
        }
        let mut parallel = LeastSquares::<1>::dense(2);
        for i in 0..1000 {
            parallel.push(0, &[0.1 * number(i), 0.3 * number(i)], Point([number(i + 3)]), 1.0);
        }
        assert_eq!(parallel.solve().unwrap_err().rank, 1);
    }

    #[test]
    fn columns_and_weights_at_the_ends_of_the_range_change_no_digit() {
        for (columns, band) in [(5, 5), (12, 4)] {
            let solve = |scale: &dyn Fn(usize) -> f64, weight: f64| {
                let mut problem = LeastSquares::<1>::banded(columns, band);
                for i in 0..150 {
                    let first = i * (columns - band + 1) / 150;
                    let a: Vec<f64> = coefficients(i, band)
                        .iter()
                        .enumerate()
                        .map(|(k, a)| a * scale(first + k))
                        .collect();
                    problem.push(first, &a, Point([number(i + 900)]), weight);
                }
                problem.solve().unwrap()
            };
            let plain = solve(&|_| 1.0, 1.0);
            let power = |k: usize| 2f64.powi([-400, 500, 0, -200, 300][k % 5]);
            for weight in [1.0, 1e300, 1e-300] {
                let scaled = solve(&power, weight);
                assert!(
                    (0..columns).all(|k| (scaled[k][0] * power(k) - plain[k][0]).abs() < 1e-12),
                    "{scaled:?}"
                );
            }
        }
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
