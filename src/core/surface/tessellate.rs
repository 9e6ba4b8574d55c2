//! Triangles close to a surface.

use super::evaluate::spread;
use super::{Direction, Patch, Surface};
use crate::core::error::{At, Error, at_most};
use crate::core::evaluate::check_tolerance;
use crate::core::limits;
use crate::core::point::Point;

/// A mesh of triangles that share their vertices.
#[derive(Debug, Clone, PartialEq)]
pub struct Mesh {
    /// How many cells lie along `u` and `v`; each is two triangles.
    pub cells: [usize; 2],
    /// The parameters of the vertices, `u` changing slowest.
    pub parameters: Vec<[f64; 2]>,
    /// The vertices.
    pub points: Vec<Point<3>>,
    /// Positions of three vertices each, counter-clockwise seen from the side of the normal `S_u x S_v`.
    pub triangles: Vec<[usize; 3]>,
    /// A bound on the distance between mesh and surface at equal parameters; at most the tolerance.
    pub bound: f64,
}

/// The largest second derivatives with respect to parameters scaled to [0, 1], bounded by their Bezier points.
struct Bends {
    uu: f64,
    uv: f64,
    vv: f64,
}

impl Bends {
    fn of(patch: &Patch) -> Self {
        let [(a, b), (c, d)] = patch.domain();
        let (u, v) = (patch.derivative(Direction::U), patch.derivative(Direction::V));
        let bend = |jet: &Patch, direction: Direction| jet.derivative(direction).largest_norm();
        Bends {
            uu: bend(&u, Direction::U) * (b - a) * (b - a),
            uv: bend(&u, Direction::V) * (b - a) * (d - c),
            vv: bend(&v, Direction::V) * (d - c) * (d - c),
        }
    }

    /// How far triangles over `m x n` cells are from the surface: Filip, Magedson and Markot 1986.
    fn bound(&self, m: usize, n: usize) -> f64 {
        let (h, k) = (1.0 / m as f64, 1.0 / n as f64);
        (h * h * self.uu + 2.0 * h * k * self.uv + k * k * self.vv) / 8.0
    }

    /// About the fewest cells that hold the tolerance: as many along `u` and `v` as their bends ask for, where they share it.
    fn cells(&self, tolerance: f64, most: usize) -> [usize; 2] {
        let root = |x: f64| x.sqrt();
        let (along_u, along_v) = (root(self.uu), root(self.vv));
        // A ruled direction bends only by its twist, which is shared evenly.
        let floor = root(self.uv) * 0.5 + 1e-300;
        let (mut x, mut y) = (along_u.max(floor * 0.1), along_v.max(floor * 0.1));
        let at_one = self.uu / (x * x) + 2.0 * self.uv / (x * y) + self.vv / (y * y);
        let scale = root(at_one / (8.0 * tolerance));
        (x, y) = (x * scale, y * scale);
        let count = |x: f64| (x.ceil().max(1.0).min(most as f64 + 1.0)) as usize;
        let [mut m, mut n] = [count(x), count(y)];
        // Where rounding up one side left room, the other may need less.
        while m > 1 && self.bound(m - 1, n) <= tolerance {
            m -= 1;
        }
        while n > 1 && self.bound(m, n - 1) <= tolerance {
            n -= 1;
        }
        while self.bound(m, n) > tolerance && m * n <= most {
            if self.bound(m + 1, n) <= self.bound(m, n + 1) { m += 1 } else { n += 1 }
        }
        [m, n]
    }
}

/// A mesh that stays within a tolerance of the surface, by a bound. Its vertices lie on the surface, and along each edge of the
/// parameter rectangle on the curve there: where two edges of the surface coincide, so do their vertices. O(vertices * degree^2).
///
/// # Errors
/// At `tolerance`: not positive, below rounding, or so small that the mesh exceeds [`limits::SAMPLES`] vertices.
pub fn tessellate(surface: &Surface, tolerance: f64) -> Result<Mesh, Error> {
    let patch = surface.patch();
    check_tolerance(tolerance, patch.magnitude()).at("tolerance")?;
    let bends = Bends::of(&patch);
    let cells = bends.cells(tolerance, limits::SAMPLES);
    let [m, n] = cells;
    let vertices = (m + 1).saturating_mul(n + 1);
    at_most("vertices or more are needed", vertices, limits::SAMPLES, "Raise the tolerance, or cut the surface first").at("tolerance")?;
    let (us, vs) = (spread(patch.domain()[0], m + 1), spread(patch.domain()[1], n + 1));
    let in_u: Vec<_> = us.iter().map(|&u| patch.weights(Direction::U, u)).collect();
    let in_v: Vec<_> = vs.iter().map(|&v| patch.weights(Direction::V, v)).collect();
    Ok(Mesh {
        cells,
        parameters: us.iter().flat_map(|&u| vs.iter().map(move |&v| [u, v])).collect(),
        points: in_u.iter().flat_map(|u| in_v.iter().map(|v| patch.combine(u, v))).collect(),
        triangles: (0..m).flat_map(|i| (0..n).flat_map(move |j| cell(i * (n + 1) + j, n + 1))).collect(),
        bound: bends.bound(m, n),
    })
}

/// The two triangles of the cell whose first vertex has this position, in rows of so many vertices.
fn cell(first: usize, row: usize) -> [[usize; 3]; 2] {
    [[first, first + row, first + row + 1], [first, first + row + 1, first + 1]]
}
