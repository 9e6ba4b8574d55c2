//! What can be wrong with a request, and where.

use crate::api::pointer::Name;
use crate::core;
use crate::core::argument::Argument;
use crate::core::error::Step;

/// What the contract forbids, or the core.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum Fault {
    /// What the core refuses.
    #[error("{0}{hint}", hint = hint(.0))]
    Core(core::fault::Fault),
    /// A part that the object needs is not there.
    #[error("the field `{field}` is missing")]
    Missing {
        /// Its name, or the names of those of which one is needed, with "` or `" between them.
        field: &'static str,
    },
    /// The part that says which variant of the object is meant is not there.
    #[error("the field `{field}` is missing; it is one of {values}")]
    MissingTag {
        /// Its name.
        field: &'static str,
        /// The variants.
        values: String,
    },
    /// A part that belongs to another variant of the object.
    #[error("the field `{field}` does not belong to {of}, only to {owners}")]
    ForeignField {
        /// Its name.
        field: &'static str,
        /// The variant given.
        of: &'static str,
        /// The variants that have it.
        owners: String,
    },
}

/// What a fault of the core means for a request, where that is not plain.
fn hint(fault: &core::fault::Fault) -> &'static str {
    match fault {
        core::fault::Fault::WrongCount { what: "bases", .. } => {
            "; for all segments give `basis` in a request, and a list of one in a curve"
        }
        _ => "",
    }
}

impl From<core::fault::Fault> for Fault {
    fn from(fault: core::fault::Fault) -> Self {
        Fault::Core(fault)
    }
}

/// Faults at their places in a request. A place is printed as a JSON Pointer (RFC 6901).
pub type Error = core::error::Error<Name, Fault>;

impl From<core::error::Error> for Error {
    fn from(error: core::error::Error) -> Self {
        error.translated(Fault::Core, Name::Argument)
    }
}

impl From<core::fault::Fault> for Error {
    fn from(fault: core::fault::Fault) -> Self {
        Fault::Core(fault).into()
    }
}

/// Adds a field, or a position in a list, to the place of an error on its way out.
pub trait Locate<T> {
    /// The same result, its error seen from one level further out.
    fn at(self, step: impl Into<Step<Name>>) -> Result<T, Error>;
}

impl<T, E: Into<Error>> Locate<T> for Result<T, E> {
    fn at(self, step: impl Into<Step<Name>>) -> Result<T, Error> {
        self.map_err(|error| error.into().at(step))
    }
}

/// Two values that do not depend on each other, or what is wrong with each.
///
/// # Errors
/// Those of both.
pub fn both<A, B>(
    a: Result<A, impl Into<Error>>,
    b: Result<B, impl Into<Error>>,
) -> Result<(A, B), Error> {
    core::error::both(a.map_err(Into::into), b.map_err(Into::into))
}

/// Values that do not depend on each other, or what is wrong with each.
///
/// # Errors
/// Those of all, up to [`GATHERED`](core::error::GATHERED).
pub fn every<T, E: Into<Error>>(
    results: impl IntoIterator<Item = Result<T, E>>,
) -> Result<Vec<T>, Error> {
    core::error::every(results.into_iter().map(|result| result.map_err(Into::into)))
}

/// The same faults at the fields that the operation takes its arguments from.
pub fn named(error: Error, field: fn(Argument) -> &'static str) -> Error {
    error.outermost(|name| match name {
        Name::Argument(argument) => Name::Field(field(argument)),
        name @ Name::Field(_) => name,
    })
}
