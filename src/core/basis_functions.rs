//! The basis functions themselves, and what they promise.

use super::argument::Argument;
use super::basis::{Basis, Properties, ShapeMatrix};
use super::bezier_form::bernstein;
use super::check::{at_least, at_most};
use super::error::{Error, Locate};
use super::fault::Fault;
use crate::core::context::Context;

/// A basis at one order, sampled.
#[derive(Debug, Clone, PartialEq)]
pub struct BasisFunctions {
    /// The degree of the functions.
    pub degree: usize,
    /// First and last parameter.
    pub domain: (f64, f64),
    /// The parameters sampled.
    pub parameters: Vec<f64>,
    /// `values[j][i]`: function `j` at parameter `i`.
    pub values: Vec<Vec<f64>>,
    /// The shape matrix.
    pub matrix: ShapeMatrix,
    /// Its 2-norm condition number; infinite where it lacks rank.
    pub condition: f64,
    /// What it promises.
    pub properties: Properties,
}

/// Refuses too few samples, and too many.
///
/// # Errors
/// [`Fault::TooFew`], [`Fault::TooLarge`].
pub fn check_count(context: &Context, count: usize) -> Result<(), Fault> {
    at_least("samples", count, 2)?;
    at_most("samples", count, context.limits.samples, "Ask for fewer")
}

/// Samples the `order + 1` functions of a basis at `count` equally spaced parameters. O(count *
/// degree * order).
///
/// # Errors
/// At `order`: one that does not suit the basis. At `count`: below 2, or more values than
/// [`ANSWER_POINTS`](crate::core::limits::ANSWER_POINTS).
pub fn basis_functions(
    context: &Context,
    basis: &Basis,
    order: usize,
    count: usize,
) -> Result<BasisFunctions, Error> {
    let degree = basis.degree(context, order).at(Argument::Order)?;
    check_count(context, count).at(Argument::Count)?;
    at_most(
        "values in the answer",
        count * (order + 1),
        context.limits.answer_points,
        "Ask for fewer samples",
    )
    .at(Argument::Count)?;
    let matrix = basis.shape_matrix(order);
    let fraction = |i: usize| i as f64 / (count - 1) as f64;
    let mut values = vec![Vec::with_capacity(count); order + 1];
    let mut pace = context.pace();
    for i in 0..count {
        pace.step()?;
        let (u, v) = (fraction(i), fraction(count - 1 - i));
        let weights = bernstein(degree, u, v);
        for (j, list) in values.iter_mut().enumerate() {
            list.push(matrix.rows().zip(&weights).map(|(row, weight)| row[j] * weight).sum());
        }
    }
    // Singular values take milliseconds.
    let condition = matrix.condition();
    context.checkpoint()?;
    Ok(BasisFunctions {
        degree,
        domain: (0.0, basis.length()),
        parameters: (0..count).map(|i| basis.length() * fraction(i)).collect(),
        values,
        condition,
        properties: matrix.properties(),
        matrix,
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::core::basis::AlphaBeta;

    /// Li 2014 eq. (8) as printed.
    fn equation_8(alpha: f64, beta: f64, t: f64) -> [f64; 4] {
        let (rest, s) = (alpha - t, alpha * beta);
        [
            rest * rest * (rest + (3.0 - s) * t) / alpha.powi(3),
            beta / alpha.powi(2) * t * rest * rest,
            beta / alpha.powi(2) * t * t * rest,
            t * t * (rest * (3.0 - s) + t) / alpha.powi(3),
        ]
    }

    #[test]
    fn alpha_beta_functions_are_equation_8() {
        for (alpha, beta) in [(1.0, 3.0), (0.4, 1.5), (0.7, 2.9)] {
            let basis = Basis::AlphaBeta(AlphaBeta::new(alpha, beta).unwrap());
            let sampled = basis_functions(&Context::default(), &basis, 3, 11).unwrap();
            for (i, &t) in sampled.parameters.iter().enumerate() {
                let expected = equation_8(alpha, beta, t);
                assert!(
                    (0..4).all(|j| (sampled.values[j][i] - expected[j]).abs() < 1e-15 * 8.0),
                    "{alpha} {beta} {t}"
                );
            }
            assert_eq!(sampled.domain, (0.0, alpha));
        }
    }
}
