//! How far a curve is from the polyline of the points.

use super::chord::{CLOSE, Chord, part};
use crate::core::context::{Context, Pace};
use crate::core::curve::Composite;
use crate::core::error::Error;
use crate::core::point::Point;

/// The largest distance of a curve from the polyline of the points, section by section: the stretch
/// of the curve between the parameters of two neighbouring points against the straight segment
/// between these two, whatever is before the first parameter or after the last against the first or
/// the last point. Neighbours are neighbours by parameter. So no point of the curve is further from
/// the polyline.
///
/// Exact to 1e-9 of its value. Most stretches are settled by a bound: the distances of their ends,
/// and what a second derivative bounded by `m` allows between ends `h` apart, `m h^2 / 8`; the
/// others by bisection on the bounds that Bezier points give. O(points * degree), and O(degree^2)
/// for a stretch that is bisected.
pub(super) fn between<const D: usize>(
    context: &Context,
    curve: &Composite<D>,
    points: &[Point<D>],
    parameters: &[f64],
) -> Result<f64, Error> {
    let sections = Sections::new(context, curve, points, parameters)?;
    let mut pace = context.pace();
    let mut largest = sections.ends.iter().flatten().fold(0.0f64, |largest, &d| largest.max(d));
    for (i, ends) in sections.ends.iter().enumerate() {
        pace.step()?;
        let bound = ends[0].max(ends[1]) + sections.bulge(i);
        let settled = bound <= largest * (1.0 + CLOSE);
        if !settled {
            largest = sections.farthest(i, largest, &mut pace)?;
        }
    }
    Ok(largest)
}

/// The stretches of a curve between neighbouring parameters, and what is outside of them.
struct Sections<'a, const D: usize> {
    curve: &'a Composite<D>,
    parameters: Vec<f64>,
    chords: Vec<Chord<D>>,
    /// The distances of the ends of each stretch from its chord.
    ends: Vec<[f64; 2]>,
    /// For each segment of the curve a bound on the second derivative.
    second: Vec<f64>,
}

impl<'a, const D: usize> Sections<'a, D> {
    fn new(
        context: &Context,
        curve: &'a Composite<D>,
        points: &[Point<D>],
        parameters: &[f64],
    ) -> Result<Self, Error> {
        let (mut parameters, mut points) = by_parameter(parameters, points);
        let (a, b) = curve.breaks().domain();
        if parameters[0] > a {
            parameters.insert(0, a);
            points.insert(0, points[0]);
        }
        let last = parameters.len() - 1;
        if parameters[last] < b {
            parameters.push(b);
            points.push(points[last]);
        }
        let on = curve.evaluator(context)?.sample(context, &parameters)?;
        let chords: Vec<_> = points.windows(2).map(|p| Chord { start: p[0], end: p[1] }).collect();
        let ends = context.collect(
            chords
                .iter()
                .zip(on.windows(2))
                .map(|(chord, on)| [chord.distance(on[0]), chord.distance(on[1])]),
        )?;
        let second = (0..curve.breaks().segments()).map(|k| second(curve, k)).collect();
        Ok(Sections { curve, parameters, chords, ends, second })
    }

    /// How far a stretch may be from the chord of its own ends.
    fn bulge(&self, i: usize) -> f64 {
        let (from, to) = (self.parameters[i], self.parameters[i + 1]);
        let most = self.segments(i).map(|k| self.second[k]).fold(0.0, f64::max);
        (to - from) * (to - from) * most / 8.0
    }

    fn farthest(&self, i: usize, known: f64, pace: &mut Pace<'_>) -> Result<f64, Error> {
        let breaks = self.curve.breaks();
        self.segments(i).try_fold(known, |known, k| {
            let (a, b) = breaks.interval(k);
            let (from, _) = breaks.local(k, self.parameters[i].max(a));
            let (to, _) = breaks.local(k, self.parameters[i + 1].min(b));
            self.chords[i].farthest(
                part(&self.curve.segment(k), from, to),
                known,
                f64::INFINITY,
                pace,
            )
        })
    }

    /// The segments of the curve that a stretch is in.
    fn segments(&self, i: usize) -> std::ops::RangeInclusive<usize> {
        let breaks = self.curve.breaks();
        if breaks.segments() == 1 {
            return 0..=0;
        }
        let (from, to) = (self.parameters[i], self.parameters[i + 1]);
        let first = breaks.segment_at(from);
        let after = breaks.as_slice()[first + 1..].iter().take_while(|&&knot| knot < to).count();
        first..=(first + after).min(breaks.segments() - 1)
    }
}

/// Parameters in order, each with its point; those that are equal stay as they come.
fn by_parameter<const D: usize>(
    parameters: &[f64],
    points: &[Point<D>],
) -> (Vec<f64>, Vec<Point<D>>) {
    if parameters.is_sorted() {
        return (parameters.to_vec(), points.to_vec());
    }
    let mut pairs: Vec<_> = parameters.iter().copied().zip(points.iter().copied()).collect();
    pairs.sort_by(|a, b| a.0.total_cmp(&b.0));
    pairs.into_iter().unzip()
}

/// A bound on the second derivative of a segment: its Bezier vectors.
pub(super) fn second<const D: usize>(curve: &Composite<D>, k: usize) -> f64 {
    let (a, b) = curve.breaks().interval(k);
    let degree = curve.degree() as f64;
    let most = curve
        .segment(k)
        .windows(3)
        .map(|q| ((q[2] - q[1]) - (q[1] - q[0])).norm())
        .fold(0.0, f64::max);
    degree * (degree - 1.0) * most / (b - a) / (b - a)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::knots::Breaks;

    fn single(length: f64, bezier: Vec<Point<2>>) -> Composite<2> {
        Composite::from_flat(
            Breaks::new(&Context::default(), vec![0.0, length]).unwrap(),
            bezier.len() - 1,
            bezier,
        )
    }

    fn curve() -> Composite<2> {
        single(
            2.0,
            vec![Point([0.0, 0.0]), Point([1.0, 9.0]), Point([4.0, -7.0]), Point([5.0, 1.0])],
        )
    }

    /// Against the definition, sampled densely.
    fn sampled(curve: &Composite<2>, points: &[Point<2>], parameters: &[f64]) -> f64 {
        let evaluator = curve.evaluator(&Context::default()).unwrap();
        let mut largest = 0.0f64;
        for i in 1..points.len() {
            let chord = Chord { start: points[i - 1], end: points[i] };
            for k in 0..=20_000 {
                let u = k as f64 / 20_000.0;
                let t = parameters[i - 1] * (1.0 - u) + parameters[i] * u;
                largest = largest.max(chord.distance(evaluator.at(t)));
            }
        }
        largest
    }

    #[test]
    fn it_is_what_dense_samples_find() {
        let curve = curve();
        let evaluator = curve.evaluator(&Context::default()).unwrap();
        for count in [2, 3, 5, 9, 40] {
            let parameters: Vec<f64> =
                (0..count).map(|i| 2.0 * i as f64 / (count - 1) as f64).collect();
            for noise in [0.0, 0.01, 1.0] {
                let off = |i: usize| {
                    Point([((i * 7) % 5) as f64 - 2.0, ((i * 11) % 7) as f64 - 3.0]) * noise
                };
                let points: Vec<_> =
                    parameters.iter().enumerate().map(|(i, &t)| evaluator.at(t) + off(i)).collect();
                let (exact, dense) = (
                    between(&Context::default(), &curve, &points, &parameters).unwrap(),
                    sampled(&curve, &points, &parameters),
                );
                assert!(
                    exact >= dense * (1.0 - 1e-9) && exact <= dense * (1.0 + 1e-6),
                    "{count} {noise}: {exact} {dense}"
                );
            }
        }
    }

    #[test]
    fn ends_without_points_count_and_the_order_of_the_list_does_not() {
        let line = single(1.0, vec![Point([0.0, 0.0]), Point([10.0, 0.0])]);
        let points = [Point([2.0, 0.0]), Point([6.0, 0.0])];
        assert!(
            (between(&Context::default(), &line, &points, &[0.2, 0.6]).unwrap() - 4.0).abs()
                < 1e-12
        );
        let turned = [points[1], points[0]];
        assert_eq!(
            between(&Context::default(), &line, &turned, &[0.6, 0.2]).unwrap(),
            between(&Context::default(), &line, &points, &[0.2, 0.6]).unwrap()
        );
    }
}
