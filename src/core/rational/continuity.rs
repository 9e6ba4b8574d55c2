//! The smoothness of rational curves, measured on the curves themselves.

use super::{AnyCurve, Rational};
use crate::core::argument::Argument;
use crate::core::context::Context;
use crate::core::continuity::{Report, Tolerance, continuity as of_composite, measured};
use crate::core::curve::Composite;
use crate::core::error::{Error, Locate};
use crate::core::gaps::Order;
use crate::core::homogeneous::{project_jet, projected, weight};
use crate::core::knots::Breaks;
use crate::core::local::placed;
use crate::core::point::{Point, larger};

/// Measures every joint of a curve. O(segments).
///
/// # Errors
/// [`Fault::Cancelled`](crate::core::fault::Fault); at `curve`: too many segments.
pub fn continuity<const D: usize, const H: usize>(
    context: &Context,
    curve: &AnyCurve<D, H>,
    tolerance: Tolerance,
) -> Result<((f64, f64), Report), Error> {
    match curve {
        AnyCurve::Polynomial(curve) => {
            let composite = curve.composite(context).at(Argument::Curve)?;
            let report = of_composite(context, &composite, curve.closed(), tolerance)?;
            Ok((composite.breaks().domain(), report))
        }
        AnyCurve::Rational(rational) => {
            let orders = Orders::of(context, rational).at(Argument::Curve)?;
            let (breaks, closed) = (&orders.breaks, rational.curve().closed());
            let report = measured(context, breaks, |i| orders.segments[i], closed, tolerance)?;
            Ok((breaks.domain(), report))
        }
    }
}

/// Measures every joint of curves laid end to end, each over an interval as long as its own domain;
/// the first starts at 0.
///
/// # Errors
/// As [`continuity`], with the place of the curve.
pub fn end_to_end<const D: usize, const H: usize>(
    context: &Context,
    curves: &[AnyCurve<D, H>],
    closed: bool,
    tolerance: Tolerance,
) -> Result<((f64, f64), Report), Error> {
    let polynomial = |curve: &AnyCurve<D, H>| match curve {
        AnyCurve::Polynomial(curve) => Some(curve.composite(context)),
        AnyCurve::Rational(_) => None,
    };
    let parts: Vec<_> = curves.iter().map_while(polynomial).collect();
    if parts.len() == curves.len() {
        let parts = parts.into_iter().enumerate().map(|(i, part)| part.at(i));
        let parts = parts.collect::<Result<Vec<_>, _>>()?;
        let whole = Composite::end_to_end(context, &parts)?;
        let report = of_composite(context, &whole, closed, tolerance)?;
        return Ok((whole.breaks().domain(), report));
    }
    let (mut knots, mut segments) = (vec![0.0], Vec::new());
    for (i, curve) in curves.iter().enumerate() {
        let orders = Orders::of(context, &curve.weighted()).at(i)?;
        let start = knots[knots.len() - 1];
        let own = orders.breaks.as_slice();
        knots.extend(own[1..].iter().map(|t| start + (t - own[0])));
        segments.extend(orders.segments);
    }
    let breaks = Breaks::new(context, knots)?;
    let report = measured(context, &breaks, |i| segments[i], closed, tolerance)?;
    Ok((breaks.domain(), report))
}

/// What is compared at the joints: points and the first two derivatives of each segment.
struct Orders<const D: usize> {
    breaks: Breaks,
    segments: Vec<[Order<D>; 3]>,
}

impl<const D: usize> Orders<D> {
    fn of<const H: usize>(context: &Context, rational: &Rational<D, H>) -> Result<Self, Error> {
        let lifted = rational.homogeneous(context)?;
        let composite = lifted.curve.composite(context)?;
        let first = composite.derivative(context)?;
        let second = first.derivative(context)?;
        let gains = [composite.gains(1), composite.gains(2)];
        let breaks = composite.breaks();
        let of_segment = |i: usize| {
            let jets = [composite.local(i), first.local(i), second.local(i)];
            let start = project_jet::<D, H, 3>(jets.map(|segment| segment.first()));
            let end = project_jet::<D, H, 3>(jets.map(|segment| segment.last()));
            let points = || jets[0].absolute();
            let size = points().fold(0.0, |m, h| larger(m, h.max_abs()));
            let reach = points().map(|h| projected::<D, H>(h).max_abs()).fold(0.0, larger);
            let lightest = [jets[0].first(), jets[0].last()].map(weight);
            let lightest = lightest[0].min(lightest[1]);
            let extent =
                points().map(|h| projected::<D, H>(h).distance(start[0])).fold(0.0, larger);
            // Rounding errors of the homogeneous derivatives, led through the quotient rule.
            let slope = [jets[1].first(), jets[1].last()].map(|h| weight(h).abs());
            let slope = larger(slope[0], slope[1]) / lightest;
            let size = size * (1.0 + reach) / lightest;
            let (of_first, of_second) = (size * gains[0][i], size * gains[1][i]);
            let of_second = of_second + 2.0 * slope * of_first;
            let order = |k: usize, scale: f64, of_points: f64| {
                let (a, b) = breaks.interval(i);
                let of_length = k as f64 * (a.abs().max(b.abs()) / (b - a));
                let place = |p: Point<D>| if k == 0 { placed(lifted.origin, p) } else { p };
                Order::between(place(start[k]), place(end[k]), scale, of_points, of_length)
            };
            let at_ends = |k: usize| larger(start[k].max_abs(), end[k].max_abs());
            let magnitude = reach + lifted.origin.max_abs();
            [
                order(0, extent, magnitude),
                order(1, at_ends(1), of_first),
                order(2, at_ends(2), of_second),
            ]
        };
        let segments = context.collect((0..breaks.segments()).map(of_segment))?;
        Ok(Orders { breaks: breaks.clone(), segments })
    }
}
