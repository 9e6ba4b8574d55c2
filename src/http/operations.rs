//! Every operation by its name: on bytes, for batches and the command line, and on a call that came by HTTP.

use std::io::Write;
use std::pin::Pin;

use axum::response::Response;

use super::call::Call;
use super::error::Problem;
use super::json;
use super::paper::{Paper, SHEET};
use super::shape::Shape;
use super::{
    basis, continuity, convert, evaluate, fit, interpolate, join, render, reshape, subdivide, surface_evaluate, surface_subdivide,
    surface_tessellate, to_bspline,
};

/// Reads a request, computes, writes the answer.
pub type Answer = fn(&[u8], Shape, &mut Paper) -> Result<(), Problem>;

/// Answers a call.
pub type Handler = fn(Call) -> Pin<Box<dyn Future<Output = Response> + Send>>;

macro_rules! by_name {
    ($($name:literal $module:ident),* $(,)?) => {
        /// Every operation by its name: its path after `/v1/`.
        pub const BY_NAME: &[(&str, Answer)] = &[$(
            ($name, |body, shape, paper| {
                let answer = $module::operation(json::from_bytes(body)?);
                json::write(&answer.map_err(|error| json::refused(error, body))?, shape, paper)
            })
        ),*];

        /// How each is answered over HTTP.
        const HANDLERS: &[(&str, Handler)] = &[$(($name, |call| Box::pin($module::post(call)))),*];
    };
}

by_name! {
    "evaluate" evaluate,
    "subdivide" subdivide,
    "to-bspline" to_bspline,
    "interpolate" interpolate,
    "fit" fit,
    "reshape" reshape,
    "join" join,
    "convert" convert,
    "continuity" continuity,
    "basis" basis,
    "surfaces/evaluate" surface_evaluate,
    "surfaces/subdivide" surface_subdivide,
    "surfaces/tessellate" surface_tessellate,
    "render" render,
}

/// The operations that answer a single request with a picture, and write it as text; in a batch it is a JSON string.
pub const PICTURES: &[(&str, Answer)] = &[("render", |body, _, paper| {
    let answer = render::operation(json::from_bytes(body)?);
    picture(&answer.map_err(|error| json::refused(error, body))?, paper)
})];

/// Writes a picture.
///
/// # Errors
/// As [`json::write`].
pub fn picture(text: &str, paper: &mut Paper) -> Result<(), Problem> {
    let mut sheets = text.as_bytes().chunks(SHEET);
    sheets.try_for_each(|sheet| paper.write_all(sheet)).map_err(json::not_written)
}

/// The operation of this name.
pub fn named(name: &str) -> Option<Answer> {
    BY_NAME.iter().find(|(known, _)| *known == name).map(|(_, answer)| *answer)
}

/// What answers calls at this path, if it is that of an operation: the router would find the same with more detours.
pub fn handler(path: &str) -> Option<Handler> {
    let name = path.strip_prefix("/v1/")?;
    HANDLERS.iter().find(|(known, _)| *known == name).map(|(_, handler)| *handler)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_path_has_its_operation() {
        let paths = super::super::OPERATIONS.iter().map(|(path, _)| path.trim_start_matches("/v1/"));
        assert!(paths.eq(BY_NAME.iter().map(|(name, _)| *name)));
    }
}
