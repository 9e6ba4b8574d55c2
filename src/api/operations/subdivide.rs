//! `subdivide`.

use crate::api::cost::{Cost, Costed, Kind, size};
use crate::api::error::{Error, both};
use crate::api::json::Request;
use crate::api::operations::Example;
use crate::api::operations::{Operation, Output};
use crate::api::wire::{AnyDimensioned, Curve, Dimensioned, Points, Whole, need, number, part};
use crate::core::context::Context;
use crate::core::curve;
use crate::core::point::Point;
use crate::core::rational::{self, AnyCurve};
use crate::core::subdivide as core;

crate::union! {
    /// Where to cut.
    pub struct Cuts by kind: CutsKind {
        /// Parameters inside the curve's domain, strictly increasing. An end or an existing joint
        /// is no new cut.
        values: Vec<f64>,
        /// How many times every segment is halved: 2^depth pieces of each.
        depth: Whole,
        /// Halve until every piece is this close to its chord, in the unit of the coordinates; more
        /// than 0. Proved by a bound.
        tolerance: f64 = number().exclusive_minimum(Some(0.0)),
    }
    /// At given parameters.
    "parameters" Parameters as ParameterCuts: [values] [];
    /// In halves, to a depth.
    "depth" Depth as DepthCuts: [depth] [];
    /// In halves, to a flatness.
    "flatness" Flatness as FlatnessCuts: [tolerance] [];
}

crate::names! {
    /// In which basis the pieces are wanted.
    pub enum Form {
        /// In their own family where that keeps 8 digits, else as Bezier curves.
        Auto = "auto",
        /// In their own family, with the same shape parameters.
        Family = "family",
        /// As Bezier curves.
        Bezier = "bezier",
    }
}

crate::object! {
    /// A curve and where to cut it.
    pub struct SubdivideRequest {
        /// The curve.
        required curve: Curve,
        /// Where to cut.
        required at: Cuts,
        /// In which basis the pieces are wanted: `auto` (the default) takes the curve's own family
        /// where that keeps 8 digits and bezier otherwise; `family` insists and answers 422 where
        /// it does not exist.
        optional form: Form,
    }
}

crate::answer! {
    /// The pieces.
    pub struct SubdivideAnswer {
        /// A piecewise curve over the same domain, equal to the input at every parameter.
        required curve: Curve,
        /// The parameters of the cuts.
        required split_parameters: Vec<f64>,
        /// The points of the curve there.
        required split_points: Points,
        /// The form of the pieces: `family` or `bezier`.
        required form: Form,
        /// By how much the control points may amplify relative rounding errors: the largest 2-norm
        /// condition number of the shape matrices; 1 for bezier pieces.
        required condition: f64,
        /// The flatness tolerance used, where one was given.
        optional tolerance: f64,
    }
}

impl Output for SubdivideAnswer {}

/// The request bodies that the specification shows.
pub const EXAMPLES: &[Example] = &[
    Example::new(
        "cheng-figure-11",
        "beta = 1, cut at 1/2 (Cheng et al. 2021 Figure 11)",
        include_str!("../../../openapi/examples/subdivide-cheng-figure-11.json"),
    ),
    Example::new(
        "chen-figure-1",
        "A quasi-bezier curve, flat to 0.05 (Chen 2013 Figure 1)",
        include_str!("../../../openapi/examples/subdivide-chen-figure-1.json"),
    ),
];

/// Cut a curve into pieces.
#[derive(Debug, Clone, Copy)]
pub struct Subdivide;

impl Operation for Subdivide {
    type Request = SubdivideRequest;
    type Answer = SubdivideAnswer;
    const PATH: &str = "/v1/subdivide";
    const ID: &str = "subdivide";
    const TAG: &str = "Curves";
    const SUMMARY: &str = "Cut a curve into pieces";
    const DESCRIPTION: &str = "\
        The pieces run over the same curve, over the same domain. Cheng et al. 2021 section 4 \
        gives the halves as Bezier curves; here they come back in their own family too. Cost: \
        linear in pieces.";
    const ANSWERED: &str = "The pieces.";
    const EXAMPLES: &[Example] = EXAMPLES;

    fn compute(context: &Context, request: SubdivideRequest) -> Result<SubdivideAnswer, Error> {
        let form = request.form.unwrap_or(Form::Auto);
        let tolerance = request.at.as_ref().and_then(|at| at.tolerance);
        match parts(context, request.curve, request.at)? {
            (Dimensioned::Plane(curve), at) => cut(context, &curve, &at, form, tolerance),
            (Dimensioned::Space(curve), at) => cut(context, &curve, &at, form, tolerance),
        }
    }

    fn is_small(request: &SubdivideRequest) -> bool {
        let few = |cuts: &Cuts| {
            cuts.values.as_ref().is_some_and(|values| values.len() <= 64)
                || cuts.depth.is_some_and(|depth| depth.0 <= 3)
        };
        request.at.as_ref().is_none_or(few) && request.curve.as_ref().is_none_or(Curve::is_small)
    }
}

impl Costed for SubdivideRequest {
    fn cost(&self) -> Cost {
        let size = self.curve.as_ref().map_or(0.0, size);
        let cuts = self.at.as_ref();
        let pieces = cuts.and_then(|cuts| {
            cuts.values.as_ref().map(Vec::len).or(cuts.depth.map(|depth| 1 << depth.0.min(20)))
        });
        match pieces {
            Some(pieces) => Cost::new(Kind::Segments, 100.0 * size * (1 + pieces) as f64),
            None => Cost::new(Kind::Adaptive, 20_000.0 * size),
        }
    }
}

impl Request for SubdivideRequest {
    fn check(self, context: &Context) -> Result<(), Error> {
        parts(context, self.curve, self.at).map(drop)
    }
}

fn parts(
    context: &Context,
    curve: Option<Curve>,
    at: Option<Cuts>,
) -> Result<(AnyDimensioned, core::Cuts), Error> {
    both(part(curve, "curve", |value| value.parse(context)), part(at, "at", Cuts::parse))
}

fn cut<const D: usize, const H: usize>(
    context: &Context,
    curve: &AnyCurve<D, H>,
    at: &core::Cuts,
    form: Form,
    tolerance: Option<f64>,
) -> Result<SubdivideAnswer, Error>
where
    Points: From<Vec<Point<D>>>,
{
    Ok(match curve {
        AnyCurve::Polynomial(curve) => {
            let of_core = |curve| Curve::of_core(curve::Curve::Piecewise(curve));
            answer(core::subdivide(context, curve, at, form.into())?, of_core, tolerance)
        }
        AnyCurve::Rational(curve) => {
            let pieces = rational::subdivide(context, curve, at, form.into())?;
            answer(pieces, Curve::of_rational, tolerance)
        }
    })
}

fn answer<C, const D: usize>(
    pieces: core::Subdivision<C, D>,
    curve: impl FnOnce(C) -> Curve,
    tolerance: Option<f64>,
) -> SubdivideAnswer
where
    Points: From<Vec<Point<D>>>,
{
    SubdivideAnswer {
        curve: curve(pieces.curve),
        split_parameters: pieces.split_parameters,
        split_points: pieces.split_points.into(),
        form: if pieces.in_family { Form::Family } else { Form::Bezier },
        condition: pieces.condition,
        tolerance,
    }
}

impl From<Form> for core::Form {
    fn from(form: Form) -> Self {
        match form {
            Form::Auto => core::Form::Auto,
            Form::Family => core::Form::Family,
            Form::Bezier => core::Form::Bezier,
        }
    }
}

impl Cuts {
    fn parse(self) -> Result<core::Cuts, Error> {
        let cuts = match self.kind()? {
            CutsKind::Parameters => core::Cuts::Parameters(need(self.values, "values")?),
            CutsKind::Depth => core::Cuts::Depth(need(self.depth, "depth")?.0),
            CutsKind::Flatness => core::Cuts::Flatness(need(self.tolerance, "tolerance")?),
        };
        cuts.check()?;
        Ok(cuts)
    }
}
