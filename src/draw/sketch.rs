//! A curve as the picture plane sees it.

use crate::core::context::Context;
use crate::core::curve::{Composite, Curve, Evaluator};
use crate::core::error::Error;
use crate::core::point::Point;
use crate::core::rational::{self, AnyCurve, Rational};
use crate::draw::comb::{Tooth, teeth};

/// A curve in the plane of the picture.
#[derive(Debug, Clone)]
pub struct Sketch {
    /// The Bezier points of each segment.
    pub segments: Vec<Vec<Point<2>>>,
    /// The control points.
    pub polygon: Vec<Point<2>>,
    /// Where segments start and end, each place once where neighbours meet.
    pub joints: Vec<Point<2>>,
    /// The curvature comb, where it is wanted.
    pub teeth: Vec<Tooth>,
}

impl Sketch {
    /// Projects a curve.
    ///
    /// # Errors
    /// A B-spline with too many spans.
    pub fn of<const D: usize, const H: usize>(
        context: &Context,
        curve: &AnyCurve<D, H>,
        view: fn(Point<D>) -> Point<2>,
        comb: bool,
    ) -> Result<Self, Error> {
        match curve {
            AnyCurve::Polynomial(curve) => Self::of_polynomial(context, curve, view, comb),
            AnyCurve::Rational(curve) => Self::of_rational(context, curve, view, comb),
        }
    }

    fn of_polynomial<const D: usize>(
        context: &Context,
        curve: &Curve<D>,
        view: fn(Point<D>) -> Point<2>,
        comb: bool,
    ) -> Result<Self, Error> {
        let composite = curve.composite(context)?;
        let segments = context
            .collect(composite.locals().map(|segment| segment.absolute().map(view).collect()))?;
        let teeth = if comb {
            let velocity = composite.derivative(context)?;
            let acceleration = velocity.derivative(context)?;
            let curves = [&composite, &velocity, &acceleration];
            let [place, first, second] = evaluators(context, curves)?;
            let jet = |i, u, v| [&place, &first, &second].map(|curve| curve.within(i, u, v));
            teeth(context, composite.breaks().segments(), jet, view)?
        } else {
            Vec::new()
        };
        let polygon = curve.control_points().iter().copied().map(view).collect();
        Ok(Sketch { joints: joints(&segments), segments, polygon, teeth })
    }

    /// SVG knows no rational curves: as lines, each closer to the curve than a picture shows.
    fn of_rational<const D: usize, const H: usize>(
        context: &Context,
        curve: &Rational<D, H>,
        view: fn(Point<D>) -> Point<2>,
        comb: bool,
    ) -> Result<Self, Error> {
        let polygon: Vec<Point<2>> =
            curve.curve().control_points().iter().copied().map(view).collect();
        let tolerance = FINE * extent(curve.curve().control_points());
        let points = rational::polyline(context, curve, tolerance)?;
        let lines = points.windows(2).map(|line| line.iter().map(|&p| view(p)).collect());
        let segments = context.collect(lines)?;
        let jets = rational::Jets::of(context, curve)?;
        let count = jets.segments();
        let ends = (0..count).flat_map(|i| [(i, 0.0, 1.0), (i, 1.0, 0.0)]);
        let ends = ends.map(|(i, u, v)| view(jets.within(i, u, v)[0])).collect::<Vec<_>>();
        let joints = joints(&ends.chunks(2).map(<[_]>::to_vec).collect::<Vec<_>>());
        let jet = |i, u, v| jets.within(i, u, v);
        let teeth = if comb { teeth(context, count, jet, view)? } else { Vec::new() };
        Ok(Sketch { segments, polygon, joints, teeth })
    }
}

/// How far lines may be from a curve, as a part of its extent.
const FINE: f64 = 1.0 / 8_000.0;

/// The largest distance of a point from the first.
fn extent<const D: usize>(points: &[Point<D>]) -> f64 {
    points.iter().map(|p| p.distance(points[0])).fold(0.0, f64::max)
}

fn evaluators<'a, const D: usize>(
    context: &Context,
    [a, b, c]: [&'a Composite<D>; 3],
) -> Result<[Evaluator<'a, D>; 3], Error> {
    Ok([a.evaluator(context)?, b.evaluator(context)?, c.evaluator(context)?])
}

/// Where segments start and end, each place once where neighbours meet.
fn joints(segments: &[Vec<Point<2>>]) -> Vec<Point<2>> {
    let mut joints: Vec<Point<2>> = Vec::with_capacity(segments.len() + 1);
    for segment in segments {
        let ends = [segment[0], segment[segment.len() - 1]];
        ends.into_iter().for_each(|end| {
            if joints.last() != Some(&end) {
                joints.push(end);
            }
        });
    }
    if joints.len() > 1 && joints.first() == joints.last() {
        joints.pop();
    }
    joints
}
