//! Curves close to points: control points, shape parameters, both, or as few segments as a
//! tolerance allows.
//!
//! Every linear problem goes through [`least_squares`](crate::core::linear::least_squares), so no
//! condition number is squared. The error that is returned is measured afresh on the curve that is
//! returned.

mod alpha_beta;
mod beta;
mod between;
mod both;
mod chord;
mod coarsen;
mod combination;
mod control_points;
mod correction;
mod data;
mod descent;
mod feet;
mod fewest;
mod freedom;
mod influence;
mod local;
mod measure;
mod near;
mod newton;
mod offsets;
mod ordered;
mod parameters;
mod problem;
mod quasi;
mod reduced;
mod refine;
mod shape;
mod spacing;
mod spline;
mod starts;
mod through;
mod tolerance;
mod unsolved;

pub use measure::FitError;

use super::argument::Argument;
use super::basis::Basis;
use super::curve::{Curve, Single};
use super::error::{Error, Locate};
use super::fault::Fault;
use super::parameterization::Parameterization;
use super::point::Point;
use crate::core::context::Context;
use data::Data;
use freedom::Freedom;

/// The most rounds of parameter correction from one start.
pub const CORRECTION_ROUNDS: usize = 400;
/// A fit whose gradient is below this is stationary: some times the root of a rounding, beyond
/// which sums of squares do not tell fits apart.
pub const STATIONARY: f64 = 1e-7;

/// How to fit.
#[derive(Debug, Clone, PartialEq)]
pub struct Options<const D: usize> {
    /// One positive weight per point; none means that all count the same.
    pub weights: Option<Vec<f64>>,
    /// How the points get their parameters.
    pub parameters: Parameterization,
    /// What happens at the first and the last point.
    pub ends: Ends,
    /// Whether to move the parameters to the feet of the points on the curve, and solve again
    /// (Hoschek 1988).
    pub parameter_correction: bool,
    /// What is sought.
    pub solve: Solve<D>,
}

/// What happens at the first and the last point.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Ends {
    /// The curve starts exactly at the first point and ends exactly at the last.
    Interpolate,
    /// The first and the last point count like any other.
    Free,
}

/// What is sought.
#[derive(Debug, Clone, PartialEq)]
pub enum Solve<const D: usize> {
    /// The control points of one segment: linear least squares.
    ControlPoints {
        /// The basis, shape parameters included.
        basis: Basis,
        /// One less than the number of control points.
        order: usize,
    },
    /// The shape parameters of one segment, whose control polygon is given.
    Shape {
        /// Whose shape parameters.
        family: Family,
        /// The control polygon.
        control_points: Vec<Point<D>>,
    },
    /// Control points and shape parameters, in turn, from degree elevation on: a local minimum.
    Both {
        /// Only quasi-bezier of a degree above the order: see [`fit`].
        family: Family,
        /// One less than the number of control points.
        order: usize,
    },
    /// A C2 piecewise cubic with few segments, no point further from it than the tolerance.
    Tolerance {
        /// The basis of every segment.
        basis: Basis,
        /// The largest distance allowed between a point and the curve at its parameter; absolute.
        tolerance: f64,
    },
}

/// A family whose shape parameters are sought.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Family {
    /// Without shape parameters: nothing to seek.
    Bezier,
    /// `beta` in [0, infinity].
    Beta,
    /// `s = alpha beta` in (0, 3]: the only combination that changes the curve.
    AlphaBeta,
    /// The shape matrix.
    Quasi {
        /// The degree of the curve, at least the order of the polygon.
        degree: usize,
    },
}

/// A fitted curve.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit<const D: usize> {
    /// The curve.
    pub curve: Curve<D>,
    /// Unweighted distances between each point and the curve at its parameter, measured on `curve`.
    pub error: FitError,
    /// The largest distance of `curve` from the polyline of the points, section by section: the
    /// curve between the parameters of two neighbouring points (by parameter) against the straight
    /// segment between them; what is before the first parameter or after the last against that
    /// point. Exact to 1e-9 of its value.
    pub between: f64,
    /// The native parameter of each point.
    pub parameters: Vec<f64>,
    /// Rounds of parameter correction, of alternation, or of refinement; 1 where one solve was
    /// enough.
    pub iterations: usize,
    /// Whether progress ended the rounds, and not their limit.
    pub converged: bool,
    /// Whether the shape parameter sought ended on a bound of its range.
    pub at_bound: bool,
    /// Whether the parameters do not decrease from point to point.
    pub ordered: bool,
    /// With parameter correction: how far the fit is from a stationary point of the weighted sum of
    /// squares; see [`fit`].
    pub gradient: Option<f64>,
    /// Below this the gradient is zero: [`STATIONARY`], or what rounding hides.
    pub gradient_tolerance: Option<f64>,
    /// For [`Solve::Tolerance`]: whether leaving out every single joint was tried in vain; false
    /// where the bounded work ran out first, or where the points do not determine a spline without
    /// one of them.
    pub locally_minimal: Option<bool>,
}

/// A segment that one solve found.
struct Solved<const D: usize> {
    curve: Single<D>,
    iterations: usize,
    converged: bool,
    at_bound: bool,
}

/// A way to find a single segment for points whose parameters are known.
trait Solver<const D: usize> {
    /// The length of the domain of the curve to come.
    fn length(&self) -> f64 {
        1.0
    }

    /// The best segment for these parameters.
    fn solve(
        &self,
        context: &Context,
        data: &Data<D>,
        parameters: &[f64],
    ) -> Result<Solved<D>, Error>;

    /// Whether the segment found is the best for its parameters, so that these can be sought with
    /// it.
    fn is_exact(&self) -> bool {
        true
    }

    /// The same for a curve with one control point less, whose parameters this one may start from.
    fn lower(&self) -> Option<Box<dyn Solver<D>>> {
        None
    }

    /// How a segment that it found may change, to first order, while the parameters do.
    fn freedom(&self, curve: &Single<D>, data: &Data<D>) -> Freedom<D>;
}

/// Fits a curve to points.
///
/// - [`Solve::ControlPoints`]: the least-squares solution, O(points * order^2).
/// - [`Solve::Shape`]: the data are reduced once to `degree + 1` equations, O(points * degree^2).
///   alpha-beta-Bezier: the minimum, in closed form, returned as `alpha = 1, beta = s`.
///   Beta-Bezier: a fixed grid in `beta / (1 + beta)`, its three best valleys refined.
///   Quasi-Bezier: the minimum of a convex program; where several matrices give that curve, the one
///   closest to degree elevation row by row.
/// - [`Solve::Both`]: those two steps in turn, none of which raises the error: a local minimum.
///   Families with `degree = order` are refused: each spans all polynomials of its degree whatever
///   its shape parameters, so the data cannot tell them.
/// - [`Solve::Tolerance`]: segments are split at data parameters until the least-squares spline
///   holds, then joints are taken out while it still does; joints spread evenly, by length and by
///   points, and moved to where the error asks for them are tried as well, and the fewest segments
///   taken. To hold is to be within the tolerance of every point and to stay near the points in
///   between: no stretch further from its chord than twice the tolerance and twice what
///   interpolation needs there or beside it, than half the longest chord there, or than half the
///   diagonal of the points' box. Where even interpolation strays, short derivatives and two more
///   joints keep a stretch near. `locally_minimal` says whether taking out every single remaining
///   joint was tried in vain; work on that is bounded.
///
/// With `parameter_correction` the parameters are sought too, inside the domain, for the least
/// weighted sum of squared distances: steps of Newton's method for curve and parameters together,
/// from several starts, the one given among them, up to [`CORRECTION_ROUNDS`] rounds from each. A
/// local minimum, never worse than the fit without. `gradient` is the largest cosine between the
/// offsets, as one long vector with the roots of the weights, and the change of that vector with
/// one parameter; the fit has converged where that is at most `gradient_tolerance`: [`STATIONARY`],
/// or what rounding hides. Not every problem has a minimum: with few unknowns left to the data a
/// curve may come ever closer to them as its control points run away, and does not converge.
/// O(points * (dimension * order)^2) a round; the starts of more than some hundred points are
/// compared on some of them. [`Solve::Both`] alternates with the feet of the points instead, for 10
/// rounds at most.
///
/// # Errors
/// At `points`, `weights`, `parameterization/values`, `ends`, `parameter_correction` or `solve`:
/// counts and ranges, contradictions, [`Fault::RankDeficient`] where more than one curve fits best,
/// [`Fault::ToleranceNotMet`] where points of one parameter are too far apart.
///
/// ```
/// use springline::core::basis::{Basis, Bezier};
/// use springline::core::context::Context;
/// use springline::core::fit::{Ends, Options, Solve, fit};
/// use springline::core::parameterization::Parameterization;
/// use springline::core::point::Point;
///
/// let points = vec![Point([0.0, 0.0]), Point([1.0, 1.0]), Point([2.0, 1.0]), Point([3.0, 0.0])];
/// let solve = Solve::ControlPoints { basis: Basis::Bezier(Bezier), order: 2 };
/// let parameters = Parameterization::ChordLength;
/// let ends = Ends::Interpolate;
/// let options = Options { weights: None, parameters, ends, parameter_correction: true, solve };
/// let fit = fit(&Context::default(), points, options)?;
/// assert!(fit.error.max < 0.01);
/// # Ok::<_, springline::core::error::Error>(())
/// ```
pub fn fit<const D: usize>(
    context: &Context,
    points: Vec<Point<D>>,
    mut options: Options<D>,
) -> Result<Fit<D>, Error> {
    let data = Data::new(context, points, options.weights.take(), options.ends)?;
    let fit = solved(context, &data, options)?;
    let between =
        between::between(context, &fit.curve.composite(context)?, &data.points, &fit.parameters)?;
    if between.is_finite() {
        Ok(Fit { between, ..fit })
    } else {
        Err(Fault::Overflow.at(Argument::Points))
    }
}

/// The same before `between` is measured, once, where all else is known.
fn solved<const D: usize>(
    context: &Context,
    data: &Data<D>,
    options: Options<D>,
) -> Result<Fit<D>, Error> {
    let single = |solver: &dyn Solver<D>| {
        let parameters = options.parameters.on_domain(data, solver.length())?;
        let first = solver.solve(context, data, &parameters)?;
        if options.parameter_correction {
            return correction::correct(
                context,
                first,
                parameters,
                solver,
                data,
                &options.parameters,
            );
        }
        Fit::of(context, first, data, parameters)
    };
    match options.solve {
        Solve::ControlPoints { basis, order } => single(
            &control_points::ControlPoints::new(context, basis, order, data.ends)
                .at(Argument::Solve)?,
        ),
        Solve::Shape { family, control_points } => {
            single(shape::solver(context, family, control_points, data)?.as_ref())
        }
        Solve::Both { family, order } => {
            single(&both::Both::new(context, family, order).at(Argument::Solve)?)
        }
        Solve::Tolerance { basis, tolerance } => {
            if options.parameter_correction {
                let why = "parameter correction would move the parameters at which a tolerance fit places its joints; leave it out here";
                return Err(Fault::Contradiction(why.into()).at(Argument::ParameterCorrection));
            }
            let parameters = options.parameters.in_order(data)?;
            tolerance::fit(context, data, parameters, basis, tolerance)
        }
    }
}

impl<const D: usize> Fit<D> {
    /// What a solve found, measured.
    fn of(
        context: &Context,
        solved: Solved<D>,
        data: &Data<D>,
        parameters: Vec<f64>,
    ) -> Result<Self, Error> {
        let Solved { curve, iterations, converged, at_bound } = solved;
        let curve = Curve::Single(curve);
        let error = measure::measure(context, &curve, &data.points, &parameters)?;
        if !error.rms.is_finite() {
            return Err(Fault::Overflow.at(Argument::Points));
        }
        let ordered = parameters.is_sorted();
        let (gradient, gradient_tolerance, locally_minimal) = (None, None, None);
        Ok(Fit {
            curve,
            error,
            between: f64::NAN,
            parameters,
            iterations,
            converged,
            at_bound,
            ordered,
            gradient,
            gradient_tolerance,
            locally_minimal,
        })
    }
}
