//! A point, or a vector, of the plane or of space.

use std::ops::{Add, AddAssign, Index, IndexMut, Mul, Sub};

/// `D` finite coordinates. Points and vectors share the type: a control point, a hodograph's
/// control vector and a residual are all added and scaled the same way.
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::TransparentWrapper)]
#[repr(transparent)]
pub struct Point<const D: usize>(pub [f64; D]);

impl<const D: usize> Point<D> {
    /// The origin, or the zero vector.
    pub const ZERO: Self = Point([0.0; D]);

    /// `self + u * (other - self)`, exact at `u = 0` and `u = 1`.
    pub fn lerp(self, other: Self, u: f64) -> Self {
        self * (1.0 - u) + other * u
    }

    /// The inner product.
    pub fn dot(self, other: Self) -> f64 {
        self.0.iter().zip(other.0).map(|(a, b)| a * b).sum()
    }

    /// The largest absolute coordinate.
    pub fn max_abs(self) -> f64 {
        self.0.iter().fold(0.0, |m, x| larger(m, x.abs()))
    }

    /// The Euclidean length; scaled where it would overflow or vanish before its value does.
    pub fn norm(self) -> f64 {
        length(self.0.into_iter())
    }

    /// The distance to another point.
    pub fn distance(self, other: Self) -> f64 {
        (self - other).norm()
    }

    /// The vector of length 1 in this direction, or `None` for the zero vector.
    pub fn unit(self) -> Option<Self> {
        let square = self.dot(self);
        let scaled = match square {
            _ if is_safe(square) => return Some(self.map(|x| x / square.sqrt())),
            _ if self == Self::ZERO => return None,
            _ => self * if square < 1.0 { LARGE } else { 1.0 / LARGE },
        };
        Some(scaled.map(|x| x / scaled.dot(scaled).sqrt()))
    }

    /// The part across a unit vector. Of a second derivative across the tangent, that is the
    /// curvature vector times the speed squared.
    #[inline(always)]
    pub fn across(self, unit: Self) -> Self {
        self - unit * unit.dot(self)
    }

    /// The same function of every coordinate.
    pub fn map(self, f: impl Fn(f64) -> f64) -> Self {
        Point(self.0.map(f))
    }

    /// Whether every coordinate is a number.
    pub fn is_finite(self) -> bool {
        self.0.iter().all(|x| x.is_finite())
    }
}

/// A power of two that brings squares back into the middle of the range from either end.
const LARGE: f64 = f64::from_bits((1023 + 600) << 52);

/// The root of the sum of squares; scaled, by a power of two, which changes no digit, where a
/// square overflows or one that counts vanishes.
#[inline]
pub(crate) fn length(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let scaled = |factor: f64| values.clone().map(|x| (x * factor) * (x * factor)).sum::<f64>();
    let square = scaled(1.0);
    match square {
        _ if is_safe(square) => square.sqrt(),
        _ if square < 1.0 => scaled(LARGE).sqrt() / LARGE,
        _ => scaled(1.0 / LARGE).sqrt() * LARGE,
    }
}

/// Whether this sum of squares has lost nothing to the ends of the range of a double.
#[inline]
pub(crate) fn is_safe(square: f64) -> bool {
    (1e-250..1e250).contains(&square)
}

/// The largest absolute coordinate of a set of points: the unit of rounding errors.
pub fn magnitude<const D: usize>(points: &[Point<D>]) -> f64 {
    points.iter().fold(0.0, |m, p| larger(m, p.max_abs()))
}

/// The larger of a number and what may be none: one instruction, unlike [`f64::max`], where the
/// first may be none too.
#[inline]
pub(crate) fn larger(number: f64, other: f64) -> f64 {
    if other > number { other } else { number }
}

impl<const D: usize> Add for Point<D> {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        Point(std::array::from_fn(|i| self.0[i] + other.0[i]))
    }
}

impl<const D: usize> AddAssign for Point<D> {
    fn add_assign(&mut self, other: Self) {
        *self = *self + other;
    }
}

impl<const D: usize> Sub for Point<D> {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        Point(std::array::from_fn(|i| self.0[i] - other.0[i]))
    }
}

impl<const D: usize> Mul<f64> for Point<D> {
    type Output = Self;
    fn mul(self, factor: f64) -> Self {
        self.map(|x| x * factor)
    }
}

impl<const D: usize> Index<usize> for Point<D> {
    type Output = f64;
    fn index(&self, axis: usize) -> &f64 {
        &self.0[axis]
    }
}

impl<const D: usize> IndexMut<usize> for Point<D> {
    fn index_mut(&mut self, axis: usize) -> &mut f64 {
        &mut self.0[axis]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn norm_survives_the_ends_of_the_range() {
        assert_eq!(Point([3e300, 4e300]).norm(), 5e300);
        assert_eq!(Point([3e-320, 4e-320]).norm(), 5e-320);
        assert_eq!(Point([0.0, 0.0]).norm(), 0.0);
    }

    #[test]
    fn unit_of_the_smallest_vector_has_length_one() {
        let unit = Point([5e-324, 0.0, -5e-324]).unit().unwrap();
        assert!((unit.norm() - 1.0).abs() < 1e-15);
        assert_eq!(Point([0.0, 0.0]).unit(), None);
    }

    #[test]
    fn lerp_is_exact_at_both_ends() {
        let (a, b) = (Point([0.1, 7e15]), Point([0.3, -3.7]));
        assert_eq!(a.lerp(b, 0.0), a);
        assert_eq!(a.lerp(b, 1.0), b);
    }
}
