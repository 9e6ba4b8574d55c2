//! The smallest change that meets linear conditions.

use nalgebra::{DMatrix, DVector};

use crate::core::context::Context;
use crate::core::error::Error;
use crate::core::linear::singular_values::decomposed;

/// One condition: a combination of changes that must have a value.
#[derive(Debug, Clone, Default)]
pub(crate) struct Condition {
    /// Variables with their coefficients; a variable may occur several times.
    pub terms: Vec<(usize, f64)>,
    /// The value.
    pub right: f64,
}

/// A change, and how well it meets the conditions.
#[derive(Debug, Clone)]
pub(crate) struct Change {
    /// The change of each variable.
    pub values: Vec<f64>,
    /// The largest violation of a condition, in units of the condition's coefficients.
    pub violation: f64,
    /// The condition with that violation.
    pub worst: usize,
}

/// Conditions scaled to length 1 and ordered along the curve: variables of one segment occur in
/// those of two neighbouring joints only, so their Gram matrix has a band; the last ones, of a
/// closed curve's seam, border it.
struct System {
    conditions: Vec<Condition>,
    /// For each variable, the conditions it occurs in.
    columns: Vec<Vec<(usize, f64)>>,
    banded: usize,
    width: usize,
}

/// Cholesky factors `L D L^T` of the band of the Gram matrix, and the Schur complement of its
/// border.
struct Factors {
    /// `lower[i][k]` belongs to row `i`, column `i - 1 - k`.
    lower: Vec<Vec<f64>>,
    /// Reciprocal pivots; 0 for a condition that depends on those before it.
    reciprocal: Vec<f64>,
    /// How the conditions of the band couple with each one of the seam.
    coupling: Vec<Vec<f64>>,
    /// The solutions of the band for those couplings.
    border: Vec<Vec<f64>>,
    complement: DMatrix<f64>,
}

/// Pivots of unit conditions below this belong to dependent ones.
const DEPENDENT: f64 = 1e-13;

/// The change of least sum of squares that meets the conditions, of which the last `seam` may
/// couple both ends. O(conditions * band^2). Dependent conditions are left out; `violation` tells
/// whether they hold all the same.
pub(crate) fn least_change(
    context: &Context,
    variables: usize,
    conditions: Vec<Condition>,
    seam: usize,
) -> Result<Change, Error> {
    let system = System::new(context, variables, conditions, seam)?;
    let factors = system.factor(context)?;
    let mut values = vec![0.0; variables];
    // The first round solves; the others remove what its rounding left.
    for _ in 0..3 {
        let residual = system.residual(context, &values)?;
        let multipliers = system.solve(context, &factors, residual)?;
        let mut pace = context.pace();
        for (value, column) in values.iter_mut().zip(&system.columns) {
            pace.step()?;
            *value += column.iter().map(|&(i, c)| c * multipliers[i]).sum::<f64>();
        }
    }
    let violations = system.residual(context, &values)?;
    let worst =
        (0..violations.len()).max_by(|&a, &b| violations[a].abs().total_cmp(&violations[b].abs()));
    Ok(Change {
        violation: worst.map_or(0.0, |i| violations[i].abs()),
        worst: worst.unwrap_or(0),
        values,
    })
}

impl System {
    fn new(
        context: &Context,
        variables: usize,
        mut conditions: Vec<Condition>,
        seam: usize,
    ) -> Result<Self, Error> {
        let banded = conditions.len() - seam;
        let mut columns = vec![Vec::new(); variables];
        let mut pace = context.pace();
        for (i, condition) in conditions.iter_mut().enumerate() {
            pace.step()?;
            let length = condition.terms.iter().map(|(_, c)| c * c).sum::<f64>().sqrt();
            // A condition without coefficients stays as it is: nothing can change it.
            let scale = if length > 0.0 { 1.0 / length } else { 1.0 };
            condition.right *= scale;
            for (variable, c) in &mut condition.terms {
                *c *= scale;
                columns[*variable].push((i, *c));
            }
        }
        let reach = |column: &Vec<(usize, f64)>| {
            let inside = || column.iter().map(|&(i, _)| i).filter(|&i| i < banded);
            inside().max().zip(inside().min()).map_or(0, |(last, first)| last - first)
        };
        let width = context.collect(columns.iter().map(reach))?.into_iter().max().unwrap_or(0);
        Ok(System { conditions, columns, banded, width })
    }

    fn residual(&self, context: &Context, values: &[f64]) -> Result<Vec<f64>, Error> {
        let rest =
            |c: &Condition| c.right - c.terms.iter().map(|&(v, c)| c * values[v]).sum::<f64>();
        context.collect(self.conditions.iter().map(rest))
    }

    /// The Gram matrix: row `i` of its band, the diagonal last, and its border.
    fn gram(&self, context: &Context) -> Result<(Vec<Vec<f64>>, DMatrix<f64>), Error> {
        let mut band = vec![vec![0.0; self.width + 1]; self.banded];
        let seam = self.conditions.len() - self.banded;
        let mut border = DMatrix::zeros(self.conditions.len(), seam);
        let mut pace = context.pace();
        for column in &self.columns {
            pace.step()?;
            for &(i, a) in column {
                for &(j, b) in column {
                    if j >= self.banded {
                        border[(i, j - self.banded)] += a * b;
                    } else if j <= i && i < self.banded {
                        band[i][self.width - (i - j)] += a * b;
                    }
                }
            }
        }
        Ok((band, border))
    }

    fn factor(&self, context: &Context) -> Result<Factors, Error> {
        let (mut lower, border) = self.gram(context)?;
        let width = self.width;
        let mut reciprocal = vec![0.0; self.banded];
        let mut pace = context.pace();
        for i in 0..self.banded {
            pace.step()?;
            for j in i.saturating_sub(width)..i {
                // lower[i] holds L D until its row is done.
                let from = i.saturating_sub(width).max(j.saturating_sub(width));
                let dot: f64 = (from..j)
                    .map(|k| lower[i][width - (i - k)] * reciprocal[k] * lower[j][width - (j - k)])
                    .sum();
                lower[i][width - (i - j)] -= dot;
            }
            let squares: f64 = (i.saturating_sub(width)..i)
                .map(|k| lower[i][width - (i - k)].powi(2) * reciprocal[k])
                .sum();
            let pivot = lower[i][width] - squares;
            reciprocal[i] = if pivot > DEPENDENT { 1.0 / pivot } else { 0.0 };
        }
        let seam = border.ncols();
        let coupling: Vec<Vec<f64>> = (0..seam)
            .map(|s| border.column(s).iter().copied().take(self.banded).collect())
            .collect();
        let mut factors = Factors {
            lower,
            reciprocal,
            coupling,
            border: Vec::new(),
            complement: DMatrix::zeros(seam, seam),
        };
        factors.border = factors
            .coupling
            .iter()
            .map(|column| self.solve_band(context, &factors, column.clone()))
            .collect::<Result<_, _>>()?;
        factors.complement = DMatrix::from_fn(seam, seam, |r, s| {
            border[(self.banded + r, s)] - dot(&factors.coupling[r], &factors.border[s])
        });
        Ok(factors)
    }

    /// Solves with the band alone.
    fn solve_band(
        &self,
        context: &Context,
        factors: &Factors,
        mut right: Vec<f64>,
    ) -> Result<Vec<f64>, Error> {
        let width = self.width;
        let mut pace = context.pace();
        for i in 0..right.len() {
            pace.step()?;
            let dot: f64 = (i.saturating_sub(width)..i)
                .map(|k| factors.lower[i][width - (i - k)] * factors.reciprocal[k] * right[k])
                .sum();
            right[i] -= dot;
        }
        for i in (0..right.len()).rev() {
            pace.step()?;
            let above: f64 = (i + 1..right.len().min(i + width + 1))
                .map(|k| factors.lower[k][width - (k - i)] * right[k])
                .sum();
            right[i] = (right[i] - above) * factors.reciprocal[i];
        }
        Ok(right)
    }

    /// Solves with the whole Gram matrix.
    fn solve(
        &self,
        context: &Context,
        factors: &Factors,
        mut right: Vec<f64>,
    ) -> Result<Vec<f64>, Error> {
        let seam = right.split_off(self.banded);
        let band = self.solve_band(context, factors, right)?;
        if seam.is_empty() {
            return Ok(band);
        }
        // C^T (band solution) = (border solution)^T (band right side), as the band is symmetric.
        let rest =
            seam.iter().zip(&factors.coupling).map(|(right, column)| right - dot(column, &band));
        let rest = DVector::from_iterator(seam.len(), rest);
        // Dependent conditions of the seam are left out, as those of the band are.
        let outer = decomposed(factors.complement.clone(), true)
            .and_then(|svd| svd.solve(&rest, DEPENDENT).ok());
        let outer = outer.unwrap_or_else(|| DVector::zeros(seam.len()));
        let through = |i: usize| {
            factors.border.iter().zip(&outer).map(|(column, x)| column[i] * x).sum::<f64>()
        };
        let inner = band.iter().enumerate().map(|(i, x)| x - through(i));
        Ok(inner.chain(outer.iter().copied()).collect())
    }
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(x, y)| x * y).sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn condition(terms: &[(usize, f64)], right: f64) -> Condition {
        Condition { terms: terms.to_vec(), right }
    }

    /// The same by the pseudo-inverse, which is the least change by definition.
    fn by_pseudo_inverse(variables: usize, conditions: &[Condition]) -> Vec<f64> {
        let mut matrix = DMatrix::<f64>::zeros(conditions.len(), variables);
        for (i, condition) in conditions.iter().enumerate() {
            condition.terms.iter().for_each(|&(v, c)| matrix[(i, v)] += c);
        }
        let right = DVector::from_iterator(conditions.len(), conditions.iter().map(|c| c.right));
        (matrix.pseudo_inverse(1e-12).unwrap() * right).iter().copied().collect()
    }

    fn chain(count: usize) -> Vec<Condition> {
        let link = |i: usize| {
            condition(
                &[(2 * i, 1.0), (2 * i + 1, -2.0), (2 * i + 2, 0.5), (2 * i + 3, 3.0)],
                i as f64 - 1.5,
            )
        };
        (0..count).map(link).collect()
    }

    #[test]
    fn agrees_with_the_pseudo_inverse() {
        let mut conditions = chain(6);
        for seam in [0, 2] {
            if seam > 0 {
                conditions.push(condition(&[(0, 1.0), (1, 1.0), (12, -1.0), (13, 0.25)], 2.0));
                conditions.push(condition(&[(0, 0.3), (13, 1.0)], -1.0));
            }
            let change = least_change(&Context::default(), 14, conditions.clone(), seam).unwrap();
            let expected = by_pseudo_inverse(14, &conditions);
            let apart =
                change.values.iter().zip(&expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            assert!(
                apart < 1e-13 && change.violation < 1e-14,
                "seam {seam}: {apart:e}, {:e}",
                change.violation
            );
        }
    }

    #[test]
    fn what_cannot_be_met_is_told() {
        let same = [condition(&[(0, 1.0), (1, 1.0)], 1.0), condition(&[(0, 2.0), (1, 2.0)], 2.0)];
        assert!(least_change(&Context::default(), 2, same.to_vec(), 0).unwrap().violation < 1e-14);
        let other = [same[0].clone(), condition(&[(0, 2.0), (1, 2.0)], 3.0)];
        let change = least_change(&Context::default(), 2, other.to_vec(), 0).unwrap();
        assert_eq!(change.worst, 1);
        assert!(change.violation > 0.3);
        assert_eq!(
            least_change(&Context::default(), 1, vec![condition(&[], 1.0)], 0).unwrap().violation,
            1.0
        );
    }
}
