//! Parts of an answer written side by side.

use crate::api::memory::NoRoom;

/// What writes one part.
pub type Part<'a> = Box<dyn FnOnce() + Send + 'a>;

/// Runs every part to its end, in any order, several at once where it can.
///
/// # Errors
/// [`NoRoom`] for all parts at once; some may have run.
pub type Run = fn(Vec<Part<'_>>) -> Result<(), NoRoom>;

/// How many parts may be written at once, and by whom.
#[derive(Debug, Clone, Copy)]
pub struct Side {
    /// How many; more than 1.
    pub parts: usize,
    /// By whom.
    pub run: Run,
}
