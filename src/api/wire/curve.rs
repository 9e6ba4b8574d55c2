//! Curves on the wire.

use crate::api::error::{Error, Locate, both, every};
use crate::api::wire::basis::{Basis, BasisFamily, Shape, li_beta, parse_list};
use crate::api::wire::field::{Whole, need, number, part, whole};
use crate::api::wire::points::Points;
use crate::core::basis;
use crate::core::check::increasing;
use crate::core::check::within_degrees;
use crate::core::context::Context;
use crate::core::curve as core;
use crate::core::fault::Fault;
use crate::core::knots::Breaks;
use crate::core::limits;
use crate::core::point::Point;
use crate::core::rational::{AnyCurve, Rational};

crate::union! {
    /// A curve, told by its `family`. Every operation takes one and returns one, so the output of a
    /// call is the input of the next.
    pub struct Curve by family: CurveFamily {
        /// The shape parameter of Cheng et al. 2021, 0 or more. Exactly one of `beta` and
        /// `lambda` is given.
        beta: f64 = number().minimum(Some(0.0)),
        /// 1 / beta, 0 or more; 0 is the limit beta = infinity, the straight segment. Exactly one
        /// of `beta` and `lambda` is given.
        lambda: f64 = number().minimum(Some(0.0)),
        /// The length of the parameter domain, 0 < alpha <= 1.
        alpha: f64 = number().exclusive_minimum(Some(0.0)).maximum(Some(1.0)),
        /// The shape matrix.
        shape: Shape,
        /// One basis for all segments, or one for each.
        bases: Vec<Basis>,
        /// Control points per segment, less one; 1 to 64.
        order: Whole = whole(1, limits::DEGREE),
        /// The degree, 1 to 64.
        degree: Whole = whole(1, limits::DEGREE),
        /// Of a piecewise curve: the parameters of the joints, strictly increasing, one more than
        /// segments. Of a B-spline: the full knot vector, control points + degree + 1 knots that do
        /// not decrease (some programs leave out the first and the last).
        knots: Vec<f64>,
        /// Whether the curve ends where it starts; default false.
        closed: bool,
        /// The control polygon. A piecewise curve has segments * order + 1 points, as neighbours
        /// share the point at their joint.
        control_points: Points,
        /// One weight for each control point, more than 0, the largest at most 1e12 times the
        /// smallest: they make the curve rational. Control points are not multiplied with them.
        /// Default: all the same, which is a polynomial curve.
        weights: Vec<f64> = utoipa::openapi::schema::ArrayBuilder::new().items(number().exclusive_minimum(Some(0.0))),
    }
    /// A Bezier curve over [0, 1].
    "bezier" Bezier as BezierCurve: [control_points] [weights];
    /// A Beta-Bezier curve over [0, 1] (Cheng et al. 2021).
    "beta-bezier" Beta as BetaBezierCurve: [control_points] [beta, lambda, weights]
        either [beta as BetaBezierCurve, lambda as BetaBezierCurveByLambda];
    /// An alpha-beta-Bezier curve over [0, alpha] with 4 control points (Li 2014).
    "alpha-beta-bezier" AlphaBeta as AlphaBetaBezierCurve: [alpha, beta, control_points] [weights] where {
        /// The second shape parameter of Li 2014, 0 < beta <= 3; alpha = 1, beta = 3 is the Bezier
        /// curve.
        beta = li_beta(),
    };
    /// A Quasi-Bezier curve over [0, 1] (Chen 2013).
    "quasi-bezier" Quasi as QuasiBezierCurve: [shape, control_points] [weights];
    /// Segments joined end to end over [first knot, last knot], each filling its interval.
    "piecewise" Piecewise as PiecewiseCurve: [bases, order, knots, control_points] [closed, weights];
    /// A B-spline over its valid knot range.
    "bspline" BSpline as BSplineCurve: [degree, knots, control_points] [closed, weights];
}

/// A curve, or a list of curves, whose dimension is known.
pub type Dimensioned<P = core::Curve<2>, S = core::Curve<3>> =
    crate::core::dimensioned::Dimensioned<P, S>;

/// A curve with weights or without.
pub type AnyDimensioned = Dimensioned<AnyCurve<2, 3>, AnyCurve<3, 4>>;

/// Curves of one dimension, with weights or without.
pub type AnyCurves = Dimensioned<Vec<AnyCurve<2, 3>>, Vec<AnyCurve<3, 4>>>;

impl AnyDimensioned {
    /// Curves of one dimension, that of the first.
    ///
    /// # Errors
    /// Faults of a curve at its place in the list; no curve at all; a curve of another dimension.
    pub fn parse_list(context: &Context, curves: Vec<Curve>) -> Result<AnyCurves, Error> {
        crate::core::check::at_least("curves", curves.len(), 1)?;
        let parsed =
            every(curves.into_iter().enumerate().map(|(i, curve)| curve.parse(context).at(i)))?;
        let (mut plane, mut space) = (Vec::new(), Vec::new());
        for (i, curve) in parsed.into_iter().enumerate() {
            match curve {
                Dimensioned::Plane(curve) => plane.push(curve),
                Dimensioned::Space(curve) => space.push(curve),
            }
            if !plane.is_empty() && !space.is_empty() {
                let (count, expected) = if plane.len() == i { (3, 2) } else { (2, 3) };
                let rule = "all curves have as many coordinates as the first";
                return Err(Fault::WrongCount { what: "coordinates", count, expected, rule })
                    .at("control_points")
                    .at(i);
            }
        }
        Ok(if space.is_empty() { Dimensioned::Plane(plane) } else { Dimensioned::Space(space) })
    }
}

/// A curve but for its control points, whose dimension is not known yet.
enum Outline {
    Single(basis::Basis),
    Piecewise { bases: core::Bases, breaks: Breaks, order: usize, closed: bool },
    BSpline { degree: usize, knots: Vec<f64>, closed: bool },
}

impl Outline {
    fn weighted<const D: usize, const H: usize>(
        self,
        context: &Context,
        points: Vec<Point<D>>,
        weights: Option<Vec<f64>>,
    ) -> Result<AnyCurve<D, H>, Error> {
        let curve = self.with_points(context, points)?;
        Ok(match weights {
            Some(weights) => AnyCurve::new(context, curve, weights)?,
            None => AnyCurve::Polynomial(curve),
        })
    }

    fn with_points<const D: usize>(
        self,
        context: &Context,
        points: Vec<Point<D>>,
    ) -> Result<core::Curve<D>, Error> {
        Ok(match self {
            Outline::Single(basis) => {
                core::Curve::Single(core::Single::new(context, basis, points)?)
            }
            Outline::Piecewise { bases, breaks, order, closed } => core::Curve::Piecewise(
                core::Piecewise::new(context, bases, order, breaks, closed, points)?,
            ),
            Outline::BSpline { degree, knots, closed } => {
                core::Curve::BSpline(core::BSpline::new(context, degree, knots, points, closed)?)
            }
        })
    }
}

impl Curve {
    /// Whether work that is linear in the segments costs less than handing it to another thread.
    pub fn is_small(&self) -> bool {
        let points = self.control_points.as_ref().map_or(0, Points::len);
        let order = self.order.or(self.degree).map_or(points, |order| order.0);
        points <= 256 && order <= 16 && self.bases.as_ref().map_or(0, Vec::len) <= 8
    }

    /// The core's curve.
    ///
    /// # Errors
    /// Fields of another family, missing fields, and whatever the mathematics forbids, each at its
    /// place.
    pub fn parse(mut self, context: &Context) -> Result<AnyDimensioned, Error> {
        context.checkpoint()?;
        let family = self.kind();
        let weights = self.weights.take();
        let points = need(self.control_points.take(), "control_points");
        let ((_, frame), points) = both(both(family, self.frame(context)), points)?;
        Ok(match points {
            Points::Plane(points) => Dimensioned::Plane(frame.weighted(context, points, weights)?),
            Points::Space(points) => Dimensioned::Space(frame.weighted(context, points, weights)?),
        })
    }

    /// All but the control points.
    fn frame(self, context: &Context) -> Result<Outline, Error> {
        let family = match self.tag()? {
            CurveFamily::Bezier => BasisFamily::Bezier,
            CurveFamily::Beta => BasisFamily::Beta,
            CurveFamily::AlphaBeta => BasisFamily::AlphaBeta,
            CurveFamily::Quasi => BasisFamily::Quasi,
            CurveFamily::Piecewise => return self.piecewise(context),
            CurveFamily::BSpline => return self.bspline(context),
        };
        let basis = Basis {
            family: Some(family),
            beta: self.beta,
            lambda: self.lambda,
            alpha: self.alpha,
            shape: self.shape,
        };
        basis.parse(context).map(Outline::Single)
    }

    fn piecewise(self, context: &Context) -> Result<Outline, Error> {
        let list = |bases| {
            let mut bases = parse_list(context, bases)?;
            match bases.pop() {
                Some(only) if bases.is_empty() => Ok(core::Bases::Common(only)),
                Some(last) => {
                    Ok(core::Bases::PerSegment(bases.into_iter().chain([last]).collect()))
                }
                None => Err(Error::from(Fault::TooFew { what: "bases", count: 0, least: 1 })),
            }
        };
        let parts = both(
            part(self.bases, "bases", list),
            part(self.knots, "knots", |knots| Breaks::new(context, knots)),
        );
        let order = part(self.order, "order", |order| {
            within_degrees(context, "order", order.0).map(|()| order.0)
        });
        let ((bases, breaks), order) = both(parts, order)?;
        Ok(Outline::Piecewise { bases, breaks, order, closed: self.closed.unwrap_or(false) })
    }

    fn bspline(self, context: &Context) -> Result<Outline, Error> {
        let degree = part(self.degree, "degree", |degree| {
            within_degrees(context, "degree", degree.0).map(|()| degree.0)
        });
        let knots =
            part(self.knots, "knots", |knots| increasing("knots", &knots, false).map(|()| knots));
        let (degree, knots) = both(degree, knots)?;
        Ok(Outline::BSpline { degree, knots, closed: self.closed.unwrap_or(false) })
    }

    /// The curve of an answer.
    pub fn of_core<const D: usize>(curve: core::Curve<D>) -> Self
    where
        Points: From<Vec<Point<D>>>,
    {
        match curve {
            core::Curve::Single(curve) => {
                let (basis, points) = curve.into_parts();
                Self::single((&basis).into(), points.into())
            }
            core::Curve::Piecewise(curve) => Self {
                bases: Some(curve.bases().as_slice().iter().map(Basis::from).collect()),
                order: Some(Whole(curve.order())),
                knots: Some(curve.breaks().as_slice().to_vec()),
                closed: Some(curve.closed()),
                control_points: Some(curve.into_control_points().into()),
                ..Self::of(CurveFamily::Piecewise)
            },
            core::Curve::BSpline(curve) => Self {
                degree: Some(Whole(curve.degree())),
                knots: Some(curve.knots().as_slice().to_vec()),
                closed: Some(curve.closed()),
                control_points: Some(curve.into_control_points().into()),
                ..Self::of(CurveFamily::BSpline)
            },
        }
    }

    /// The curve of an answer, with weights or without.
    pub fn of_any<const D: usize, const H: usize>(curve: AnyCurve<D, H>) -> Self
    where
        Points: From<Vec<Point<D>>>,
    {
        match curve {
            AnyCurve::Polynomial(curve) => Self::of_core(curve),
            AnyCurve::Rational(curve) => Self::of_rational(curve),
        }
    }

    /// The rational curve of an answer.
    pub fn of_rational<const D: usize, const H: usize>(curve: Rational<D, H>) -> Self
    where
        Points: From<Vec<Point<D>>>,
    {
        let (curve, weights) = curve.into_parts();
        Self { weights: Some(weights.into_vec()), ..Self::of_core(curve) }
    }

    fn single(basis: Basis, points: Points) -> Self {
        let family = basis.family.map(|family| match family {
            BasisFamily::Bezier => CurveFamily::Bezier,
            BasisFamily::Beta => CurveFamily::Beta,
            BasisFamily::AlphaBeta => CurveFamily::AlphaBeta,
            BasisFamily::Quasi => CurveFamily::Quasi,
        });
        Self {
            family,
            beta: basis.beta,
            lambda: basis.lambda,
            alpha: basis.alpha,
            shape: basis.shape,
            control_points: Some(points),
            ..Self::default()
        }
    }
}
