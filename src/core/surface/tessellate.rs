//! Triangles close to a surface.

use super::evaluate::spread;
use super::{Direction, Patch, RationalPatch, Shape, Surface};
use crate::core::argument::Argument;
use crate::core::context::Context;
use crate::core::error::{Error, Locate};
use crate::core::evaluate::check_tolerance;
use crate::core::fault::Fault;
use crate::core::homogeneous::{projected, weight};
use crate::core::point::{Point, larger, magnitude};

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
    fn of(patch: &Patch<3>) -> Self {
        let [(a, b), (c, d)] = patch.domain();
        let (u, v) = (patch.derivative(Direction::U), patch.derivative(Direction::V));
        let bend = |jet: &Patch<3>, direction: Direction| jet.derivative(direction).largest_norm();
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

/// How far a cell of a rational patch is from its triangles, and why.
///
/// Let `B` be the bilinear patch through the corners `Q` of the cell. Written over the denominator
/// of `S`, raised by one degree in `u` and `v`, `S - B` is a rational Bezier patch with positive
/// weights whose control vectors are means of differences `P_ij - Q_pq`, `p, q` in {0, 1}. It lies
/// in their convex hull (Farin 2002, section 13.3), so that the longest bounds it at any weights.
/// On the triangles `B` differs from the plane by `v (1 - u) T` or `u (1 - v) T` with the twist
/// `T = Q00 - Q10 - Q01 + Q11`, at most a quarter of its length.
struct Cell {
    /// The bound.
    bound: f64,
    /// How far columns of the control vectors bend along `u`, and rows along `v`.
    bends: [f64; 2],
    /// A quarter of the length of the twist.
    twist: f64,
}

impl Cell {
    fn of(patch: &Patch<4>) -> Self {
        let [m, n] = patch.degrees();
        let rows: Vec<Vec<(Point<3>, f64)>> = patch
            .rows()
            .map(|row| row.iter().map(|&h| (projected(h), weight(h))).collect())
            .collect();
        let corner = |p: usize, q: usize| rows[p * m][q * n].0;
        let corners = [[corner(0, 0), corner(0, 1)], [corner(1, 0), corner(1, 1)]];
        // Bernstein polynomial i of degree d, times that number p of degree 1, is this multiple of
        // number i + p of degree d + 1.
        let share = |d: usize, i: usize, p: usize| {
            (if p == 0 { d + 1 - i } else { i }) as f64 / (d + 1) as f64
        };
        let vector = |i: usize, j: usize| {
            let (mut sum, mut total) = (Point::ZERO, 0.0);
            for (p, q) in [(0, 0), (0, 1), (1, 0), (1, 1)] {
                let factor = share(m, i, p) * share(n, j, q);
                if factor > 0.0 {
                    let (point, w) = rows[i - p][j - q];
                    sum += (point - corners[p][q]) * (w * factor);
                    total += w * factor;
                }
            }
            sum.map(|x| x / total)
        };
        let net: Vec<Vec<Point<3>>> =
            (0..=m + 1).map(|i| (0..=n + 1).map(|j| vector(i, j)).collect()).collect();
        let is_finite = net.iter().flatten().all(|p| p.is_finite());
        let longest = net.iter().flatten().map(|p| p.norm()).fold(0.0, larger);
        let longest = if is_finite { longest } else { f64::INFINITY };
        let twist = 0.25 * (corners[0][0] - corners[1][0] - corners[0][1] + corners[1][1]).norm();
        let columns = (0..=n + 1).map(|j| bend(&super::column(&net, j)));
        Cell {
            bound: longest + twist,
            bends: [columns.fold(0.0, larger), net.iter().map(|row| bend(row)).fold(0.0, larger)],
            twist,
        }
    }

    /// Which directions to cut: that which bends more, and both where they are about the same, as
    /// the fewest cells have the same share of the distance from both.
    fn cuts(&self) -> [bool; 2] {
        let [along_u, along_v] = self.bends;
        let both = self.twist > along_u.max(along_v);
        [both || along_u >= 0.5 * along_v, both || along_v >= 0.5 * along_u]
    }
}

/// How far points are from equally spaced ones on their chord.
fn bend(points: &[Point<3>]) -> f64 {
    let last = points.len() - 1;
    let on_chord = |i: usize| points[0].lerp(points[last], i as f64 / last as f64);
    points.iter().enumerate().map(|(i, &p)| p.distance(on_chord(i))).fold(0.0, larger)
}

/// The parameters of the lines of a grid whose cells are within the tolerance, and the largest bound
/// of a cell. Strips are cut where they have a cell that is not, so that the lines lie close where
/// the weights make the surface run fast.
fn lines(
    context: &Context,
    rational: &RationalPatch,
    tolerance: f64,
) -> Result<([Vec<f64>; 2], f64), Error> {
    let mut lines = rational.patch.domain().map(|(a, b)| vec![a, b]);
    loop {
        let mut parts = [vec![1; lines[0].len() - 1], vec![1; lines[1].len() - 1]];
        let mut largest = 0.0;
        each_cell(context, &rational.patch, [&lines[0], &lines[1]], [0, 0], &mut |patch, at| {
            let cell = Cell::of(patch);
            largest = larger(largest, cell.bound);
            if cell.bound <= tolerance {
                return;
            }
            // The bound is quadratic in the size of small cells; of large ones it says less.
            let ratio = cell.bound / tolerance;
            let count = if ratio < 16.0 { ratio.sqrt().ceil().max(2.0) as usize } else { 2 };
            for axis in (0..2).filter(|&axis| cell.cuts()[axis]) {
                parts[axis][at[axis]] = count.max(parts[axis][at[axis]]);
            }
        })?;
        if largest.is_infinite() {
            return Err(Fault::Overflow.into());
        }
        if parts.iter().flatten().all(|&count| count == 1) {
            return Ok((lines, largest));
        }
        for axis in 0..2 {
            lines[axis] = refined(&lines[axis], &parts[axis]).ok_or_else(|| too_fine(context))?;
        }
        if lines[0].len().saturating_mul(lines[1].len()) > context.limits.samples {
            return Err(too_fine(context));
        }
    }
}

/// The lines with each interval in so many parts; `None` where doubles are too coarse for that.
fn refined(lines: &[f64], parts: &[usize]) -> Option<Vec<f64>> {
    let mut finer = vec![lines[0]];
    for (ends, &count) in lines.windows(2).zip(parts) {
        let (a, b) = (ends[0], ends[1]);
        finer.extend((1..count).map(|i| a + (b - a) * (i as f64 / count as f64)));
        finer.push(b);
    }
    finer.windows(2).all(|pair| pair[0] < pair[1]).then_some(finer)
}

/// Visits the cells between lines, each as a patch with its position.
fn each_cell(
    context: &Context,
    patch: &Patch<4>,
    lines: [&[f64]; 2],
    first: [usize; 2],
    visit: &mut impl FnMut(&Patch<4>, [usize; 2]),
) -> Result<(), Error> {
    let long =
        [Direction::U, Direction::V].into_iter().find(|&axis| lines[axis as usize].len() > 2);
    let Some(direction) = long else {
        context.checkpoint()?;
        visit(patch, first);
        return Ok(());
    };
    let axis = direction as usize;
    let middle = lines[axis].len() / 2;
    let (before, after) = patch.split_near(direction, lines[axis][middle]);
    let (mut left, mut right, mut next) = (lines, lines, first);
    left[axis] = &lines[axis][..=middle];
    right[axis] = &lines[axis][middle..];
    next[axis] += middle;
    each_cell(context, &before, left, first, visit)?;
    each_cell(context, &after, right, next, visit)
}

/// A mesh that stays within a tolerance of the surface, by a bound. Its vertices lie on the
/// surface, and along each edge of the parameter rectangle on the curve there: where opposite edges
/// of the surface coincide, so do their vertices. O(vertices * degree^2).
///
/// # Errors
/// At `tolerance`: not positive, below rounding, or so small that the mesh exceeds
/// [`SAMPLES`](crate::core::limits::SAMPLES) vertices.
pub fn tessellate(context: &Context, surface: &Surface, tolerance: f64) -> Result<Mesh, Error> {
    match surface.shape() {
        Shape::Polynomial(patch) => {
            check_tolerance(tolerance, patch.magnitude()).at(Argument::Tolerance)?;
            let bends = Bends::of(&patch);
            let Some([m, n]) = bends.cells(tolerance, context.limits.samples) else {
                return Err(too_fine(context));
            };
            let lines =
                [(0, m), (1, n)].map(|(axis, cells)| spread(patch.domain()[axis], cells + 1));
            mesh(context, &patch, lines, bends.bound(m, n), |p| p)
        }
        Shape::Rational(rational) => {
            let largest = magnitude(&Shape::Rational(rational.clone()).hull());
            check_tolerance(tolerance, largest).at(Argument::Tolerance)?;
            let (lines, bound) = lines(context, &rational, tolerance)?;
            mesh(context, &rational.patch, lines, bound, |h| rational.placed(h))
        }
    }
}

fn too_fine(context: &Context) -> Error {
    let advice = "Raise the tolerance, or cut the surface first";
    let (what, count, most) =
        ("vertices or more are needed", context.limits.samples + 1, context.limits.samples);
    Fault::TooLarge { what, count, most, advice }.at(Argument::Tolerance)
}

/// The mesh whose vertices have these parameters.
fn mesh<const D: usize>(
    context: &Context,
    patch: &Patch<D>,
    [us, vs]: [Vec<f64>; 2],
    bound: f64,
    placed: impl Fn(Point<D>) -> Point<3>,
) -> Result<Mesh, Error> {
    let [m, n] = [us.len() - 1, vs.len() - 1];
    let in_u = context.collect(us.iter().map(|&u| patch.weights(Direction::U, u)))?;
    let in_v = context.collect(vs.iter().map(|&v| patch.weights(Direction::V, v)))?;
    Ok(Mesh {
        cells: [m, n],
        parameters: us.iter().flat_map(|&u| vs.iter().map(move |&v| [u, v])).collect(),
        points: context
            .collect(in_u.iter().flat_map(|u| in_v.iter().map(|v| placed(patch.combine(u, v)))))?,
        triangles: (0..m)
            .flat_map(|i| (0..n).flat_map(move |j| cell(i * (n + 1) + j, n + 1)))
            .collect(),
        bound,
    })
}

/// The two triangles of the cell whose first vertex has this position, in rows of so many vertices.
fn cell(first: usize, row: usize) -> [[usize; 3]; 2] {
    [[first, first + row, first + row + 1], [first, first + row + 1, first + 1]]
}
