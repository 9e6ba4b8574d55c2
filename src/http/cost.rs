//! What a request is expected to cost before it is computed: how much work, of which kind, and how long an answer.
//!
//! Work is counted in nanoseconds on the machine these formulas were measured on. How far this machine and this kind of request are from
//! that is measured while the service runs, see [`super::rates`]: the formulas only have to be right in proportion.

use super::basis::BasisRequest;
use super::continuity::ContinuityRequest;
use super::convert::ConvertRequest;
use super::evaluate::EvaluateRequest;
use super::fit::{FitRequest, SolveKind};
use super::interpolate::InterpolateRequest;
use super::join::JoinRequest;
use super::render::RenderRequest;
use super::reshape::ReshapeRequest;
use super::subdivide::SubdivideRequest;
use super::surface_evaluate::SurfaceEvaluateRequest;
use super::surface_subdivide::SurfaceSubdivideRequest;
use super::surface_tessellate::SurfaceTessellateRequest;
use super::to_bspline::ToBsplineRequest;
use super::wire::{Curve, Points, Surface, Whole};

/// Computations whose time follows one formula.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// So many samples.
    Evaluate,
    /// As many samples, pieces or faces as a tolerance needs.
    Adaptive,
    /// Work in proportion to the segments of curves: subdivide, to-bspline, convert, continuity, basis.
    Segments,
    /// Smoothness kept or made: reshape, join.
    Smooth,
    /// Interpolate.
    Interpolate,
    /// Fits of one segment with all else given.
    FitLinear,
    /// Fits of shape parameters.
    FitShape,
    /// Fits within a tolerance.
    FitTolerance,
    /// Surfaces.
    Surface,
    /// Render.
    Render,
    /// A body too long to be read before it is admitted: of it only the length is known.
    Long,
    /// The same of a fit.
    LongFit,
    /// A part of a batch, of which the same holds.
    Batch,
    /// Whatever else needs a worker.
    Other,
}

/// How many kinds there are.
pub const KINDS: usize = Kind::Other as usize + 1;

/// What a computation is expected to cost.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cost {
    /// By which formula.
    pub kind: Kind,
    /// Nanoseconds on the machine of the formula; more than 0.
    pub work: f64,
    /// About how many bytes the answer has; 0 where that is not known.
    pub answer: usize,
}

impl Cost {
    fn new(kind: Kind, work: f64) -> Self {
        Cost { kind, work: work.max(1.0), answer: 0 }
    }

    /// Of an operation at this path with a body of so many bytes.
    pub fn of_body(path: &str, bytes: usize) -> Self {
        match path {
            "/v1/fit" => Cost::new(Kind::LongFit, 300.0 * bytes as f64),
            _ => Cost::new(Kind::Long, 30.0 * bytes as f64),
        }
    }

    /// Of a part of a batch of so many bytes.
    pub fn of_batch(bytes: usize) -> Self {
        Cost::new(Kind::Batch, 50.0 * bytes as f64)
    }

    /// Of something else.
    pub fn other() -> Self {
        Cost::new(Kind::Other, 1e6)
    }
}

/// A request that can tell.
pub trait Costed {
    /// What it is expected to cost.
    fn cost(&self) -> Cost;
}

fn length(points: Option<&Points>) -> f64 {
    points.map_or(0, Points::len) as f64
}

/// Control points times the order: what an operation does with each segment is at least linear in both.
fn size(curve: &Curve) -> f64 {
    let points = length(curve.control_points.as_ref());
    points * order(curve)
}

fn order(curve: &Curve) -> f64 {
    let points = curve.control_points.as_ref().map_or(0, Points::len);
    curve.order.or(curve.degree).map_or(points, |order| order.0).clamp(1, 64) as f64
}

fn sizes<'a>(curves: impl IntoIterator<Item = &'a Curve>) -> f64 {
    curves.into_iter().map(size).sum()
}

/// Points of the net.
fn net(surface: &Option<Surface>) -> f64 {
    let rows = surface.as_ref().and_then(|surface| surface.control_net.as_ref());
    rows.map_or(0, |rows| rows.iter().map(Points::len).sum()) as f64
}

/// About 20 characters a number, three of them a point.
const POINT_BYTES: f64 = 60.0;

impl Costed for EvaluateRequest {
    fn cost(&self) -> Cost {
        let (size, order) = self.curve.as_ref().map_or((0.0, 1.0), |curve| (size(curve), order(curve)));
        let sampling = self.sampling.as_ref();
        let samples = sampling.and_then(|sampling| sampling.count.map(|count| count.0).or(sampling.values.as_ref().map(Vec::len)));
        let Some(samples) = samples else { return Cost::new(Kind::Adaptive, 20_000.0 * size) };
        let orders = self.derivatives.map_or(0, |orders| orders.0) as f64;
        let each = 1.0 + orders + self.quantities.as_ref().map_or(0, Vec::len) as f64;
        let points = samples as f64 * each;
        let answer = (POINT_BYTES * points) as usize;
        Cost { answer, ..Cost::new(Kind::Evaluate, 20.0 * size + points * (80.0 + 5.0 * order)) }
    }
}

impl Costed for SubdivideRequest {
    fn cost(&self) -> Cost {
        let size = self.curve.as_ref().map_or(0.0, size);
        let cuts = self.at.as_ref();
        let pieces = cuts.and_then(|cuts| cuts.values.as_ref().map(Vec::len).or(cuts.depth.map(|depth| 1 << depth.0.min(20))));
        match pieces {
            Some(pieces) => Cost::new(Kind::Segments, 100.0 * size * (1 + pieces) as f64),
            None => Cost::new(Kind::Adaptive, 20_000.0 * size),
        }
    }
}

impl Costed for ToBsplineRequest {
    fn cost(&self) -> Cost {
        Cost::new(Kind::Segments, 300.0 * self.curve.as_ref().map_or(0.0, size))
    }
}

impl Costed for ConvertRequest {
    fn cost(&self) -> Cost {
        let wider = self.order.map_or(1.0, |order| order.0.max(1) as f64);
        Cost::new(Kind::Segments, 100.0 * self.curve.as_ref().map_or(0.0, size) * wider)
    }
}

impl Costed for ContinuityRequest {
    fn cost(&self) -> Cost {
        Cost::new(Kind::Segments, 300.0 * sizes(self.curve.iter().chain(self.curves.iter().flatten())))
    }
}

impl Costed for BasisRequest {
    fn cost(&self) -> Cost {
        let order = self.order.map_or(1, |order| order.0.min(64)) as f64;
        Cost::new(Kind::Segments, 30.0 * self.count.map_or(100, |count| count.0) as f64 * order * (order + 1.0))
    }
}

impl Costed for ReshapeRequest {
    fn cost(&self) -> Cost {
        let size = self.curve.as_ref().map_or(0.0, |curve| size(curve) * order(curve));
        Cost::new(Kind::Smooth, 300.0 * size)
    }
}

impl Costed for JoinRequest {
    fn cost(&self) -> Cost {
        Cost::new(Kind::Smooth, self.curves.iter().flatten().map(|curve| 300.0 * size(curve) * order(curve)).sum())
    }
}

impl Costed for InterpolateRequest {
    fn cost(&self) -> Cost {
        Cost::new(Kind::Interpolate, 1_500.0 * length(self.points.as_ref()))
    }
}

impl Costed for FitRequest {
    fn cost(&self) -> Cost {
        let points = length(self.points.as_ref());
        let solve = self.solve.as_ref();
        let width = solve.and_then(|solve| solve.order.or(solve.degree)).map_or(4.0, |order| (1 + order.0.min(64)) as f64);
        let rounds = if self.parameter_correction == Some(true) { 30.0 } else { 1.0 };
        let (kind, each) = match solve.and_then(|solve| solve.kind) {
            Some(SolveKind::ControlPoints) | None => (Kind::FitLinear, 20.0 * width * width),
            Some(SolveKind::Shape | SolveKind::Both) => (Kind::FitShape, 2_000.0 * width),
            Some(SolveKind::Tolerance) => (Kind::FitTolerance, 20_000.0),
        };
        Cost::new(kind, rounds * points * each)
    }
}

impl Costed for SurfaceEvaluateRequest {
    fn cost(&self) -> Cost {
        let each = 1 + self.derivatives.map_or(0, |orders| 3 * orders.0.min(2)) + self.quantities.as_ref().map_or(0, Vec::len);
        let samples = self.at.as_ref().map_or(1, |at| {
            let along = |count: Option<Whole>| count.map_or(1, |count| count.0);
            at.values.as_ref().map_or(along(at.u).saturating_mul(along(at.v)), Vec::len)
        });
        let points = samples as f64 * each as f64;
        Cost { answer: (POINT_BYTES * points) as usize, ..Cost::new(Kind::Surface, points * (100.0 + 2.0 * net(&self.surface))) }
    }
}

impl Costed for SurfaceSubdivideRequest {
    fn cost(&self) -> Cost {
        let cuts = |values: Option<&Vec<f64>>| 1.0 + values.map_or(0, Vec::len) as f64;
        let pieces = self.at.as_ref().map_or(1.0, |at| cuts(at.u.as_ref()) * cuts(at.v.as_ref()));
        Cost::new(Kind::Surface, 200.0 * pieces * net(&self.surface))
    }
}

impl Costed for SurfaceTessellateRequest {
    fn cost(&self) -> Cost {
        Cost::new(Kind::Adaptive, 20_000.0 * net(&self.surface))
    }
}

impl Costed for RenderRequest {
    fn cost(&self) -> Cost {
        let curves: f64 = self.curves.iter().flatten().filter_map(|drawn| drawn.curve.as_ref()).map(size).sum();
        let surfaces = self.surfaces.as_ref().map_or(0, Vec::len) as f64;
        Cost::new(Kind::Render, 1_000.0 * curves + 1e6 * surfaces)
    }
}
