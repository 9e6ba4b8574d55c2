//! The Quasi-Bezier bases of Chen 2013: the shape matrix itself is the parameter.

use std::sync::Arc;

use super::{Family, ShapeMatrix};
use crate::core::argument::Argument;
use crate::core::check::{at_least, at_most};
use crate::core::context::Context;
use crate::core::error::{Error, Locate, every};
use crate::core::fault::Fault;
use crate::core::limits;

/// The four ways to give a shape matrix.
#[derive(Debug, Clone, PartialEq)]
pub enum ShapeParameters {
    /// Every row.
    Matrix {
        /// `degree + 1` rows of `order + 1` entries.
        rows: Vec<Vec<f64>>,
    },
    /// Rows 1 to `floor(degree / 2)`; the first row is the unit row, the rest follow by symmetry
    /// (Chen 2013 eq. (13), (29)).
    Symmetric {
        /// The degree of the curve.
        degree: usize,
        /// Rows 1 to `floor(degree / 2)`; for an even degree the last of them is its own mirror
        /// image.
        upper_rows: Vec<Vec<f64>>,
    },
    /// A matrix of lower order, raised by Chen 2013 eq. (36) to the order of the control polygon.
    Recursive {
        /// Every row of the seed.
        seed: Vec<Vec<f64>>,
    },
    /// Yang and Zeng 2009 (Chen 2013 eq. (37)): `degree = order + 1`, one number per edge of the
    /// polygon.
    Elevation {
        /// `lambda_1 .. lambda_n`; all zero is degree elevation, the Bezier curve.
        lambdas: Vec<f64>,
    },
}

/// A shape matrix that is non-negative, has rows summing to 1, and full rank.
#[derive(Debug, Clone, PartialEq)]
pub struct Quasi {
    /// Shared, because every piece of a curve that is cut has the basis of the whole.
    shape: Arc<ShapeParameters>,
    /// The matrix at the order in which it was given.
    given: Arc<ShapeMatrix>,
}

impl Quasi {
    /// Checks a shape and builds its matrix.
    ///
    /// # Errors
    /// At the offending row or entry: rows of different lengths, a negative entry, a row sum that
    /// is not 1 (within [`limits::ROW_SUM_TOLERANCE`]), a middle row that is not symmetric; or
    /// without a place, a matrix without full rank.
    pub fn new(context: &Context, shape: ShapeParameters) -> Result<Self, Error> {
        let given = match &shape {
            ShapeParameters::Matrix { rows } => checked(context, rows).at(Argument::Rows)?,
            ShapeParameters::Symmetric { degree, upper_rows } => {
                mirrored(context, *degree, upper_rows)?
            }
            ShapeParameters::Recursive { seed } => checked(context, seed).at(Argument::Seed)?,
            ShapeParameters::Elevation { lambdas } => {
                yang_zeng(context, lambdas).at(Argument::Lambdas)?
            }
        };
        let columns = given.order() + 1;
        let rank = given.rank();
        if rank < columns {
            return Err(Fault::ShapeRank { rank, columns }.into());
        }
        Ok(Quasi { shape: Arc::new(shape), given: Arc::new(given) })
    }

    /// The shape as it was given.
    pub fn shape(&self) -> &ShapeParameters {
        &self.shape
    }
}

impl Family for Quasi {
    fn name(&self) -> &'static str {
        "quasi-bezier"
    }

    fn degree(&self, order: usize) -> Result<usize, Fault> {
        let own = self.given.order();
        let raisable = matches!(*self.shape, ShapeParameters::Recursive { .. });
        if order == own || (raisable && order > own) {
            return Ok(self.given.degree() + (order - own));
        }
        Err(Fault::WrongCount {
            what: "control points per segment",
            count: order + 1,
            expected: own + 1,
            rule: if raisable {
                "a recursive shape serves control polygons of its seed's order and above"
            } else {
                "a quasi-bezier segment has one control point for each column of its shape matrix"
            },
        })
    }

    fn own_order(&self) -> Option<usize> {
        Some(self.given.order())
    }

    fn shape_matrix(&self, order: usize) -> ShapeMatrix {
        (self.given.order()..order).fold((*self.given).clone(), |matrix, _| matrix.raised())
    }
}

/// Checks one row: finite, no negative entry, sum 1.
fn check_row(row: &[f64]) -> Result<(), Error> {
    let check = |(j, &m): (usize, &f64)| {
        let allowed = "0 <= entry <= 1 (Chen 2013 Propositions 1 and 2: the curve stays in the convex hull of its points)";
        let refuse = || {
            Fault::OutOfRange {
                what: "an entry of the shape matrix",
                value: m,
                allowed: allowed.into(),
            }
            .at(j)
        };
        if (0.0..=1.0).contains(&m) { Ok(()) } else { Err(refuse()) }
    };
    every(row.iter().enumerate().map(check))?;
    let sum: f64 = row.iter().sum();
    if (sum - 1.0).abs() > limits::ROW_SUM_TOLERANCE {
        return Err(Fault::RowSum { sum }.into());
    }
    Ok(())
}

/// Checks rows on their own: one length, at least two columns, each row valid.
fn check_rows(rows: &[Vec<f64>]) -> Result<(), Error> {
    let columns = rows.first().map_or(0, Vec::len);
    at_least("columns in the shape matrix (one per control point)", columns, 2)?;
    let check = |(i, row): (usize, &Vec<f64>)| {
        if row.len() != columns {
            let rule = "every row of a shape matrix has one entry per control point";
            return Err(Fault::WrongCount {
                what: "entries in this row",
                count: row.len(),
                expected: columns,
                rule,
            }
            .at(i));
        }
        check_row(row).at(i)
    };
    every(rows.iter().enumerate().map(check)).map(drop)
}

/// A matrix given by all its rows.
fn checked(context: &Context, rows: &[Vec<f64>]) -> Result<ShapeMatrix, Error> {
    at_most(
        "rows in the shape matrix",
        rows.len(),
        context.limits.degree + 1,
        "The degree of a segment is one less than its rows",
    )?;
    check_rows(rows)?;
    let columns = rows[0].len();
    if rows.len() < columns {
        let rule = "a shape matrix has at least as many rows (degree + 1) as columns (control points): Chen 2013 Note 3";
        return Err(
            Fault::WrongCount { what: "rows", count: rows.len(), expected: columns, rule }.into()
        );
    }
    Ok(ShapeMatrix::from_fn(rows.len(), columns, |i, j| rows[i][j]))
}

/// The matrix of eq. (29) from its free rows. The middle row of an even degree is its own mirror
/// image; eq. (30) leaves that out.
fn mirrored(
    context: &Context,
    degree: usize,
    upper_rows: &[Vec<f64>],
) -> Result<ShapeMatrix, Error> {
    if !(2..=context.limits.degree).contains(&degree) {
        let allowed = format!("2 <= degree <= {}", context.limits.degree);
        return Err(Fault::OutOfRange { what: "degree", value: degree as f64, allowed }
            .at(Argument::Degree));
    }
    let half = degree / 2;
    if upper_rows.len() != half {
        let rule = "rows 1 to floor(degree / 2) are free, the others follow by symmetry";
        return Err(Fault::WrongCount {
            what: "upper rows",
            count: upper_rows.len(),
            expected: half,
            rule,
        }
        .at(Argument::UpperRows));
    }
    check_rows(upper_rows).at(Argument::UpperRows)?;
    if degree.is_multiple_of(2) {
        own_mirror_image(&upper_rows[half - 1]).at(half - 1).at(Argument::UpperRows)?;
    }
    let unit = (0..upper_rows[0].len()).map(|j| f64::from(j == 0)).collect();
    let upper: Vec<Vec<f64>> = std::iter::once(unit).chain(upper_rows.iter().cloned()).collect();
    let lower =
        upper.iter().take(degree.div_ceil(2)).rev().map(|row| row.iter().rev().copied().collect());
    checked(context, &upper.iter().cloned().chain(lower).collect::<Vec<_>>())
}

/// Refuses a middle row that does not read the same backwards.
fn own_mirror_image(row: &[f64]) -> Result<(), Error> {
    let mirror = |j: usize| row[row.len() - 1 - j];
    let Some(j) = (0..row.len()).find(|&j| row[j] != mirror(j)) else { return Ok(()) };
    let allowed = format!(
        "{:?}, the entry across: for an even degree the middle row is its own mirror image",
        mirror(j)
    );
    Err(Fault::OutOfRange { what: "an entry of the middle row", value: row[j], allowed }.at(j))
}

/// Yang and Zeng 2009, Chen 2013 eq. (37): degree elevation with one number per edge.
/// `m_(i,i-1) = (i - lambda_i) / (n + 1)`, `m_ii = 1 - m_(i,i-1)`.
fn yang_zeng(context: &Context, lambdas: &[f64]) -> Result<ShapeMatrix, Error> {
    let order = lambdas.len();
    at_least("lambdas (one per edge of the control polygon)", order, 1)?;
    at_most("lambdas", order, context.limits.degree - 1, "The degree of the curve is one more")?;
    let height = (order + 1) as f64;
    let check = |(k, &lambda): (usize, &f64)| {
        let i = (k + 1) as f64;
        let allowed = || {
            format!(
                "{} <= lambda_{} <= {i} (Yang and Zeng 2009; 0 is degree elevation)",
                i - height,
                k + 1
            )
        };
        let refuse =
            || Fault::OutOfRange { what: "lambda", value: lambda, allowed: allowed() }.at(k);
        if (i - height..=i).contains(&lambda) { Ok(()) } else { Err(refuse()) }
    };
    every(lambdas.iter().enumerate().map(check))?;
    let before = |i: usize| (i as f64 - lambdas[i - 1]) / height;
    Ok(ShapeMatrix::from_fn(order + 2, order + 1, |i, j| match () {
        () if i == 0 || i == order + 1 => f64::from(j == i.min(order)),
        () if j + 1 == i => before(i),
        () if j == i => 1.0 - before(i),
        () => 0.0,
    }))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn place_of(shape: ShapeParameters) -> String {
        Quasi::new(&Context::default(), shape).unwrap_err().place.to_string()
    }

    #[test]
    fn symmetric_shapes_follow_equation_29() {
        let quasi = Quasi::new(
            &Context::default(),
            ShapeParameters::Symmetric {
                degree: 4,
                upper_rows: vec![vec![0.25, 0.75, 0.0], vec![0.25, 0.5, 0.25]],
            },
        )
        .unwrap();
        let rows: Vec<_> = quasi.given.rows().map(<[f64]>::to_vec).collect();
        let expected = [
            [1.0, 0.0, 0.0],
            [0.25, 0.75, 0.0],
            [0.25, 0.5, 0.25],
            [0.0, 0.75, 0.25],
            [0.0, 0.0, 1.0],
        ];
        assert_eq!(rows, expected);
        let properties = quasi.given.properties();
        assert!(
            properties.symmetric
                && properties.tangent_to_end_edges
                && properties.interpolates_end_points
        );
        assert!(!properties.degenerates_to_bernstein);
    }

    #[test]
    fn zero_lambdas_are_degree_elevation() {
        let quasi =
            Quasi::new(&Context::default(), ShapeParameters::Elevation { lambdas: vec![0.0; 4] })
                .unwrap();
        assert!(quasi.given.properties().degenerates_to_bernstein);
        let bent = Quasi::new(
            &Context::default(),
            ShapeParameters::Elevation { lambdas: vec![0.5, -0.2, 0.2, -0.5] },
        )
        .unwrap()
        .given
        .properties();
        assert!(
            bent.symmetric && !bent.degenerates_to_bernstein,
            "lambda_i = -lambda_(n+1-i) is symmetric"
        );
        assert!(
            !Quasi::new(
                &Context::default(),
                ShapeParameters::Elevation { lambdas: vec![0.5, -0.2, 0.3, -0.5] }
            )
            .unwrap()
            .given
            .properties()
            .symmetric
        );
    }

    #[test]
    fn raising_the_bernstein_seed_stays_bernstein() {
        let seed = vec![
            vec![1.0, 0.0, 0.0],
            vec![1.0 / 3.0, 2.0 / 3.0, 0.0],
            vec![0.0, 2.0 / 3.0, 1.0 / 3.0],
            vec![0.0, 0.0, 1.0],
        ];
        let quasi = Quasi::new(&Context::default(), ShapeParameters::Recursive { seed }).unwrap();
        assert_eq!(quasi.degree(5), Ok(6));
        assert!(quasi.shape_matrix(5).properties().degenerates_to_bernstein);
        assert!(quasi.degree(1).is_err());
    }

    #[test]
    fn faults_point_at_the_entry() {
        let rows = |m: [[f64; 2]; 3]| ShapeParameters::Matrix {
            rows: m.iter().map(|r| r.to_vec()).collect(),
        };
        let each = Quasi::new(&Context::default(), rows([[1.0, 0.0], [-0.1, 1.1], [0.0, 1.0]]))
            .unwrap_err()
            .each();
        assert_eq!(
            each.iter().map(|error| error.place.to_string()).collect::<Vec<_>>(),
            ["/rows/1/0", "/rows/1/1"]
        );
        assert_eq!(place_of(rows([[1.0, 0.0], [0.5, 0.4], [0.0, 1.0]])), "/rows/1");
        assert_eq!(place_of(rows([[0.5, 0.5], [0.5, 0.5], [0.5, 0.5]])), "");
        assert_eq!(
            place_of(ShapeParameters::Matrix { rows: vec![vec![1.0, 0.0], vec![1.0]] }),
            "/rows/1"
        );
        assert_eq!(place_of(ShapeParameters::Matrix { rows: vec![] }), "/rows");
        assert_eq!(
            place_of(ShapeParameters::Symmetric {
                degree: 2,
                upper_rows: vec![vec![0.25, 0.5, 0.25], vec![1.0]]
            }),
            "/upper rows"
        );
        assert_eq!(
            place_of(ShapeParameters::Symmetric {
                degree: 2,
                upper_rows: vec![vec![0.3, 0.5, 0.2]]
            }),
            "/upper rows/0/0"
        );
        assert_eq!(
            place_of(ShapeParameters::Symmetric {
                degree: 4,
                upper_rows: vec![vec![0.3, 0.7], vec![0.6, 0.5]]
            }),
            "/upper rows/1"
        );
        assert_eq!(place_of(ShapeParameters::Elevation { lambdas: vec![0.0, 2.5] }), "/lambdas/1");
    }
}
