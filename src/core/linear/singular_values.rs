//! Singular values, with an end to the search for them.

use nalgebra::{DMatrix, Dyn, SVD};

/// Steps after which the search is given up; a matrix of 65 columns takes some hundreds.
const STEPS: usize = 100_000;

/// The decomposition, with its vectors if asked for; `None` for a matrix that is empty or not
/// finite: over the one the library panics, over the other it iterates without end.
pub fn decomposed(matrix: DMatrix<f64>, vectors: bool) -> Option<SVD<f64, Dyn, Dyn>> {
    let usable = !matrix.is_empty() && matrix.iter().all(|x| x.is_finite());
    if usable { SVD::try_new(matrix, vectors, vectors, 5.0 * f64::EPSILON, STEPS) } else { None }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_matrix_that_is_not_finite_has_none() {
        for x in [f64::NAN, f64::INFINITY] {
            assert!(
                decomposed(
                    DMatrix::from_row_slice(3, 3, &[1.0, 0.0, 0.0, x, x, x, 0.0, 0.0, 1.0]),
                    false
                )
                .is_none()
            );
        }
        assert_eq!(decomposed(DMatrix::identity(3, 3), true).map(|svd| svd.rank(0.5)), Some(3));
    }
}
