//! `surfaces/tessellate`.

use crate::api::cost::{Cost, Costed, Kind, net};
use crate::api::error::{Error, both};
use crate::api::json::Request;
use crate::api::operations::Example;
use crate::api::operations::{Operation, Output};
use crate::api::wire::{Points, Surface, Tuple, Whole, number, part, space_list};
use crate::core::context::Context;
use crate::core::evaluate::check_distance;
use crate::core::surface as core;

crate::object! {
    /// A surface to turn into triangles.
    pub struct SurfaceTessellateRequest {
        /// The surface.
        required surface: Surface,
        /// The largest distance between the triangles and the surface at equal parameters, in the
        /// unit of the coordinates; proved by a bound, not sampled. More than 0.
        required tolerance: f64 = number().exclusive_minimum(Some(0.0)),
    }
}

crate::answer! {
    /// A mesh of triangles that share their vertices, over a grid of cells of two triangles each.
    pub struct SurfaceTessellateAnswer {
        /// How many cells lie along u and along v; (cells along u + 1) times (cells along v + 1)
        /// vertices, at most 200,000.
        required cells: Tuple<Whole, 2>,
        /// The parameters [u, v] of the vertices, u changing slowest.
        required parameters: Vec<Tuple<f64, 2>>,
        /// The vertices, 3D, on the surface.
        required points: Points = space_list(),
        /// Positions of three vertices each, from 0, counter-clockwise seen from the side of the
        /// normal du x dv.
        required triangles: Vec<Tuple<Whole, 3>>,
        /// A bound on the distance between triangles and surface at equal parameters, in the unit
        /// of the coordinates: 0 or more, at most the tolerance.
        required bound: f64 = number().minimum(Some(0.0)),
        /// The tolerance used.
        required tolerance: f64,
    }
}

impl Output for SurfaceTessellateAnswer {}

/// The request bodies that the specification shows.
pub const EXAMPLES: &[Example] = &[
    Example::new(
        "li-figure-7",
        "alpha = 0.5, beta = 1 in both directions (Li 2014 Figure 7)",
        include_str!("../../../openapi/examples/surfaces-tessellate-li-figure-7.json"),
    ),
    Example::new(
        "mixed-families",
        "alpha-beta-bezier along u, bezier along v",
        include_str!("../../../openapi/examples/surfaces-tessellate-mixed-families.json"),
    ),
];

/// Turn a surface into triangles.
#[derive(Debug, Clone, Copy)]
pub struct SurfaceTessellate;

impl Operation for SurfaceTessellate {
    type Request = SurfaceTessellateRequest;
    type Answer = SurfaceTessellateAnswer;
    const PATH: &str = "/v1/surfaces/tessellate";
    const ID: &str = "tessellateSurface";
    const TAG: &str = "Surfaces";
    const SUMMARY: &str = "Turn a surface into triangles";
    const DESCRIPTION: &str = "\
        As few cells of a regular grid as prove the tolerance (Filip et al. 1986); with weights, \
        cells that are cut until their control points prove it. \
        Cost: linear in vertices times the product of the degrees.";
    const ANSWERED: &str = "The mesh.";
    const EXAMPLES: &[Example] = EXAMPLES;

    fn compute(
        context: &Context,
        request: SurfaceTessellateRequest,
    ) -> Result<SurfaceTessellateAnswer, Error> {
        let (surface, tolerance) = parts(context, request.surface, request.tolerance)?;
        let mesh = core::tessellate(context, &surface, tolerance)?;
        Ok(SurfaceTessellateAnswer {
            cells: Tuple(mesh.cells.map(Whole)),
            parameters: mesh.parameters.into_iter().map(Tuple).collect(),
            points: mesh.points.into(),
            triangles: mesh
                .triangles
                .into_iter()
                .map(|corners| Tuple(corners.map(Whole)))
                .collect(),
            bound: mesh.bound,
            tolerance,
        })
    }
}

impl Costed for SurfaceTessellateRequest {
    fn cost(&self) -> Cost {
        Cost::new(Kind::Adaptive, 20_000.0 * net(&self.surface))
    }
}

impl Request for SurfaceTessellateRequest {
    fn check(self, context: &Context) -> Result<(), Error> {
        parts(context, self.surface, self.tolerance).map(drop)
    }
}

fn parts(
    context: &Context,
    surface: Option<Surface>,
    tolerance: Option<f64>,
) -> Result<(core::Surface, f64), Error> {
    let tolerance =
        part(tolerance, "tolerance", |tolerance| check_distance(tolerance).map(|()| tolerance));
    both(part(surface, "surface", |value| value.parse(context)), tolerance)
}
