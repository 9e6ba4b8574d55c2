//! The same curve in another basis.

use super::argument::Argument;
use super::basis::Basis;
use super::curve::{Bases, Curve, Piecewise, Single};
use super::error::{Error, Locate};
use super::fault::Fault;
use super::local::placed;
use super::metric::Affine;
use super::point::Point;
use crate::core::context::Context;

/// A curve in another basis.
#[derive(Debug, Clone, PartialEq)]
pub struct Converted<C, const D: usize> {
    /// The same curve: a single segment stays one, anything else becomes piecewise over the same
    /// domain.
    pub curve: C,
    /// By how much the control points may amplify relative rounding errors: the 2-norm condition
    /// number of the new shape matrix.
    pub condition: f64,
    /// The construction of the Bezier points of each segment, where the input is cubic Beta-Bezier
    /// throughout and without weights; else empty.
    pub construction: Vec<Construction<D>>,
}

/// The points through which Cheng et al. 2021 Figure 4 constructs the inner Bezier points of a
/// cubic Beta-Bezier segment: `Q1 = (R11 + beta R12) / (1 + beta)` and
/// `Q2 = (R21 + beta R22) / (1 + beta)`, eq. (10) and (11).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Construction<const D: usize> {
    /// On the edge from P1 to P2, nearer to P1.
    pub r11: Point<D>,
    /// On the segment from P0 to P3, nearer to P0.
    pub r12: Point<D>,
    /// On the edge from P1 to P2, nearer to P2.
    pub r21: Point<D>,
    /// On the segment from P0 to P3, nearer to P3.
    pub r22: Point<D>,
}

/// Writes a curve in another basis, exactly. `order` asks for a higher one than the curve needs
/// (degree elevation). A single segment runs over the new basis's own domain. O(segments).
///
/// # Errors
/// At the basis: a basis that cannot write every curve of this degree. At `order`: one below the
/// degree of the curve, as degrees cannot be lowered exactly. At `curve`: a B-spline that jumps.
pub fn convert<const D: usize>(
    context: &Context,
    curve: &Curve<D>,
    to: Basis,
    order: Option<usize>,
) -> Result<Converted<Curve<D>, D>, Error> {
    let composite = curve.composite(context).at(Argument::Curve)?;
    let degree = composite.degree();
    let order = order.or(to.own_order()).unwrap_or(degree);
    if order < degree {
        let why = format!(
            "the curve has degree {degree}, which cannot be lowered to {order} exactly; choose a basis and an order of at least {degree}"
        );
        return Err(Fault::UnsuitableCurve(why).at(Argument::Order));
    }
    let way = to.way_back(context, order).at(Argument::Basis)?;
    let construction = construction(curve);
    if let Curve::Single(_) = curve {
        let segment = composite.local(0);
        let points = way.control_points(&super::bezier_form::elevate(segment.points, order));
        let points = points.into_iter().map(|p| placed(segment.origin, p)).collect();
        let curve = Curve::Single(Single::new(context, to, points).of_result()?);
        return Ok(Converted { curve, condition: way.condition, construction });
    }
    to.joinable(context, order).at(Argument::Basis)?;
    composite.check_joined(&Affine).at(Argument::Curve)?;
    let (piecewise, condition) = Piecewise::from_composite(
        context,
        Bases::Common(to),
        order,
        &composite,
        composite.closes(curve.closed()),
    )?;
    Ok(Converted { curve: Curve::Piecewise(piecewise), condition, construction })
}

fn construction<const D: usize>(curve: &Curve<D>) -> Vec<Construction<D>> {
    let of_segment = |basis: &Basis, points: &[Point<D>]| match (basis, points) {
        (Basis::Beta(beta), &[p0, p1, p2, p3]) => {
            Some(Construction::new(beta.beta(), [p0, p1, p2, p3]))
        }
        _ => None,
    };
    let all: Option<Vec<_>> = match curve {
        Curve::Single(single) => {
            of_segment(single.basis(), single.control_points()).map(|one| vec![one])
        }
        Curve::Piecewise(curve) => {
            let segments = 0..curve.breaks().segments();
            segments.map(|i| of_segment(curve.bases().of(i), curve.polygon(i))).collect()
        }
        Curve::BSpline(_) => None,
    };
    all.unwrap_or_default()
}

impl<const D: usize> Construction<D> {
    fn new(beta: f64, [p0, p1, p2, p3]: [Point<D>; 4]) -> Self {
        // (1 + beta) / (1 + 2 beta) and (1 + 4 beta / 3) / (1 + 2 beta), also for an infinite beta.
        let near = if beta.is_infinite() { 0.5 } else { (1.0 + beta) / (1.0 + 2.0 * beta) };
        let base = if beta.is_infinite() {
            2.0 / 3.0
        } else {
            (1.0 + 4.0 * beta / 3.0) / (1.0 + 2.0 * beta)
        };
        Construction {
            r11: p2.lerp(p1, near),
            r12: p3.lerp(p0, base),
            r21: p1.lerp(p2, near),
            r22: p0.lerp(p3, base),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::basis::{Beta, Bezier};

    #[test]
    fn the_construction_leads_to_the_bezier_points() {
        let points = [[0.0, 0.0], [1.0, 3.0], [4.0, 2.0], [5.0, -1.0]].map(Point);
        for beta in [0.0, 0.7, 5.0] {
            let single = Single::new(
                &Context::default(),
                Basis::Beta(Beta::from_beta(beta).unwrap()),
                points.to_vec(),
            )
            .unwrap();
            let q = single.bezier_points();
            let r = Construction::new(beta, points);
            assert!(r.r11.lerp(r.r12, beta / (1.0 + beta)).distance(q[1]) < 1e-15 * 8.0);
            assert!(r.r21.lerp(r.r22, beta / (1.0 + beta)).distance(q[2]) < 1e-15 * 8.0);
        }
    }

    #[test]
    fn there_and_back_is_the_same_curve() {
        let points: Vec<_> = [[0.0, 0.0], [1.0, 3.0], [4.0, 2.0], [5.0, -1.0]].map(Point).to_vec();
        let curve = Curve::Single(
            Single::new(&Context::default(), Basis::Bezier(Bezier), points.clone()).unwrap(),
        );
        let bent =
            convert(&Context::default(), &curve, Basis::Beta(Beta::from_beta(2.0).unwrap()), None)
                .unwrap();
        let back = convert(&Context::default(), &bent.curve, Basis::Bezier(Bezier), None).unwrap();
        assert!(
            back.curve.control_points().iter().zip(&points).all(|(p, q)| p.distance(*q) < 1e-13)
        );
        let high = convert(&Context::default(), &curve, Basis::Bezier(Bezier), Some(6)).unwrap();
        assert_eq!(high.curve.control_points().len(), 7);
        assert_eq!(
            convert(&Context::default(), &high.curve, Basis::Bezier(Bezier), Some(3))
                .unwrap_err()
                .place
                .to_string(),
            "/order"
        );
    }
}
