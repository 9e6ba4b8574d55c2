//! `interpolate`.

use crate::api::cost::{Cost, Costed, Kind, length};
use crate::api::error::{Error, Locate, both};
use crate::api::json::Request;
use crate::api::operations::Example;
use crate::api::operations::{Operation, Output};
use crate::api::wire::{
    Basis, Continuity, Curve, EndCondition, Parameterization, Points, ReportStyle, Vector, bases,
    need,
};
use crate::core::context::Context;
use crate::core::curve;
use crate::core::fault::Fault;
use crate::core::interpolate as core;
use crate::core::parameterization;
use crate::core::point::Point;

crate::object! {
    /// Points to interpolate.
    pub struct InterpolateRequest {
        /// The points in turn, 2 (closed: 3) to 100,000. A closed curve does not repeat its first
        /// point.
        required points: Points,
        /// Whether the curve returns to its first point, C2 there too; default false.
        optional closed: bool,
        /// The basis of every segment; default bezier. Cubic, of order 3, with a way back from
        /// Bezier points.
        optional basis: Basis,
        /// One basis for each segment instead.
        optional bases: Vec<Basis>,
        /// How the points get their parameters; default chord-length.
        optional parameterization: Parameterization,
        /// What holds at the start of an open curve; default natural.
        optional start: EndCondition,
        /// What holds at the end of an open curve; default natural.
        optional end: EndCondition,
        /// Whether the continuity report lists every joint (`full`) or only the largest values
        /// (`summary`, the default). Every joint is measured either way.
        optional report: ReportStyle,
    }
}

crate::answer! {
    /// The interpolant.
    pub struct InterpolateAnswer {
        /// The C2 piecewise cubic through every point, with one segment between neighbours. It is
        /// the same curve whatever the shape parameters: they only change its control points.
        required curve: Curve,
        /// Its continuity, measured on the curve returned.
        required continuity: Continuity,
        /// By how much the control points may amplify relative rounding errors: the largest 2-norm
        /// condition number of the bases.
        required condition: f64,
        /// The parameterization used; the knots are in the curve.
        required parameterization: Parameterization,
        /// The condition used at the start of an open curve.
        optional start: EndCondition,
        /// The condition used at the end of an open curve.
        optional end: EndCondition,
    }
}

impl Output for InterpolateAnswer {}

/// The request bodies that the specification shows.
pub const EXAMPLES: &[Example] = &[
    Example::new(
        "cheng-figure-12",
        "A closed curve through 5 points, beta = 1 (Cheng et al. 2021 Figure 12)",
        include_str!("../../../openapi/examples/interpolate-cheng-figure-12.json"),
    ),
    Example::new(
        "mixed-bases",
        "An open curve, one basis per segment, end derivatives given",
        include_str!("../../../openapi/examples/interpolate-mixed-bases.json"),
    ),
];

/// Put a C2 curve through points.
#[derive(Debug, Clone, Copy)]
pub struct Interpolate;

impl Operation for Interpolate {
    type Request = InterpolateRequest;
    type Answer = InterpolateAnswer;
    const PATH: &str = "/v1/interpolate";
    const ID: &str = "interpolate";
    const TAG: &str = "Points";
    const SUMMARY: &str = "Put a C2 curve through points";
    const DESCRIPTION: &str = "\
        The composite cubic of Cheng et al. 2021 section 5, open or closed, in any cubic basis. \
        Cost: linear in points.";
    const ANSWERED: &str = "The interpolant.";
    const EXAMPLES: &[Example] = EXAMPLES;

    fn compute(
        context: &Context,
        mut request: InterpolateRequest,
    ) -> Result<InterpolateAnswer, Error> {
        match need(request.points.take(), "points")? {
            Points::Plane(points) => interpolate(context, &points, request),
            Points::Space(points) => interpolate(context, &points, request),
        }
    }

    fn is_small(request: &InterpolateRequest) -> bool {
        request.points.as_ref().is_none_or(|points| points.len() <= 256)
            && request.bases.as_ref().is_none_or(|bases| bases.len() <= 8)
    }
}

impl Costed for InterpolateRequest {
    fn cost(&self) -> Cost {
        Cost::new(Kind::Interpolate, 1_500.0 * length(self.points.as_ref()))
    }
}

impl Request for InterpolateRequest {
    fn check(self, context: &Context) -> Result<(), Error> {
        let points = need(self.points.as_ref(), "points").map(drop);
        // The vectors are to have the dimension of the points, or at least one of their own.
        let is_space = |end: &Option<EndCondition>| {
            matches!(end, Some(EndCondition { vector: Some(Vector::Space(_)), .. }))
        };
        let in_space = match &self.points {
            Some(points) => matches!(points, Points::Space(_)),
            None => is_space(&self.start) || is_space(&self.end),
        };
        let parts = if in_space {
            parts::<3>(context, self).map(drop)
        } else {
            parts::<2>(context, self).map(drop)
        };
        both(points, parts).map(drop)
    }
}

fn interpolate<const D: usize>(
    context: &Context,
    points: &[Point<D>],
    request: InterpolateRequest,
) -> Result<InterpolateAnswer, Error>
where
    Points: From<Vec<Point<D>>>,
{
    let closed = request.closed.unwrap_or(false);
    let echo = |end: &Option<EndCondition>| {
        (!closed).then(|| end.clone().unwrap_or_else(EndCondition::default_end))
    };
    let (start, end) = (echo(&request.start), echo(&request.end));
    let parameterization =
        request.parameterization.clone().unwrap_or_else(Parameterization::default_rule);
    let report = request.report;
    let (shape, bases, rule) = parts(context, request)?;
    let result = core::interpolate(context, points, shape, bases, &rule)?;
    Ok(InterpolateAnswer {
        continuity: Continuity::of_core(&result.continuity, report.unwrap_or(ReportStyle::Summary)),
        curve: Curve::of_core(curve::Curve::Piecewise(result.curve)),
        condition: result.condition,
        parameterization,
        start,
        end,
    })
}

/// All but the points.
type Parts<const D: usize> =
    (core::EndConditions<D>, curve::Bases, parameterization::Parameterization);

fn parts<const D: usize>(
    context: &Context,
    request: InterpolateRequest,
) -> Result<Parts<D>, Error> {
    let closed = request.closed.unwrap_or(false);
    let end_of = |end: Option<EndCondition>, name: &'static str| {
        if closed && end.is_some() {
            let why = format!("a closed curve has no {name}; leave `{name}` out, or `closed`");
            return Err(Fault::Contradiction(why)).at(name);
        }
        end.unwrap_or_else(EndCondition::default_end).parse().at(name)
    };
    let ends = both(end_of(request.start, "start"), end_of(request.end, "end"));
    let rule = request
        .parameterization
        .unwrap_or_else(Parameterization::default_rule)
        .parse()
        .at("parameterization");
    let ((bases, rule), (start, end)) =
        both(both(bases(context, request.basis, request.bases), rule), ends)?;
    Ok((
        if closed { core::EndConditions::Closed } else { core::EndConditions::Open(start, end) },
        bases,
        rule,
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn joints_are_listed_on_demand_and_measured_always() {
        let ask = |report: &str| {
            let body = format!(r#"{{"points":[[0,0],[1,2],[3,1],[4,5]]{report}}}"#);
            let context = Context::default();
            let request = crate::api::json::from_bytes(&context, body.as_bytes()).unwrap();
            Interpolate::compute(&context, request).unwrap().continuity
        };
        let (default, full) = (ask(""), ask(r#","report":"full""#));
        assert_eq!(
            (default.joints.is_none(), full.joints.map(|joints| joints.len())),
            (true, Some(2))
        );
        assert_eq!(
            (default.class, default.worst.unwrap().position_gap),
            (full.class, full.worst.unwrap().position_gap)
        );
    }
}
