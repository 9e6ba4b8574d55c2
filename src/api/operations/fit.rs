//! `fit`.

use crate::api::cost::{Cost, Costed, Kind, length};
use crate::api::error::{Error, Locate, both};
use crate::api::json::Request;
use crate::api::operations::Example;
use crate::api::operations::{Operation, Output};
use crate::api::wire::{Basis, Curve, Points, Whole, need, number, part, whole};
use crate::core::context::Context;
use crate::core::fault::Fault;
use crate::core::fit as core;
use crate::core::limits;
use crate::core::parameterization::Parameterization;
use crate::core::point::Point;

crate::names! {
    /// A family whose shape parameters are sought.
    pub enum ShapeFamily {
        /// beta in [0, infinity].
        Beta = "beta-bezier",
        /// alpha * beta in (0, 3].
        AlphaBeta = "alpha-beta-bezier",
        /// The shape matrix.
        Quasi = "quasi-bezier",
    }
}

crate::union! {
    /// What is sought.
    pub struct Solve by kind: SolveKind {
        /// The basis, with its shape parameters.
        basis: Basis,
        /// One less than the number of control points; 1 to 64.
        order: Whole = whole(1, limits::DEGREE),
        /// Whose shape parameters are sought.
        family: ShapeFamily,
        /// The control polygon, which stays.
        control_points: Points,
        /// Of a quasi-bezier curve, which needs it: the degree, at least the order; 1 to 64.
        degree: Whole = whole(1, limits::DEGREE),
        /// The largest distance allowed between a data point and the curve at its parameter, in the
        /// unit of the coordinates; more than 0.
        tolerance: f64 = number().exclusive_minimum(Some(0.0)),
    }
    /// The control points of one segment of a given basis: linear least squares.
    "control-points" ControlPoints as SolveControlPoints: [basis, order] [];
    /// The shape parameters of one segment with a given control polygon.
    "shape" Shape as SolveShape: [family, control_points] [degree];
    /// Control points and shape matrix in turn, from degree elevation on: a local minimum. Only for
    /// quasi-bezier with degree above order: other families span the same curves whatever their
    /// shape parameters.
    "both" Both as SolveBoth: [family, order] [degree];
    /// A C2 piecewise cubic that comes within a tolerance of every point, with few segments, and
    /// stays near the points in between: no stretch between two neighbours is further from their
    /// chord than twice the tolerance plus twice what interpolation needs there, nor than half the
    /// diagonal of the points' box. Two points give a line, three a parabola.
    "tolerance" Tolerance as SolveTolerance: [basis, tolerance] [];
}

crate::union! {
    /// How the points get their parameters; default chord-length. The rules fill the curve's domain
    /// from end to end.
    pub struct FitParameterization by kind: FitParameterizationKind {
        /// One parameter per point, inside the curve's domain; points may share one. With `ends`
        /// interpolate the first and the last are the ends of the domain. For a tolerance fit they
        /// do not decrease, and the first and the last are the domain.
        values: Vec<f64>,
    }
    /// 0, 1, 2, ...: blind to distances.
    "uniform" Uniform as UniformParameterization: [] [];
    /// Sums of the distances between neighbours.
    "chord-length" ChordLength as ChordLengthParameterization: [] [];
    /// Sums of the square roots of the distances (Lee 1989).
    "centripetal" Centripetal as CentripetalParameterization: [] [];
    /// Given.
    "parameters" Parameters as GivenParameters: [values] [];
}

crate::names! {
    /// What happens at the first and the last point.
    pub enum Ends {
        /// The curve starts exactly at the first point and ends exactly at the last.
        Interpolate = "interpolate",
        /// They count like any other point.
        Free = "free",
    }
}

crate::object! {
    /// Points to fit.
    pub struct FitRequest {
        /// The points in turn, 2 to 100,000.
        required points: Points,
        /// What is sought.
        required solve: Solve,
        /// One weight per point, each more than 0: the weighted sum of squared distances is
        /// minimised. Default: all 1.
        optional weights: Vec<f64> = utoipa::openapi::schema::ArrayBuilder::new().items(number().exclusive_minimum(Some(0.0))),
        /// How the points get their parameters; default chord-length.
        optional parameterization: FitParameterization,
        /// What happens at the ends: `interpolate` (the default) or `free` (the default where the
        /// control polygon is given).
        optional ends: Ends,
        /// Whether to seek the parameters of the points too, together with the curve, for the least
        /// weighted sum of squares (total least squares; Borges and Pastva 2002); default false.
        /// Not for a tolerance fit.
        optional parameter_correction: bool,
    }
}

crate::answer! {
    /// Unweighted distances between each data point and the curve at the point's parameter,
    /// measured on the curve returned.
    pub struct FitDeviation {
        /// The largest.
        required max: f64 = number().minimum(Some(0.0)),
        /// The root of the mean square.
        required rms: f64 = number().minimum(Some(0.0)),
        /// The position of the point with the largest, from 0.
        required worst_index: Whole,
    }
}
crate::nested!(answer FitDeviation);

crate::answer! {
    /// The fitted curve.
    pub struct FitAnswer {
        /// The curve.
        required curve: Curve,
        /// How far it is from the points.
        required error: FitDeviation,
        /// The largest distance of the curve from the polyline of the points, section by section:
        /// the curve between the parameters of two neighbouring points (in the order of their
        /// parameters) against the straight segment between these points; what lies before the
        /// first parameter or after the last, against that point. Exact to 1e-9 of its value; no
        /// point of the curve is further from the polyline.
        required between: f64 = number().minimum(Some(0.0)),
        /// The parameter of each point.
        required parameters: Vec<f64>,
        /// Rounds of parameter correction from all its starts, of alternation, or of refinement; 1
        /// where one solve was enough.
        required iterations: Whole,
        /// With parameter correction: whether the fit is stationary, `gradient` being at most
        /// `gradient_tolerance`. Else whether the rounds ended because progress did, and not
        /// because of their limit.
        required converged: bool,
        /// Whether the shape parameter sought ended on a bound of its range, so that the best value
        /// may lie beyond it.
        required at_bound: bool,
        /// Whether the parameters are in the order of the points: none is less than that of the
        /// point before.
        required ordered: bool,
        /// With parameter correction: the largest cosine between the offsets of the points, each
        /// times the root of its weight, taken as one long vector, and the change of that vector
        /// with one parameter. 0 where every offset is normal to the curve. Parameters that may not
        /// move count as 0: those of interpolated ends, and those at an end of the domain that
        /// would leave it.
        optional gradient: f64 = number().minimum(Some(0.0)).maximum(Some(1.0)),
        /// Below this the gradient counts as 0: 1e-7, or more where rounding hides more.
        optional gradient_tolerance: f64 = number().minimum(Some(0.0)),
        /// Of a tolerance fit: whether leaving out every single remaining joint was tried in vain:
        /// the least-squares spline without it misses the tolerance, or strays between the points.
        /// False also where the bounded work ran out first, or where the points do not determine a
        /// spline without one of the joints.
        optional locally_minimal: bool,
        /// The parameterization used; given values are in `parameters`.
        required parameterization: FitParameterizationKind,
        /// What was done at the ends.
        required ends: Ends,
        /// Whether parameters were corrected.
        required parameter_correction: bool,
        /// The tolerance used, where one was given.
        optional tolerance: f64,
    }
}

impl Output for FitAnswer {}

/// The request bodies that the specification shows.
pub const EXAMPLES: &[Example] = &[
    Example::new(
        "control-points",
        "A cubic with beta = 1 close to seven points",
        include_str!("../../../openapi/examples/fit-control-points.json"),
    ),
    Example::new(
        "shape-cheng-figure-3",
        "Which beta? (Cheng et al. 2021 Figure 3)",
        include_str!("../../../openapi/examples/fit-shape-cheng-figure-3.json"),
    ),
    Example::new(
        "shape-chen-figure-4",
        "Which shape matrix? (Chen 2013 Figure 4)",
        include_str!("../../../openapi/examples/fit-shape-chen-figure-4.json"),
    ),
    Example::new(
        "both",
        "Control points and shape matrix",
        include_str!("../../../openapi/examples/fit-both.json"),
    ),
    Example::new(
        "tolerance",
        "As few segments as a tolerance needs",
        include_str!("../../../openapi/examples/fit-tolerance.json"),
    ),
];

/// Put a curve close to points.
#[derive(Debug, Clone, Copy)]
pub struct Fit;

impl Operation for Fit {
    type Request = FitRequest;
    type Answer = FitAnswer;
    const PATH: &str = "/v1/fit";
    const ID: &str = "fit";
    const TAG: &str = "Points";
    const SUMMARY: &str = "Put a curve close to points";
    const DESCRIPTION: &str = "\
        Finds control points, shape parameters, both, or as few segments as a tolerance needs. \
        Least squares by orthogonal rotations, never by normal equations; problems with more \
        than one solution are named, not solved. Cost: linear in points.";
    const ANSWERED: &str = "The fitted curve.";
    const EXAMPLES: &[Example] = EXAMPLES;

    fn compute(context: &Context, mut request: FitRequest) -> Result<FitAnswer, Error> {
        match need(request.points.take(), "points")? {
            Points::Plane(points) => fit(context, points, request, Points::plane),
            Points::Space(points) => fit(context, points, request, Points::space),
        }
    }
}

impl Costed for FitRequest {
    fn cost(&self) -> Cost {
        let points = length(self.points.as_ref());
        let solve = self.solve.as_ref();
        let width = solve
            .and_then(|solve| solve.order.or(solve.degree))
            .map_or(4.0, |order| (1 + order.0.min(64)) as f64);
        let rounds = if self.parameter_correction == Some(true) { 30.0 } else { 1.0 };
        let (kind, each) = match solve.and_then(|solve| solve.kind) {
            Some(SolveKind::ControlPoints) | None => (Kind::FitLinear, 20.0 * width * width),
            Some(SolveKind::Shape | SolveKind::Both) => (Kind::FitShape, 2_000.0 * width),
            Some(SolveKind::Tolerance) => (Kind::FitTolerance, 20_000.0),
        };
        Cost::new(kind, rounds * points * each)
    }
}

impl Request for FitRequest {
    fn check(self, context: &Context) -> Result<(), Error> {
        let points = need(self.points.as_ref(), "points").map(drop);
        let options = match self.points {
            Some(Points::Plane(_)) => options(context, self, Points::plane).map(drop),
            Some(Points::Space(_)) => options(context, self, Points::space).map(drop),
            // A polygon may have any dimension.
            None => options::<2>(context, self, |_| Ok(Vec::new())).map(drop),
        };
        both(points, options).map(drop)
    }
}

fn fit<const D: usize>(
    context: &Context,
    points: Vec<Point<D>>,
    request: FitRequest,
    same_dimension: fn(Points) -> Result<Vec<Point<D>>, Error>,
) -> Result<FitAnswer, Error>
where
    Points: From<Vec<Point<D>>>,
{
    let tolerance = request.solve.as_ref().and_then(|solve| solve.tolerance);
    let given =
        request.parameterization.as_ref().and_then(|parameterization| parameterization.kind);
    let used = given.unwrap_or(FitParameterizationKind::ChordLength);
    let ends = ends(&request);
    let parameter_correction = request.parameter_correction.unwrap_or(false);
    let options = options(context, request, same_dimension)?;
    let fit = core::fit(context, points, options)?;
    Ok(FitAnswer {
        curve: Curve::of_core(fit.curve),
        error: FitDeviation {
            max: fit.error.max,
            rms: fit.error.rms,
            worst_index: Whole(fit.error.worst_index),
        },
        between: fit.between,
        parameters: fit.parameters,
        iterations: Whole(fit.iterations),
        converged: fit.converged,
        at_bound: fit.at_bound,
        ordered: fit.ordered,
        gradient: fit.gradient,
        gradient_tolerance: fit.gradient_tolerance,
        locally_minimal: fit.locally_minimal,
        parameterization: used,
        ends,
        parameter_correction,
        tolerance,
    })
}

/// What is done at the ends.
fn ends(request: &FitRequest) -> Ends {
    let polygon_given =
        request.solve.as_ref().is_some_and(|solve| solve.kind == Some(SolveKind::Shape));
    request.ends.unwrap_or(if polygon_given { Ends::Free } else { Ends::Interpolate })
}

fn options<const D: usize>(
    context: &Context,
    request: FitRequest,
    same_dimension: fn(Points) -> Result<Vec<Point<D>>, Error>,
) -> Result<core::Options<D>, Error> {
    let ends = match ends(&request) {
        Ends::Interpolate => core::Ends::Interpolate,
        Ends::Free => core::Ends::Free,
    };
    let rule = request
        .parameterization
        .unwrap_or_else(|| FitParameterization::of(FitParameterizationKind::ChordLength));
    let solve = part(request.solve, "solve", |solve| solve.parse(context, same_dimension));
    let (parameters, solve) = both(rule.parse().at("parameterization"), solve)?;
    let parameter_correction = request.parameter_correction.unwrap_or(false);
    Ok(core::Options { weights: request.weights, parameters, ends, parameter_correction, solve })
}

impl FitParameterization {
    fn parse(self) -> Result<Parameterization, Error> {
        Ok(match self.kind()? {
            FitParameterizationKind::Uniform => Parameterization::Uniform,
            FitParameterizationKind::ChordLength => Parameterization::ChordLength,
            FitParameterizationKind::Centripetal => Parameterization::Centripetal,
            FitParameterizationKind::Parameters => {
                Parameterization::Given(need(self.values, "values")?)
            }
        })
    }
}

impl Solve {
    fn parse<const D: usize>(
        mut self,
        context: &Context,
        same_dimension: fn(Points) -> Result<Vec<Point<D>>, Error>,
    ) -> Result<core::Solve<D>, Error> {
        Ok(match self.kind()? {
            SolveKind::ControlPoints => {
                let basis = need(self.basis, "basis")?.parse(context).at("basis")?;
                core::Solve::ControlPoints { basis, order: need(self.order, "order")?.0 }
            }
            SolveKind::Shape => {
                let control_points =
                    same_dimension(need(self.control_points.take(), "control_points")?)
                        .at("control_points")?;
                core::Solve::Shape { family: self.sought()?, control_points }
            }
            SolveKind::Both => {
                core::Solve::Both { family: self.sought()?, order: need(self.order, "order")?.0 }
            }
            SolveKind::Tolerance => {
                let basis = need(self.basis, "basis")?.parse(context).at("basis")?;
                core::Solve::Tolerance { basis, tolerance: need(self.tolerance, "tolerance")? }
            }
        })
    }

    /// The family sought; a degree goes with quasi-bezier only.
    fn sought(&self) -> Result<core::Family, Error> {
        let family = match need(self.family, "family")? {
            ShapeFamily::Beta => core::Family::Beta,
            ShapeFamily::AlphaBeta => core::Family::AlphaBeta,
            ShapeFamily::Quasi => {
                return Ok(core::Family::Quasi { degree: need(self.degree, "degree")?.0 });
            }
        };
        match self.degree {
            None => Ok(family),
            Some(_) => {
                let why = "only quasi-bezier has a degree of its own; leave it out for this family";
                Err(Fault::Contradiction(why.into())).at("degree")
            }
        }
    }
}
