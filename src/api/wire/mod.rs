//! What the JSON looks like: every object of the contract, declared once.
//!
//! `object!` and `union!` make of one declaration the type that reads and writes the JSON and the
//! schema that describes it, so that the three cannot drift apart. Each wire type then turns into
//! its core type in one step (`parse`), where everything semantic is checked.

mod basis;
mod curve;
mod entry;
mod failure;
mod field;
mod length;
mod object;
mod points;
pub mod rank;
pub mod raw;
mod reading;
mod report;
mod rules;
mod schema;
mod surface;
pub mod tolerant;
mod variant;

pub use basis::{Basis, Shape, Target, bases};
pub use curve::{AnyCurves, AnyDimensioned, Curve, Dimensioned};
pub use entry::{refuse, set, set_by};
pub use failure::meant;
pub use field::{Described, Field, Tuple, Whole, list, need, number, part, whole};
pub use length::TOO_LONG;
pub use points::{Points, Vector, space_list};
pub use reading::{Read, Reading};
pub use report::{Continuity, ReportStyle};
pub use rules::{EndCondition, Parameterization};
pub use schema::{constant, one_of, schema_of, union_schema};
pub use surface::{Surface, SurfaceDomain};
pub use variant::{Part, Variant, missing};
