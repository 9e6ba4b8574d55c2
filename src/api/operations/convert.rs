//! `convert`.

use crate::api::cost::{Cost, Costed, Kind, size};
use crate::api::error::{Error, both};
use crate::api::json::Request;
use crate::api::operations::Example;
use crate::api::operations::{Operation, Output};
use crate::api::pointer;
use crate::api::wire::{AnyDimensioned, Curve, Dimensioned, Points, Target, Vector, Whole, part};
use crate::core::argument::Argument;
use crate::core::context::Context;
use crate::core::convert as core;
use crate::core::point::Point;
use crate::core::rational::{self, AnyCurve};

crate::object! {
    /// A curve to write in another basis.
    pub struct ConvertRequest {
        /// The curve.
        required curve: Curve,
        /// The basis wanted: `"bezier"`, or a basis with its shape parameters.
        required to: Target,
        /// The order wanted, for degree elevation; default the degree of the curve, or the order of
        /// the basis where it has one of its own.
        optional order: Whole,
    }
}

crate::object! {
    /// How the Bezier points of a cubic beta-bezier segment are constructed (Cheng et al. 2021
    /// Figure 4): Q1 = (r11 + beta r12) / (1 + beta) and Q2 = (r21 + beta r22) / (1 + beta).
    pub struct Construction {
        /// On the edge from P1 to P2, nearer to P1.
        required r11: Vector,
        /// On the segment from P0 to P3, nearer to P0.
        required r12: Vector,
        /// On the edge from P1 to P2, nearer to P2.
        required r21: Vector,
        /// On the segment from P0 to P3, nearer to P3.
        required r22: Vector,
    }
}
crate::nested!(Construction);

crate::answer! {
    /// The curve in the other basis.
    pub struct ConvertAnswer {
        /// The same curve. A single segment stays one, over the domain of the new basis; anything
        /// else becomes piecewise over its own domain.
        required curve: Curve,
        /// By how much the control points may amplify relative rounding errors: the 2-norm
        /// condition number of the new shape matrix.
        required condition: f64,
        /// Where the input is cubic beta-bezier throughout: the construction of the Bezier points
        /// of each segment.
        optional construction: Vec<Construction>,
    }
}

impl Output for ConvertAnswer {}

/// The request bodies that the specification shows.
pub const EXAMPLES: &[Example] = &[
    Example::new(
        "cheng-figure-4",
        "beta = 1 to Bezier, with its construction (Cheng et al. 2021 Figure 4)",
        include_str!("../../../openapi/examples/convert-cheng-figure-4.json"),
    ),
    Example::new(
        "to-alpha-beta",
        "A Bezier cubic as an alpha-beta cubic",
        include_str!("../../../openapi/examples/convert-to-alpha-beta.json"),
    ),
];

/// Write a curve in another basis.
#[derive(Debug, Clone, Copy)]
pub struct Convert;

impl Operation for Convert {
    type Request = ConvertRequest;
    type Answer = ConvertAnswer;
    const PATH: &str = "/v1/convert";
    const ID: &str = "convert";
    const TAG: &str = "Curves";
    const SUMMARY: &str = "Write a curve in another basis";
    const DESCRIPTION: &str = "\
        Exactly, or not at all: a basis without a way back from Bezier points is refused, and \
        so is a lower degree. Cost: linear in segments.";
    const ANSWERED: &str = "The curve.";
    const EXAMPLES: &[Example] = EXAMPLES;

    fn compute(context: &Context, request: ConvertRequest) -> Result<ConvertAnswer, Error> {
        let order = request.order.map(|whole| whole.0);
        match parts(context, request.curve, request.to)? {
            (Dimensioned::Plane(curve), basis) => convert(context, &curve, basis, order),
            (Dimensioned::Space(curve), basis) => convert(context, &curve, basis, order),
        }
    }

    fn field(argument: Argument) -> &'static str {
        match argument {
            Argument::Basis => "to",
            argument => pointer::field(argument),
        }
    }

    fn is_small(request: &ConvertRequest) -> bool {
        request.curve.as_ref().is_none_or(Curve::is_small)
    }
}

impl Costed for ConvertRequest {
    fn cost(&self) -> Cost {
        let wider = self.order.map_or(1.0, |order| order.0.max(1) as f64);
        Cost::new(Kind::Segments, 100.0 * self.curve.as_ref().map_or(0.0, size) * wider)
    }
}

impl Request for ConvertRequest {
    fn check(self, context: &Context) -> Result<(), Error> {
        parts(context, self.curve, self.to).map(drop)
    }
}

fn parts(
    context: &Context,
    curve: Option<Curve>,
    to: Option<Target>,
) -> Result<(AnyDimensioned, crate::core::basis::Basis), Error> {
    both(
        part(curve, "curve", |value| value.parse(context)),
        part(to, "to", |to| to.into_basis().parse(context)),
    )
}

fn convert<const D: usize, const H: usize>(
    context: &Context,
    curve: &AnyCurve<D, H>,
    basis: crate::core::basis::Basis,
    order: Option<usize>,
) -> Result<ConvertAnswer, Error>
where
    Points: From<Vec<Point<D>>>,
    Vector: From<Point<D>>,
{
    Ok(match curve {
        AnyCurve::Polynomial(curve) => {
            answer(core::convert(context, curve, basis, order)?, Curve::of_core)
        }
        AnyCurve::Rational(curve) => {
            answer(rational::convert(context, curve, basis, order)?, Curve::of_rational)
        }
    })
}

fn answer<C, const D: usize>(
    converted: core::Converted<C, D>,
    curve: impl FnOnce(C) -> Curve,
) -> ConvertAnswer
where
    Vector: From<Point<D>>,
{
    let construction = |c: &core::Construction<D>| Construction {
        r11: Some(c.r11.into()),
        r12: Some(c.r12.into()),
        r21: Some(c.r21.into()),
        r22: Some(c.r22.into()),
    };
    let constructions: Vec<_> = converted.construction.iter().map(construction).collect();
    ConvertAnswer {
        curve: curve(converted.curve),
        condition: converted.condition,
        construction: (!constructions.is_empty()).then_some(constructions),
    }
}
