//! The convex program for the shape matrix of a Quasi-Bezier curve.

use clarabel::algebra::CscMatrix;
use clarabel::solver::{
    DefaultSettings, DefaultSolver, IPSolver, NonnegativeConeT, SolverStatus, ZeroConeT,
};

use crate::core::context::Context;
use crate::core::point::Point;

/// What the interior-point method is asked for; it stops earlier where it makes no more progress.
const TOLERANCE: f64 = 1e-12;

/// Where each kind of variable starts in the program's list: weights `m`, Bezier points `Q`,
/// residuals `r`.
struct Layout {
    vertices: usize,
    bezier: usize,
    residual: usize,
    variables: usize,
}

/// The matrix of the constraints, entry by entry.
#[derive(Default)]
struct Entries {
    rows: Vec<usize>,
    columns: Vec<usize>,
    values: Vec<f64>,
}

impl Entries {
    fn push(&mut self, row: usize, column: usize, value: f64) {
        if value != 0.0 {
            self.rows.push(row);
            self.columns.push(column);
            self.values.push(value);
        }
    }
}

/// Rows `m_i` of convex weights that minimize `sum_k |sum_i R_ki Q_i - c_k|^2` with
/// `Q_i = sum_j m_ij P_j`, to the accuracy of an interior-point method; `None` where it fails.
///
/// Residuals are variables of their own, so that `R` is not squared. Coordinates are of size 1.
pub(crate) fn convex_rows<const D: usize>(
    context: &Context,
    equations: &[(Vec<f64>, Point<D>)],
    polygon: &[Point<D>],
) -> Option<Vec<Vec<f64>>> {
    let count = equations.first()?.0.len();
    let vertices = polygon.len();
    let bezier = count * vertices;
    let residual = bezier + count * D;
    let layout = Layout { vertices, bezier, residual, variables: residual + equations.len() * D };
    let (entries, right, equalities) = constraints(equations, polygon, &layout);
    let a = CscMatrix::new_from_triplets(
        right.len(),
        layout.variables,
        entries.rows,
        entries.columns,
        entries.values,
    );
    let squares: Vec<usize> = (residual..layout.variables).collect();
    let p = CscMatrix::new_from_triplets(
        layout.variables,
        layout.variables,
        squares.clone(),
        squares.clone(),
        vec![1.0; squares.len()],
    );
    let cones = [ZeroConeT(equalities), NonnegativeConeT(bezier)];
    let settings = DefaultSettings {
        verbose: false,
        tol_gap_abs: TOLERANCE,
        tol_gap_rel: TOLERANCE,
        tol_feas: TOLERANCE,
        ..Default::default()
    };
    let mut solver =
        DefaultSolver::new(&p, &vec![0.0; layout.variables], &a, &right, &cones, settings).ok()?;
    let until = context.clone();
    solver.set_termination_callback(move |_| until.checkpoint().is_err());
    solver.solve();
    let usable = matches!(
        solver.solution.status,
        SolverStatus::Solved | SolverStatus::AlmostSolved | SolverStatus::InsufficientProgress
    );
    let weights = &solver.solution.x[..bezier];
    let sound = usable && weights.chunks(vertices).all(|row| row.iter().sum::<f64>() > 0.5);
    sound.then(|| weights.chunks(vertices).map(|row| normalized(row.to_vec())).collect())
}

/// `Q_i - sum_j m_ij P_j = 0`, `r_k - sum_i R_ki Q_i = -c_k`, `sum_j m_ij = 1`, and `m >= 0`:
/// entries, right-hand sides, and how many of the rows are equalities.
fn constraints<const D: usize>(
    equations: &[(Vec<f64>, Point<D>)],
    polygon: &[Point<D>],
    layout: &Layout,
) -> (Entries, Vec<f64>, usize) {
    let mut entries = Entries::default();
    let mut right = Vec::new();
    let count = (layout.residual - layout.bezier) / D;
    for (i, axis) in (0..count).flat_map(|i| (0..D).map(move |axis| (i, axis))) {
        entries.push(right.len(), layout.bezier + i * D + axis, 1.0);
        polygon
            .iter()
            .enumerate()
            .for_each(|(j, p)| entries.push(right.len(), i * layout.vertices + j, -p[axis]));
        right.push(0.0);
    }
    for (k, (row, c)) in equations.iter().enumerate() {
        for axis in 0..D {
            entries.push(right.len(), layout.residual + k * D + axis, 1.0);
            row.iter()
                .enumerate()
                .for_each(|(i, r)| entries.push(right.len(), layout.bezier + i * D + axis, -r));
            right.push(-c[axis]);
        }
    }
    for i in 0..count {
        (0..layout.vertices).for_each(|j| entries.push(right.len(), i * layout.vertices + j, 1.0));
        right.push(1.0);
    }
    let equalities = right.len();
    for m in 0..layout.bezier {
        entries.push(right.len(), m, -1.0);
        right.push(0.0);
    }
    (entries, right, equalities)
}

/// Without what rounding left below 0, and with sum 1.
pub(crate) fn normalized(weights: Vec<f64>) -> Vec<f64> {
    let clean: Vec<f64> = weights.into_iter().map(|m| m.max(0.0)).collect();
    let sum: f64 = clean.iter().sum();
    clean.into_iter().map(|m| m / sum).collect()
}
