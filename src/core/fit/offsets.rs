//! The offsets of a segment from points, and how they change with the parameters, in blocks.

use super::Ends;
use super::data::Data;
use super::quasi::centre;
use crate::core::bezier_form::hodograph;
use crate::core::context::Context;
use crate::core::curve::Single;
use crate::core::error::Error;
use crate::core::linear::householder::Column;
use crate::core::linear::lanes::{LANES, bernstein};
use crate::core::point::{Point, larger, magnitude};

/// Points in coordinates of size 1 about their middle, with weights of at most 1: every sum of
/// squares is safe, and no digit is lost to where the data lie.
pub(super) struct Scene<'a, const D: usize> {
    pub(super) data: &'a Data<D>,
    /// The length of the domain of the curve.
    length: f64,
    origin: Point<D>,
    unit: f64,
    heaviest: f64,
}

/// What is known of up to [`LANES`] points, every row times the root of its weight.
pub(super) struct Offsets<const D: usize> {
    /// Bernstein polynomials of the degree, and their derivatives with respect to `u = t / length`.
    pub(super) basis: Vec<Column>,
    pub(super) slopes: Vec<Column>,
    /// `C - p`, `C'` and `C''`.
    pub(super) offset: [Column; D],
    pub(super) tangent: [Column; D],
    pub(super) bend: [Column; D],
    /// Where the parameter must stay.
    pub(super) held: [bool; LANES],
}

impl<'a, const D: usize> Scene<'a, D> {
    pub(super) fn new(data: &'a Data<D>, length: f64) -> Self {
        let origin = centre(&data.points);
        let size = data.points.iter().fold(0.0, |m, &p| larger(m, (p - origin).max_abs()));
        let heaviest = data.weights.iter().flatten().fold(0.0, |m, &w| larger(m, w));
        let unit = if size > 0.0 { size } else { 1.0 };
        Scene { data, length, origin, unit, heaviest: if heaviest > 0.0 { heaviest } else { 1.0 } }
    }

    /// The weighted sum of squared distances, in units of the scene.
    pub(super) fn squares(
        &self,
        context: &Context,
        curve: &Single<D>,
        parameters: &[f64],
    ) -> Result<f64, Error> {
        let composite = curve.composite(context)?;
        let sampled = composite.evaluator(context)?.sample(context, parameters)?;
        let pairs = self.data.points.iter().zip(sampled).enumerate();
        let square = |(i, (&p, q)): (usize, (&Point<D>, Point<D>))| {
            let off = (q - p).map(|x| x / self.unit);
            off.dot(off) * (self.data.weight(i) / self.heaviest)
        };
        Ok(context.collect(pairs.map(square))?.iter().sum())
    }

    /// What rounding leaves of the root of such a sum, with coordinates as large as these.
    pub(super) fn rounding(&self, points: &[Point<D>]) -> f64 {
        f64::EPSILON * magnitude(points) / self.unit * (self.data.points.len() as f64).sqrt()
    }

    /// The Bezier points of a curve, and those of its derivatives, in units of the scene.
    pub(super) fn derivatives(&self, curve: &Single<D>) -> [Vec<Point<D>>; 3] {
        let place = |p: &Point<D>| (*p - self.origin).map(|x| x / self.unit);
        let points: Vec<_> = curve.bezier_points().iter().map(place).collect();
        let first = hodograph(&points, 1.0);
        let second = hodograph(&first, 1.0);
        [points, first, second]
    }

    /// A vector in the unit of the data.
    pub(super) fn enlarged(&self, v: Point<D>) -> Point<D> {
        v.map(|x| x * self.unit)
    }

    /// A parameter moved by a part of the domain, and kept inside.
    pub(super) fn moved(&self, t: f64, step: f64) -> f64 {
        (t + step * self.length).clamp(0.0, self.length)
    }

    /// The part of the domain between two parameters.
    pub(super) fn part(&self, from: f64, to: f64) -> f64 {
        (to - from) / self.length
    }

    /// The offsets of one block of points after the other.
    pub(super) fn blocks<'b>(
        &'b self,
        derivatives: &'b [Vec<Point<D>>; 3],
        parameters: &'b [f64],
    ) -> impl Iterator<Item = Offsets<D>> + 'b {
        (0..parameters.len().div_ceil(LANES))
            .map(move |part| self.block(derivatives, parameters, part * LANES))
    }

    fn block(
        &self,
        derivatives: &[Vec<Point<D>>; 3],
        parameters: &[f64],
        start: usize,
    ) -> Offsets<D> {
        let degree = derivatives[0].len() - 1;
        let (mut u, mut v, mut root) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
        let mut held = [true; LANES];
        let count = LANES.min(parameters.len() - start);
        for l in 0..count {
            let t = parameters[start + l];
            (u[l], v[l]) = (t / self.length, (self.length - t) / self.length);
            root[l] = (self.data.weight(start + l) / self.heaviest).sqrt();
            held[l] = self.is_end(start + l);
        }
        let mut basis = bernstein(degree, &u, &v);
        let mut lower = bernstein(degree - 1, &u, &v);
        let mut lowest = bernstein(degree.saturating_sub(2), &u, &v);
        for column in basis.iter_mut().chain(&mut lower).chain(&mut lowest) {
            column.iter_mut().zip(&root).for_each(|(x, r)| *x *= r);
        }
        let mut offset = along(&basis, &derivatives[0]);
        for l in 0..count {
            let p = (self.data.points[start + l] - self.origin).map(|x| x / self.unit);
            (0..D).for_each(|a| offset[a][l] -= p[a] * root[l]);
        }
        let (tangent, bend) = (along(&lower, &derivatives[1]), along(&lowest, &derivatives[2]));
        let mut offsets = Offsets { slopes: slopes(&lower), basis, offset, tangent, bend, held };
        offsets.hold_at_bounds(&u, &v, count);
        offsets
    }

    /// Whether the point is one that the curve starts or ends at.
    fn is_end(&self, i: usize) -> bool {
        self.data.ends == Ends::Interpolate && (i == 0 || i == self.data.points.len() - 1)
    }
}

/// `sum_k basis_k points_k`.
#[multiversion::multiversion(targets("x86_64+avx512f+avx512vl+avx512dq+avx512bw", "x86_64+avx2"))]
pub(super) fn along<const D: usize>(basis: &[Column], points: &[Point<D>]) -> [Column; D] {
    let mut sums = [[0.0; LANES]; D];
    for (column, p) in basis.iter().zip(points) {
        for (a, sum) in sums.iter_mut().enumerate() {
            sum.iter_mut().zip(column).for_each(|(s, b)| *s += b * p[a]);
        }
    }
    sums
}

/// The derivatives of the Bernstein polynomials of one degree more.
fn slopes(lower: &[Column]) -> Vec<Column> {
    let degree = lower.len() as f64;
    let entry = |k: usize, l: usize| {
        let before = if k > 0 { lower[k - 1][l] } else { 0.0 };
        let after = lower.get(k).map_or(0.0, |column| column[l]);
        degree * (before - after)
    };
    (0..=lower.len()).map(|k| std::array::from_fn(|l| entry(k, l))).collect()
}

/// The inner product of the vectors in one lane.
pub(super) fn dot<const D: usize>(a: &[Column; D], b: &[Column; D], l: usize) -> f64 {
    (0..D).map(|k| a[k][l] * b[k][l]).sum()
}

impl<const D: usize> Offsets<D> {
    /// Half the slope of the squared distance.
    pub(super) fn slope(&self, l: usize) -> f64 {
        dot(&self.offset, &self.tangent, l)
    }

    /// A parameter at an end of the domain stays there if it would leave.
    fn hold_at_bounds(&mut self, u: &Column, v: &Column, count: usize) {
        for l in 0..count {
            let slope = self.slope(l);
            self.held[l] |= (u[l] <= 0.0 && slope >= 0.0) || (v[l] <= 0.0 && slope <= 0.0);
        }
    }

    /// The part of the offset that lies along the curve, for a parameter that is free.
    pub(super) fn tangential(&self, l: usize) -> f64 {
        let speed = dot(&self.tangent, &self.tangent, l).sqrt();
        if self.held[l] || speed == 0.0 { 0.0 } else { (self.slope(l) / speed).abs() }
    }
}
