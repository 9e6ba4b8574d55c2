//! The shape matrix of a Quasi-Bezier curve.

use std::ops::Range;

use super::combination::nearest_combination;
use super::data::Data;
use super::freedom::Freedom;
use super::influence::no_influence;
use super::parameters::distinct;
use super::reduced::{Reduced, combine, deficiency, length};
use super::unsolved::Unsolved;
use super::{Ends, Solved, Solver};
use crate::core::argument::Argument;
use crate::core::basis::{Basis, Quasi, ShapeMatrix, ShapeParameters};
use crate::core::context::Context;
use crate::core::curve::Single;
use crate::core::error::Error;
use crate::core::fault::Fault;
use crate::core::linear::least_squares::{Deficient, LeastSquares};
use crate::core::linear::quadratic_program::convex_rows;
use crate::core::point::{Point, magnitude};

/// Weights below this came out of the interior-point method as zeros.
const ZERO_WEIGHT: f64 = 1e-6;
/// Points this close to the hull of the polygon, of size 1, are in it up to rounding.
const ON_HULL: f64 = 1e-10;

/// The shape matrix for a control polygon.
pub(super) struct ShapeFit<const D: usize> {
    degree: usize,
    polygon: Vec<Point<D>>,
}

impl<const D: usize> ShapeFit<D> {
    /// For a degree that is at least the order of the polygon.
    pub(super) fn new(degree: usize, polygon: Vec<Point<D>>) -> Self {
        ShapeFit { degree, polygon }
    }
}

impl<const D: usize> Solver<D> for ShapeFit<D> {
    fn solve(
        &self,
        context: &Context,
        data: &Data<D>,
        parameters: &[f64],
    ) -> Result<Solved<D>, Error> {
        if self.polygon.iter().all(|&p| p == self.polygon[0]) {
            return Err(no_influence("the shape matrix"));
        }
        let origin = centre(&self.polygon);
        let polygon: Vec<_> = self.polygon.iter().map(|&p| p - origin).collect();
        let reduced = Reduced::new(context, data, parameters, self.degree, origin)?;
        let matrix = best_matrix(context, &reduced, &polygon, self.degree, data.ends).map_err(
            |unsolved| {
                unsolved.explained(|deficient| {
                    let inner = |t: &f64| data.ends == Ends::Free || (*t > 0.0 && *t < 1.0);
                    let count = distinct(parameters.iter().copied().filter(inner));
                    let advice = "give more points, or a lower degree";
                    deficiency(deficient, count, "Bezier points of this degree", advice)
                        .at(Argument::Degree)
                        .at(Argument::Solve)
                })
            },
        )?;
        let curve = Single::new(context, quasi_basis(context, &matrix)?, self.polygon.clone())?;
        Ok(Solved { curve, iterations: 1, converged: true, at_bound: false })
    }

    fn freedom(&self, curve: &Single<D>, data: &Data<D>) -> Freedom<D> {
        let matrix = curve.basis().shape_matrix(curve.order());
        Freedom::of_motions(self.degree, on_hull(&matrix, curve.control_points(), data.ends))
    }
}

/// The middle of the polygon's vertices: coordinates counted from there lose no digits to their
/// offset.
pub(super) fn centre<const D: usize>(points: &[Point<D>]) -> Point<D> {
    let share = 1.0 / points.len() as f64;
    points.iter().fold(Point::ZERO, |sum, &p| sum + p * share)
}

/// The basis of a fitted matrix.
pub(super) fn quasi_basis(context: &Context, matrix: &ShapeMatrix) -> Result<Basis, Error> {
    let rows = matrix.rows().map(<[f64]>::to_vec).collect();
    let quasi = Quasi::new(context, ShapeParameters::Matrix { rows }).map_err(|error| match &error.fault {
        Fault::ShapeRank { rank, columns } => Fault::RankDeficient(format!(
            "the best shape matrix has rank {rank} for {columns} control points: on the best curve some of them cannot be told apart; \
             use a control polygon with fewer points, or seek the control points instead"
        ))
        .at(Argument::ControlPoints)
        .at(Argument::Solve),
        _ => error,
    })?;
    Ok(Basis::Quasi(quasi))
}

/// The convex least-squares problem for the Bezier points that are not fixed, in coordinates of
/// size 1.
struct Program<const D: usize> {
    equations: Vec<(Vec<f64>, Point<D>)>,
    polygon: Vec<Point<D>>,
    elevation: ShapeMatrix,
    unknown: Range<usize>,
}

/// The shape matrix whose Bezier points `M P` are best; of those that give the same points, the one
/// whose rows are nearest to those of degree elevation. Coordinates are counted from near the
/// polygon.
pub(super) fn best_matrix<const D: usize>(
    context: &Context,
    reduced: &Reduced<D>,
    polygon: &[Point<D>],
    degree: usize,
    ends: Ends,
) -> Result<ShapeMatrix, Unsolved> {
    let order = polygon.len() - 1;
    let unknown = if ends == Ends::Interpolate { 1..degree } else { 0..degree + 1 };
    let program =
        Program::new(reduced, polygon, ShapeMatrix::elevation(degree, order), unknown.clone());
    let rows = program.solve(context)?;
    let unit = |i: usize, j: usize| f64::from((i == 0 && j == 0) || (i == degree && j == order));
    let entry = |i: usize, j: usize| {
        if unknown.contains(&i) { rows[i - unknown.start][j] } else { unit(i, j) }
    };
    Ok(ShapeMatrix::from_fn(degree + 1, order + 1, entry))
}

impl<const D: usize> Program<D> {
    fn new(
        reduced: &Reduced<D>,
        polygon: &[Point<D>],
        elevation: ShapeMatrix,
        unknown: Range<usize>,
    ) -> Self {
        let size = magnitude(polygon);
        let scale = |p: Point<D>| if size > 0.0 { p.map(|x| x / size) } else { p };
        let last = polygon[polygon.len() - 1];
        let degree = elevation.degree();
        let norm = reduced.norm();
        let equation = |(row, right): (&[f64], Point<D>)| {
            let known = if unknown.start > 0 {
                polygon[0] * row[0] + last * row[degree]
            } else {
                Point::ZERO
            };
            (
                row[unknown.clone()].iter().map(|r| r / norm).collect(),
                scale(right - known).map(|x| x / norm),
            )
        };
        let equations = reduced.equations().map(equation).collect();
        Program {
            equations,
            polygon: polygon.iter().map(|&p| scale(p)).collect(),
            elevation,
            unknown,
        }
    }

    /// One row of weights per unknown Bezier point.
    fn solve(&self, context: &Context) -> Result<Vec<Vec<f64>>, Unsolved> {
        let finite = |p: &Point<D>| p.is_finite();
        if !self.polygon.iter().all(finite)
            || !self.equations.iter().all(|(_, right)| finite(right))
        {
            // Coordinates at the end of the range of a double: the error, once measured, says so.
            return Ok(self.unknown.clone().map(|i| self.elevation.row(i).to_vec()).collect());
        }
        let unbounded = self.unbounded()?;
        let rows = self.combinations(context, &unbounded)?;
        if self.off_hull(&rows, &unbounded) <= ON_HULL {
            return Ok(rows);
        }
        let inner = convex_rows(context, &self.equations, &self.polygon);
        // A program that was stopped is none that failed.
        context.checkpoint()?;
        Ok(match inner {
            Some(inner) => self.polished(context, &inner)?,
            None => rows,
        })
    }

    /// The best Bezier points if the hull of the polygon did not bind them.
    fn unbounded(&self) -> Result<Vec<Point<D>>, Deficient> {
        let mut problem = LeastSquares::dense(self.unknown.len());
        self.equations.iter().for_each(|(row, right)| problem.push(0, row, *right, 1.0));
        problem.solve()
    }

    /// For each Bezier point the weights that give it and are nearest to degree elevation.
    fn combinations(&self, context: &Context, bezier: &[Point<D>]) -> Result<Vec<Vec<f64>>, Error> {
        let row = |(i, &q): (usize, &Point<D>)| {
            context.checkpoint()?;
            Ok(nearest_combination(&self.polygon, q, self.elevation.row(self.unknown.start + i)))
        };
        bezier.iter().enumerate().map(row).collect()
    }

    fn bezier(&self, rows: &[Vec<f64>]) -> Vec<Point<D>> {
        rows.iter().map(|row| combine(row, &self.polygon)).collect()
    }

    /// How far Bezier points are from what the weights give.
    fn off_hull(&self, rows: &[Vec<f64>], bezier: &[Point<D>]) -> f64 {
        self.bezier(rows).iter().zip(bezier).map(|(a, &b)| a.distance(b)).fold(0.0, f64::max)
    }

    fn error(&self, rows: &[Vec<f64>]) -> f64 {
        let bezier = self.bezier(rows);
        length(
            &self
                .equations
                .iter()
                .map(|(row, right)| combine(row, &bezier) - *right)
                .collect::<Vec<_>>(),
        )
    }

    /// The interior point's solution with all digits: its zeros tell the face of the hull each
    /// Bezier point lies on, and on those faces the problem is linear. Kept only where it is no
    /// worse.
    fn polished(&self, context: &Context, inner: &[Vec<f64>]) -> Result<Vec<Vec<f64>>, Error> {
        let plain = self.combinations(context, &self.bezier(inner))?;
        let bezier = match self.on_faces(context, inner) {
            Ok(bezier) => bezier,
            Err(Unsolved::Deficient(_)) => return Ok(plain),
            Err(Unsolved::Stopped(error)) => return Err(error),
        };
        let rows = self.combinations(context, &bezier)?;
        let no_worse = self.error(&rows) <= self.error(&plain) * (1.0 + 1e-9);
        Ok(if no_worse && self.off_hull(&rows, &bezier) <= ON_HULL { rows } else { plain })
    }

    /// Least squares with each Bezier point free on the flat of the vertices it has weight on.
    fn on_faces(&self, context: &Context, inner: &[Vec<f64>]) -> Result<Vec<Point<D>>, Unsolved> {
        let flats: Vec<_> = inner.iter().map(|row| Flat::new(&self.polygon, row)).collect();
        let columns = flats.iter().map(|flat| flat.directions.len()).sum();
        let mut problem = LeastSquares::<1>::dense(columns);
        for (row, right) in &self.equations {
            context.checkpoint()?;
            let rest = row.iter().zip(&flats).fold(*right, |rest, (&r, flat)| rest - flat.base * r);
            for axis in 0..D {
                let coefficients = row
                    .iter()
                    .zip(&flats)
                    .flat_map(|(r, flat)| flat.directions.iter().map(move |e| r * e[axis]));
                problem.push(0, &coefficients.collect::<Vec<_>>(), Point([rest[axis]]), 1.0);
            }
        }
        let solution = problem.solve()?;
        let mut along = solution.iter();
        let point = |flat: &Flat<D>| {
            flat.directions.iter().zip(along.by_ref()).fold(flat.base, |q, (&e, y)| q + e * y[0])
        };
        Ok(flats.iter().map(point).collect())
    }
}

/// How the Bezier points of a matrix may move without leaving the faces of the hull that they lie
/// on.
pub(super) fn on_hull<const D: usize>(
    matrix: &ShapeMatrix,
    polygon: &[Point<D>],
    ends: Ends,
) -> Vec<Vec<Point<D>>> {
    let (origin, degree) = (centre(polygon), matrix.degree());
    let size = polygon.iter().map(|&p| (p - origin).max_abs()).fold(f64::MIN_POSITIVE, f64::max);
    let polygon: Vec<_> = polygon.iter().map(|&p| (p - origin).map(|x| x / size)).collect();
    let unknown = if ends == Ends::Interpolate { 1..degree } else { 0..degree + 1 };
    let motion = |i: usize, e: Point<D>| {
        (0..=degree).map(|k| if k == i { e } else { Point::ZERO }).collect()
    };
    let of_point = |i: usize| {
        let directions = Flat::new(&polygon, matrix.row(i)).directions;
        directions.into_iter().map(move |e| motion(i, e)).collect::<Vec<_>>()
    };
    unknown.flat_map(of_point).collect()
}

/// The affine hull of the vertices with weight: a point and orthonormal directions.
struct Flat<const D: usize> {
    base: Point<D>,
    directions: Vec<Point<D>>,
}

impl<const D: usize> Flat<D> {
    /// Gram and Schmidt, the longest remainder first.
    fn new(polygon: &[Point<D>], weights: &[f64]) -> Self {
        let vertices: Vec<_> = polygon
            .iter()
            .zip(weights)
            .filter(|&(_, &m)| m > ZERO_WEIGHT)
            .map(|(&p, _)| p)
            .collect();
        let base = vertices[0];
        let mut rest: Vec<_> = vertices.iter().map(|&p| p - base).collect();
        let mut directions = Vec::new();
        while directions.len() < D {
            let Some(&longest) = rest.iter().max_by(|a, b| a.norm().total_cmp(&b.norm())) else {
                break;
            };
            let Some(e) = longest.unit().filter(|_| longest.norm() > ZERO_WEIGHT) else { break };
            directions.push(e);
            rest.iter_mut().for_each(|p| *p = *p - e * p.dot(e));
        }
        Flat { base, directions }
    }
}
