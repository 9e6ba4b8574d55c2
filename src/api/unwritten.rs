//! Why an answer cannot be written.

use std::io;

/// Why an answer cannot be written.
#[derive(Debug)]
pub struct Unwritten(pub io::Error);

impl std::fmt::Display for Unwritten {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        self.0.fmt(f)
    }
}

impl std::error::Error for Unwritten {}

impl From<io::Error> for Unwritten {
    fn from(error: io::Error) -> Self {
        Unwritten(error)
    }
}

impl From<serde_json::Error> for Unwritten {
    fn from(error: serde_json::Error) -> Self {
        Unwritten(error.into())
    }
}

/// Neither JSON nor the raw format has numbers that are not finite.
pub(super) fn not_finite() -> Unwritten {
    Unwritten(io::Error::other("not a finite number"))
}
