//! Batches: one operation a line in, one answer a line out, in the same order.

use std::io::Write;
use std::ops::AddAssign;
use std::sync::Arc;

use crate::api::problem::Status;
use crate::core::context::Context;

use crate::api::chunks::{Buffer, Chunks};
use crate::api::json;
use crate::api::line::{Id, Line};
use crate::api::memory::Memory;
use crate::api::operations::{self, Entry, TABLE};
use crate::api::output::Format;
use crate::api::problem::Problem;
use crate::api::sentences::shortened;
use crate::api::wire::meant;

/// The media type of lines of JSON.
pub const NDJSON: &str = "application/x-ndjson";
/// Lines that are computed together: a part of a batch large enough that handing it to another
/// thread costs nothing.
pub const PART_BYTES: usize = 32 * 1024;
/// And not more of them, so that a part is soon done.
pub const PART_LINES: usize = 128;

/// Lines of a batch, and where in it they begin.
#[derive(Debug, Clone)]
pub struct BatchPart {
    /// The lines, each but perhaps the last with its end.
    pub text: Vec<u8>,
    /// The number of the first, from 1.
    pub first: usize,
}

/// Lines that were answered, and how many of them with a problem.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Tally {
    /// All of them, blank ones left out.
    pub lines: usize,
    /// Those with a problem.
    pub failed: usize,
}

impl AddAssign for Tally {
    fn add_assign(&mut self, other: Self) {
        self.lines += other.lines;
        self.failed += other.failed;
    }
}

impl BatchPart {
    /// The lines one by one.
    pub fn split(&self) -> Vec<BatchPart> {
        let lines = self.text.split_inclusive(|byte| *byte == b'\n').enumerate();
        lines.map(|(i, line)| BatchPart { text: line.to_vec(), first: self.first + i }).collect()
    }

    /// How many lines.
    pub fn lines(&self) -> usize {
        self.text.split_inclusive(|byte| *byte == b'\n').count()
    }

    /// Answers every line; a blank one with nothing.
    ///
    /// # Errors
    /// Never for a line, which has its problem in its place; only when nobody waits any more.
    pub fn answer(
        &self,
        context: &Context,
        format: Format,
        max_depth: usize,
        budget: &Arc<dyn Memory>,
    ) -> Result<Chunks, Problem> {
        self.tell(context, format, max_depth, budget).map(|(chunks, _)| chunks)
    }

    /// The same, counted.
    ///
    /// # Errors
    /// As [`BatchPart::answer`].
    pub fn tell(
        &self,
        context: &Context,
        format: Format,
        max_depth: usize,
        budget: &Arc<dyn Memory>,
    ) -> Result<(Chunks, Tally), Problem> {
        let (mut buffer, mut tally) = (Buffer::new(context, budget), Tally::default());
        for (i, line) in self.text.split(|byte| *byte == b'\n').enumerate() {
            if !line.trim_ascii().is_empty() {
                context.checkpoint()?;
                let is_answered =
                    answer(context, line, self.first + i, format, max_depth, &mut buffer)?;
                tally += Tally { lines: 1, failed: usize::from(!is_answered) };
            }
        }
        Ok((buffer.finish(), tally))
    }

    /// This problem in the place of every line.
    pub fn refuse(&self, problem: &Problem, budget: &Arc<dyn Memory>) -> Chunks {
        // It is short, and wanted by whoever still reads.
        let context = &Context::default();
        let mut buffer = Buffer::new(context, budget);
        for (i, line) in self.text.split(|byte| *byte == b'\n').enumerate() {
            if !line.trim_ascii().is_empty() {
                let id = Line::read(context, line, self.first + i, usize::MAX)
                    .map_or_else(|(id, _)| id, |(id, ..)| id);
                // A chunk for a problem is always there.
                let _ = refused(self.first + i, id.as_ref(), problem, &mut buffer);
            }
        }
        buffer.finish()
    }
}

/// Whether it could be answered; if not, its problem is written.
fn answer(
    context: &Context,
    line: &[u8],
    number: usize,
    format: Format,
    max_depth: usize,
    buffer: &mut Buffer,
) -> Result<bool, Problem> {
    let (id, op, body) = match Line::read(context, line, number, max_depth) {
        Ok(parts) => parts,
        Err((id, problem)) => {
            return refused(number, id.as_ref(), &problem, buffer).map(|()| false);
        }
    };
    let mut own = buffer.sibling();
    let computed = match operations::named(&op) {
        Some(operation) => {
            (operation.answer_json)(context, body.get().as_bytes(), format, &mut own)
        }
        None => Err(unknown(&op)),
    };
    context.checkpoint()?;
    match computed {
        Ok(()) => {
            begin(number, id.as_ref(), "answer", buffer)?;
            let chunks = own.finish();
            buffer.take(chunks).map_err(json::not_written)?;
            buffer.write_all(b"}\n").map_err(json::not_written).map(|()| true)
        }
        Err(problem) => refused(number, id.as_ref(), &problem, buffer).map(|()| false),
    }
}

fn unknown(op: &str) -> Problem {
    let names = || TABLE.iter().map(Entry::name);
    let hint = meant(op, names()).map_or(String::new(), |name| format!(" (did you mean {name}?)"));
    let all = names().collect::<Vec<_>>().join(", ");
    let detail =
        format!("there is no operation `{}`{hint}; the operations are {all}", shortened(op));
    Problem::at(
        Status::NOT_FOUND,
        "unknown_operation",
        "There is no such operation",
        "/op".into(),
        detail,
    )
}

fn begin(number: usize, id: Option<&Id>, what: &str, buffer: &mut Buffer) -> Result<(), Problem> {
    let id = id
        .and_then(|id| serde_json::to_string(id).ok())
        .map_or(String::new(), |id| format!("\"id\":{id},"));
    write!(buffer, "{{\"line\":{number},{id}\"{what}\":").map_err(json::not_written)
}

fn refused(
    number: usize,
    id: Option<&Id>,
    problem: &Problem,
    buffer: &mut Buffer,
) -> Result<(), Problem> {
    begin(number, id, "problem", buffer)?;
    let text = serde_json::to_vec(problem).unwrap_or_default();
    buffer.write_all(&text).and_then(|()| buffer.write_all(b"}\n")).map_err(json::not_written)
}

/// Cuts a stream of bytes into parts.
#[derive(Debug, Default)]
pub struct Cutter {
    bytes: Vec<u8>,
    /// How much of it has been cut off, how much has been searched for ends of lines, and where the
    /// last of these is.
    cut: usize,
    seen: usize,
    end: usize,
    /// The whole lines since the last cut, and all before.
    whole: usize,
    lines: usize,
}

impl Cutter {
    /// Adds bytes.
    pub fn push(&mut self, bytes: &[u8]) {
        self.bytes.drain(..self.cut);
        (self.seen, self.end, self.cut) = (self.seen - self.cut, self.end - self.cut, 0);
        self.bytes.extend_from_slice(bytes);
    }

    /// Bytes that belong to no part yet.
    pub fn pending(&self) -> usize {
        self.bytes.len() - self.cut
    }

    /// The number of the next line, from 1.
    pub fn line(&self) -> usize {
        self.lines + 1
    }

    /// The next part, if there are enough whole lines for one.
    pub fn part(&mut self) -> Option<BatchPart> {
        while let Some(length) = self.bytes[self.seen..].iter().position(|byte| *byte == b'\n') {
            self.seen += length + 1;
            self.whole += 1;
            self.end = self.seen;
            if self.end - self.cut >= PART_BYTES || self.whole == PART_LINES {
                return Some(self.cut_off(self.end));
            }
        }
        self.seen = self.bytes.len();
        None
    }

    /// What is left of what [`Cutter::part`] has seen: whole lines, and at the end of the stream
    /// one without its end.
    pub fn rest(&mut self, is_end: bool) -> Option<BatchPart> {
        let end = if is_end { self.bytes.len() } else { self.end };
        (end > self.cut).then(|| self.cut_off(end))
    }

    fn cut_off(&mut self, end: usize) -> BatchPart {
        let part = BatchPart { first: self.lines + 1, text: self.bytes[self.cut..end].to_vec() };
        (self.cut, self.seen, self.end, self.whole) = (end, end, end, 0);
        self.lines += part.lines();
        part
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_are_the_text_again_whatever_the_pieces() {
        let text: String = (0..1000).map(|i| format!("{}\n", "x".repeat(i % 700))).collect();
        for piece in [1, 7, 1000, 100_000] {
            let (mut cutter, mut whole, mut lines) = (Cutter::default(), Vec::new(), 1);
            let mut take = |part: BatchPart| {
                assert_eq!(part.first, lines);
                lines += part.lines();
                assert!(part.lines() <= PART_LINES);
                whole.extend(part.text);
            };
            for bytes in text.as_bytes().chunks(piece) {
                cutter.push(bytes);
                while let Some(part) = cutter.part() {
                    take(part);
                }
            }
            cutter.rest(true).into_iter().for_each(&mut take);
            assert_eq!(whole, text.as_bytes(), "{piece}");
            assert_eq!(lines, 1001);
        }
    }
}
