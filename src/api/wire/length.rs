//! How long lists may be.

use crate::core::limits;

/// The longest list that is read: the knots of the largest curve. Longer ones are refused while
/// they are read, before they take memory that no request needs.
pub const ITEMS: usize = limits::CONTROL_POINTS + limits::DEGREE + 1;

/// The refusal of a longer list.
pub(super) fn too_long<E: serde::de::Error>() -> E {
    E::custom(format!("{TOO_LONG} {ITEMS} items; the largest curve has as many knots"))
}

/// How the refusal of a list that is too long begins.
pub const TOO_LONG: &str = "the list has more than";
