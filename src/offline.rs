//! The operations without a server: from standard input to standard output, with the same code and the same bytes.

use std::io::{self, BufRead, IsTerminal, Read, Write};

use indicatif::{ProgressBar, ProgressStyle};
use rayon::prelude::*;

use crate::core::limits;
use crate::http::budget::Budget;
use crate::http::json::{MAX_DEPTH, check_depth};
use crate::http::lines::{Cutter, Part};
use crate::http::operations::{self, BY_NAME};
use crate::http::paper::Paper;
use crate::http::shape::Shape;

/// Bytes read before their lines are computed, over all cores.
const ROUND: usize = 8 * 1024 * 1024;

/// One operation: a request in, its answer out.
///
/// # Errors
/// The problem, as JSON; an operation that does not exist; input or output that fails.
pub fn operation(name: &str, mut input: impl Read, mut output: impl Write) -> Result<(), String> {
    let names = || BY_NAME.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(", ");
    let answer = operations::named(name).ok_or_else(|| format!("there is no command {name}; the operations are {}", names()))?;
    let mut body = Vec::new();
    input.by_ref().take(limits::BODY_BYTES as u64 + 1).read_to_end(&mut body).map_err(|error| error.to_string())?;
    if body.len() > limits::BODY_BYTES {
        return Err(format!("the request exceeds {} bytes; send the data in parts", limits::BODY_BYTES));
    }
    let mut paper = Paper::new(&Budget::unlimited());
    let written = check_depth(&body, MAX_DEPTH).and_then(|()| answer(&body, Shape::default(), &mut paper));
    written.map_err(|problem| serde_json::to_string_pretty(&problem).unwrap_or_else(|_| problem.to_string()))?;
    let written = paper.finish().into_iter().try_for_each(|sheet| output.write_all(&sheet));
    written.and_then(|()| output.write_all(b"\n")).and_then(|()| output.flush()).map_err(|error| error.to_string())
}

/// A batch: lines in, lines out, in the same order, over all cores, in constant memory. `total` is the size of the input, if known.
///
/// # Errors
/// Input or output that fails.
pub fn batch(mut input: impl BufRead, mut output: impl Write, total: Option<u64>) -> io::Result<()> {
    let (budget, bar) = (Budget::unlimited(), bar(total));
    let mut cutter = Cutter::default();
    loop {
        let mut parts = Vec::new();
        let (mut read, mut is_end) = (0, false);
        while read < ROUND && !is_end {
            let bytes = input.fill_buf()?;
            is_end = bytes.is_empty();
            cutter.push(bytes);
            let count = bytes.len();
            input.consume(count);
            read += count;
            parts.extend(std::iter::from_fn(|| cutter.part()));
        }
        if is_end {
            parts.extend(cutter.rest(true));
        }
        let answer = |part: &Part| part.answer(Shape::default(), MAX_DEPTH, &budget);
        let answered: Vec<_> = parts.par_iter().map(answer).collect();
        for (part, sheets) in parts.iter().zip(answered) {
            let sheets = sheets.unwrap_or_else(|problem| part.refuse(&problem, &budget));
            sheets.into_iter().try_for_each(|sheet| output.write_all(&sheet))?;
        }
        bar.inc(read as u64);
        if is_end {
            bar.finish_and_clear();
            return output.flush();
        }
    }
}

/// Shown where a person looks.
fn bar(total: Option<u64>) -> ProgressBar {
    if !io::stderr().is_terminal() {
        return ProgressBar::hidden();
    }
    let (bar, template) = match total {
        Some(total) => (ProgressBar::new(total), "{wide_bar} {bytes} of {total_bytes}, {bytes_per_sec}, {eta} left"),
        None => (ProgressBar::new_spinner(), "{spinner} {bytes}, {bytes_per_sec}"),
    };
    bar.with_style(ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar()))
}
