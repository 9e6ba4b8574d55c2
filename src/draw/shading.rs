//! Surfaces: faces shaded by their normal, the far ones first, with iso-lines over them.

use crate::core::context::Context;
use crate::core::error::Error;
use crate::core::point::Point;
use crate::core::surface::Surface;
use crate::draw::canvas::Canvas;
use crate::draw::frame::Frame;
use crate::draw::palette::lit;
use crate::draw::view::{EYE, nearness, project};

/// Faces along each direction.
const CELLS: usize = 16;
/// Faces between two iso-lines.
const EVERY: usize = 4;
/// Where the light comes from: the left of the eye, from above.
const LIGHT: Point<3> = Point([-0.35, -0.60, 0.72]);

/// A surface cut into faces.
#[derive(Debug)]
pub struct Shaded {
    /// `CELLS + 1` rows of as many points.
    grid: Vec<Vec<Point<3>>>,
    /// The lines of the control net, projected.
    pub net: Vec<Vec<Point<2>>>,
    /// The same in space, in pieces as short as faces are.
    wires: Vec<[Point<3>; 2]>,
}

/// What is drawn of a surface in the order of its distance.
enum Part {
    Face(usize, usize),
    Wire(usize),
}

impl Shaded {
    /// Samples a surface at equal steps.
    ///
    /// # Errors
    /// [`Fault::Cancelled`](crate::core::fault::Fault).
    pub fn of(context: &Context, surface: &Surface) -> Result<Self, Error> {
        let shape = surface.shape();
        let at = |[a, b]: [f64; 2], i: usize| a + (b - a) * i as f64 / CELLS as f64;
        let [u, v] = shape.domain().map(|(a, b)| [a, b]);
        let row = |i: usize| {
            context
                .checkpoint()
                .map(|()| (0..=CELLS).map(|j| shape.at(at(u, i), at(v, j))).collect())
        };
        let grid: Vec<Vec<Point<3>>> = (0..=CELLS).map(row).collect::<Result<_, _>>()?;
        let rows: Vec<Vec<Point<3>>> = surface.rows().map(<[_]>::to_vec).collect();
        let columns = (0..rows[0].len()).map(|j| rows.iter().map(|row| row[j]).collect());
        let lines: Vec<Vec<Point<3>>> = rows.iter().cloned().chain(columns).collect();
        let net = lines.iter().map(|line| line.iter().copied().map(project).collect()).collect();
        Ok(Shaded { wires: wires(&lines), grid, net })
    }

    /// Every point, projected.
    pub fn outline(&self) -> Vec<Point<2>> {
        self.grid.iter().flatten().copied().map(project).collect()
    }

    /// Draws the faces by the painter's algorithm. Each brings its part of the iso-lines, so that
    /// nearer faces cover them; the control net, where it is wanted, is covered in the same way.
    pub fn draw(
        &self,
        context: &Context,
        canvas: &mut Canvas,
        frame: &Frame,
        color: usize,
        net: bool,
    ) {
        let mean = |points: &[Point<3>]| {
            points.iter().map(|&p| nearness(p) / points.len() as f64).sum::<f64>()
        };
        let cells = (0..CELLS).flat_map(|i| (0..CELLS).map(move |j| (i, j)));
        let faces = cells.map(|(i, j)| (mean(&self.corners(i, j)), Part::Face(i, j)));
        let wires = self
            .wires
            .iter()
            .enumerate()
            .filter(|_| net)
            .map(|(i, wire)| (mean(wire), Part::Wire(i)));
        let mut parts: Vec<(f64, Part)> = faces.chain(wires).collect();
        parts.sort_by(|a, b| a.0.total_cmp(&b.0));
        for (_, part) in parts {
            match part {
                Part::Face(i, j) => self.face(context, canvas, frame, color, i, j),
                Part::Wire(i) => {
                    canvas.wire(context, self.wires[i].map(|p| frame.place(project(p))))
                }
            }
        }
    }

    fn face(
        &self,
        context: &Context,
        canvas: &mut Canvas,
        frame: &Frame,
        color: usize,
        i: usize,
        j: usize,
    ) {
        let pixels = self.corners(i, j).map(|p| frame.place(project(p)));
        canvas.face(context, &pixels, &lit(color, self.light(i, j)));
        let edges = iso_edges(i, j, pixels);
        if !edges.is_empty() {
            canvas.edges(context, &edges, &lit(color, 0.12));
        }
    }

    /// The corners of a cell, around it.
    fn corners(&self, i: usize, j: usize) -> [Point<3>; 4] {
        [self.grid[i][j], self.grid[i + 1][j], self.grid[i + 1][j + 1], self.grid[i][j + 1]]
    }

    /// How much light a cell shows, 0 to 1: by the normal on the side that is seen.
    fn light(&self, i: usize, j: usize) -> f64 {
        let [a, b, c, d] = self.corners(i, j);
        let (Some(p), Some(q)) = ((c - a).unit(), (d - b).unit()) else { return 0.5 };
        let Some(normal) = cross(p, q).unit() else { return 0.5 };
        let seen = if normal.dot(EYE) < 0.0 { normal * -1.0 } else { normal };
        (0.5 + 0.5 * seen.dot(LIGHT)).clamp(0.0, 1.0)
    }
}

/// Pieces of the lines, none longer than a sixteenth of the net.
fn wires(lines: &[Vec<Point<3>>]) -> Vec<[Point<3>; 2]> {
    let all = || lines.iter().flatten().copied();
    let size =
        all().map(|p| all().next().map_or(0.0, |first| p.distance(first))).fold(0.0, f64::max);
    let cut = |[a, b]: [Point<3>; 2]| {
        let count =
            (a.distance(b) / size * CELLS as f64).ceil().clamp(1.0, 2.0 * CELLS as f64) as usize;
        (0..count).map(move |i| [i, i + 1].map(|k| a.lerp(b, k as f64 / count as f64)))
    };
    lines.iter().flat_map(|line| line.windows(2)).flat_map(|pair| cut([pair[0], pair[1]])).collect()
}

fn cross(a: Point<3>, b: Point<3>) -> Point<3> {
    Point([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])
}

/// The edges of a cell that lie on iso-lines.
fn iso_edges(i: usize, j: usize, [a, b, c, d]: [Point<2>; 4]) -> Vec<[Point<2>; 2]> {
    let edges = [(i, [a, d]), (i + 1, [b, c]), (j, [a, b]), (j + 1, [d, c])];
    edges.into_iter().filter(|(line, _)| line % EVERY == 0).map(|(_, edge)| edge).collect()
}
