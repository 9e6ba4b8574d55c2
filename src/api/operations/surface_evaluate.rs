//! `surfaces/evaluate`.

use crate::api::cost::{Cost, Costed, Kind, POINT_BYTES, net};
use crate::api::error::{Error, Locate, both};
use crate::api::json::Request;
use crate::api::operations::Example;
use crate::api::operations::{Operation, Output};
use crate::api::wire::{
    Points, Surface, SurfaceDomain, Tuple, Whole, list, need, part, space_list, whole,
};
use crate::core::context::Context;
use crate::core::limits;
use crate::core::surface as core;

crate::union! {
    /// Where to sample a surface.
    pub struct SurfaceSampling by kind: SurfaceSamplingKind {
        /// How many values of u, equally spaced from end to end; at least 2, and u times v at most
        /// 200,000.
        u: Whole = whole(2, limits::SAMPLES / 2),
        /// How many values of v, equally spaced from end to end; at least 2, and u times v at most
        /// 200,000.
        v: Whole = whole(2, limits::SAMPLES / 2),
        /// Pairs [u, v] inside the domain, in any order; 1 to 200,000.
        values: Vec<Tuple<f64, 2>> = list::<Tuple<f64, 2>>(1, limits::SAMPLES),
    }
    /// A grid: every value of u with every value of v, u changing slowest.
    "grid" Grid as GridSampling: [u, v] [];
    /// Given parameters.
    "parameters" Parameters as SurfaceParameterSampling: [values] [];
}

crate::names! {
    /// A quantity of the surface.
    pub enum SurfaceQuantity {
        /// The unit normal.
        Normal = "normal",
        /// The mean curvature.
        MeanCurvature = "mean-curvature",
        /// The Gaussian curvature.
        GaussianCurvature = "gaussian-curvature",
    }
}

crate::object! {
    /// A surface and where to sample it.
    pub struct SurfaceEvaluateRequest {
        /// The surface.
        required surface: Surface,
        /// Where to sample.
        required at: SurfaceSampling,
        /// How many orders of partial derivatives to return, 0 (the default) to 2, with respect to
        /// the surface's own parameters.
        optional derivatives: Whole = whole(0, 2),
        /// Quantities to return; default none. The normal is the direction of du x dv; the mean
        /// curvature is positive where the surface bends towards its normal.
        optional quantities: Vec<SurfaceQuantity>,
    }
}

crate::answer! {
    /// Samples of a surface; every list but `degenerate` has one entry per pair of parameters.
    /// Derivatives are in the unit of the coordinates / unit of the parameters.
    pub struct SurfaceEvaluateAnswer {
        /// The ranges of the parameters.
        required domain: SurfaceDomain,
        /// The pairs [u, v] sampled.
        required parameters: Vec<Tuple<f64, 2>>,
        /// The points there, 3D.
        required points: Points = space_list(),
        /// First partial derivatives by u, 3D; present from `derivatives` = 1 on.
        optional du: Points = space_list(),
        /// First partial derivatives by v, 3D; present from `derivatives` = 1 on.
        optional dv: Points = space_list(),
        /// Second partial derivatives by u, 3D; present for `derivatives` = 2.
        optional duu: Points = space_list(),
        /// Mixed partial derivatives, 3D; present for `derivatives` = 2.
        optional duv: Points = space_list(),
        /// Second partial derivatives by v, 3D; present for `derivatives` = 2.
        optional dvv: Points = space_list(),
        /// Unit normals, 3D; the zero vector where degenerate.
        optional normal: Points = space_list(),
        /// Mean curvatures, of any sign, in 1 / unit of the coordinates; 0 where degenerate.
        optional mean_curvature: Vec<f64>,
        /// Gaussian curvatures, of any sign, in 1 / unit of the coordinates squared; 0 where
        /// degenerate.
        optional gaussian_curvature: Vec<f64>,
        /// The positions in `parameters`, from 0, at which du and dv are parallel or vanish within
        /// rounding, so that there is no normal and no curvature; present when quantities are asked
        /// for.
        optional degenerate: Vec<Whole>,
    }
}

impl Output for SurfaceEvaluateAnswer {}

/// The request bodies that the specification shows.
pub const EXAMPLES: &[Example] = &[
    Example::new(
        "li-figure-7",
        "alpha = 0.5, beta = 1 in both directions (Li 2014 Figure 7)",
        include_str!("../../../openapi/examples/surfaces-evaluate-li-figure-7.json"),
    ),
    Example::new(
        "mixed-families",
        "beta-bezier along u, bezier along v, with curvatures",
        include_str!("../../../openapi/examples/surfaces-evaluate-mixed-families.json"),
    ),
    Example::new(
        "torus",
        "A sixteenth of a torus, with weights (Piegl and Tiller 1997, section 8.5)",
        include_str!("../../../openapi/examples/surfaces-evaluate-torus.json"),
    ),
];

/// Sample a surface.
#[derive(Debug, Clone, Copy)]
pub struct SurfaceEvaluate;

impl Operation for SurfaceEvaluate {
    type Request = SurfaceEvaluateRequest;
    type Answer = SurfaceEvaluateAnswer;
    const PATH: &str = "/v1/surfaces/evaluate";
    const ID: &str = "evaluateSurface";
    const TAG: &str = "Surfaces";
    const SUMMARY: &str = "Sample a surface";
    const DESCRIPTION: &str = "\
        Points, partial derivatives up to the second, normals and curvatures, on a grid or at \
        given parameters. Cost: linear in samples times the product of the degrees.";
    const ANSWERED: &str = "The samples.";
    const EXAMPLES: &[Example] = EXAMPLES;

    fn compute(
        context: &Context,
        request: SurfaceEvaluateRequest,
    ) -> Result<SurfaceEvaluateAnswer, Error> {
        let (surface, places, orders) =
            parts(context, request.surface, request.at, request.derivatives)?;
        let asked = request.quantities.unwrap_or_default();
        let samples = core::evaluate(context, &surface, &places, orders, quantities(&asked))?;
        let has = |quantity| asked.contains(&quantity);
        let mut derivatives = samples.derivatives.into_iter().map(Points::from);
        Ok(SurfaceEvaluateAnswer {
            domain: surface.domain().into(),
            parameters: samples.parameters.into_iter().map(Tuple).collect(),
            points: samples.points.into(),
            du: derivatives.next(),
            dv: derivatives.next(),
            duu: derivatives.next(),
            duv: derivatives.next(),
            dvv: derivatives.next(),
            normal: has(SurfaceQuantity::Normal).then(|| samples.normals.into()),
            mean_curvature: has(SurfaceQuantity::MeanCurvature).then_some(samples.mean_curvatures),
            gaussian_curvature: has(SurfaceQuantity::GaussianCurvature)
                .then_some(samples.gaussian_curvatures),
            degenerate: (!asked.is_empty())
                .then(|| samples.degenerate.into_iter().map(Whole).collect()),
        })
    }

    fn is_small(request: &SurfaceEvaluateRequest) -> bool {
        let points = |rows: &Vec<Points>| rows.iter().map(Points::len).sum::<usize>();
        let net = request
            .surface
            .as_ref()
            .and_then(|surface| surface.control_net.as_ref())
            .map_or(0, points);
        let grid = |at: &SurfaceSampling| {
            at.u.zip(at.v)
                .map(|(u, v)| u.0.saturating_mul(v.0))
                .or(at.values.as_ref().map(Vec::len))
        };
        net <= 25
            && request.at.as_ref().is_none_or(|at| grid(at).is_some_and(|samples| samples <= 200))
    }
}

impl Costed for SurfaceEvaluateRequest {
    fn cost(&self) -> Cost {
        let each = 1
            + self.derivatives.map_or(0, |orders| 3 * orders.0.min(2))
            + self.quantities.as_ref().map_or(0, Vec::len);
        let samples = self.at.as_ref().map_or(1, |at| {
            let along = |count: Option<Whole>| count.map_or(1, |count| count.0);
            at.values.as_ref().map_or(along(at.u).saturating_mul(along(at.v)), Vec::len)
        });
        let points = samples as f64 * each as f64;
        Cost {
            answer: (POINT_BYTES * points) as usize,
            ..Cost::new(Kind::Surface, points * (100.0 + 2.0 * net(&self.surface)))
        }
    }
}

impl Request for SurfaceEvaluateRequest {
    fn check(self, context: &Context) -> Result<(), Error> {
        parts(context, self.surface, self.at, self.derivatives).map(drop)
    }
}

fn parts(
    context: &Context,
    surface: Option<Surface>,
    at: Option<SurfaceSampling>,
    derivatives: Option<Whole>,
) -> Result<(core::Surface, core::Places, usize), Error> {
    let orders = derivatives.map_or(0, |whole| whole.0);
    let parts = both(
        part(surface, "surface", |value| value.parse(context)),
        part(at, "at", |value| value.parse(context)),
    );
    let ((surface, places), ()) = both(parts, core::check_orders(orders).at("derivatives"))?;
    Ok((surface, places, orders))
}

fn quantities(asked: &[SurfaceQuantity]) -> core::SurfaceQuantities {
    core::SurfaceQuantities {
        normal: asked.contains(&SurfaceQuantity::Normal),
        mean_curvature: asked.contains(&SurfaceQuantity::MeanCurvature),
        gaussian_curvature: asked.contains(&SurfaceQuantity::GaussianCurvature),
    }
}

impl SurfaceSampling {
    fn parse(self, context: &Context) -> Result<core::Places, Error> {
        let places = match self.kind()? {
            SurfaceSamplingKind::Grid => {
                core::Places::Grid(need(self.u, "u")?.0, need(self.v, "v")?.0)
            }
            SurfaceSamplingKind::Parameters => core::Places::Parameters(
                need(self.values, "values")?.into_iter().map(|pair| pair.0).collect(),
            ),
        };
        places.check(context)?;
        Ok(places)
    }
}
