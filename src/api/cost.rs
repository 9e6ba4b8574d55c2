//! What a request is expected to cost before it is computed: how much work, of which kind, and how
//! long an answer.
//!
//! Work is counted in nanoseconds on the machine these formulas were measured on. How far this
//! machine and this kind of request are from that is measured while the service runs, see the rates
//! of the service: the formulas only have to be right in proportion.

use crate::api::wire::{Curve, Points, Surface};

/// Computations whose time follows one formula.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// So many samples.
    Evaluate,
    /// As many samples, pieces or faces as a tolerance needs.
    Adaptive,
    /// Work in proportion to the segments of curves: subdivide, to-bspline, convert, continuity,
    /// basis.
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
    pub(crate) fn new(kind: Kind, work: f64) -> Self {
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

pub(crate) fn length(points: Option<&Points>) -> f64 {
    points.map_or(0, Points::len) as f64
}

/// Control points times the order: what an operation does with each segment is at least linear in
/// both.
pub(crate) fn size(curve: &Curve) -> f64 {
    let points = length(curve.control_points.as_ref());
    points * order(curve)
}

pub(crate) fn order(curve: &Curve) -> f64 {
    let points = curve.control_points.as_ref().map_or(0, Points::len);
    curve.order.or(curve.degree).map_or(points, |order| order.0).clamp(1, 64) as f64
}

pub(crate) fn sizes<'a>(curves: impl IntoIterator<Item = &'a Curve>) -> f64 {
    curves.into_iter().map(size).sum()
}

/// Points of the net.
pub(crate) fn net(surface: &Option<Surface>) -> f64 {
    let rows = surface.as_ref().and_then(|surface| surface.control_net.as_ref());
    rows.map_or(0, |rows| rows.iter().map(Points::len).sum()) as f64
}

/// About 20 characters a number, three of them a point.
pub(crate) const POINT_BYTES: f64 = 60.0;
