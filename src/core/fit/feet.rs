//! Each point's parameter moves to the foot of the point on the curve (Hoschek 1988).

use super::Ends;
use super::data::Data;
use crate::core::context::Context;
use crate::core::curve::{Composite, Evaluator};
use crate::core::error::Error;
use crate::core::point::Point;

/// Newton steps towards one foot in one round. The next round goes on where they end.
const NEWTON_STEPS: usize = 8;
/// Parts of a Newton step that are tried in turn.
const STEPS: [f64; 6] = [1.0, 0.5, 0.25, 1.0 / 16.0, 1.0 / 256.0, 1.0 / 4096.0];

/// Places along a curve among which the nearest is sought, for each degree.
const SAMPLES: usize = 16;

/// The curve with what Newton's method needs.
struct Feet<'a, const D: usize> {
    length: f64,
    curve: Evaluator<'a, D>,
    first: Evaluator<'a, D>,
    second: Evaluator<'a, D>,
}

/// A parameter for each point at which the curve is no further from it than before.
pub(super) fn feet<const D: usize>(
    context: &Context,
    curve: &Composite<D>,
    data: &Data<D>,
    parameters: &[f64],
) -> Result<Vec<f64>, Error> {
    moved(context, curve, data, parameters, 0)
}

/// The same, of all places along the curve and not only downhill from the parameter: the nearest
/// foot, unless a bend is too narrow for the samples that are compared first. O(points * degree).
pub(super) fn nearest_feet<const D: usize>(
    context: &Context,
    curve: &Composite<D>,
    data: &Data<D>,
    parameters: &[f64],
) -> Result<Vec<f64>, Error> {
    moved(context, curve, data, parameters, SAMPLES * curve.degree())
}

fn moved<const D: usize>(
    context: &Context,
    curve: &Composite<D>,
    data: &Data<D>,
    parameters: &[f64],
    samples: usize,
) -> Result<Vec<f64>, Error> {
    let first = curve.derivative(context)?;
    let second = first.derivative(context)?;
    let (_, length) = curve.breaks().domain();
    let feet = Feet {
        length,
        curve: curve.evaluator(context)?,
        first: first.evaluator(context)?,
        second: second.evaluator(context)?,
    };
    let places =
        (0..=samples).filter(|_| samples > 0).map(|k| length * (k as f64 / samples as f64));
    let places: Vec<_> = places.map(|t| (t, feet.curve.at(t))).collect();
    let last = parameters.len() - 1;
    let held = |i: usize| data.ends == Ends::Interpolate && (i == 0 || i == last);
    let foot = |(i, &t): (usize, &f64)| {
        if held(i) { t } else { feet.nearest(data.points[i], t, &places) }
    };
    context.collect(parameters.iter().enumerate().map(foot))
}

impl<const D: usize> Feet<'_, D> {
    /// The nearest of the feet downhill from the parameter and from every place that is no further
    /// from the point than those beside it.
    fn nearest(&self, point: Point<D>, parameter: f64, places: &[(f64, Point<D>)]) -> f64 {
        let distances: Vec<f64> = places.iter().map(|(_, place)| place.distance(point)).collect();
        let is_low = |&k: &usize| {
            let beside = [k.checked_sub(1), k.checked_add(1)].into_iter().flatten();
            beside.filter_map(|k| distances.get(k)).all(|&beside| distances[k] <= beside)
        };
        let lows = (0..places.len()).filter(is_low).map(|k| places[k].0);
        let feet = lows.map(|t| self.near(point, t));
        let distance = |t: f64| self.curve.at(t).distance(point);
        feet.fold(self.near(point, parameter), |nearest, t| {
            if distance(t) < distance(nearest) { t } else { nearest }
        })
    }

    /// Newton's method for `(C(t) - p) . C'(t) = 0`, kept inside the domain; a step that does not
    /// bring the curve closer is shortened, then given up.
    fn near(&self, point: Point<D>, start: f64) -> f64 {
        let (mut t, mut distance) = (start, self.curve.at(start).distance(point));
        for _ in 0..NEWTON_STEPS {
            let closer = |step: f64| {
                let to = (t + step).clamp(0.0, self.length);
                let there = self.curve.at(to).distance(point);
                (there < distance).then_some((to, there))
            };
            let Some(step) = self.step(point, t) else { break };
            let Some(next) = STEPS.iter().find_map(|part| closer(step * part)) else { break };
            (t, distance) = next;
        }
        t
    }

    /// A Newton step where the distance is convex, else a Gauss-Newton step; both go downhill.
    fn step(&self, point: Point<D>, t: f64) -> Option<f64> {
        let (off, tangent) = (self.curve.at(t) - point, self.first.at(t));
        let speed = tangent.dot(tangent);
        let curvature = speed + off.dot(self.second.at(t));
        let slope = off.dot(tangent);
        let step = -slope / if curvature > 0.0 { curvature } else { speed };
        (step.is_finite() && step != 0.0).then_some(step)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::basis::{Basis, Bezier};
    use crate::core::curve::Single;

    #[test]
    fn a_foot_is_where_the_offset_is_normal_and_never_further() {
        let polygon =
            vec![Point([0.0, 0.0]), Point([9.0, 8.0]), Point([-8.0, 8.0]), Point([5.0, -1.0])];
        let curve = Single::new(&Context::default(), Basis::Bezier(Bezier), polygon)
            .unwrap()
            .composite(&Context::default())
            .unwrap();
        // Every start with every point, the far sides of the bends included, where a bare Newton
        // step goes astray.
        let pairs =
            || (0..40).flat_map(|i| (0..40).map(move |j| (i as f64 / 39.0, j as f64 / 39.0)));
        let points =
            pairs().map(|(x, _)| Point([11.0 * x - 3.0, 9.0 * (7.0 * x).fract() - 1.0])).collect();
        let data = Data::new(&Context::default(), points, None, Ends::Free).unwrap();
        let start: Vec<f64> = pairs().map(|(_, t)| t).collect();
        let once = feet(&Context::default(), &curve, &data, &start).unwrap();
        let found =
            (0..3).fold(once.clone(), |t, _| feet(&Context::default(), &curve, &data, &t).unwrap());
        let derivative = curve.derivative(&Context::default()).unwrap();
        let (at, tangent) = (
            curve.evaluator(&Context::default()).unwrap(),
            derivative.evaluator(&Context::default()).unwrap(),
        );
        for (i, (&t, &p)) in found.iter().zip(&data.points).enumerate() {
            assert!(at.at(once[i]).distance(p) <= at.at(start[i]).distance(p), "point {i}");
            // Distances stop telling parameters apart at half the digits.
            let normal = (at.at(t) - p).dot(tangent.at(t)).abs() < 1e-4;
            assert!(normal || t == 0.0 || t == 1.0, "point {i} at {t}");
        }
    }

    /// Against the distances to many places, from parameters that are all at one end.
    #[test]
    fn the_nearest_foot_is_nearer_than_any_place() {
        let context = Context::default();
        let polygon =
            vec![Point([0.0, 0.0]), Point([9.0, 8.0]), Point([-8.0, 8.0]), Point([5.0, -1.0])];
        let curve = Single::new(&context, Basis::Bezier(Bezier), polygon)
            .unwrap()
            .composite(&context)
            .unwrap();
        let points: Vec<_> = (0..500)
            .map(|i| f64::from(i) / 499.0)
            .map(|x| Point([11.0 * x - 3.0, 9.0 * (37.0 * x).fract() - 1.0]))
            .collect();
        let data = Data::new(&context, points.clone(), None, Ends::Free).unwrap();
        let found = nearest_feet(&context, &curve, &data, &vec![0.0; points.len()]).unwrap();
        let at = curve.evaluator(&context).unwrap();
        for (&t, &p) in found.iter().zip(&points) {
            let least = (0..=5000)
                .map(|k| at.at(f64::from(k) / 5000.0).distance(p))
                .fold(f64::INFINITY, f64::min);
            assert!(at.at(t).distance(p) <= least + 1e-9, "{p:?} at {t}: {least}");
        }
    }
}
