//! Surfaces: faces shaded by their normal, the far ones first, with iso-lines over them.

use super::canvas::Canvas;
use super::frame::Frame;
use super::palette::lit;
use super::view::{EYE, nearness, project};
use crate::core::error::Error;
use crate::core::point::Point;
use crate::core::surface::Surface;
use crate::core::work;

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
}

impl Shaded {
    /// Samples a surface at equal steps.
    ///
    /// # Errors
    /// [`Fault::Cancelled`](crate::core::error::Fault).
    pub fn of(surface: &Surface) -> Result<Self, Error> {
        let patch = surface.patch();
        let at = |[a, b]: [f64; 2], i: usize| a + (b - a) * i as f64 / CELLS as f64;
        let [u, v] = patch.domain().map(|(a, b)| [a, b]);
        let row = |i: usize| work::checkpoint().map(|()| (0..=CELLS).map(|j| patch.at(at(u, i), at(v, j))).collect());
        let rows: Vec<Vec<Point<2>>> = surface.rows().map(|row| row.iter().copied().map(project).collect()).collect();
        let columns = (0..rows[0].len()).map(|j| rows.iter().map(|row| row[j]).collect());
        let net = rows.iter().cloned().chain(columns).collect();
        Ok(Shaded { grid: (0..=CELLS).map(row).collect::<Result<_, _>>()?, net })
    }

    /// Every point, projected.
    pub fn outline(&self) -> Vec<Point<2>> {
        self.grid.iter().flatten().copied().map(project).collect()
    }

    /// Draws the faces by the painter's algorithm. Each brings its part of the iso-lines, so that nearer faces cover them.
    pub fn draw(&self, canvas: &mut Canvas, frame: &Frame, color: usize) {
        let mut cells: Vec<[usize; 2]> = (0..CELLS).flat_map(|i| (0..CELLS).map(move |j| [i, j])).collect();
        let near = |[i, j]: &[usize; 2]| self.corners(*i, *j).iter().map(|&p| nearness(p) / 4.0).sum::<f64>();
        cells.sort_by(|a, b| near(a).total_cmp(&near(b)));
        for [i, j] in cells {
            let pixels = self.corners(i, j).map(|p| frame.place(project(p)));
            canvas.face(&pixels, &lit(color, self.light(i, j)));
            let edges = iso_edges(i, j, pixels);
            if !edges.is_empty() {
                canvas.edges(&edges, &lit(color, 0.12));
            }
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

fn cross(a: Point<3>, b: Point<3>) -> Point<3> {
    Point([a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]])
}

/// The edges of a cell that lie on iso-lines.
fn iso_edges(i: usize, j: usize, [a, b, c, d]: [Point<2>; 4]) -> Vec<[Point<2>; 2]> {
    let edges = [(i, [a, d]), (i + 1, [b, c]), (j, [a, b]), (j + 1, [d, c])];
    edges.into_iter().filter(|(line, _)| line % EVERY == 0).map(|(_, edge)| edge).collect()
}
