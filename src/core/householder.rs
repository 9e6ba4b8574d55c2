//! Reflections that take a block of equations into a triangle.

use super::lanes::LANES;
use super::point::{Point, is_safe, length};

/// One number of each equation.
pub type Column = [f64; LANES];

/// Equations side by side: `columns[k][l]` is the coefficient of unknown `k` in equation `l`. Equations of zeros change nothing.
#[derive(Debug, Clone)]
pub struct Block<const D: usize> {
    pub(crate) columns: Vec<Column>,
    pub(crate) right: [Column; D],
}

impl<const D: usize> Block<D> {
    /// Equations of zeros.
    pub fn zeros(columns: usize) -> Self {
        Block { columns: vec![[0.0; LANES]; columns], right: [[0.0; LANES]; D] }
    }

    /// Writes the equation `sum_k coefficients[k] x[first + k] = right` with a weight that is not negative.
    pub fn put(&mut self, l: usize, first: usize, coefficients: &[f64], right: Point<D>, weight: f64) {
        let root = weight.sqrt();
        self.columns[first..].iter_mut().zip(coefficients).for_each(|(column, c)| column[l] = c * root);
        self.right.iter_mut().zip(right.0).for_each(|(column, x)| column[l] = x * root);
    }

    /// Gives the first equations weights that are not negative.
    pub fn weigh(&mut self, weights: &[f64]) {
        for column in self.columns.iter_mut().chain(&mut self.right) {
            column.iter_mut().zip(weights).for_each(|(x, weight)| *x *= weight.sqrt());
        }
    }

    /// Takes an unknown out whose value is known.
    pub fn settle(&mut self, k: usize, value: Point<D>) {
        let column = self.columns.remove(k);
        for (right, x) in self.right.iter_mut().zip(value.0) {
            right.iter_mut().zip(&column).for_each(|(right, c)| *right -= c * x);
        }
    }
}

/// Reflects the equations into those of a triangle, `columns` entries for each of its rows from the diagonal on, so that nothing of
/// them is left: the same sums of squares in as many equations as unknowns (Householder 1958; Golub and Van Loan, Matrix
/// Computations, 5.1 and 5.2.2; rows a block at a time after Lawson and Hanson 1974, chapter 27).
#[multiversion::multiversion(targets("x86_64+avx512f+avx512vl+avx512dq+avx512bw", "x86_64+avx2"))]
pub(crate) fn absorb<const D: usize>(triangle: &mut [f64], right: &mut [Point<D>], mut block: Block<D>) {
    let mut columns = block.columns.as_mut_slice();
    for (row, right) in triangle.chunks_exact_mut(right.len().max(1)).zip(right) {
        let ([first, row @ ..], [column, later @ ..]) = (row, columns) else { return };
        if let Some(share) = reflector(first, column) {
            row.iter_mut().zip(&mut *later).for_each(|(top, other)| reflect(column, share, top, other));
            right.0.iter_mut().zip(&mut block.right).for_each(|(top, other)| reflect(column, share, top, other));
        }
        columns = later;
    }
}

/// The vector `(1, column)` and the factor of the reflection that makes `column` vanish under `top`: no entry is larger than 1.
/// `None` where it is zero already.
#[inline(always)]
fn reflector(top: &mut f64, column: &mut Column) -> Option<f64> {
    let square = dot(column, column);
    if square == 0.0 && column.iter().all(|&x| x == 0.0) {
        return None;
    }
    let all = square + *top * *top;
    let length = if is_safe(all) { all.sqrt() } else { length(column.iter().copied().chain([*top])) };
    let image = -length.copysign(*top);
    column.iter_mut().for_each(|x| *x /= *top - image);
    let share = (image - *top) / image;
    *top = image;
    Some(share)
}

#[inline(always)]
fn reflect(column: &Column, share: f64, top: &mut f64, other: &mut Column) {
    let along = share * (*top + dot(column, other));
    *top -= along;
    other.iter_mut().zip(column).for_each(|(x, c)| *x -= along * c);
}

/// In eight sums, whatever the registers hold.
#[inline(always)]
fn dot(a: &Column, b: &Column) -> f64 {
    let mut sums = [0.0; 8];
    for (a, b) in a.as_chunks::<8>().0.iter().zip(b.as_chunks::<8>().0) {
        sums = std::array::from_fn(|l| sums[l] + a[l] * b[l]);
    }
    let [a, b, c, d]: [f64; 4] = std::array::from_fn(|l| sums[l] + sums[l + 4]);
    (a + c) + (b + d)
}
