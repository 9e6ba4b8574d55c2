//! `evaluate`.

use crate::api::cost::{Cost, Costed, Kind, POINT_BYTES, order, size};
use crate::api::error::{Error, Locate, both};
use crate::api::json::Request;
use crate::api::operations::Example;
use crate::api::operations::{Operation, Output};
use crate::api::wire::{
    AnyDimensioned, Curve, Dimensioned, Points, Whole, list, need, number, part, whole,
};
use crate::core::argument::Argument;
use crate::core::context::Context;
use crate::core::error::{Error as CoreError, Place};
use crate::core::evaluate as core;
use crate::core::limits;
use crate::core::point::Point;
use crate::core::rational::{self, AnyCurve};

crate::union! {
    /// Where to sample.
    pub struct Sampling by kind: SamplingKind {
        /// How many samples, at equal parameter distances from end to end; 2 to 200,000.
        count: Whole = whole(2, limits::SAMPLES),
        /// Parameters inside the curve's domain, in any order; 1 to 200,000.
        values: Vec<f64> = list::<f64>(1, limits::SAMPLES),
        /// The largest distance between the curve and the polyline through the samples, in the unit
        /// of the coordinates; proved by a bound, not sampled. More than 0.
        tolerance: f64 = number().exclusive_minimum(Some(0.0)),
    }
    /// A number of samples.
    "count" Count as CountSampling: [count] [];
    /// Given parameters.
    "parameters" Parameters as ParameterSampling: [values] [];
    /// As many samples as a tolerance needs.
    "tolerance" Tolerance as ToleranceSampling: [tolerance] [];
}

crate::names! {
    /// A quantity of the moving frame.
    pub enum Quantity {
        /// The unit tangent.
        Tangent = "tangent",
        /// The unit normal.
        Normal = "normal",
        /// The curvature.
        Curvature = "curvature",
        /// The torsion.
        Torsion = "torsion",
        /// The length of the first derivative.
        Speed = "speed",
    }
}

crate::object! {
    /// A curve and where to sample it.
    pub struct EvaluateRequest {
        /// The curve.
        required curve: Curve,
        /// Where to sample.
        required sampling: Sampling,
        /// How many orders of derivatives to return, 0 (the default) to 64, with respect to the
        /// curve's own parameter.
        optional derivatives: Whole = whole(0, limits::DEGREE),
        /// Quantities of the moving frame to return; default none. The normal is the tangent turned
        /// left by 90 degrees in 2D and the principal normal in 3D; the curvature is signed in 2D
        /// (positive turns left); torsion needs 3D.
        optional quantities: Vec<Quantity>,
    }
}

crate::answer! {
    /// A sample at which a quantity asked for does not exist; its entry there is 0 (or the zero
    /// vector).
    pub struct Degenerate {
        /// The position in `parameters`, from 0.
        required index: Whole,
        /// The parameter.
        required parameter: f64,
        /// `zero-speed`: the curve stops there within rounding, so it has no tangent, normal,
        /// curvature or torsion. `zero-curvature`: a space curve is straight there, so it has no
        /// normal and no torsion.
        required reason: DegenerateReason,
    }
}
crate::nested!(answer Degenerate);

crate::names! {
    /// Why a quantity does not exist.
    pub enum DegenerateReason {
        /// The first derivative vanishes.
        ZeroSpeed = "zero-speed",
        /// The curvature vanishes.
        ZeroCurvature = "zero-curvature",
    }
}

crate::answer! {
    /// Samples of a curve; every list has one entry per parameter.
    pub struct EvaluateAnswer {
        /// First and last parameter of the curve.
        required domain: Vec<f64> = list::<f64>(2, 2),
        /// The parameters sampled.
        required parameters: Vec<f64>,
        /// The points there.
        required points: Points,
        /// `derivatives[k - 1][i]` is the k-th derivative at `parameters[i]`; from the right at a
        /// joint, from the left at the end.
        optional derivatives: Vec<Points>,
        /// Unit tangents.
        optional tangent: Points,
        /// Unit normals.
        optional normal: Points,
        /// Curvatures, in 1 / unit of the coordinates.
        optional curvature: Vec<f64>,
        /// Torsions, in 1 / unit of the coordinates.
        optional torsion: Vec<f64>,
        /// Speeds, in unit of the coordinates / unit of the parameter.
        optional speed: Vec<f64>,
        /// Where a quantity asked for does not exist; present when quantities are asked for.
        optional degenerate: Vec<Degenerate>,
        /// The tolerance used, where one was given.
        optional tolerance: f64,
    }
}

impl Output for EvaluateAnswer {}

/// The request bodies that the specification shows.
pub const EXAMPLES: &[Example] = &[
    Example::new(
        "cheng-figure-3",
        "A cubic with beta = 1 (Cheng et al. 2021 Figure 3)",
        include_str!("../../../openapi/examples/evaluate-cheng-figure-3.json"),
    ),
    Example::new(
        "li-figure-4",
        "Curvature of an alpha-beta cubic (Li 2014 Figure 4)",
        include_str!("../../../openapi/examples/evaluate-li-figure-4.json"),
    ),
    Example::new(
        "chen-figure-2",
        "A quasi-bezier curve to a tolerance (Chen 2013 Figure 2)",
        include_str!("../../../openapi/examples/evaluate-chen-figure-2.json"),
    ),
    Example::new(
        "circle",
        "A circle: nine control points with weights",
        include_str!("../../../openapi/examples/evaluate-circle.json"),
    ),
];

/// Sample a curve.
#[derive(Debug, Clone, Copy)]
pub struct Evaluate;

impl Operation for Evaluate {
    type Request = EvaluateRequest;
    type Answer = EvaluateAnswer;
    const PATH: &str = "/v1/evaluate";
    const ID: &str = "evaluate";
    const TAG: &str = "Curves";
    const SUMMARY: &str = "Sample a curve";
    const DESCRIPTION: &str = "\
        Points, derivatives of any order, and the moving frame: tangent, normal, curvature, \
        torsion and speed. Cost: linear in samples times degree.";
    const ANSWERED: &str = "The samples.";
    const EXAMPLES: &[Example] = EXAMPLES;

    fn compute(context: &Context, request: EvaluateRequest) -> Result<EvaluateAnswer, Error> {
        let asked = request.quantities.unwrap_or_default();
        let (curve, sampling, orders) =
            parts(context, request.curve, request.sampling, request.derivatives)?;
        match curve {
            Dimensioned::Plane(curve) => sample(context, &curve, sampling, orders, &asked),
            Dimensioned::Space(curve) => sample(context, &curve, sampling, orders, &asked),
        }
    }

    fn is_small(request: &EvaluateRequest) -> bool {
        let Some(sampling) = &request.sampling else { return true };
        let samples =
            sampling.count.map(|count| count.0).or(sampling.values.as_ref().map(Vec::len));
        let quantities = request.quantities.as_ref().map_or(0, Vec::len);
        let each = request.derivatives.map_or(0, |orders| orders.0).saturating_add(1 + quantities);
        samples.is_some_and(|samples| samples.saturating_mul(each) <= 1_000)
            && request.curve.as_ref().is_none_or(Curve::is_small)
    }
}

impl Costed for EvaluateRequest {
    fn cost(&self) -> Cost {
        let (size, order) =
            self.curve.as_ref().map_or((0.0, 1.0), |curve| (size(curve), order(curve)));
        let sampling = self.sampling.as_ref();
        let samples = sampling.and_then(|sampling| {
            sampling.count.map(|count| count.0).or(sampling.values.as_ref().map(Vec::len))
        });
        let Some(samples) = samples else { return Cost::new(Kind::Adaptive, 20_000.0 * size) };
        let orders = self.derivatives.map_or(0, |orders| orders.0) as f64;
        let each = 1.0 + orders + self.quantities.as_ref().map_or(0, Vec::len) as f64;
        let points = samples as f64 * each;
        let answer = (POINT_BYTES * points) as usize;
        Cost { answer, ..Cost::new(Kind::Evaluate, 20.0 * size + points * (80.0 + 5.0 * order)) }
    }
}

impl Request for EvaluateRequest {
    fn check(self, context: &Context) -> Result<(), Error> {
        parts(context, self.curve, self.sampling, self.derivatives).map(drop)
    }
}

/// What is computed from; the tolerance beside the sampling is to be echoed.
type Parts = (AnyDimensioned, (core::Sampling, Option<f64>), usize);

fn parts(
    context: &Context,
    curve: Option<Curve>,
    sampling: Option<Sampling>,
    derivatives: Option<Whole>,
) -> Result<Parts, Error> {
    let orders = derivatives.map_or(0, |whole| whole.0);
    let parts = both(
        part(curve, "curve", |value| value.parse(context)),
        part(sampling, "sampling", |value| value.parse(context)),
    );
    let ((curve, sampling), ()) =
        both(parts, core::check_orders(context, orders).at("derivatives"))?;
    Ok((curve, sampling, orders))
}

fn sample<const D: usize, const H: usize>(
    context: &Context,
    curve: &AnyCurve<D, H>,
    (sampling, tolerance): (core::Sampling, Option<f64>),
    orders: usize,
    asked: &[Quantity],
) -> Result<EvaluateAnswer, Error>
where
    Points: From<Vec<Point<D>>>,
{
    let wanted = quantities(asked);
    let samples = match curve {
        AnyCurve::Polynomial(curve) => core::evaluate(context, curve, &sampling, orders, wanted),
        AnyCurve::Rational(curve) => rational::evaluate(context, curve, &sampling, orders, wanted),
    };
    let samples = samples.map_err(|error| name_torsion(error, asked))?;
    let frames = samples.frames;
    let has = |quantity| asked.contains(&quantity);
    let degenerate =
        frames.degenerate.iter().map(|d| Degenerate::of(*d, &samples.parameters)).collect();
    Ok(EvaluateAnswer {
        domain: vec![samples.domain.0, samples.domain.1],
        parameters: samples.parameters,
        points: samples.points.into(),
        derivatives: (orders > 0)
            .then(|| samples.derivatives.into_iter().map(Points::from).collect()),
        tangent: has(Quantity::Tangent).then(|| frames.tangents.into()),
        normal: has(Quantity::Normal).then(|| frames.normals.into()),
        curvature: has(Quantity::Curvature).then_some(frames.curvatures),
        torsion: has(Quantity::Torsion).then_some(frames.torsions),
        speed: has(Quantity::Speed).then_some(frames.speeds),
        degenerate: (!asked.is_empty()).then_some(degenerate),
        tolerance,
    })
}

/// The core knows which quantities are asked for, but not where in the list: torsion is the one it
/// may refuse.
fn name_torsion(error: CoreError, asked: &[Quantity]) -> CoreError {
    let torsion = asked.iter().position(|quantity| *quantity == Quantity::Torsion);
    match torsion {
        Some(i) if error.place == Place::here().within(Argument::Quantities) => {
            error.fault.at(i).at(Argument::Quantities)
        }
        _ => error,
    }
}

fn quantities(asked: &[Quantity]) -> core::Quantities {
    core::Quantities {
        tangent: asked.contains(&Quantity::Tangent),
        normal: asked.contains(&Quantity::Normal),
        curvature: asked.contains(&Quantity::Curvature),
        torsion: asked.contains(&Quantity::Torsion),
        speed: asked.contains(&Quantity::Speed),
    }
}

impl Sampling {
    /// The core's sampling, and the tolerance to echo.
    fn parse(self, context: &Context) -> Result<(core::Sampling, Option<f64>), Error> {
        let (sampling, tolerance) = match self.kind()? {
            SamplingKind::Count => (core::Sampling::Count(need(self.count, "count")?.0), None),
            SamplingKind::Parameters => {
                (core::Sampling::Parameters(need(self.values, "values")?), None)
            }
            SamplingKind::Tolerance => {
                (core::Sampling::Tolerance(need(self.tolerance, "tolerance")?), self.tolerance)
            }
        };
        sampling.check(context)?;
        Ok((sampling, tolerance))
    }
}

impl Degenerate {
    fn of(degenerate: core::Degenerate, parameters: &[f64]) -> Self {
        let reason = if degenerate.zero_speed {
            DegenerateReason::ZeroSpeed
        } else {
            DegenerateReason::ZeroCurvature
        };
        let core::Degenerate { index, .. } = degenerate;
        Degenerate { index: Whole(index), parameter: parameters[index], reason }
    }
}
