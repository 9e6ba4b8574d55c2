//! Random bases, points and curves.

use proptest::collection::vec;
use proptest::prelude::*;
use springline::core::basis::{AlphaBeta, Basis, Beta, Bezier, Quasi, ShapeParameters};
use springline::core::context::Context;
use springline::core::curve::{BSpline, Bases, Curve, Piecewise};
use springline::core::knots::Breaks;
use springline::core::point::Point;

use super::single;

pub fn point<const D: usize>() -> impl Strategy<Value = Point<D>> {
    vec(-10.0..10.0, D).prop_map(|x| Point(x.try_into().unwrap()))
}

pub fn points<const D: usize>(count: usize) -> impl Strategy<Value = Vec<Point<D>>> {
    vec(point(), count)
}

/// From 1e-8 to 1e8, every decade alike; and both ends of the range, `beta = 0` and `lambda = 0`.
pub fn beta() -> impl Strategy<Value = Basis> {
    let decades = |least, most| (least..most).prop_map(|e| 10f64.powf(e));
    prop_oneof![
        4 => decades(-8.0, 8.0).prop_map(|beta| Basis::Beta(Beta::from_beta(beta).unwrap())),
        4 => decades(-8.0, 8.0).prop_map(|lambda| Basis::Beta(Beta::from_lambda(lambda).unwrap())),
        1 => Just(Basis::Beta(Beta::from_beta(0.0).unwrap())),
        1 => Just(Basis::Beta(Beta::from_lambda(0.0).unwrap())),
    ]
}

pub fn alpha_beta() -> impl Strategy<Value = Basis> {
    (0.01..=1.0, 0.01..=3.0)
        .prop_map(|(alpha, beta)| Basis::AlphaBeta(AlphaBeta::new(alpha, beta).unwrap()))
}

/// Degree elevation with one number per edge, each inside its range.
pub fn yang_zeng(order: usize) -> impl Strategy<Value = Basis> {
    vec(0.05..0.95, order).prop_map(move |shares| {
        let lambdas = shares
            .iter()
            .enumerate()
            .map(|(k, share)| (k + 1) as f64 - share * (order + 1) as f64)
            .collect();
        Basis::Quasi(
            Quasi::new(&Context::default(), ShapeParameters::Elevation { lambdas }).unwrap(),
        )
    })
}

/// The seed of Wu's family (Chen 2013 Table 1), for control polygons of order 2 and above.
pub fn wu() -> impl Strategy<Value = Basis> {
    (-1.9..0.9).prop_map(|l: f64| {
        let first = (1.0 - l) / 3.0;
        let seed = vec![
            vec![1.0, 0.0, 0.0],
            vec![first, 1.0 - first, 0.0],
            vec![0.0, 1.0 - first, first],
            vec![0.0, 0.0, 1.0],
        ];
        Basis::Quasi(Quasi::new(&Context::default(), ShapeParameters::Recursive { seed }).unwrap())
    })
}

/// A random shape matrix of one degree more than the order, or of the order itself, that starts and
/// ends in unit rows.
pub fn matrix(order: usize, more: usize) -> impl Strategy<Value = Basis> {
    let degree = order + more;
    vec(vec(0.0..1.0, order + 1), degree + 1).prop_map(move |mut rows| {
        for (i, row) in rows.iter_mut().enumerate() {
            let near = (i * order + degree / 2) / degree;
            row[near] += 2.0 * (order + 1) as f64; // dominant, so that the rank is full
            if i == 0 || i == degree {
                row.iter_mut().enumerate().for_each(|(j, m)| *m = f64::from(j == near));
            }
            let sum: f64 = row.iter().sum();
            row.iter_mut().for_each(|m| *m /= sum);
        }
        Basis::Quasi(Quasi::new(&Context::default(), ShapeParameters::Matrix { rows }).unwrap())
    })
}

/// A basis of any family that suits an order of 1 to 63, and starts and ends at its control points.
pub fn basis(order: usize) -> BoxedStrategy<Basis> {
    let bezier = Just(Basis::Bezier(Bezier)).boxed();
    let any = vec![
        bezier,
        beta().boxed(),
        yang_zeng(order).boxed(),
        matrix(order, 0).boxed(),
        matrix(order, 1).boxed(),
    ];
    let cubic = (order == 3).then(|| alpha_beta().boxed());
    let wu = (order >= 2).then(|| wu().boxed());
    proptest::strategy::Union::new(any.into_iter().chain(cubic).chain(wu)).boxed()
}

/// A cubic basis with a way back from Bezier points that keeps most digits.
pub fn cubic_with_way_back() -> BoxedStrategy<Basis> {
    let mild = (0.0..5.0).prop_map(|beta| Basis::Beta(Beta::from_beta(beta).unwrap()));
    let strong = (0.2..1.0, 0.2..3.0)
        .prop_map(|(alpha, beta)| Basis::AlphaBeta(AlphaBeta::new(alpha, beta).unwrap()));
    prop_oneof![Just(Basis::Bezier(Bezier)), mild, strong, matrix(3, 0)].boxed()
}

/// A curve of one segment.
pub fn one_segment<const D: usize>(
    orders: std::ops::Range<usize>,
) -> impl Strategy<Value = Curve<D>> {
    orders
        .prop_flat_map(|order| (basis(order), points(order + 1)))
        .prop_map(|(basis, points)| single(basis, points))
}

/// Increasing parameters with gaps between 0.1 and 3.
pub fn breaks(segments: usize) -> impl Strategy<Value = Vec<f64>> {
    (-5.0..5.0, vec(0.1..3.0, segments)).prop_map(|(start, gaps)| {
        let later = gaps.iter().scan(start, |t: &mut f64, gap| {
            *t += gap;
            Some(*t)
        });
        std::iter::once(start).chain(later).collect()
    })
}

/// Segments with one basis each, or one for all; open or closed.
pub fn piecewise<const D: usize>() -> impl Strategy<Value = Curve<D>> {
    let parts = |(order, segments): (usize, usize)| {
        let bases = prop_oneof![
            basis(order).prop_map(Bases::Common),
            vec(basis(order), segments).prop_map(Bases::PerSegment)
        ];
        (Just(order), bases, breaks(segments), any::<bool>(), points(segments * order + 1))
    };
    (1usize..6, 1usize..6).prop_flat_map(parts).prop_map(
        |(order, bases, breaks, closed, mut points)| {
            if closed {
                let last = points.len() - 1;
                points[last] = points[0];
            }
            Curve::Piecewise(
                Piecewise::new(
                    &Context::default(),
                    bases,
                    order,
                    Breaks::new(&Context::default(), breaks).unwrap(),
                    closed,
                    points,
                )
                .unwrap(),
            )
        },
    )
}

/// A knot vector of this degree whose inner knots repeat up to `most` times; clamped or not. With
/// its number of control points.
pub fn knots(degree: usize, most: usize) -> impl Strategy<Value = (Vec<f64>, usize)> {
    let inner = vec(1..=most, 0..5usize);
    let parts =
        inner.prop_flat_map(move |copies| (breaks(copies.len() + 1), Just(copies), any::<bool>()));
    parts.prop_map(move |(breaks, copies, clamped)| {
        let (a, b) = (breaks[0], breaks[breaks.len() - 1]);
        let outside = |t: f64, step: f64| {
            (0..=degree).map(move |i| if clamped { t } else { t + step * i as f64 })
        };
        let before: Vec<f64> = outside(a, -0.7).collect();
        let repeated = breaks[1..]
            .iter()
            .zip(&copies)
            .flat_map(|(&t, &copies)| std::iter::repeat_n(t, copies));
        let knots: Vec<f64> =
            before.into_iter().rev().chain(repeated).chain(outside(b, 0.4)).collect();
        let count = knots.len() - degree - 1;
        (knots, count)
    })
}

pub fn bspline<const D: usize>(
    degrees: std::ops::Range<usize>,
    smooth: usize,
) -> impl Strategy<Value = Curve<D>> {
    let parts =
        move |degree: usize| (Just(degree), knots(degree, degree.saturating_sub(smooth).max(1)));
    let with_points = |(degree, (knots, count))| (Just(degree), Just(knots), points(count));
    degrees.prop_flat_map(parts).prop_flat_map(with_points).prop_map(|(degree, knots, points)| {
        Curve::BSpline(BSpline::new(&Context::default(), degree, knots, points, false).unwrap())
    })
}

/// A curve of any kind without jumps.
pub fn curve<const D: usize>() -> impl Strategy<Value = Curve<D>> {
    prop_oneof![one_segment(1..9), piecewise(), bspline(1..6, 0)]
}
