//! `surfaces/subdivide`.

use crate::api::cost::{Cost, Costed, Kind, net};
use crate::api::error::{Error, both};
use crate::api::json::Request;
use crate::api::operations::Example;
use crate::api::operations::subdivide::Form;
use crate::api::operations::{Operation, Output};
use crate::api::wire::{Surface, SurfaceDomain, need, part};
use crate::core::context::Context;
use crate::core::surface as core;

crate::object! {
    /// Where to cut a surface: along lines of constant u and of constant v.
    pub struct SurfaceCuts {
        /// Parameters u inside the domain, strictly increasing; default none. An end of the domain
        /// is no cut.
        optional u: Vec<f64>,
        /// Parameters v inside the domain, strictly increasing; default none. An end of the domain
        /// is no cut.
        optional v: Vec<f64>,
    }
}
crate::nested!(SurfaceCuts);

crate::object! {
    /// A surface and where to cut it.
    pub struct SurfaceSubdivideRequest {
        /// The surface.
        required surface: Surface,
        /// Where to cut.
        required at: SurfaceCuts,
        /// In which bases the pieces are wanted: `auto` (the default) takes the surface's own where
        /// that keeps 8 digits and bezier otherwise; `family` insists and answers 422 where they do
        /// not exist.
        optional form: Form,
    }
}

crate::answer! {
    /// A piece of a surface.
    pub struct SurfacePiece {
        /// The part of the whole surface's domain that the piece covers.
        required domain: SurfaceDomain,
        /// The piece, over the domain of its own bases: its parameters run in proportion to those
        /// of the whole.
        required surface: Surface,
    }
}
crate::nested!(answer SurfacePiece);

crate::answer! {
    /// The pieces.
    pub struct SurfaceSubdivideAnswer {
        /// The pieces, u changing slowest; together they are the surface.
        required pieces: Vec<SurfacePiece>,
        /// The form of the pieces: `family` or `bezier`.
        required form: Form,
        /// By how much the control points may amplify relative rounding errors, 1 or more: the
        /// product of the 2-norm condition numbers of the two shape matrices; 1 for bezier pieces.
        required condition: f64,
    }
}

impl Output for SurfaceSubdivideAnswer {}

/// The request bodies that the specification shows.
pub const EXAMPLES: &[Example] = &[
    Example::new(
        "li-figure-7",
        "alpha = 0.8, beta = 3 in both directions, in quarters (Li 2014 Figure 7)",
        include_str!("../../../openapi/examples/surfaces-subdivide-li-figure-7.json"),
    ),
    Example::new(
        "mixed-families",
        "quasi-bezier along u, beta-bezier along v, as Bezier patches",
        include_str!("../../../openapi/examples/surfaces-subdivide-mixed-families.json"),
    ),
];

/// Cut a surface into pieces.
#[derive(Debug, Clone, Copy)]
pub struct SurfaceSubdivide;

impl Operation for SurfaceSubdivide {
    type Request = SurfaceSubdivideRequest;
    type Answer = SurfaceSubdivideAnswer;
    const PATH: &str = "/v1/surfaces/subdivide";
    const ID: &str = "subdivideSurface";
    const TAG: &str = "Surfaces";
    const SUMMARY: &str = "Cut a surface into pieces";
    const DESCRIPTION: &str = "\
        Along lines of constant u and v, in the bases of the surface or as Bezier patches. \
        Cost: linear in pieces times the cube of the degree.";
    const ANSWERED: &str = "The pieces.";
    const EXAMPLES: &[Example] = EXAMPLES;

    fn compute(
        context: &Context,
        request: SurfaceSubdivideRequest,
    ) -> Result<SurfaceSubdivideAnswer, Error> {
        let (surface, at) = parts(context, request.surface, request.at)?;
        let form = request.form.unwrap_or(Form::Auto).into();
        let pieces = core::subdivide(
            context,
            &surface,
            &at.u.unwrap_or_default(),
            &at.v.unwrap_or_default(),
            form,
        )?;
        let piece = |piece: &core::PatchPiece| SurfacePiece {
            domain: piece.domain.into(),
            surface: (&piece.surface).into(),
        };
        Ok(SurfaceSubdivideAnswer {
            pieces: pieces.pieces.iter().map(piece).collect(),
            form: if pieces.in_family { Form::Family } else { Form::Bezier },
            condition: pieces.condition,
        })
    }
}

impl Costed for SurfaceSubdivideRequest {
    fn cost(&self) -> Cost {
        let cuts = |values: Option<&Vec<f64>>| 1.0 + values.map_or(0, Vec::len) as f64;
        let pieces = self.at.as_ref().map_or(1.0, |at| cuts(at.u.as_ref()) * cuts(at.v.as_ref()));
        Cost::new(Kind::Surface, 200.0 * pieces * net(&self.surface))
    }
}

impl Request for SurfaceSubdivideRequest {
    fn check(self, context: &Context) -> Result<(), Error> {
        parts(context, self.surface, self.at).map(drop)
    }
}

fn parts(
    context: &Context,
    surface: Option<Surface>,
    at: Option<SurfaceCuts>,
) -> Result<(core::Surface, SurfaceCuts), Error> {
    both(part(surface, "surface", |value| value.parse(context)), need(at, "at"))
}
