//! The mathematics: pure, synchronous and total. Nothing here reads, writes, or knows of HTTP or
//! JSON.
//!
//! A curve of any family is control points `P` and a basis; its basis functions are combinations of
//! Bernstein polynomials, so a *shape matrix* `M` gives the Bezier points `Q = M P` of the same
//! curve. [`basis`] makes `M`; [`bezier_form`] does everything with `Q`; [`curve`] joins segments;
//! one file per operation does the rest.

pub mod argument;
pub mod basis;
pub mod basis_functions;
pub mod bezier_form;
pub mod cancellation;
pub mod check;
pub mod context;
pub mod continuity;
pub mod convert;
pub mod curve;
pub mod dimensioned;
mod distance;
pub mod domain;
pub mod error;
pub mod evaluate;
pub mod fault;
pub mod fit;
mod gaps;
mod homogeneous;
pub mod interpolate;
pub mod join;
mod joint_rows;
pub mod knots;
pub mod limits;
pub mod linear;
mod local;
mod metric;
pub mod parameterization;
pub mod point;
pub mod rational;
pub mod reshape;
pub mod smoothness;
pub mod subdivide;
pub mod surface;
pub mod to_bspline;
pub mod weights;
