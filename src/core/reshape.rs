//! New shape parameters on fixed control points.

use super::argument::Argument;
use super::continuity::{Report, Tolerance, continuity};
use super::curve::{Bases, Composite, Curve, Piecewise, Single};
use super::distance::largest_distance;
use super::error::{Error, Locate};
use super::fault::Fault;
use super::joint_rows::{Side, derivative_row};
use super::point::Point;
use super::smoothness::Smoothness;
use crate::core::context::Context;
use crate::core::linear::least_change::{Condition, least_change};

/// A curve with new shape parameters.
#[derive(Debug, Clone, PartialEq)]
pub struct Reshaped<C> {
    /// The curve.
    pub curve: C,
    /// Its continuity, measured.
    pub continuity: Report,
    /// The largest distance between the old and the new curve at equal fractions of their domains;
    /// of a rational curve, at [`PLACES`](crate::core::rational::PLACES) and one of each segment.
    pub curve_moved: f64,
    /// The largest distance that a control point moved.
    pub points_moved: f64,
}

/// Gives a curve new bases. O(segments).
///
/// Where only meeting ends are kept (`C0` or less) the control points stay, which is what shape
/// parameters are for. At joints that only meets the promise of the papers for alpha-beta-Bezier
/// and end-tangent Quasi-Bezier curves: others lose their tangents. With [`Smoothness::C1`] or
/// [`Smoothness::G1`] the joints stay and the inner control points move by the least sum of squares
/// that keeps that class wherever the curve had it. With [`Smoothness::C2`] the curve itself stays,
/// as there is only one C2 cubic through its joints for its ends, and its control points change.
///
/// # Errors
/// At `curve`: a B-spline. At `basis` or `bases`: as many as segments, suiting the order. At
/// `keep`: `G2`, which is not kept alone; a joint without enough free control points; a basis
/// without a way back for [`Smoothness::C2`].
pub fn reshape<const D: usize>(
    context: &Context,
    curve: &Curve<D>,
    bases: Bases,
    keep: Smoothness,
) -> Result<Reshaped<Curve<D>>, Error> {
    if keep == Smoothness::G2 {
        let why = "G2 cannot be kept alone; keep G1, C1 or C2";
        return Err(Fault::Contradiction(why.into()).at(Argument::Keep));
    }
    let old = curve.composite(context).at(Argument::Curve)?;
    let new = match curve {
        Curve::BSpline(_) => {
            let why = "a bspline has no shape parameters; convert it to another basis first";
            return Err(Fault::UnsuitableCurve(why.into()).at(Argument::Curve));
        }
        Curve::Single(single) => Curve::Single(reshaped_single(context, single, bases, keep)?),
        Curve::Piecewise(piecewise) => {
            Curve::Piecewise(reshaped_piecewise(context, piecewise, &old, bases, keep)?)
        }
    };
    let composite = new.composite(context)?;
    Ok(Reshaped {
        continuity: continuity(context, &composite, curve.closed(), Tolerance::default())?,
        curve_moved: largest_distance(context, &old, &composite)?,
        points_moved: points_moved(curve, &new),
        curve: new,
    })
}

/// Refuses to write a curve in bases of a lower degree, which cannot be done exactly.
fn check_degree<const D: usize>(old: &Composite<D>, order: usize) -> Result<(), Fault> {
    let degree = old.degree();
    if degree <= order {
        return Ok(());
    }
    Err(Fault::UnsuitableCurve(format!(
        "the curve has degree {degree}, so with control points of order {order} only its own kind of basis keeps it as it is; convert it instead"
    )))
}

fn reshaped_single<const D: usize>(
    context: &Context,
    single: &Single<D>,
    bases: Bases,
    keep: Smoothness,
) -> Result<Single<D>, Error> {
    bases.check_count(1).at(Argument::Bases)?;
    let basis = bases.of(0).clone();
    let points = match keep {
        Smoothness::C2 => {
            check_degree(&single.composite(context)?, single.order()).at(Argument::Keep)?;
            basis
                .way_back(context, single.order())
                .at(Argument::Keep)?
                .control_points(&single.bezier_points())
        }
        _ => single.control_points().to_vec(),
    };
    Single::new(context, basis, points)
        .map_err(|error| Error::from(error.of_result().fault).at(Argument::Basis))
}

fn reshaped_piecewise<const D: usize>(
    context: &Context,
    old: &Piecewise<D>,
    composite: &Composite<D>,
    bases: Bases,
    keep: Smoothness,
) -> Result<Piecewise<D>, Error> {
    let (order, breaks, closed) = (old.order(), old.breaks(), old.closed());
    bases.check_count(breaks.segments()).at(Argument::Bases)?;
    bases.check_each(context, |basis| {
        if keep == Smoothness::C2 {
            basis.way_back(context, order).map(drop)
        } else {
            basis.joinable(context, order)
        }
    })?;
    if keep == Smoothness::C2 {
        check_degree(composite, order).at(Argument::Keep)?;
        return Ok(Piecewise::from_composite(context, bases, order, composite, closed)?.0);
    }
    let mut points = old.control_points().to_vec();
    let bent = Piecewise::new(context, bases, order, breaks.clone(), closed, points.clone())?;
    if keep <= Smoothness::C0 {
        return Ok(bent);
    }
    let kept = kept_joints(context, old, composite, keep)?;
    let row = |segment: usize, side: Side| {
        let (a, b) = bent.breaks().interval(segment);
        derivative_row(bent.bases().of(segment), order, b - a, 1, side)
    };
    let changes = mend(context, &bent, &kept, row).at(Argument::Keep)?;
    for (point, change) in points.iter_mut().zip(changes) {
        *point += change;
    }
    Piecewise::new(context, bent.bases().clone(), order, breaks.clone(), closed, points).of_result()
}

/// A joint to keep smooth: its segments, and the ratio of the speeds after and before it.
pub(crate) struct Kept {
    pub(crate) parameter: f64,
    pub(crate) left: usize,
    pub(crate) right: usize,
    pub(crate) ratio: f64,
}

/// The joints at which the old curve had the class to keep.
fn kept_joints<const D: usize>(
    context: &Context,
    old: &Piecewise<D>,
    composite: &Composite<D>,
    keep: Smoothness,
) -> Result<Vec<Kept>, Error> {
    let segments = old.breaks().segments();
    let report = continuity(context, composite, old.closed(), Tolerance::default())?;
    let derivative = composite.derivative(context)?;
    let joint = |(i, joint): (usize, &super::continuity::Joint)| {
        let (left, right) = (i, (i + 1) % segments);
        let (before, after) = (derivative.local(left).last(), derivative.local(right).first());
        let ratio = match keep {
            Smoothness::C1 if joint.parametric >= Smoothness::C1 => 1.0,
            Smoothness::G1 if joint.geometric >= Smoothness::G1 => after.norm() / before.norm(),
            _ => return None,
        };
        Some(Kept { parameter: joint.parameter, left, right, ratio })
    };
    Ok(report.joints.iter().enumerate().filter_map(joint).collect())
}

/// The least changes of inner control points that make the end derivatives at the kept joints
/// agree.
pub(crate) fn mend<const D: usize>(
    context: &Context,
    curve: &Piecewise<D>,
    kept: &[Kept],
    row: impl Fn(usize, Side) -> Vec<f64>,
) -> Result<Vec<Point<D>>, Error> {
    let order = curve.order();
    let count = curve.control_points().len();
    let mut conditions = Vec::with_capacity(kept.len() * D);
    for joint in kept {
        context.checkpoint()?;
        let before =
            row(joint.left, Side::End).into_iter().map(|c| -joint.ratio * c).collect::<Vec<_>>();
        let after = row(joint.right, Side::Start);
        for axis in 0..D {
            let mut condition = Condition::default();
            for (segment, row) in [(joint.left, &before), (joint.right, &after)] {
                for (c, &factor) in row.iter().enumerate() {
                    let point = segment * order + c;
                    condition.right -= factor * curve.control_points()[point][axis];
                    if c > 0 && c < order {
                        condition.terms.push((point * D + axis, factor));
                    }
                }
            }
            conditions.push(condition);
        }
    }
    let seam = if kept.last().is_some_and(|joint| joint.right <= joint.left) { D } else { 0 };
    let change = least_change(context, count * D, conditions, seam)?;
    let allowed = 1e-9 * super::point::magnitude(curve.control_points());
    if change.violation > allowed {
        let t = kept[change.worst / D].parameter;
        let why = format!(
            "the joint at {t:?} cannot be kept smooth: segments of order {order} have too few inner control points"
        );
        return Err(Fault::UnsuitableCurve(why).into());
    }
    Ok(change.values.chunks_exact(D).map(|x| Point(std::array::from_fn(|axis| x[axis]))).collect())
}

fn points_moved<const D: usize>(old: &Curve<D>, new: &Curve<D>) -> f64 {
    old.control_points()
        .iter()
        .zip(new.control_points())
        .map(|(p, q)| p.distance(*q))
        .fold(0.0, f64::max)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::basis::{AlphaBeta, Basis, Beta, Bezier};
    use crate::core::curve::BSpline;
    use crate::core::knots::Breaks;

    fn single(points: &[[f64; 2]]) -> Curve<2> {
        let points = points.iter().map(|&p| Point(p)).collect();
        Curve::Single(Single::new(&Context::default(), Basis::Bezier(Bezier), points).unwrap())
    }

    /// Half of both end edges is left: the curve moves by `3 / 2 u (1 - u)`.
    #[test]
    fn a_cubic_with_half_its_end_edges_moves_by_three_eighths() {
        let curve = single(&[[0.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.0]]);
        let half = Bases::Common(Basis::AlphaBeta(AlphaBeta::new(1.0, 1.5).unwrap()));
        let found = reshape(&Context::default(), &curve, half, Smoothness::C0).unwrap();
        assert_eq!((found.curve_moved, found.points_moved), (0.375, 0.0));
    }

    /// Two cubics, mirror images of each other. With beta = 1 the derivative after the joint is
    /// `(P1 - P0) + (P2 - P0) / 2 + (P3 - P0) / 3`, whose height must be 0 again: 1/6 too much,
    /// taken from `P1` and `P2` in the ratio of their factors 1 and 1/2.
    #[test]
    fn the_least_change_that_keeps_a_mirrored_joint_is_known() {
        let heights = [0.0, 2.0, 1.0, 1.0, 1.0, 2.0, 0.0];
        let points = heights.iter().enumerate().map(|(i, &y)| Point([i as f64, y])).collect();
        let context = Context::default();
        let breaks = Breaks::new(&context, vec![0.0, 1.0, 2.0]).unwrap();
        let bases = Bases::Common(Basis::Bezier(Bezier));
        let curve = Piecewise::new(&context, bases, 3, breaks, false, points).unwrap();
        let beta = Bases::Common(Basis::Beta(Beta::from_beta(1.0).unwrap()));
        let found = reshape(&context, &Curve::Piecewise(curve), beta, Smoothness::C1).unwrap();
        let (near, far) = (1.0 - 2.0 / 15.0, 2.0 - 1.0 / 15.0);
        let expected = [0.0, far, near, 1.0, near, far, 0.0];
        for (i, (p, y)) in found.curve.control_points().iter().zip(expected).enumerate() {
            assert!(p.distance(Point([i as f64, y])) <= f64::EPSILON, "{i}: {p:?}");
        }
        assert!((found.points_moved - 2.0 / 15.0).abs() <= f64::EPSILON);
    }

    #[test]
    fn a_refused_reshape_is_placed() {
        let place = |curve: &Curve<2>, bases| {
            let found = reshape(&Context::default(), curve, bases, Smoothness::C0);
            found.unwrap_err().place.to_string()
        };
        let curve = single(&[[0.0, 0.0], [1.0, 1.0], [2.0, 0.0]]);
        let cubic = Basis::AlphaBeta(AlphaBeta::new(1.0, 3.0).unwrap());
        assert_eq!(place(&curve, Bases::Common(cubic)), "/basis");
        assert_eq!(place(&curve, Bases::PerSegment(vec![Basis::Bezier(Bezier); 2])), "/bases");
        let (knots, points) = (vec![0.0, 0.0, 0.0, 1.0, 1.0, 1.0], curve.control_points().to_vec());
        let spline = BSpline::new(&Context::default(), 2, knots, points, false).unwrap();
        assert_eq!(place(&Curve::BSpline(spline), Bases::Common(Basis::Bezier(Bezier))), "/curve");
    }
}
