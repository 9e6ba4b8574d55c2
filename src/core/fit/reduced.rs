//! Data as linear equations for the Bezier points of one segment.

use super::data::Data;
use super::unsolved::Unsolved;
use crate::core::basis::ShapeMatrix;
use crate::core::context::Context;
use crate::core::error::Error;
use crate::core::fault::Fault;
use crate::core::linear::householder::Column;
use crate::core::linear::lanes::{LANES, bernstein};
use crate::core::linear::least_squares::{Block, Deficient, LeastSquares};
use crate::core::point::{self, Point};

/// One equation per point: `sum_i B_i(u) Q_i = p`, coordinates counted from `origin`.
pub(super) fn blocks<'a, const D: usize>(
    data: &'a Data<D>,
    parameters: &'a [f64],
    length: f64,
    degree: usize,
    origin: Point<D>,
) -> impl Iterator<Item = Block<D>> + 'a {
    parameters.chunks(LANES).zip(data.points.chunks(LANES)).enumerate().map(
        move |(part, (parameters, points))| {
            // Lanes without a point keep u = v = 0, where all Bernstein polynomials of a positive
            // degree vanish.
            let (mut u, mut v) = ([0.0; LANES], [0.0; LANES]);
            let mut block = Block { columns: Vec::new(), right: [[0.0; LANES]; D] };
            for (l, (t, &p)) in parameters.iter().zip(points).enumerate() {
                (u[l], v[l]) = (t / length, (length - t) / length);
                block.right.iter_mut().zip((p - origin).0).for_each(|(column, x)| column[l] = x);
            }
            block.columns = bernstein(degree, &u, &v);
            if let Some(weights) = &data.weights {
                block.weigh(&weights[part * LANES..][..points.len()]);
            }
            block
        },
    )
}

/// The data reduced to `degree + 1` equations `R Q = c` that have, up to a constant, the same sum
/// of squares for every curve of the degree, so that a trial of a shape costs O(degree^2).
#[derive(Debug, Clone)]
pub(super) struct Reduced<const D: usize> {
    rows: Vec<Vec<f64>>,
    right: Vec<Point<D>>,
}

impl<const D: usize> Reduced<D> {
    /// O(points * degree^2).
    pub(super) fn new(
        context: &Context,
        data: &Data<D>,
        parameters: &[f64],
        degree: usize,
        origin: Point<D>,
    ) -> Result<Self, Error> {
        let mut problem = LeastSquares::dense(degree + 1);
        for block in blocks(data, parameters, 1.0, degree, origin) {
            context.checkpoint()?;
            problem.push_block(block);
        }
        let full_row = |(k, (entries, right)): (usize, (&[f64], Point<D>))| {
            ([&vec![0.0; k], entries].concat(), right)
        };
        let (rows, right) = problem.reduced().enumerate().map(full_row).unzip();
        Ok(Reduced { rows, right })
    }

    /// The equations, each of weight 1.
    pub(super) fn equations(&self) -> impl Iterator<Item = (&[f64], Point<D>)> {
        self.rows.iter().map(Vec::as_slice).zip(self.right.iter().copied())
    }

    /// The same, side by side.
    pub(super) fn blocks(&self) -> impl Iterator<Item = Block<D>> {
        self.rows.chunks(LANES).zip(self.right.chunks(LANES)).map(|(rows, right)| {
            let mut block = Block::zeros(self.rows.len());
            rows.iter()
                .zip(right)
                .enumerate()
                .for_each(|(l, (row, &right))| block.put(l, 0, row, right, 1.0));
            block
        })
    }

    /// `R Q` for these Bezier points, or vectors.
    pub(super) fn apply(&self, bezier: &[Point<D>]) -> Vec<Point<D>> {
        self.rows.iter().map(|row| combine(row, bezier)).collect()
    }

    /// `R Q - c`.
    pub(super) fn residual(&self, bezier: &[Point<D>]) -> Vec<Point<D>> {
        self.apply(bezier).into_iter().zip(&self.right).map(|(p, &c)| p - c).collect()
    }

    /// The length of `R Q - c`.
    pub(super) fn error(&self, bezier: &[Point<D>]) -> f64 {
        length(&self.residual(bezier))
    }

    /// The Frobenius norm of `R`.
    pub(super) fn norm(&self) -> f64 {
        point::length(self.rows.iter().flatten().copied())
    }
}

/// `sum_i row_i points_i`.
pub(super) fn combine<const D: usize>(row: &[f64], points: &[Point<D>]) -> Point<D> {
    row.iter().zip(points).fold(Point::ZERO, |sum, (&r, &p)| sum + p * r)
}

/// The inner product of two lists of vectors.
pub(super) fn inner<const D: usize>(a: &[Point<D>], b: &[Point<D>]) -> f64 {
    a.iter().zip(b).map(|(&a, &b)| a.dot(b)).sum()
}

/// The Euclidean length of a list of vectors.
pub(super) fn length<const D: usize>(a: &[Point<D>]) -> f64 {
    point::length(a.iter().flat_map(|p| p.0))
}

/// The control points that solve equations for the Bezier points `M P`; with `fixed` the first and
/// the last control point are known.
pub(super) fn solve_for_control_points<const D: usize>(
    context: &Context,
    blocks: impl Iterator<Item = Block<D>>,
    matrix: &ShapeMatrix,
    fixed: Option<(Point<D>, Point<D>)>,
) -> Result<Vec<Point<D>>, Unsolved> {
    let (order, is_identity) = (matrix.order(), matrix.is_identity());
    let unknown = if fixed.is_some() { order - 1 } else { order + 1 };
    let mut problem = LeastSquares::dense(unknown);
    for block in blocks {
        context.checkpoint()?;
        let columns =
            if is_identity { block.columns } else { control_columns(&block.columns, matrix) };
        let mut block = Block { columns, right: block.right };
        if let Some((first, last)) = fixed {
            block.settle(0, first);
            block.settle(order - 1, last);
        }
        problem.push_block(block);
    }
    let mut points = problem.solve()?;
    if let Some((first, last)) = fixed {
        points.insert(0, first);
        points.push(last);
    }
    Ok(points)
}

/// Coefficients of control points from those of Bezier points.
fn control_columns(bezier: &[Column], matrix: &ShapeMatrix) -> Vec<Column> {
    let mut columns = vec![[0.0; LANES]; matrix.order() + 1];
    for (bezier, row) in bezier.iter().zip(matrix.rows()) {
        for (column, &m) in columns.iter_mut().zip(row).filter(|&(_, &m)| m != 0.0) {
            column.iter_mut().zip(bezier).for_each(|(sum, b)| *sum += b * m);
        }
    }
    columns
}

/// Names a deficiency by what causes it: too few parameters, or rounding.
pub(super) fn deficiency(
    deficient: Deficient,
    parameters: usize,
    unknown: &str,
    advice: &str,
) -> Fault {
    let Deficient { rank, columns } = deficient;
    let cause = if parameters < columns {
        format!(
            "the points have {parameters} distinct parameters that bear on {columns} unknown {unknown}"
        )
    } else {
        format!("up to rounding, the points determine only {rank} of {columns} unknown {unknown}")
    };
    Fault::RankDeficient(format!("{cause}, so more than one curve fits best; {advice}"))
}
