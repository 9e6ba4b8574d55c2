//! Many parameters of one segment together, for wide registers.

use crate::core::bezier_form::{binomials, step};
use crate::core::point::Point;

/// Parameters taken together.
pub(crate) const LANES: usize = 64;

/// Where Horner's scheme is at each of some parameters, coordinates in arrays of their own.
pub(crate) struct Lanes<const D: usize> {
    u: [f64; LANES],
    v: [f64; LANES],
    power: [f64; LANES],
    sum: [[f64; LANES]; D],
}

impl<const D: usize> Lanes<D> {
    /// Room, to be used many times.
    pub(crate) fn new() -> Self {
        Lanes { u: [0.0; LANES], v: [0.0; LANES], power: [0.0; LANES], sum: [[0.0; LANES]; D] }
    }

    /// The parameters of an interval in that of its segment, as
    /// [`Breaks::local`](crate::core::knots::Breaks::local) has them.
    #[inline(always)]
    fn place(&mut self, (a, b): (f64, f64), parameters: &[f64]) {
        let length = b - a;
        let places = self.u.iter_mut().zip(&mut self.v).zip(parameters);
        // To divide by 1 changes nothing but the time it takes.
        if length == 1.0 {
            places.for_each(|((u, v), t)| (*u, *v) = (t - a, b - t));
        } else {
            places.for_each(|((u, v), t)| (*u, *v) = ((t - a) / length, (b - t) / length));
        }
    }

    /// The first `N` steps, so many that what is between them stays in registers.
    #[inline(always)]
    fn start<const N: usize>(&mut self, count: usize, first: Point<D>, scaled: [Point<D>; N]) {
        for l in 0..count.min(LANES) {
            self.put(
                l,
                scaled
                    .iter()
                    .fold((first, 1.0), |here, &next| step(here, next, self.u[l], self.v[l])),
            );
        }
    }

    /// Four steps more.
    #[inline(always)]
    fn advance(&mut self, count: usize, scaled: [Point<D>; 4]) {
        for l in 0..count.min(LANES) {
            let here = (Point(std::array::from_fn(|k| self.sum[k][l])), self.power[l]);
            self.put(
                l,
                scaled.iter().fold(here, |here, &next| step(here, next, self.u[l], self.v[l])),
            );
        }
    }

    #[inline(always)]
    fn put(&mut self, l: usize, (sum, power): (Point<D>, f64)) {
        self.power[l] = power;
        (0..D).for_each(|k| self.sum[k][l] = sum[k]);
    }
}

/// Where a segment is.
pub(crate) struct LocalFrame<const D: usize> {
    /// What its points are relative to.
    pub(crate) origin: Point<D>,
    /// What they are to be multiplied by.
    pub(crate) unit: f64,
    /// Its parameters.
    pub(crate) interval: (f64, f64),
}

/// Appends the points at up to [`LANES`] parameters of an interval, each with the bits that
/// [`horner`](crate::core::bezier_form::horner) gives it, times the unit, from the origin. The
/// widest registers of the processor change no bit: every lane takes the same steps, and none is
/// fused.
#[multiversion::multiversion(targets("x86_64+avx512f+avx512vl+avx512dq+avx512bw", "x86_64+avx2"))]
pub(crate) fn extend<const D: usize>(
    points: &mut Vec<Point<D>>,
    lanes: &mut Lanes<D>,
    scaled: &[Point<D>],
    place: LocalFrame<D>,
    parameters: &[f64],
) {
    let count = parameters.len().next_multiple_of(8);
    let LocalFrame { origin, unit, interval } = place;
    lanes.place(interval, parameters);
    let (few, fours) = scaled[1..].as_rchunks::<4>();
    match *few {
        [p] => lanes.start(count, scaled[0], [p]),
        [p, q] => lanes.start(count, scaled[0], [p, q]),
        [p, q, r] => lanes.start(count, scaled[0], [p, q, r]),
        _ => lanes.start(count, scaled[0], []),
    }
    fours.iter().for_each(|&four| lanes.advance(count, four));
    let point = |l: usize| Point(std::array::from_fn(|k| lanes.sum[k][l] * unit + origin[k]));
    points.extend((0..parameters.len().min(LANES)).map(point));
}

/// So many parameters at equal distances from `a` to `b`; at least 2.
#[multiversion::multiversion(targets("x86_64+avx512f+avx512vl+avx512dq+avx512bw", "x86_64+avx2"))]
pub(crate) fn uniform(a: f64, b: f64, count: u32) -> Vec<f64> {
    let last = f64::from(count - 1);
    let mut values: Vec<f64> =
        (0..count).map(|i| smaller(a + (b - a) * (f64::from(i) / last), b)).collect();
    values[count as usize - 1] = b;
    values
}

/// The smaller of two numbers.
#[inline(always)]
fn smaller(number: f64, other: f64) -> f64 {
    if other < number { other } else { number }
}

/// Whether all are finite.
#[multiversion::multiversion(targets("x86_64+avx512f+avx512vl+avx512dq+avx512bw", "x86_64+avx2"))]
pub(crate) fn are_finite(values: &[f64]) -> bool {
    // Not `all`, which would end early: so the loop takes many at once.
    values.iter().fold(true, |finite, value| finite & value.is_finite())
}

/// The values of the Bernstein polynomials at each `u` (with `v = 1 - u`), as
/// [`bernstein`](crate::core::bezier_form::bernstein) has them.
#[multiversion::multiversion(targets("x86_64+avx512f+avx512vl+avx512dq+avx512bw", "x86_64+avx2"))]
pub(crate) fn bernstein(degree: usize, u: &[f64; LANES], v: &[f64; LANES]) -> Vec<[f64; LANES]> {
    let mut values: Vec<_> = binomials(degree).iter().map(|&b| [b; LANES]).collect();
    let (mut up, mut down) = ([1.0; LANES], [1.0; LANES]);
    for i in 1..=degree {
        raise(&mut up, u, &mut values[i]);
        raise(&mut down, v, &mut values[degree - i]);
    }
    values
}

/// The next power, into what it is a factor of.
#[inline(always)]
fn raise(power: &mut [f64; LANES], base: &[f64; LANES], product: &mut [f64; LANES]) {
    for l in 0..LANES {
        power[l] *= base[l];
        product[l] *= power[l];
    }
}
