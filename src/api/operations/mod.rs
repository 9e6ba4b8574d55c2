//! The operations: what each is, and the one table of all.

pub mod basis;
pub mod continuity;
pub mod convert;
pub mod evaluate;
pub mod fit;
pub mod interpolate;
pub mod join;
pub mod render;
pub mod reshape;
pub mod subdivide;
pub mod surface_evaluate;
pub mod surface_subdivide;
pub mod surface_tessellate;
pub mod to_bspline;

use std::io::Write;

use utoipa::ToSchema;

use crate::api::chunks::{Buffer, CHUNK};
use crate::api::cost::Costed;
use crate::api::error::{self, Error};
use crate::api::json::{self, Request};
use crate::api::output::Format;
use crate::api::pointer;
use crate::api::problem::Problem;
use crate::api::writer::Written;
use crate::core::argument::Argument;
use crate::core::context::Context;

/// A request body that the specification shows and a test runs.
#[derive(Debug, Clone, Copy)]
pub struct Example {
    /// Its key in the specification.
    pub name: &'static str,
    /// What it shows.
    pub summary: &'static str,
    /// The JSON.
    pub body: &'static str,
}

impl Example {
    const fn new(name: &'static str, summary: &'static str, body: &'static str) -> Self {
        Example { name, summary, body }
    }
}

/// What an operation answers with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum OutputKind {
    /// An object: as JSON or in the raw format.
    Object,
    /// A picture, as SVG; in a batch a string.
    Picture,
}

/// One operation: everything that the floors above, the specification and the command line need to
/// know of it.
pub trait Operation: 'static {
    /// What it takes.
    type Request: Request + Costed + Written + ToSchema + Send + 'static;
    /// What it answers.
    type Answer: Output + ToSchema;
    /// Where it is posted to: `/v1/` and its name in batches and on the command line.
    const PATH: &str;
    /// Its name in generated clients.
    const ID: &str;
    /// Its group in the documentation.
    const TAG: &str;
    /// What it does, in a few words.
    const SUMMARY: &str;
    /// What it does, and what it costs.
    const DESCRIPTION: &str;
    /// What its answer is.
    const ANSWERED: &str;
    /// Requests that show it.
    const EXAMPLES: &[Example];

    /// Request to answer.
    ///
    /// # Errors
    /// Whatever the core refuses, at the field, or still at the argument.
    fn compute(context: &Context, request: Self::Request) -> Result<Self::Answer, Error>;

    /// The field of the request that an argument of the core comes from.
    fn field(argument: Argument) -> &'static str {
        pointer::field(argument)
    }

    /// Request to answer, each fault at the field that is wrong.
    ///
    /// # Errors
    /// As [`Operation::compute`].
    fn answer(context: &Context, request: Self::Request) -> Result<Self::Answer, Error> {
        Self::compute(context, request).map_err(|error| error::named(error, Self::field))
    }

    /// Whether a request costs less than handing it to another thread.
    fn is_small(_request: &Self::Request) -> bool {
        false
    }
}

/// What answers are.
pub trait Output: Written + Sized + 'static {
    /// As which kind.
    const KIND: OutputKind = OutputKind::Object;

    /// Writes it as the answer to a single request.
    ///
    /// # Errors
    /// As [`json::write`].
    fn write(&self, format: Format, buffer: &mut Buffer) -> Result<(), Problem> {
        json::write(self, format, buffer)
    }
}

/// A picture.
impl Output for String {
    const KIND: OutputKind = OutputKind::Picture;

    fn write(&self, _: Format, buffer: &mut Buffer) -> Result<(), Problem> {
        self.as_bytes()
            .chunks(CHUNK)
            .try_for_each(|part| buffer.write_all(part))
            .map_err(json::not_written)
    }
}

/// Reads a request, computes, writes the answer.
pub type Answer = fn(&Context, &[u8], Format, &mut Buffer) -> Result<(), Problem>;

/// An operation in the table.
#[derive(Debug, Clone, Copy)]
pub struct Entry {
    /// Where it is posted to.
    pub path: &'static str,
    /// Requests that show it.
    pub examples: &'static [Example],
    /// What it answers with.
    pub kind: OutputKind,
    /// Bytes to bytes, as to a single request.
    pub answer: Answer,
    /// Bytes to JSON, as in a batch.
    pub answer_json: Answer,
}

impl Entry {
    const fn of<O: Operation>() -> Self {
        Entry {
            path: O::PATH,
            examples: O::EXAMPLES,
            kind: O::Answer::KIND,
            answer: |context, body, format, buffer| {
                answered::<O>(context, body)?.write(format, buffer)
            },
            answer_json: |context, body, format, buffer| {
                json::write(&answered::<O>(context, body)?, format, buffer)
            },
        }
    }

    /// Its name in batches and on the command line: its path after `/v1/`.
    pub fn name(&self) -> &'static str {
        self.path.trim_start_matches("/v1/")
    }
}

fn answered<O: Operation>(context: &Context, body: &[u8]) -> Result<O::Answer, Problem> {
    O::answer(context, json::from_bytes(context, body)?).map_err(|error| json::refused(error, body))
}

/// Makes something of every operation, by its type.
pub trait Visitor {
    /// What is made.
    type Made;

    /// Makes it of one.
    fn visit<O: Operation>(&self) -> Self::Made;
}

macro_rules! operations {
    ($($module:ident::$name:ident),* $(,)?) => {
        /// Every operation.
        pub const TABLE: &[Entry] = &[$(Entry::of::<$module::$name>()),*];

        /// What the visitor makes of every operation, in the order of the table.
        pub fn each<V: Visitor>(visitor: &V) -> Vec<V::Made> {
            vec![$(visitor.visit::<$module::$name>()),*]
        }
    };
}

operations! {
    evaluate::Evaluate,
    subdivide::Subdivide,
    to_bspline::ToBspline,
    interpolate::Interpolate,
    fit::Fit,
    reshape::Reshape,
    join::Join,
    convert::Convert,
    continuity::ContinuityOperation,
    basis::BasisOperation,
    surface_evaluate::SurfaceEvaluate,
    surface_subdivide::SurfaceSubdivide,
    surface_tessellate::SurfaceTessellate,
    render::Render,
}

/// The operation of this name.
pub fn named(name: &str) -> Option<&'static Entry> {
    TABLE.iter().find(|entry| entry.name() == name)
}
