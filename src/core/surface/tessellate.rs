//! Triangles close to a surface.

use super::evaluate::spread;
use super::{Direction, Patch, Surface};
use crate::core::argument::Argument;
use crate::core::context::Context;
use crate::core::error::{Error, Locate};
use crate::core::evaluate::check_tolerance;
use crate::core::fault::Fault;
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
    /// Positions of three vertices each, counter-clockwise seen from the side of the normal `S_u x
    /// S_v`.
    pub triangles: Vec<[usize; 3]>,
    /// A bound on the distance between mesh and surface at equal parameters; at most the tolerance.
    pub bound: f64,
}

/// The largest second derivatives with respect to parameters scaled to [0, 1], bounded by their
/// Bezier points.
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

    /// How far triangles over `m x n` cells are from the surface: Filip et al. 1986.
    fn bound(&self, m: usize, n: usize) -> f64 {
        let (h, k) = (1.0 / m as f64, 1.0 / n as f64);
        (h * h * self.uu + 2.0 * h * k * self.uv + k * k * self.vv) / 8.0
    }

    /// The fewest cells along `v` that hold the tolerance with `m` along `u`: the bound is
    /// quadratic in their size. Infinite where none do.
    fn across(&self, m: usize, tolerance: f64) -> f64 {
        let h = 1.0 / m as f64;
        let left = 8.0 * tolerance - h * h * self.uu;
        let twist = h * self.uv;
        // The positive root without cancellation; no bend at all gives one cell.
        let size = left / (twist + (twist * twist + self.vv * left).sqrt());
        if left > 0.0 { (1.0 / size).ceil().max(1.0) } else { f64::INFINITY }
    }

    /// The cells with the fewest vertices that hold the tolerance, if there are any with at most so
    /// many vertices.
    fn cells(&self, tolerance: f64, most: usize) -> Option<[usize; 2]> {
        let mut best: Option<[usize; 2]> = None;
        let mut fewest = most + 1;
        let mut m = 1;
        // Each row has two vertices at least.
        while 2 * (m + 1) < fewest {
            let n = self.across(m, tolerance).min(most as f64) as usize;
            // Rounding may have made it one too few.
            let n = if self.bound(m, n) > tolerance { n + 1 } else { n };
            if (m + 1) * (n + 1) < fewest && self.bound(m, n) <= tolerance {
                (best, fewest) = (Some([m, n]), (m + 1) * (n + 1));
            }
            m += 1;
        }
        best
    }
}

/// A mesh that stays within a tolerance of the surface, by a bound. Its vertices lie on the
/// surface, and along each edge of the parameter rectangle on the curve there: where opposite edges
/// of the surface coincide, so do their vertices. O(vertices * degree^2).
///
/// # Errors
/// At `tolerance`: not positive, below rounding, or so small that the mesh exceeds
/// [`SAMPLES`](crate::core::limits::SAMPLES) vertices.
pub fn tessellate(context: &Context, surface: &Surface, tolerance: f64) -> Result<Mesh, Error> {
    let patch = surface.patch();
    check_tolerance(tolerance, patch.magnitude()).at(Argument::Tolerance)?;
    let bends = Bends::of(&patch);
    let Some([m, n]) = bends.cells(tolerance, context.limits.samples) else {
        let advice = "Raise the tolerance, or cut the surface first";
        let (what, count, most) =
            ("vertices or more are needed", context.limits.samples + 1, context.limits.samples);
        return Err(Fault::TooLarge { what, count, most, advice }.at(Argument::Tolerance));
    };
    let (us, vs) = (spread(patch.domain()[0], m + 1), spread(patch.domain()[1], n + 1));
    let in_u = context.collect(us.iter().map(|&u| patch.weights(Direction::U, u)))?;
    let in_v = context.collect(vs.iter().map(|&v| patch.weights(Direction::V, v)))?;
    Ok(Mesh {
        cells: [m, n],
        parameters: us.iter().flat_map(|&u| vs.iter().map(move |&v| [u, v])).collect(),
        points: context
            .collect(in_u.iter().flat_map(|u| in_v.iter().map(|v| patch.combine(u, v))))?,
        triangles: (0..m)
            .flat_map(|i| (0..n).flat_map(move |j| cell(i * (n + 1) + j, n + 1)))
            .collect(),
        bound: bends.bound(m, n),
    })
}

/// The two triangles of the cell whose first vertex has this position, in rows of so many vertices.
fn cell(first: usize, row: usize) -> [[usize; 3]; 2] {
    [[first, first + row, first + row + 1], [first, first + row + 1, first + 1]]
}
