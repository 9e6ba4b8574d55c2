//! `to-bspline`.

use crate::api::cost::{Cost, Costed, Kind, size};
use crate::api::error::{Error, Locate, both};
use crate::api::json::Request;
use crate::api::operations::Example;
use crate::api::operations::{Operation, Output};
use crate::api::wire::{AnyDimensioned, Curve, Dimensioned, Points, Whole, number, part};
use crate::core::context::Context;
use crate::core::curve;
use crate::core::limits;
use crate::core::point::Point;
use crate::core::rational::{self, AnyCurve};
use crate::core::to_bspline as core;

crate::names! {
    /// The kind of knot vector.
    pub enum KnotStyle {
        /// End knots of multiplicity degree + 1.
        Clamped = "clamped",
        /// Equally spaced simple knots.
        Uniform = "uniform",
        /// Knots that repeat with the period of a closed curve.
        Periodic = "periodic",
    }
}

crate::object! {
    /// A curve to write as a B-spline.
    pub struct ToBsplineRequest {
        /// The curve.
        required curve: Curve,
        /// The knot vector wanted. `clamped` (the default) starts and ends at control points.
        /// `uniform` has equally spaced simple knots, also beyond the ends (Cheng et al. 2021 eq.
        /// (26)); it needs segments of equal length and C(degree-1) joints, and is periodic for a
        /// closed curve. `periodic` is for any closed curve.
        optional knots: KnotStyle,
        /// The tolerance for measuring continuity, 0 < tolerance < 1, relative to the derivatives
        /// compared; default 1e-9.
        optional tolerance: f64 = number().exclusive_minimum(Some(0.0)).exclusive_maximum(Some(1.0)),
    }
}

crate::answer! {
    /// A former joint.
    pub struct FormerJoint {
        /// Its parameter.
        required parameter: f64,
        /// The number of derivatives found to agree there, up to the degree; -1 where not even the
        /// points do.
        required continuity: i32,
        /// The multiplicity of its knot, degree - continuity where the knot style allows it; 0
        /// where the segments are one polynomial.
        required multiplicity: Whole,
    }
}
crate::nested!(answer FormerJoint);

crate::answer! {
    /// The B-spline.
    pub struct ToBsplineAnswer {
        /// The same curve over the same domain, with its full knot vector.
        required curve: Curve,
        /// The continuity found at each former joint; for a closed curve the last is the seam.
        required joints: Vec<FormerJoint>,
        /// A bound on the distance between the two curves at equal parameters, measured on the
        /// answer.
        required deviation: f64,
        /// The kind of knot vector used.
        required knots: KnotStyle,
        /// The tolerance used.
        required tolerance: f64,
    }
}

impl Output for ToBsplineAnswer {}

/// The request bodies that the specification shows.
pub const EXAMPLES: &[Example] = &[
    Example::new(
        "cheng-figure-13",
        "One cubic with beta = 1 on uniform knots (Cheng et al. 2021 Figure 13)",
        include_str!("../../../openapi/examples/to-bspline-cheng-figure-13.json"),
    ),
    Example::new(
        "cheng-figure-9",
        "Two cubics with different beta (Cheng et al. 2021 Figure 9)",
        include_str!("../../../openapi/examples/to-bspline-cheng-figure-9.json"),
    ),
];

/// Write a curve as a B-spline.
#[derive(Debug, Clone, Copy)]
pub struct ToBspline;

impl Operation for ToBspline {
    type Request = ToBsplineRequest;
    type Answer = ToBsplineAnswer;
    const PATH: &str = "/v1/to-bspline";
    const ID: &str = "toBspline";
    const TAG: &str = "Curves";
    const SUMMARY: &str = "Write a curve as a B-spline";
    const DESCRIPTION: &str = "\
        One B-spline of the degree of the segments; each joint becomes a knot of the lowest \
        multiplicity that its measured continuity allows, judged one by one. A B-spline keeps \
        its inner knots, but for copies that its continuity makes superfluous. Cost: linear in \
        segments.";
    const ANSWERED: &str = "The B-spline.";
    const EXAMPLES: &[Example] = EXAMPLES;

    fn compute(context: &Context, request: ToBsplineRequest) -> Result<ToBsplineAnswer, Error> {
        let style = request.knots.unwrap_or(KnotStyle::Clamped);
        match parts(context, request.curve, request.tolerance)? {
            (Dimensioned::Plane(curve), tolerance) => convert(context, &curve, style, tolerance),
            (Dimensioned::Space(curve), tolerance) => convert(context, &curve, style, tolerance),
        }
    }

    fn is_small(request: &ToBsplineRequest) -> bool {
        request.curve.as_ref().is_none_or(Curve::is_small)
    }
}

impl Costed for ToBsplineRequest {
    fn cost(&self) -> Cost {
        Cost::new(Kind::Segments, 300.0 * self.curve.as_ref().map_or(0.0, size))
    }
}

impl Request for ToBsplineRequest {
    fn check(self, context: &Context) -> Result<(), Error> {
        parts(context, self.curve, self.tolerance).map(drop)
    }
}

fn parts(
    context: &Context,
    curve: Option<Curve>,
    tolerance: Option<f64>,
) -> Result<(AnyDimensioned, f64), Error> {
    let tolerance = tolerance.unwrap_or(limits::CONTINUITY_TOLERANCE);
    let (curve, ()) = both(
        part(curve, "curve", |value| value.parse(context)),
        core::check_tolerance(tolerance).at("tolerance"),
    )?;
    Ok((curve, tolerance))
}

fn convert<const D: usize, const H: usize>(
    context: &Context,
    curve: &AnyCurve<D, H>,
    style: KnotStyle,
    tolerance: f64,
) -> Result<ToBsplineAnswer, Error>
where
    Points: From<Vec<Point<D>>>,
{
    let wanted = match style {
        KnotStyle::Clamped => core::KnotStyle::Clamped,
        KnotStyle::Uniform => core::KnotStyle::Uniform,
        KnotStyle::Periodic => core::KnotStyle::Periodic,
    };
    Ok(match curve {
        AnyCurve::Polynomial(curve) => {
            let of_core = |curve| Curve::of_core(curve::Curve::BSpline(curve));
            answer(core::to_bspline(context, curve, wanted, tolerance)?, of_core, style)
        }
        AnyCurve::Rational(curve) => {
            let result = rational::to_bspline(context, curve, wanted, tolerance)?;
            answer(result, Curve::of_rational, style)
        }
    })
}

fn answer<C>(
    result: core::Conversion<C>,
    curve: impl FnOnce(C) -> Curve,
    style: KnotStyle,
) -> ToBsplineAnswer {
    let joint = |joint: &core::FormerJoint| FormerJoint {
        parameter: joint.parameter,
        continuity: joint.continuity,
        multiplicity: Whole(joint.multiplicity),
    };
    ToBsplineAnswer {
        joints: result.joints.iter().map(joint).collect(),
        curve: curve(result.curve),
        deviation: result.deviation,
        knots: style,
        tolerance: result.tolerance,
    }
}
