//! `join`.

use crate::api::cost::{Cost, Costed, Kind, order, size};
use crate::api::error::{Error, Locate, both};
use crate::api::json::Request;
use crate::api::operations::Example;
use crate::api::operations::{Operation, Output};
use crate::api::wire::{
    AnyCurves, AnyDimensioned, Continuity, Curve, Dimensioned, Points, ReportStyle, list, need,
    part,
};
use crate::core::context::Context;
use crate::core::curve::{self, Single};
use crate::core::fault::Fault;
use crate::core::join as core;
use crate::core::point::Point;
use crate::core::rational::{self, AnyCurve};
use crate::core::smoothness;
use crate::core::weights::Weights;

crate::names! {
    /// The smoothness wanted at every joint.
    pub enum Smoothness {
        /// The curves meet.
        C0 = "C0",
        /// Their tangents agree.
        G1 = "G1",
        /// Their first derivatives agree.
        C1 = "C1",
        /// Their tangents and curvatures agree.
        G2 = "G2",
        /// Their first and second derivatives agree.
        C2 = "C2",
    }
}

crate::names! {
    /// Which control points may move.
    pub enum Movable {
        /// Those of the curve after a joint.
        Following = "following",
        /// Those of the curve before a joint.
        Leading = "leading",
        /// Both.
        Both = "both",
    }
}

crate::object! {
    /// Curves to join.
    pub struct JoinRequest {
        /// Single curves, 2 to 1,000, of one order and one dimension, laid end to end in this
        /// order.
        required curves: Vec<Curve> = list::<Curve>(2, core::CURVES),
        /// The smoothness wanted at every joint, for the shape parameters that the curves have,
        /// mixed ones included.
        required smoothness: Smoothness,
        /// Which control points next to a joint may move: `following`, `leading` or `both` (the
        /// default); on a side the end point and as many more as derivatives are compared.
        optional movable: Movable,
        /// Whether the continuity report lists every joint (`full`, the default) or only the
        /// largest values (`summary`).
        optional report: ReportStyle,
    }
}

crate::answer! {
    /// The curves, joined.
    pub struct JoinAnswer {
        /// The piecewise curve; its knots are the sums of the lengths of the curves' domains.
        required curve: Curve,
        /// `moved[i][j]`: how far control point j of curve i moved. The sum of squares is least for
        /// C classes, a local minimum for G classes.
        required moved: Vec<Vec<f64>>,
        /// The continuity reached, measured on the curve returned.
        required continuity: Continuity,
        /// Which control points were allowed to move.
        required movable: Movable,
    }
}

impl Output for JoinAnswer {}

/// The request bodies that the specification shows.
pub const EXAMPLES: &[Example] = &[
    Example::new(
        "cheng-figure-9",
        "Two cubics with different beta, made C1 (Cheng et al. 2021 Figure 9)",
        include_str!("../../../openapi/examples/join-cheng-figure-9.json"),
    ),
    Example::new(
        "curvature",
        "Two families, one curvature: G2, only the following curve moves",
        include_str!("../../../openapi/examples/join-curvature.json"),
    ),
];

/// Join curves smoothly.
#[derive(Debug, Clone, Copy)]
pub struct Join;

impl Operation for Join {
    type Request = JoinRequest;
    type Answer = JoinAnswer;
    const PATH: &str = "/v1/join";
    const ID: &str = "join";
    const TAG: &str = "Curves";
    const SUMMARY: &str = "Join curves smoothly";
    const DESCRIPTION: &str = "\
        Moves as few control points as little as possible so that the curves join with the \
        class wanted. Cost: linear in curves.";
    const ANSWERED: &str = "The joined curve.";
    const EXAMPLES: &[Example] = EXAMPLES;

    fn compute(context: &Context, request: JoinRequest) -> Result<JoinAnswer, Error> {
        let movable = request.movable.unwrap_or(Movable::Both);
        let style = request.report.unwrap_or(ReportStyle::Full);
        match parts(context, request.curves, request.smoothness)? {
            (Dimensioned::Plane(curves), smoothness) => {
                join(context, curves, smoothness, movable, style)
            }
            (Dimensioned::Space(curves), smoothness) => {
                join(context, curves, smoothness, movable, style)
            }
        }
    }
}

impl Costed for JoinRequest {
    fn cost(&self) -> Cost {
        Cost::new(
            Kind::Smooth,
            self.curves.iter().flatten().map(|curve| 300.0 * size(curve) * order(curve)).sum(),
        )
    }
}

impl Request for JoinRequest {
    fn check(self, context: &Context) -> Result<(), Error> {
        parts(context, self.curves, self.smoothness).map(drop)
    }
}

fn parts(
    context: &Context,
    curves: Option<Vec<Curve>>,
    smoothness: Option<Smoothness>,
) -> Result<(AnyCurves, Smoothness), Error> {
    both(
        part(curves, "curves", |curves| AnyDimensioned::parse_list(context, curves)),
        need(smoothness, "smoothness"),
    )
}

fn join<const D: usize, const H: usize>(
    context: &Context,
    curves: Vec<AnyCurve<D, H>>,
    smoothness: Smoothness,
    movable: Movable,
    style: ReportStyle,
) -> Result<JoinAnswer, Error>
where
    Points: From<Vec<Point<D>>>,
{
    let singles = curves.into_iter().enumerate().map(|(i, curve)| single(curve).at("family").at(i));
    let singles = singles.collect::<Result<Vec<_>, _>>().at("curves")?;
    let (smoothness, movable_points) = (smoothness.into(), movable.into());
    if singles.iter().any(|(_, weights)| weights.is_some()) {
        let joined = rational::join::<D, H>(context, singles, smoothness, movable_points)?;
        return Ok(answer(joined, Curve::of_any, movable, style));
    }
    let singles = singles.into_iter().map(|(single, _)| single).collect();
    let joined = core::join(context, singles, smoothness, movable_points)?;
    let of_core = |curve| Curve::of_core(curve::Curve::Piecewise(curve));
    Ok(answer(joined, of_core, movable, style))
}

fn answer<C>(
    joined: core::Joined<C>,
    curve: impl FnOnce(C) -> Curve,
    movable: Movable,
    style: ReportStyle,
) -> JoinAnswer {
    JoinAnswer {
        curve: curve(joined.curve),
        moved: joined.moved,
        continuity: Continuity::of_core(&joined.continuity, style),
        movable,
    }
}

/// A segment and its weights, if it has any.
type Weighted<const D: usize> = (Single<D>, Option<Weights>);

fn single<const D: usize, const H: usize>(curve: AnyCurve<D, H>) -> Result<Weighted<D>, Fault> {
    let (curve, weights) = match curve {
        AnyCurve::Polynomial(curve) => (curve, None),
        AnyCurve::Rational(rational) => {
            let (curve, weights) = rational.into_parts();
            (curve, Some(weights))
        }
    };
    match curve {
        curve::Curve::Single(single) => Ok((single, weights)),
        _ => Err(Fault::UnsuitableCurve(
            "only single segments are joined; send the segments of a piecewise curve one by one"
                .into(),
        )),
    }
}

impl From<Smoothness> for smoothness::Smoothness {
    fn from(smoothness: Smoothness) -> Self {
        match smoothness {
            Smoothness::C0 => smoothness::Smoothness::C0,
            Smoothness::G1 => smoothness::Smoothness::G1,
            Smoothness::C1 => smoothness::Smoothness::C1,
            Smoothness::G2 => smoothness::Smoothness::G2,
            Smoothness::C2 => smoothness::Smoothness::C2,
        }
    }
}

impl From<Movable> for core::Movable {
    fn from(movable: Movable) -> Self {
        match movable {
            Movable::Following => core::Movable::Following,
            Movable::Leading => core::Movable::Leading,
            Movable::Both => core::Movable::Both,
        }
    }
}
