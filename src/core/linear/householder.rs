//! Reflections that take a block of equations into a triangle.

use std::array::{from_mut, from_ref};
use std::hint::black_box;

use crate::core::linear::lanes::LANES;
use crate::core::point::{Point, is_safe, larger, length};

/// One number of each equation.
pub type Column = [f64; LANES];

/// Equations side by side: `columns[k][l]` is the coefficient of unknown `k` in equation `l`.
/// Equations of zeros change nothing.
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

    /// Writes the equation `sum_k coefficients[k] x[first + k] = right` with a weight that is not
    /// negative.
    pub fn put(
        &mut self,
        l: usize,
        first: usize,
        coefficients: &[f64],
        right: Point<D>,
        weight: f64,
    ) {
        let root = weight.sqrt();
        self.columns[first..]
            .iter_mut()
            .zip(coefficients)
            .for_each(|(column, c)| column[l] = c * root);
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

/// Reflects the equations into those of a triangle, `columns` entries for each of its rows from the
/// diagonal on, so that nothing of them is left: the same sums of squares in as many equations as
/// unknowns (Householder 1958; Golub and Van Loan 2013, 5.1 and 5.2.2; rows a block
/// at a time after Lawson and Hanson 1974, chapter 27).
#[multiversion::multiversion(targets("x86_64+avx512f+avx512vl+avx512dq+avx512bw", "x86_64+avx2"))]
pub(crate) fn absorb<const D: usize>(
    triangle: &mut [f64],
    right: &mut [Point<D>],
    block: &mut Block<D>,
) {
    let mut columns = block.columns.as_mut_slice();
    for (row, right) in triangle.chunks_exact_mut(right.len().max(1)).zip(right) {
        let ([first, row @ ..], [column, later @ ..]) = (row, columns) else { return };
        if let Some(share) = reflector(first, column) {
            let count = row.len().min(later.len());
            let ((tops, top), (others, other)) =
                (row[..count].as_chunks_mut(), later[..count].as_chunks_mut());
            tops.iter_mut()
                .zip(others)
                .for_each(|(tops, others)| reflect::<TOGETHER>(column, share, tops, others));
            top.iter_mut()
                .zip(other)
                .for_each(|(top, other)| reflect(column, share, from_mut(top), from_mut(other)));
            reflect(column, share, &mut right.0, &mut block.right);
        }
        columns = later;
    }
}

/// So many columns are reflected at once, so that none waits for the sum of another.
const TOGETHER: usize = 4;

/// The vector `(1, column)` and the factor of the reflection that makes `column` vanish under
/// `top`: no entry is larger than 1. `None` where it is zero already.
#[inline(always)]
fn reflector(top: &mut f64, column: &mut Column) -> Option<f64> {
    let [square] = dots(column, from_ref(column));
    if square == 0.0 && column.iter().all(|&x| x == 0.0) {
        return None;
    }
    let all = square + *top * *top;
    let length =
        if is_safe(all) { all.sqrt() } else { length(column.iter().copied().chain([*top])) };
    let image = -length.copysign(*top);
    let divisor = *top - image;
    if is_safe(all) {
        let factor = 1.0 / divisor;
        column.iter_mut().for_each(|x| *x *= factor);
    } else {
        column.iter_mut().for_each(|x| *x /= divisor);
    }
    let share = -divisor / image;
    *top = image;
    Some(share)
}

#[inline(always)]
fn reflect<const N: usize>(
    column: &Column,
    share: f64,
    tops: &mut [f64; N],
    others: &mut [Column; N],
) {
    let sums = dots(column, others);
    for ((top, other), sum) in tops.iter_mut().zip(others).zip(sums) {
        let along = share * (*top + sum);
        *top -= along;
        other.iter_mut().zip(column).for_each(|(x, c)| *x -= along * c);
    }
}

/// Each in eight sums, whatever the registers hold.
#[inline(always)]
pub(crate) fn dots<const N: usize>(a: &Column, others: &[Column; N]) -> [f64; N] {
    let mut sums = [[0.0; 8]; N];
    for i in (0..LANES).step_by(8) {
        for (sums, b) in sums.iter_mut().zip(others) {
            *sums = std::array::from_fn(|l| sums[l] + a[i + l] * b[i + l]);
        }
    }
    // What is done with the sums is not to change how they are summed: the compiler would shuffle
    // every register for it.
    let sums = black_box(sums);
    sums.map(|sums| {
        let [a, b, c, d]: [f64; 4] = std::array::from_fn(|l| sums[l] + sums[l + 4]);
        (a + c) + (b + d)
    })
}

/// The band that cubic splines have.
pub(crate) const BAND: usize = 4;
/// An equation within a band: its coefficients, and its right-hand sides from [`BAND`] on.
pub(crate) type Row = [f64; 2 * BAND];

/// The same for equations whose coefficients lie within the first [`BAND`] columns of a triangle of
/// that band, all sides of an equation in one register.
#[multiversion::multiversion(targets("x86_64+avx512f+avx512vl+avx512dq+avx512bw", "x86_64+avx2"))]
pub(crate) fn absorb_rows<const D: usize>(
    triangle: &mut [[f64; BAND]],
    right: &mut [Point<D>],
    rows: &mut [Row],
) {
    const { assert!(D <= BAND) };
    for (j, (pivot, right)) in triangle.iter_mut().zip(right).enumerate().take(BAND) {
        let largest = rows.iter().fold(0.0, |largest, row| larger(largest, row[j].abs()));
        if largest == 0.0 {
            continue;
        }
        let mut top = Row::default();
        top[j..BAND].copy_from_slice(&pivot[..BAND - j]);
        top[BAND..BAND + D].copy_from_slice(&right.0);
        // A power of two, which changes no digit, so that no product overflows or vanishes.
        let scale = reciprocal_power(larger(largest, top[j].abs()));
        let (mut sums, mut square) = (Row::default(), 0.0);
        for row in &*rows {
            let part = black_box(row[j]) * scale;
            square += part * part;
            sums = std::array::from_fn(|l| sums[l] + part * row[l]);
        }
        let first = top[j] * scale;
        let image = -(square + first * first).sqrt().copysign(first);
        let divisor = first - image;
        let (share, factor) = (-divisor / image, 1.0 / divisor);
        let along: Row = std::array::from_fn(|l| share * (top[l] + sums[l] * factor));
        let scaled = along.map(|x| x * factor);
        for row in &mut *rows {
            // One row at a time: the compiler would gather a column of many.
            let part = black_box(row[j]) * scale;
            *row = std::array::from_fn(|l| row[l] - part * scaled[l]);
        }
        top = std::array::from_fn(|l| top[l] - along[l]);
        top[j] = image / scale;
        pivot[..BAND - j].copy_from_slice(&top[j..BAND]);
        right.0.copy_from_slice(&top[BAND..BAND + D]);
    }
}

/// One over the power of two below a positive number, as far as there is one.
fn reciprocal_power(x: f64) -> f64 {
    let exponent = (x.to_bits() >> 52).min(2045);
    f64::from_bits((2046 - exponent) << 52)
}
