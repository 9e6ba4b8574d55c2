//! The alpha-beta-Bezier basis of Li 2014.

use super::{Family, ShapeMatrix};
use crate::core::argument::Argument;
use crate::core::error::{Error, both};
use crate::core::fault::Fault;

/// Two parameters for cubics, Li 2014 eq. (8). They bend the curve through their product only;
/// `alpha` is also the length of the parameter domain.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct AlphaBeta {
    alpha: f64,
    beta: f64,
}

impl AlphaBeta {
    /// `alpha` in (0, 1], `beta` in (0, 3]; `alpha = 1, beta = 3` is the Bezier curve.
    ///
    /// # Errors
    /// [`Fault::OutOfRange`] at the parameter.
    pub fn new(alpha: f64, beta: f64) -> Result<Self, Error> {
        let within = |argument: Argument, what: &'static str, value: f64, most: f64| {
            let allowed = || {
                format!(
                    "0 < {what} <= {most} (Li 2014, Definition 1; alpha = 1, beta = 3 is the Bezier curve)"
                )
            };
            let valid = value > 0.0 && value <= most;
            if valid {
                Ok(())
            } else {
                Err(Fault::OutOfRange { what, value, allowed: allowed() }.at(argument))
            }
        };
        both(
            within(Argument::Alpha, "alpha", alpha, 1.0),
            within(Argument::Beta, "beta", beta, 3.0),
        )?;
        Ok(AlphaBeta { alpha, beta })
    }

    /// The length of the parameter domain.
    pub fn alpha(&self) -> f64 {
        self.alpha
    }

    /// The speed at the ends in units of the end edges: `C'(0) = beta (P1 - P0)`.
    pub fn beta(&self) -> f64 {
        self.beta
    }

    /// How far the inner Bezier points go along the end edges: `Q1 = P0 + (s / 3)(P1 - P0)`, `s =
    /// alpha beta`.
    fn third(&self) -> f64 {
        self.alpha * self.beta / 3.0
    }
}

/// The 4 x 4 matrix that moves the inner points along the end edges by this fraction.
fn along_edges(fraction: f64) -> ShapeMatrix {
    let rest = 1.0 - fraction;
    let rows = [
        [1.0, 0.0, 0.0, 0.0],
        [rest, fraction, 0.0, 0.0],
        [0.0, 0.0, fraction, rest],
        [0.0, 0.0, 0.0, 1.0],
    ];
    ShapeMatrix::from_fn(4, 4, |i, j| rows[i][j])
}

impl Family for AlphaBeta {
    fn name(&self) -> &'static str {
        "alpha-beta-bezier"
    }

    fn degree(&self, order: usize) -> Result<usize, Fault> {
        if order == 3 {
            return Ok(3);
        }
        Err(Fault::WrongCount {
            what: "control points per segment",
            count: order + 1,
            expected: 4,
            rule: "an alpha-beta-bezier segment is a cubic with 4 control points (order 3)",
        })
    }

    fn length(&self) -> f64 {
        self.alpha
    }

    fn own_order(&self) -> Option<usize> {
        Some(3)
    }

    fn shape_matrix(&self, _order: usize) -> ShapeMatrix {
        along_edges(self.third())
    }

    fn inverse(&self, _order: usize) -> Option<ShapeMatrix> {
        Some(along_edges(1.0 / self.third()))
    }
}
