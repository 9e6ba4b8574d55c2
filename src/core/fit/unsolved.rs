//! Why a least-squares problem of a fit has no solution.

use crate::core::error::Error;
use crate::core::linear::least_squares::Deficient;

/// Either the problem has none, or finding it was stopped.
#[derive(Debug)]
pub(super) enum Unsolved {
    /// More than one curve fits best.
    Deficient(Deficient),
    /// Nobody waits for the solution.
    Stopped(Error),
}

impl Unsolved {
    /// The error for a client, to whom a deficiency has to be explained.
    pub(super) fn explained(self, explain: impl FnOnce(Deficient) -> Error) -> Error {
        match self {
            Unsolved::Deficient(deficient) => explain(deficient),
            Unsolved::Stopped(error) => error,
        }
    }
}

impl From<Deficient> for Unsolved {
    fn from(deficient: Deficient) -> Self {
        Unsolved::Deficient(deficient)
    }
}

impl From<Error> for Unsolved {
    fn from(error: Error) -> Self {
        Unsolved::Stopped(error)
    }
}
