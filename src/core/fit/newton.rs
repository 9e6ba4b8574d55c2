//! One step for parameters and curve together.
//!
//! Half the sum of squares `F(y, u) = 1/2 sum_i w_i |C(u_i; y) - p_i|^2` has one parameter `u_i`
//! per point, which meets the curve's own unknowns `y` and no other parameter. So the parameters
//! are eliminated from Newton's equations one by one, and a system for `y` remains: `(F_yy - sum_i
//! c_i c_i' / h_i) dy = sum_i c_i g_i / h_i - g_y` with `g_i = r_i . C'_i`, `h_i = |C'_i|^2 + r_i .
//! C''_i` and `c_i = C'_i . V + r_i . V'`, `V = dC/dy`; then `du_i = -(g_i + c_i . dy) / h_i`
//! (Golub and Pereyra 1973; Borges and Pastva 2002). Without the terms in `r_i` this is
//! the step of Gauss and Newton, whose matrix is never indefinite.

use nalgebra::{Cholesky, DMatrix, DVector};

use super::freedom::Freedom;
use super::offsets::{Offsets, Scene, along, dot};
use crate::core::context::Context;
use crate::core::error::Error;
use crate::core::linear::householder::{Block, Column, dots};
use crate::core::linear::lanes::LANES;
use crate::core::linear::least_squares::LeastSquares;
use crate::core::point::{Point, larger};

/// A point whose curvature term is below this part of `|C'|^2` is taken without it.
const LEAST_CURVATURE: f64 = 0.1;
/// Slower than this, with data of size 1, the curve stands still.
const STANDSTILL: f64 = 1e-8;
/// Pivots below this part of the largest are rounding.
const RIDGE: f64 = 1e-14;

/// Which matrix a step uses.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Matrix {
    /// With second derivatives: fast near a minimum, and perhaps indefinite.
    Newton,
    /// Without.
    Gauss,
}

/// Functions that are orthonormal over the points, for the motions of a curve.
pub(super) struct Space<const D: usize> {
    /// Bernstein coefficients of the functions, one in each column.
    functions: DMatrix<f64>,
    /// Each motion as vectors for the functions; see [`Freedom`].
    motions: Option<Vec<Vec<Point<D>>>>,
}

/// Sums over all points.
pub(super) struct Sums {
    gram: DMatrix<f64>,
    cross: DMatrix<f64>,
    right: DVector<f64>,
    slope: DVector<f64>,
}

/// A step, and by how much it should lower half the sum of squares.
pub(super) struct NewtonStep<const D: usize> {
    pub(super) parameters: Vec<f64>,
    pub(super) decrease: f64,
    /// The Bezier points of the change of the curve, in units of the scene.
    pub(super) change: Vec<Point<D>>,
}

/// A curve with the parameters of the points.
pub(super) struct At<'a, const D: usize> {
    pub(super) scene: &'a Scene<'a, D>,
    /// Bezier points of the curve and its derivatives, from [`Scene::derivatives`].
    pub(super) derivatives: [Vec<Point<D>>; 3],
    pub(super) parameters: &'a [f64],
}

impl<const D: usize> Space<D> {
    /// Orthonormal up to rounding, by reflections. Where the points do not tell the functions
    /// apart, as they are.
    pub(super) fn new(context: &Context, freedom: Freedom<D>, at: &At<D>) -> Result<Self, Error> {
        let Freedom { functions, motions } = freedom;
        let count = functions.ncols();
        let mut problem = LeastSquares::<1>::dense(count);
        for offsets in at.blocks() {
            context.checkpoint()?;
            problem.push_block(Block {
                columns: combined(&offsets.basis, &functions),
                right: [[0.0; LANES]],
            });
        }
        let mut triangle = DMatrix::zeros(count, count);
        for (k, (row, _)) in problem.reduced().enumerate() {
            row.iter().enumerate().for_each(|(j, &x)| triangle[(k, k + j)] = x);
        }
        let largest = triangle.diagonal().iter().fold(0.0, |m, x| larger(m, x.abs()));
        let independent = triangle.diagonal().iter().all(|x| x.abs() > RIDGE * largest);
        let space = Space { functions, motions };
        Ok(if independent { space.turned(&triangle).unwrap_or(space) } else { space })
    }

    /// The functions as they are.
    pub(super) fn plain(freedom: Freedom<D>) -> Self {
        Space { functions: freedom.functions, motions: freedom.motions }
    }

    /// The same motions in functions `R^-T f`.
    fn turned(&self, triangle: &DMatrix<f64>) -> Option<Self> {
        let transposed =
            triangle.transpose().solve_lower_triangular(&self.functions.transpose())?;
        let turn = |motion: &Vec<Point<D>>| {
            let row = |k: usize| {
                (k..motion.len()).fold(Point::ZERO, |sum, j| sum + motion[j] * triangle[(k, j)])
            };
            (0..motion.len()).map(row).collect()
        };
        let motions = self.motions.as_ref().map(|motions| motions.iter().map(turn).collect());
        Some(Space { functions: transposed.transpose(), motions })
    }

    /// The system for the motions from that for all functions along all axes.
    fn reduced(&self, full: DMatrix<f64>, right: DVector<f64>) -> (DMatrix<f64>, DVector<f64>) {
        let Some(motions) = &self.motions else { return (full, right) };
        let t = DMatrix::from_fn(full.nrows(), motions.len(), |z, j| motions[j][z / D][z % D]);
        let product = |a: &DMatrix<f64>| {
            DMatrix::from_fn(t.ncols(), a.ncols(), |j, z| t.column(j).dot(&a.column(z)))
        };
        let half = product(&full);
        (product(&half.transpose()), DVector::from_fn(t.ncols(), |j, _| t.column(j).dot(&right)))
    }

    /// The Bezier points of a change of the curve.
    fn change(&self, y: &DVector<f64>) -> Vec<Point<D>> {
        let vector = |k: usize| match &self.motions {
            None => Point(std::array::from_fn(|a| y[k * D + a])),
            Some(motions) => {
                motions.iter().zip(y.iter()).fold(Point::ZERO, |sum, (m, &y)| sum + m[k] * y)
            }
        };
        let vectors: Vec<_> = (0..self.functions.ncols()).map(vector).collect();
        let bezier = |i: usize| {
            vectors
                .iter()
                .enumerate()
                .fold(Point::ZERO, |sum, (k, &v)| sum + v * self.functions[(i, k)])
        };
        (0..self.functions.nrows()).map(bezier).collect()
    }
}

/// `sum_k basis_k coefficients_kj` for every `j`.
#[multiversion::multiversion(targets("x86_64+avx512f+avx512vl+avx512dq+avx512bw", "x86_64+avx2"))]
fn combined(basis: &[Column], coefficients: &DMatrix<f64>) -> Vec<Column> {
    let mut columns = vec![[0.0; LANES]; coefficients.ncols()];
    for (j, sum) in columns.iter_mut().enumerate() {
        for (k, column) in basis.iter().enumerate() {
            let c = coefficients[(k, j)];
            sum.iter_mut().zip(column).for_each(|(s, b)| *s += c * b);
        }
    }
    columns
}

/// Adds the inner products of columns to the lower half of a matrix.
#[multiversion::multiversion(targets("x86_64+avx512f+avx512vl+avx512dq+avx512bw", "x86_64+avx2"))]
fn add_products(sums: &mut DMatrix<f64>, columns: &[Column]) {
    for (j, column) in columns.iter().enumerate() {
        let (fours, rest) = columns[j..].as_chunks::<4>();
        for (part, four) in fours.iter().enumerate() {
            let products = dots(column, four);
            (0..4).for_each(|i| sums[(j + 4 * part + i, j)] += products[i]);
        }
        for (i, other) in rest.iter().enumerate() {
            sums[(j + 4 * fours.len() + i, j)] += dots(column, std::array::from_ref(other))[0];
        }
    }
}

impl<const D: usize> At<'_, D> {
    fn blocks(&self) -> impl Iterator<Item = Offsets<D>> {
        self.scene.blocks(&self.derivatives, self.parameters)
    }

    /// The largest part of an offset along the curve, where the parameter is free to follow it.
    pub(super) fn steepest(&self, context: &Context) -> Result<f64, Error> {
        let mut steepest = 0.0;
        for offsets in self.blocks() {
            context.checkpoint()?;
            steepest = (0..LANES).fold(steepest, |m, l| larger(m, offsets.tangential(l)));
        }
        Ok(steepest)
    }

    /// Sums the equations over the points. O(points * (D functions)^2).
    pub(super) fn sums(
        &self,
        context: &Context,
        space: &Space<D>,
        matrix: Matrix,
        damping: f64,
    ) -> Result<Sums, Error> {
        let count = space.functions.ncols();
        let mut sums = Sums {
            gram: DMatrix::zeros(count, count),
            cross: DMatrix::zeros(count * D, count * D),
            right: DVector::zeros(count * D),
            slope: DVector::zeros(count * D),
        };
        for offsets in self.blocks() {
            context.checkpoint()?;
            let functions = combined(&offsets.basis, &space.functions);
            let slopes = combined(&offsets.slopes, &space.functions);
            sums.add(&offsets, &functions, &slopes, matrix, damping);
        }
        Ok(sums)
    }

    /// The step of these sums, with so much damping of the curve beside that of the parameters;
    /// none where their matrix is not positive definite.
    pub(super) fn step(
        &self,
        context: &Context,
        space: &Space<D>,
        sums: &Sums,
        matrix: Matrix,
        damping: f64,
        stiffness: f64,
    ) -> Result<Option<NewtonStep<D>>, Error> {
        let Some(y) = sums.solve(space, stiffness) else { return Ok(None) };
        let change = space.change(&y);
        let mut parameters = Vec::with_capacity(self.parameters.len());
        let mut decrease = 0.0;
        for offsets in self.blocks() {
            context.checkpoint()?;
            let moved = along(&offsets.basis, &change);
            let turned = along(&offsets.slopes, &change);
            let start = parameters.len();
            for (l, &t) in self.parameters[start..].iter().take(LANES).enumerate() {
                let bend = Curvature::of(&offsets, l, matrix);
                let mixed = dot(&offsets.tangent, &moved, l)
                    + bend.share * dot(&offsets.offset, &turned, l);
                let slope = if offsets.held[l] { 0.0 } else { offsets.slope(l) };
                let step =
                    if offsets.held[l] { 0.0 } else { -(slope + mixed) / bend.damped(damping) };
                let to = self.scene.moved(t, step);
                let taken = self.scene.part(t, to);
                decrease -= dot(&offsets.offset, &moved, l)
                    + 0.5 * dot(&moved, &moved, l)
                    + taken * (slope + mixed + 0.5 * bend.value * taken);
                parameters.push(to);
            }
        }
        Ok(Some(NewtonStep { parameters, decrease, change }))
    }
}

/// The second derivative with respect to one parameter, as a step takes it.
struct Curvature {
    value: f64,
    speed: f64,
    /// 1 with the terms in the offset, 0 without.
    share: f64,
}

impl Curvature {
    fn of<const D: usize>(offsets: &Offsets<D>, l: usize, matrix: Matrix) -> Self {
        let speed = larger(dot(&offsets.tangent, &offsets.tangent, l), STANDSTILL * STANDSTILL);
        let whole = speed + dot(&offsets.offset, &offsets.bend, l);
        let share = f64::from(matrix == Matrix::Newton && whole > LEAST_CURVATURE * speed);
        Curvature { value: if share > 0.0 { whole } else { speed }, speed, share }
    }

    fn damped(&self, damping: f64) -> f64 {
        self.value + damping * self.speed
    }
}

impl Sums {
    fn add<const D: usize>(
        &mut self,
        offsets: &Offsets<D>,
        functions: &[Column],
        slopes: &[Column],
        matrix: Matrix,
        damping: f64,
    ) {
        let (mut share, mut root, mut slope) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
        for l in (0..LANES).filter(|&l| !offsets.held[l]) {
            let bend = Curvature::of(offsets, l, matrix);
            root[l] = 1.0 / bend.damped(damping).sqrt();
            share[l] = bend.share;
            slope[l] = offsets.slope(l) * root[l];
        }
        let mut mixed = Vec::with_capacity(functions.len() * D);
        for (f, s) in functions.iter().zip(slopes) {
            for (tangent, offset) in offsets.tangent.iter().zip(&offsets.offset) {
                let entry = |l: usize| root[l] * (f[l] * tangent[l] + share[l] * s[l] * offset[l]);
                mixed.push(std::array::from_fn(entry));
            }
        }
        add_products(&mut self.gram, functions);
        add_products(&mut self.cross, &mixed);
        for (z, column) in mixed.iter().enumerate() {
            self.right[z] += dots(&slope, std::array::from_ref(column))[0];
            self.slope[z] +=
                dots(&offsets.offset[z % D], std::array::from_ref(&functions[z / D]))[0];
        }
    }

    /// The change of the unknowns of the curve.
    fn solve<const D: usize>(&self, space: &Space<D>, stiffness: f64) -> Option<DVector<f64>> {
        let size = self.right.len();
        if size == 0 {
            return Some(DVector::zeros(0));
        }
        let lower =
            |a: &DMatrix<f64>, i: usize, j: usize| if i >= j { a[(i, j)] } else { a[(j, i)] };
        let full = DMatrix::from_fn(size, size, |i, j| {
            let gram = if i % D == j % D { lower(&self.gram, i / D, j / D) } else { 0.0 };
            gram - lower(&self.cross, i, j)
        });
        let (mut a, b) = space.reduced(full, &self.right - &self.slope);
        let largest = self.gram.diagonal().max();
        let square =
            |k: usize| if space.motions.is_none() { self.gram[(k / D, k / D)] } else { largest };
        (0..a.nrows()).for_each(|k| a[(k, k)] += RIDGE * largest + stiffness * square(k));
        if !a.iter().chain(b.iter()).all(|x| x.is_finite()) {
            return None;
        }
        Some(Cholesky::new(a)?.solve(&b))
    }
}
