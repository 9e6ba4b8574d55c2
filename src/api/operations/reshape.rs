//! `reshape`.

use crate::api::cost::{Cost, Costed, Kind, order, size};
use crate::api::error::{Error, both};
use crate::api::json::Request;
use crate::api::operations::Example;
use crate::api::operations::{Operation, Output};
use crate::api::wire::{
    AnyDimensioned, Basis, Continuity, Curve, Dimensioned, Points, ReportStyle, bases, need, part,
};
use crate::core::context::Context;
use crate::core::curve::Bases;
use crate::core::point::Point;
use crate::core::rational::{self, AnyCurve};
use crate::core::reshape as core;
use crate::core::smoothness::Smoothness;

crate::names! {
    /// What must survive at the joints.
    pub enum Keep {
        /// Nothing: every control point stays.
        Nothing = "nothing",
        /// Parallel tangents, with the ratio of end speeds that the curve had.
        G1 = "G1",
        /// Equal first derivatives.
        C1 = "C1",
        /// Equal first and second derivatives: the curve stays, its control points change.
        C2 = "C2",
    }
}

crate::object! {
    /// A curve and its new shape parameters.
    pub struct ReshapeRequest {
        /// The curve: a single or a piecewise one.
        required curve: Curve,
        /// The new basis of every segment; exactly one of `basis` and `bases` is given.
        optional basis: Basis,
        /// One new basis for each segment.
        optional bases: Vec<Basis>,
        /// What must survive at joints that have it: `nothing` (the default) leaves every control
        /// point where it is; `C1` and `G1` leave the joints and move the inner control points by
        /// the least sum of squares; `C2` gives the same curve again in the new basis, because
        /// there is only one C2 cubic through its joints for its ends, whatever the shape
        /// parameters.
        optional keep: Keep,
        /// Whether the continuity report lists every joint (`full`, the default) or only the
        /// largest values (`summary`).
        optional report: ReportStyle,
    }
}

crate::answer! {
    /// The curve with its new shape parameters.
    pub struct ReshapeAnswer {
        /// The curve.
        required curve: Curve,
        /// The continuity that is left, measured on the curve returned.
        required continuity: Continuity,
        /// The largest distance between the old and the new curve at equal fractions of their
        /// domains, to 9 digits.
        required curve_moved: f64,
        /// The largest distance that a control point moved.
        required points_moved: f64,
        /// What was kept.
        required keep: Keep,
    }
}

impl Output for ReshapeAnswer {}

/// The request bodies that the specification shows.
pub const EXAMPLES: &[Example] = &[
    Example::new(
        "cheng-figure-12",
        "The closed interpolant of Cheng et al. 2021 Figure 12 with beta from 1 to 3: its tangents \
         break",
        include_str!("../../../openapi/examples/reshape-cheng-figure-12.json"),
    ),
    Example::new(
        "keep-c1",
        "The same, kept C1",
        include_str!("../../../openapi/examples/reshape-keep-c1.json"),
    ),
];

/// Bend a curve by its shape parameters.
#[derive(Debug, Clone, Copy)]
pub struct Reshape;

impl Operation for Reshape {
    type Request = ReshapeRequest;
    type Answer = ReshapeAnswer;
    const PATH: &str = "/v1/reshape";
    const ID: &str = "reshape";
    const TAG: &str = "Curves";
    const SUMMARY: &str = "Bend a curve by its shape parameters";
    const DESCRIPTION: &str = "\
        New shape parameters on fixed control points, which is what these families are for; \
        or, for composite curves, the least change of control points that keeps them smooth. \
        Cost: linear in segments.";
    const ANSWERED: &str = "The bent curve.";
    const EXAMPLES: &[Example] = EXAMPLES;

    fn compute(context: &Context, request: ReshapeRequest) -> Result<ReshapeAnswer, Error> {
        let keep = request.keep.unwrap_or(Keep::Nothing);
        let style = request.report.unwrap_or(ReportStyle::Full);
        match parts(context, request.curve, request.basis, request.bases)? {
            (Dimensioned::Plane(curve), bases) => reshape(context, &curve, bases, keep, style),
            (Dimensioned::Space(curve), bases) => reshape(context, &curve, bases, keep, style),
        }
    }
}

impl Costed for ReshapeRequest {
    fn cost(&self) -> Cost {
        let size = self.curve.as_ref().map_or(0.0, |curve| size(curve) * order(curve));
        Cost::new(Kind::Smooth, 300.0 * size)
    }
}

impl Request for ReshapeRequest {
    fn check(self, context: &Context) -> Result<(), Error> {
        parts(context, self.curve, self.basis, self.bases).map(drop)
    }
}

fn parts(
    context: &Context,
    curve: Option<Curve>,
    basis: Option<Basis>,
    each: Option<Vec<Basis>>,
) -> Result<(AnyDimensioned, Bases), Error> {
    let given =
        if basis.is_none() { need(each.as_ref(), "basis` or `bases").map(drop) } else { Ok(()) };
    let (curve, (bases, ())) = both(
        part(curve, "curve", |value| value.parse(context)),
        both(bases(context, basis, each), given),
    )?;
    Ok((curve, bases))
}

fn reshape<const D: usize, const H: usize>(
    context: &Context,
    curve: &AnyCurve<D, H>,
    bases: Bases,
    keep: Keep,
    style: ReportStyle,
) -> Result<ReshapeAnswer, Error>
where
    Points: From<Vec<Point<D>>>,
{
    let wanted = match keep {
        Keep::Nothing => Smoothness::C0,
        Keep::G1 => Smoothness::G1,
        Keep::C1 => Smoothness::C1,
        Keep::C2 => Smoothness::C2,
    };
    Ok(match curve {
        AnyCurve::Polynomial(curve) => {
            answer(core::reshape(context, curve, bases, wanted)?, Curve::of_core, keep, style)
        }
        AnyCurve::Rational(curve) => {
            let reshaped = rational::reshape(context, curve, bases, wanted)?;
            answer(reshaped, Curve::of_rational, keep, style)
        }
    })
}

fn answer<C>(
    reshaped: core::Reshaped<C>,
    curve: impl FnOnce(C) -> Curve,
    keep: Keep,
    style: ReportStyle,
) -> ReshapeAnswer {
    ReshapeAnswer {
        curve: curve(reshaped.curve),
        continuity: Continuity::of_core(&reshaped.continuity, style),
        curve_moved: reshaped.curve_moved,
        points_moved: reshaped.points_moved,
        keep,
    }
}
