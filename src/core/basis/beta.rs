//! The Beta-Bezier basis of Cheng et al. 2021.

use super::{Family, ShapeMatrix};
use crate::core::argument::Argument;
use crate::core::bezier_form::binomials;
use crate::core::error::Error;
use crate::core::fault::Fault;

/// One parameter for any order, Cheng et al. 2021 eq. (3): `beta = 0` is the Bezier curve, a larger
/// `beta` pulls the curve towards the segment between its end points, `beta = infinity` is that
/// segment.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Beta {
    beta: f64,
    lambda: f64,
    given_as_lambda: bool,
}

impl Beta {
    /// From `beta` in [0, infinity).
    ///
    /// # Errors
    /// [`Fault::OutOfRange`] at `beta`.
    pub fn from_beta(beta: f64) -> Result<Self, Error> {
        let allowed = "beta >= 0 (beta = 0 is the Bezier curve; for the straight limit give lambda = 0 instead)";
        if beta >= 0.0 && beta.is_finite() {
            // -0 is 0, and its reciprocal no less infinite than that of 0.
            return Ok(Beta { beta, lambda: 1.0 / beta.abs(), given_as_lambda: false });
        }
        Err(Fault::OutOfRange { what: "beta", value: beta, allowed: allowed.into() }
            .at(Argument::Beta))
    }

    /// From `lambda = 1 / beta` in [0, infinity), the parameter of Chu and Zeng 2014 (Cheng et al.
    /// 2021 eq. (1)).
    ///
    /// # Errors
    /// [`Fault::OutOfRange`] at `lambda`.
    pub fn from_lambda(lambda: f64) -> Result<Self, Error> {
        let allowed = "lambda >= 0 (lambda = 0 is the straight limit; for the Bezier curve give beta = 0 instead)";
        if lambda >= 0.0 && lambda.is_finite() {
            return Ok(Beta { beta: 1.0 / lambda.abs(), lambda, given_as_lambda: true });
        }
        Err(Fault::OutOfRange { what: "lambda", value: lambda, allowed: allowed.into() }
            .at(Argument::Lambda))
    }

    /// `beta`, which is infinite in the straight limit.
    pub fn beta(&self) -> f64 {
        self.beta
    }

    /// `lambda`, where the basis was made from it.
    pub fn lambda(&self) -> Option<f64> {
        self.given_as_lambda.then_some(self.lambda)
    }

    /// Factor `i` of a product in eq. (3) over divisor `m`: the two Bernstein coefficients of
    /// `(1 - t + i beta) / (1 + m beta)`, for any `beta` without overflow.
    fn factor(&self, i: usize, m: usize) -> (f64, f64) {
        let (i, divisor) = (i as f64, m as f64);
        if m == 0 {
            return (1.0, 0.0);
        }
        if self.beta <= 1.0 {
            let scale = 1.0 + divisor * self.beta;
            ((1.0 + i * self.beta) / scale, i * self.beta / scale)
        } else {
            let scale = self.lambda + divisor;
            ((self.lambda + i) / scale, i / scale)
        }
    }

    /// Column `k` of the shape matrix: the Bernstein coefficients of eq. (3), as a product of
    /// degree-1 factors of non-negative numbers, so that nothing cancels.
    fn column(&self, order: usize, k: usize) -> Vec<f64> {
        let binomial = binomials(order);
        let mut product = vec![0.0; order + 1];
        product[0] = 1.0;
        for m in 0..order {
            let (low, high) = if m < order - k {
                self.factor(m, m)
            } else {
                let (near, far) = self.factor(m - (order - k), m);
                (far, near)
            };
            for i in (1..=m + 1).rev() {
                product[i] = product[i] * low + product[i - 1] * high;
            }
            product[0] *= low;
        }
        product.iter_mut().zip(binomial).for_each(|(c, b)| *c = *c * binomial[k] / b);
        product
    }
}

impl Family for Beta {
    fn name(&self) -> &'static str {
        "beta-bezier"
    }

    fn degree(&self, order: usize) -> Result<usize, Fault> {
        Ok(order)
    }

    fn shape_matrix(&self, order: usize) -> ShapeMatrix {
        // The second half of the columns mirrors the first: the basis is symmetric, so let its
        // rounding be too.
        let columns: Vec<_> = (0..=order / 2).map(|k| self.column(order, k)).collect();
        ShapeMatrix::from_fn(order + 1, order + 1, |i, j| match columns.get(j) {
            Some(column) if 2 * j < order || i <= order - i => column[i],
            _ => columns[order - j][order - i],
        })
    }

    fn is_identity(&self) -> bool {
        self.beta == 0.0
    }

    /// For cubics in closed form: the inverse of Cheng et al. 2021 eq. (8) and (9). None in the
    /// straight limit.
    fn inverse(&self, order: usize) -> Option<ShapeMatrix> {
        let b = self.beta;
        if b.is_infinite() {
            return None;
        }
        if order != 3 {
            return super::inverse_by_elimination(&self.shape_matrix(order));
        }
        let row = [-b * (1.0 + b / 3.0), (1.0 + b) * (1.0 + b), -b * (1.0 + b), b * b / 3.0];
        Some(ShapeMatrix::from_fn(4, 4, |i, j| match i {
            1 => row[j],
            2 => row[3 - j],
            _ => f64::from(i == j),
        }))
    }

    fn no_inverse_because(&self) -> String {
        "lambda = 0 (beta = infinity) collapses every control polygon onto the segment between its end points, so control points \
         cannot be computed back; use lambda > 0, or the bezier form"
            .into()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::point::Point;

    /// Cheng et al. 2021 eq. (8) as printed.
    fn equation_8(b: f64) -> [f64; 4] {
        let common = (1.0 + b) * (1.0 + 2.0 * b);
        [
            b * (3.0 + 4.0 * b) / (3.0 * common),
            1.0 / (1.0 + 2.0 * b),
            b / common,
            2.0 * b * b / (3.0 * common),
        ]
    }

    #[test]
    fn cubic_rows_are_equations_8_and_9() {
        for b in [0.0, 1e-8, 0.3, 1.0, 2.5, 40.0, 1e8] {
            let m = Beta::from_beta(b).unwrap().shape_matrix(3);
            for (j, expected) in equation_8(b).into_iter().enumerate() {
                assert!((m.row(1)[j] - expected).abs() <= 4e-16, "beta {b}, column {j}");
                assert_eq!(m.row(2)[3 - j], m.row(1)[j], "symmetry, beta {b}");
            }
        }
    }

    #[test]
    fn lambda_is_the_reciprocal_and_zero_is_the_chord() {
        let by_beta = Beta::from_beta(4.0).unwrap().shape_matrix(5);
        assert_eq!(Beta::from_lambda(0.25).unwrap().shape_matrix(5), by_beta);
        let chord = Beta::from_lambda(0.0).unwrap().shape_matrix(3);
        assert_eq!(chord.row(1), [2.0 / 3.0, 0.0, 0.0, 1.0 / 3.0]);
        assert!(Beta::from_lambda(0.0).unwrap().inverse(3).is_none());
        assert_eq!(Beta::from_lambda(-0.0).unwrap().shape_matrix(3), chord);
        assert!(Beta::from_beta(-0.0).unwrap().is_identity());
        assert!(
            Beta::from_lambda(1e-320)
                .unwrap()
                .shape_matrix(64)
                .rows()
                .flatten()
                .all(|m| m.is_finite())
        );
    }

    /// The de Casteljau-like scheme of Cheng et al. 2021 Figure 7, which never forms a shape
    /// matrix.
    fn figure_7(points: &[Point<2>], beta: f64, t: f64) -> Point<2> {
        let n = points.len() - 1;
        let mut p = points.to_vec();
        for i in 1..=n {
            let divisor = 1.0 + (n - i) as f64 * beta;
            for j in (i..=n).rev() {
                let left = (1.0 - t + (n - j) as f64 * beta) / divisor;
                let right = (t + (j - i) as f64 * beta) / divisor;
                p[j] = p[j - 1] * left + p[j] * right;
            }
        }
        p[n]
    }

    #[test]
    fn figure_7_agrees_with_the_bezier_route() {
        let points: Vec<_> = (0..9).map(|i| Point([i as f64, (i * i % 7) as f64 - 3.0])).collect();
        for n in 1..=8 {
            for beta in [0.0, 0.2, 1.0, 3.7, 250.0] {
                let q = Beta::from_beta(beta).unwrap().shape_matrix(n).apply(&points[..=n]);
                for t in [0.0, 0.125, 0.5, 0.8, 1.0] {
                    let by_form = crate::core::bezier_form::evaluate(&q, t);
                    let by_scheme = figure_7(&points[..=n], beta, t);
                    assert!(by_form.distance(by_scheme) < 8e-14, "n {n}, beta {beta}, t {t}");
                }
            }
        }
    }

    #[test]
    fn the_cubic_inverse_undoes_the_matrix() {
        for b in [0.1, 1.0, 10.0] {
            let beta = Beta::from_beta(b).unwrap();
            let product = beta.shape_matrix(3).dense() * beta.inverse(3).unwrap().dense();
            assert!(
                (product - nalgebra::DMatrix::identity(4, 4)).amax() < 1e-12 * (1.0 + b * b),
                "beta {b}"
            );
        }
    }
}
