//! The shape matrix: how a family's basis functions are made of Bernstein polynomials.

use nalgebra::DMatrix;

use crate::core::linear::singular_values::decomposed;
use crate::core::point::Point;

/// `M` with `degree + 1` rows and `order + 1` columns: `b_j = sum_i M[i][j] B_i^degree`, so that
/// the control points `P` of the family are the Bezier points `Q = M P` (Chen 2013 eq. (8)).
#[derive(Debug, Clone, PartialEq)]
pub struct ShapeMatrix {
    columns: usize,
    /// Row after row.
    entries: Vec<f64>,
}

/// The properties of a basis, one for each of Chen 2013 Propositions 1 to 7.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Properties {
    /// No entry is negative (Proposition 1).
    pub nonnegative: bool,
    /// Every row sums to 1 (Proposition 2).
    pub partition_of_unity: bool,
    /// `m_ij = m_(d-i)(n-j)` (Proposition 3).
    pub symmetric: bool,
    /// Rank `n + 1` (Proposition 4).
    pub linearly_independent: bool,
    /// The matrix is that of degree elevation, so the basis is Bernstein's (Proposition 5, eq.
    /// (18)).
    pub degenerates_to_bernstein: bool,
    /// The curve starts at its first and ends at its last control point (Proposition 6).
    pub interpolates_end_points: bool,
    /// The curve leaves along the first edge of its polygon and arrives along the last (Proposition
    /// 7).
    pub tangent_to_end_edges: bool,
}

/// Whether a row is that of the identity whose 1 is here.
fn is_unit(row: &[f64], at: usize) -> bool {
    row.iter().enumerate().all(|(j, &m)| m == f64::from(j == at))
}

impl ShapeMatrix {
    /// From a function of row and column.
    pub fn from_fn(rows: usize, columns: usize, entry: impl Fn(usize, usize) -> f64) -> Self {
        let mut entries = Vec::with_capacity(rows * columns);
        for i in 0..rows {
            entries.extend((0..columns).map(|j| entry(i, j)));
        }
        ShapeMatrix { columns, entries }
    }

    /// The matrix of degree elevation, Chen 2013 eq. (18): the Bernstein basis of this order,
    /// written in a degree at least as high.
    pub fn elevation(degree: usize, order: usize) -> Self {
        let unit = |j: usize| (0..=order).map(|i| Point([f64::from(i == j)])).collect::<Vec<_>>();
        let columns: Vec<_> =
            (0..=order).map(|j| crate::core::bezier_form::elevate(&unit(j), degree)).collect();
        Self::from_fn(degree + 1, order + 1, |i, j| columns[j][i][0])
    }

    /// The degree `d` of the curve.
    pub fn degree(&self) -> usize {
        self.entries.len() / self.columns - 1
    }

    /// The order `n` of the control polygon.
    pub fn order(&self) -> usize {
        self.columns - 1
    }

    /// One row: the weights of the control points in one Bezier point.
    pub fn row(&self, i: usize) -> &[f64] {
        &self.entries[i * self.columns..(i + 1) * self.columns]
    }

    /// All rows, first to last.
    pub fn rows(&self) -> impl DoubleEndedIterator<Item = &[f64]> + ExactSizeIterator {
        self.entries.chunks_exact(self.columns)
    }

    /// `Q = M P`, in O(d n).
    pub fn apply<const D: usize>(&self, points: &[Point<D>]) -> Vec<Point<D>> {
        let combine =
            |row: &[f64]| row.iter().zip(points).fold(Point::ZERO, |sum, (&m, &p)| sum + p * m);
        self.rows().map(combine).collect()
    }

    /// Chen 2013 eq. (36): the matrix one order and one degree higher.
    /// `m'_ij = m_ij (d + 1 - i) / (d + 1) + m_(i-1)(j-1) i / (d + 1)`.
    pub fn raised(&self) -> Self {
        let rows = self.degree() + 2;
        let height = (rows - 1) as f64;
        let old = |i: usize, j: usize| {
            if i < rows - 1 && j < self.columns { self.row(i)[j] } else { 0.0 }
        };
        Self::from_fn(rows, self.columns + 1, |i, j| {
            let below = if i > 0 && j > 0 { old(i - 1, j - 1) } else { 0.0 };
            old(i, j) * ((rows - 1 - i) as f64 / height) + below * (i as f64 / height)
        })
    }

    /// As a matrix of the linear-algebra library.
    pub fn dense(&self) -> DMatrix<f64> {
        DMatrix::from_row_slice(self.degree() + 1, self.columns, &self.entries)
    }

    /// Singular values, largest first; not numbers where the matrix is not finite.
    fn singular_values(&self) -> Vec<f64> {
        let Some(svd) = decomposed(self.dense(), false) else { return vec![f64::NAN] };
        let mut values: Vec<f64> = svd.singular_values.iter().copied().collect();
        values.sort_by(|a, b| b.total_cmp(a));
        values
    }

    /// The rank, by singular values: those above `d + 1` roundings of the largest count.
    pub fn rank(&self) -> usize {
        let values = self.singular_values();
        let threshold = values[0] * f64::EPSILON * (self.degree() + 1) as f64;
        values.iter().filter(|&&s| s > threshold).count()
    }

    /// The 2-norm condition number; infinite where the smallest singular value vanishes.
    pub fn condition(&self) -> f64 {
        let values = self.singular_values();
        values[0] / values[values.len() - 1]
    }

    /// Whether control points are Bezier points.
    pub fn is_identity(&self) -> bool {
        self.degree() == self.order() && self.rows().enumerate().all(|(i, row)| is_unit(row, i))
    }

    /// Whether first and last row are unit rows, so that segments sharing an end point meet there.
    pub fn interpolates_end_points(&self) -> bool {
        is_unit(self.row(0), 0) && is_unit(self.row(self.degree()), self.order())
    }

    /// Measures every property of Chen 2013 Propositions 1 to 7. Equalities hold to 1e-12.
    pub fn properties(&self) -> Properties {
        let (d, n) = (self.degree(), self.order());
        let close = |a: f64, b: f64| (a - b).abs() <= crate::core::limits::ROW_SUM_TOLERANCE;
        let elevation = if d >= n { Some(Self::elevation(d, n)) } else { None };
        let along_edge = |i: usize, end: usize, next: usize| {
            let row = self.row(i);
            close(row[end] + row[next], 1.0) && !close(row[end], 1.0)
        };
        Properties {
            nonnegative: self.entries.iter().all(|&m| m >= 0.0),
            partition_of_unity: self.rows().all(|row| close(row.iter().sum(), 1.0)),
            symmetric: (0..=d)
                .all(|i| (0..=n).all(|j| close(self.row(i)[j], self.row(d - i)[n - j]))),
            linearly_independent: self.rank() == n + 1,
            degenerates_to_bernstein: elevation
                .is_some_and(|e| e.entries.iter().zip(&self.entries).all(|(&a, &b)| close(a, b))),
            interpolates_end_points: self.interpolates_end_points(),
            tangent_to_end_edges: n > 0
                && d > 0
                && along_edge(1, 0, 1)
                && along_edge(d - 1, n, n - 1),
        }
    }
}
