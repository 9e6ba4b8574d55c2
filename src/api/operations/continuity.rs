//! `continuity`.

use crate::api::cost::{Cost, Costed, Kind, sizes};
use crate::api::error::{Error, Locate, both};
use crate::api::json::Request;
use crate::api::operations::Example;
use crate::api::operations::{Operation, Output};
use crate::api::wire::{
    AnyCurves, AnyDimensioned, Continuity, Curve, Dimensioned, ReportStyle, list, need, number,
};
use crate::core::check::at_most;
use crate::core::context::Context;
use crate::core::continuity as core;
use crate::core::fault::Fault;
use crate::core::rational;
use crate::core::to_bspline::check_tolerance;

crate::object! {
    /// A curve, or curves laid end to end, to measure.
    pub struct ContinuityRequest {
        /// The curve; exactly one of `curve` and `curves` is given.
        optional curve: Curve,
        /// Curves laid end to end in this order, each over its own domain moved to where the one
        /// before ends.
        optional curves: Vec<Curve>,
        /// Whether the last curve of `curves` is to join the first; default false. A single `curve`
        /// says so itself.
        optional closed: bool,
        /// The relative tolerance, 0 < tolerance < 1: a jump of a derivative counts from this
        /// fraction of the derivative's largest control vector on the two segments, a gap from this
        /// fraction of their extent, rounding errors aside. Default 1e-9.
        optional tolerance: f64 = number().exclusive_minimum(Some(0.0)).exclusive_maximum(Some(1.0)),
        /// A gap that is allowed besides, in the unit of the coordinates; default 0.
        optional gap_tolerance: f64 = number().minimum(Some(0.0)),
        /// Whether to list every joint (`full`, the default) or only the largest values
        /// (`summary`).
        optional report: ReportStyle,
    }
}

crate::answer! {
    /// How smoothly the segments join.
    pub struct ContinuityAnswer {
        /// First and last parameter; curves laid end to end start at 0.
        required domain: Vec<f64> = list::<f64>(2, 2),
        /// The report.
        required continuity: Continuity,
    }
}

impl Output for ContinuityAnswer {}

/// The request bodies that the specification shows.
pub const EXAMPLES: &[Example] = &[
    Example::new(
        "cheng-figure-9",
        "Two cubics with different beta (Cheng et al. 2021 Figure 9)",
        include_str!("../../../openapi/examples/continuity-cheng-figure-9.json"),
    ),
    Example::new(
        "end-to-end",
        "Two curves of different families laid end to end",
        include_str!("../../../openapi/examples/continuity-end-to-end.json"),
    ),
];

/// Measure how smoothly segments join.
#[derive(Debug, Clone, Copy)]
pub struct ContinuityOperation;

impl Operation for ContinuityOperation {
    type Request = ContinuityRequest;
    type Answer = ContinuityAnswer;
    const PATH: &str = "/v1/continuity";
    const ID: &str = "continuity";
    const TAG: &str = "Curves";
    const SUMMARY: &str = "Measure how smoothly segments join";
    const DESCRIPTION: &str = "\
        Joint by joint: parametric classes C0 to C2 and geometric classes G1 and G2, told \
        apart, with the gaps, angles and jumps behind them. Cost: linear in segments.";
    const ANSWERED: &str = "The report.";
    const EXAMPLES: &[Example] = EXAMPLES;

    fn compute(context: &Context, request: ContinuityRequest) -> Result<ContinuityAnswer, Error> {
        let style = request.report.unwrap_or(ReportStyle::Full);
        let (measured, tolerance) = parts(context, request)?;
        match measured {
            Measured::One(Dimensioned::Plane(curve)) => {
                Ok(answer(rational::continuity(context, &curve, tolerance)?, style))
            }
            Measured::One(Dimensioned::Space(curve)) => {
                Ok(answer(rational::continuity(context, &curve, tolerance)?, style))
            }
            Measured::Several(curves, closed) => {
                laid_end_to_end(context, curves, closed, tolerance, style)
            }
        }
    }

    fn is_small(request: &ContinuityRequest) -> bool {
        let small = |curves: &Vec<Curve>| curves.len() <= 8 && curves.iter().all(Curve::is_small);
        request.curve.as_ref().is_none_or(Curve::is_small)
            && request.curves.as_ref().is_none_or(small)
    }
}

impl Costed for ContinuityRequest {
    fn cost(&self) -> Cost {
        Cost::new(
            Kind::Segments,
            300.0 * sizes(self.curve.iter().chain(self.curves.iter().flatten())),
        )
    }
}

impl Request for ContinuityRequest {
    fn check(self, context: &Context) -> Result<(), Error> {
        parts(context, self).map(drop)
    }
}

/// What is measured: a curve, or curves laid end to end, closed or not.
enum Measured {
    One(AnyDimensioned),
    Several(AnyCurves, bool),
}

fn parts(
    context: &Context,
    request: ContinuityRequest,
) -> Result<(Measured, core::Tolerance), Error> {
    let tolerance = tolerance(request.tolerance, request.gap_tolerance);
    let contradiction = |why: &str, field| Err(Fault::Contradiction(why.into())).at(field);
    let measured = match (request.curve, request.curves) {
        (Some(_), Some(_)) => contradiction("give `curve` or `curves`, not both", "curves"),
        (Some(_), None) if request.closed.is_some() => contradiction(
            "a curve says itself whether it is closed; `closed` goes with `curves`",
            "closed",
        ),
        (Some(curve), None) => curve.parse(context).at("curve").map(Measured::One),
        (None, curves) => need(curves, "curve` or `curves")
            .and_then(|curves| several(context, curves, request.closed.unwrap_or(false))),
    };
    both(measured, tolerance)
}

fn several(context: &Context, curves: Vec<Curve>, closed: bool) -> Result<Measured, Error> {
    at_most("curves", curves.len(), context.limits.segments, "Measure them in groups")
        .at("curves")?;
    Ok(Measured::Several(AnyDimensioned::parse_list(context, curves).at("curves")?, closed))
}

fn tolerance(relative: Option<f64>, gap: Option<f64>) -> Result<core::Tolerance, Error> {
    let default = core::Tolerance::default();
    let tolerance = core::Tolerance {
        relative: relative.unwrap_or(default.relative),
        gap: gap.unwrap_or(default.gap),
    };
    let gap = if tolerance.gap < 0.0 {
        let allowed = "0 or more, in the unit of the coordinates".into();
        Err(Fault::OutOfRange { what: "gap_tolerance", value: tolerance.gap, allowed })
            .at("gap_tolerance")
    } else {
        Ok(())
    };
    both(check_tolerance(tolerance.relative).at("tolerance"), gap)?;
    Ok(tolerance)
}

fn laid_end_to_end(
    context: &Context,
    curves: AnyCurves,
    closed: bool,
    tolerance: core::Tolerance,
    style: ReportStyle,
) -> Result<ContinuityAnswer, Error> {
    let measured = match curves {
        Dimensioned::Plane(curves) => rational::end_to_end(context, &curves, closed, tolerance),
        Dimensioned::Space(curves) => rational::end_to_end(context, &curves, closed, tolerance),
    };
    Ok(answer(measured.at("curves")?, style))
}

fn answer((domain, report): ((f64, f64), core::Report), style: ReportStyle) -> ContinuityAnswer {
    let domain = vec![domain.0, domain.1];
    ContinuityAnswer { domain, continuity: Continuity::of_core(&report, style) }
}
