//! The operations without a server: from a file or standard input to standard output, with the same
//! code and the same bytes.

use std::io::{self, Read, Write};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::Arc;
use std::sync::mpsc::{self, Receiver, SyncSender, TryRecvError};
use std::thread;

use crate::api::chunks::{Buffer, Chunks};
use crate::api::json::{MAX_DEPTH, check_depth};
use crate::api::lines::{BatchPart, Cutter, Tally};
use crate::api::memory::{self, Memory};
use crate::api::operations::Answer;
use crate::api::output::Format;
use crate::api::problem::{Problem, Status};
use crate::core::context::Context;
use crate::core::limits;

/// Bytes read at once, at most.
const PIECE: usize = 1 << 20;

/// Why there is no answer.
#[derive(Debug, thiserror::Error)]
pub enum Failure {
    /// The request is at fault.
    #[error("{0}")]
    Refused(Box<Problem>),
    /// Input or output failed.
    #[error("{0}")]
    Io(#[from] io::Error),
}

impl From<Problem> for Failure {
    fn from(problem: Problem) -> Self {
        Failure::Refused(Box::new(problem))
    }
}

/// One operation: a request in, its answer out.
///
/// # Errors
/// What is wrong with the request; input that fails.
pub fn operation(answer: Answer, format: Format, input: impl Read) -> Result<Chunks, Failure> {
    let mut body = Vec::new();
    input.take(limits::BODY_BYTES as u64 + 1).read_to_end(&mut body)?;
    if body.len() > limits::BODY_BYTES {
        return Err(too_large("request").into());
    }
    check_depth(&body, MAX_DEPTH)?;
    let mut buffer = Buffer::new(&Context::default(), &memory::unlimited());
    answer(&Context::default(), &body, format, &mut buffer)?;
    Ok(buffer.finish())
}

fn too_large(what: &str) -> Problem {
    let detail = format!("the {what} exceeds {} bytes; send the data in parts", limits::BODY_BYTES);
    Problem::new(Status::PAYLOAD_TOO_LARGE, "too_large", "Beyond a limit", detail)
}

/// The answers to a part, when they are there.
type Underway = Receiver<(Chunks, Tally)>;

/// A batch: lines in, lines out, in the same order, over all cores, in constant memory. A line is
/// answered as soon as it is read, whatever comes after it. `on_read` is told of the bytes read.
///
/// # Errors
/// Input or output that fails. A line that fails has its problem in its place, and is counted.
pub fn batch(
    input: impl Read + Send + 'static,
    mut output: impl Write,
    format: Format,
    on_read: impl Fn(usize) + Send + 'static,
) -> io::Result<Tally> {
    let (send, parts) = mpsc::sync_channel(2 * rayon::current_num_threads());
    // Not waited for: where the output is closed, it may be reading a terminal.
    thread::spawn(move || {
        if let Err(error) = read(input, format, &send, on_read) {
            let _ = send.send(Err(error));
        }
    });
    let mut tally = Tally::default();
    while let Some(underway) = next(&parts, &mut output)? {
        let Some((chunks, counted)) = next(&underway?, &mut output)? else { continue };
        chunks.into_iter().try_for_each(|chunk| output.write_all(&chunk))?;
        tally += counted;
    }
    output.flush()?;
    Ok(tally)
}

/// What comes next. Before waiting for it, what was written is sent off: whoever sends line by line
/// waits for the answer.
fn next<T>(receiver: &Receiver<T>, output: &mut impl Write) -> io::Result<Option<T>> {
    match receiver.try_recv() {
        Ok(ready) => Ok(Some(ready)),
        Err(TryRecvError::Disconnected) => Ok(None),
        Err(TryRecvError::Empty) => output.flush().map(|()| receiver.recv().ok()),
    }
}

/// Reads the batch and has its parts computed, until its end or until nobody takes them.
fn read(
    mut input: impl Read,
    format: Format,
    parts: &SyncSender<io::Result<Underway>>,
    on_read: impl Fn(usize),
) -> io::Result<()> {
    let (budget, mut cutter) = (memory::unlimited(), Cutter::default());
    let mut piece = vec![0; PIECE];
    let hand_out = |part: BatchPart, refusal: Option<Problem>| {
        let (done, underway) = mpsc::sync_channel(1);
        let budget = budget.clone();
        let is_wanted = parts.send(Ok(underway)).is_ok();
        if is_wanted {
            rayon::spawn(move || _ = done.send(compute(&part, refusal, format, &budget)));
        }
        is_wanted
    };
    loop {
        let count = match input.read(&mut piece) {
            Err(error) if error.kind() == io::ErrorKind::Interrupted => continue,
            read => read?,
        };
        on_read(count);
        cutter.push(&piece[..count]);
        while let Some(part) = cutter.part().or_else(|| cutter.rest(count == 0)) {
            if !hand_out(part, None) {
                return Ok(());
            }
        }
        if cutter.pending() > limits::BODY_BYTES {
            hand_out(
                BatchPart { text: b"-".to_vec(), first: cutter.line() },
                Some(too_large("line")),
            );
            return Ok(());
        }
        if count == 0 {
            return Ok(());
        }
    }
}

/// Answers a part; a panic costs its lines, not the batch.
fn compute(
    part: &BatchPart,
    refusal: Option<Problem>,
    format: Format,
    budget: &Arc<dyn Memory>,
) -> (Chunks, Tally) {
    let answered = match refusal {
        Some(problem) => Err(problem),
        None => catch_unwind(AssertUnwindSafe(|| {
            part.tell(&Context::default(), format, MAX_DEPTH, budget)
        }))
        .unwrap_or_else(|_| Err(Problem::internal())),
    };
    answered.unwrap_or_else(|problem| {
        let lines = part.lines();
        (part.refuse(&problem, budget), Tally { lines, failed: lines })
    })
}
