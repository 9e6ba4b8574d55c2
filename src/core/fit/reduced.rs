//! Data as linear equations for the Bezier points of one segment.

use super::data::Data;
use super::unsolved::Unsolved;
use crate::core::basis::ShapeMatrix;
use crate::core::bezier_form::bernstein;
use crate::core::error::{Error, Fault};
use crate::core::least_squares::{Deficient, LeastSquares};
use crate::core::point::Point;
use crate::core::work::Pace;

/// One equation: coefficients of all Bezier points, right-hand side, weight.
pub(super) type Equation<const D: usize> = (Vec<f64>, Point<D>, f64);

/// One equation per point: `sum_i B_i(u) Q_i = p`, coordinates counted from `origin`.
pub(super) fn equations<'a, const D: usize>(
    data: &'a Data<D>,
    parameters: &'a [f64],
    length: f64,
    degree: usize,
    origin: Point<D>,
) -> impl Iterator<Item = Equation<D>> + 'a {
    let bernstein_at = move |t: f64| bernstein(degree, t / length, (length - t) / length);
    parameters.iter().enumerate().map(move |(i, &t)| (bernstein_at(t), data.points[i] - origin, data.weight(i)))
}

/// The data reduced to `degree + 1` equations `R Q = c` that have, up to a constant, the same sum of
/// squares for every curve of the degree, so that a trial of a shape costs O(degree^2).
#[derive(Debug, Clone)]
pub(super) struct Reduced<const D: usize> {
    rows: Vec<Vec<f64>>,
    right: Vec<Point<D>>,
}

impl<const D: usize> Reduced<D> {
    /// O(points * degree^2).
    pub(super) fn new(data: &Data<D>, parameters: &[f64], degree: usize, origin: Point<D>) -> Result<Self, Error> {
        let mut problem = LeastSquares::dense(degree + 1);
        let mut pace = Pace::default();
        for (row, right, weight) in equations(data, parameters, 1.0, degree, origin) {
            pace.step()?;
            problem.push(0, &row, right, weight);
        }
        let full_row = |k: usize| {
            let (entries, right) = problem.reduced(k);
            ([vec![0.0; k], entries.to_vec()].concat(), right)
        };
        let (rows, right) = (0..=degree).map(full_row).unzip();
        Ok(Reduced { rows, right })
    }

    /// The equations, each of weight 1.
    pub(super) fn equations(&self) -> impl Iterator<Item = Equation<D>> + '_ {
        self.rows.iter().zip(&self.right).map(|(row, &right)| (row.clone(), right, 1.0))
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
        self.rows.iter().flatten().fold(0.0, |norm: f64, &r| norm.hypot(r))
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
    a.iter().fold(0.0, |norm: f64, p| norm.hypot(p.norm()))
}

/// The control points that solve equations for the Bezier points `M P`; with `fixed` the first and
/// the last control point are known.
pub(super) fn solve_for_control_points<const D: usize>(
    equations: impl Iterator<Item = Equation<D>>,
    matrix: &ShapeMatrix,
    fixed: Option<(Point<D>, Point<D>)>,
) -> Result<Vec<Point<D>>, Unsolved> {
    let order = matrix.order();
    let unknown = if fixed.is_some() { 1..order } else { 0..order + 1 };
    let mut problem = LeastSquares::dense(unknown.len());
    let mut pace = Pace::default();
    for (bezier, right, weight) in equations {
        pace.step()?;
        let column = |j: usize| bezier.iter().zip(matrix.rows()).map(|(b, row)| b * row[j]).sum::<f64>();
        let right = fixed.map_or(right, |(first, last)| right - first * column(0) - last * column(order));
        problem.push(0, &unknown.clone().map(column).collect::<Vec<_>>(), right, weight);
    }
    let mut points = problem.solve()?;
    if let Some((first, last)) = fixed {
        points.insert(0, first);
        points.push(last);
    }
    Ok(points)
}

/// Names a deficiency by what causes it: too few parameters, or rounding.
pub(super) fn deficiency(deficient: Deficient, parameters: usize, unknown: &str, advice: &str) -> Fault {
    let Deficient { rank, columns } = deficient;
    let cause = if parameters < columns {
        format!("the points have {parameters} distinct parameters that bear on {columns} unknown {unknown}")
    } else {
        format!("up to rounding, the points determine only {rank} of {columns} unknown {unknown}")
    };
    Fault::RankDeficient(format!("{cause}, so more than one curve fits best; {advice}"))
}
