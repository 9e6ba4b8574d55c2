//! Log lines: text on a terminal, JSON otherwise, on standard error.

use clap::ValueEnum;
use std::cell::RefCell;
use std::io::{self, IsTerminal, Write, stderr};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, OnceLock, PoisonError};
use std::thread;
use std::time::{Duration, SystemTime};

use serde::Serialize;
use tracing_subscriber::EnvFilter;

/// How log lines look.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum LogFormat {
    /// Text on a terminal, JSON otherwise
    Auto,
    /// For people
    Text,
    /// One JSON object a line
    Json,
}

/// So many bytes of lines wait to be written at most; a line beyond is lost.
const MOST: usize = 8 << 20;
/// How long a line waits for others that are written with it: waking a thread for each costs more
/// than the line.
const GATHER: Duration = Duration::from_millis(10);
/// How long the end of the process waits for a reader that stands still.
const PATIENCE: Duration = Duration::from_secs(1);

/// Where lines of JSON go, once logging has started and is of JSON.
static JSON: OnceLock<Arc<Queue>> = OnceLock::new();

/// Starts logging. The guard, when dropped, waits until all is written, but not for ever.
///
/// Lines are written by a thread of their own, as many at once as there are: a reader of the log
/// that stands still costs lines, not answers.
///
/// # Errors
/// A filter that makes no sense; no thread.
pub fn start(filter: &str, format: LogFormat) -> Result<Guard, String> {
    let filter = EnvFilter::builder()
        .parse(filter)
        .map_err(|error| format!("the setting `log`: {error}"))?;
    let queue = Arc::new(Queue::default());
    let writing = queue.clone();
    let spawned = thread::Builder::new()
        .name("log".into())
        .spawn(move || writing.write_all_to(&mut stderr()));
    spawned.map_err(|error| format!("cannot start the thread of the log: {error}"))?;
    let (is_terminal, for_others) = (stderr().is_terminal(), queue.clone());
    let writer = move || Lines(for_others.clone());
    let builder = tracing_subscriber::fmt()
        .with_env_filter(filter)
        .with_writer(writer)
        .with_ansi(is_terminal)
        .with_target(false);
    if format == LogFormat::Text || (format == LogFormat::Auto && is_terminal) {
        builder.init();
    } else {
        builder.json().flatten_event(true).with_current_span(false).with_span_list(false).init();
        let _ = JSON.set(queue.clone());
    }
    Ok(Guard(queue))
}

/// Ends logging when dropped.
#[must_use = "logging ends where this is dropped"]
pub struct Guard(Arc<Queue>);

impl Drop for Guard {
    fn drop(&mut self) {
        let mut state = self.0.state();
        state.ended = true;
        self.0.arrived.notify_one();
        drop(self.0.done.wait_timeout_while(state, PATIENCE, |state| !state.done));
    }
}

/// Lines on their way.
#[derive(Default)]
struct Queue {
    state: Mutex<State>,
    arrived: Condvar,
    done: Condvar,
}

#[derive(Default)]
struct State {
    text: Vec<u8>,
    /// Nothing comes any more.
    ended: bool,
    /// All is written.
    done: bool,
}

impl Queue {
    fn state(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Adds a line, if there is room.
    fn push(&self, line: &[u8]) {
        let mut state = self.state();
        if state.text.len() + line.len() <= MOST {
            let is_first = state.text.is_empty();
            state.text.extend_from_slice(line);
            if is_first {
                self.arrived.notify_one();
            }
        }
    }

    /// Writes lines until they end.
    fn write_all_to(&self, out: &mut impl Write) {
        let mut text = Vec::new();
        loop {
            let state = self.state();
            let state =
                self.arrived.wait_while(state, |state| state.text.is_empty() && !state.ended);
            let state = state.unwrap_or_else(PoisonError::into_inner);
            let gathered = self.arrived.wait_timeout_while(state, GATHER, |state| !state.ended);
            let mut state = gathered.unwrap_or_else(PoisonError::into_inner).0;
            if state.text.is_empty() {
                state.done = true;
                return self.done.notify_all();
            }
            std::mem::swap(&mut state.text, &mut text);
            drop(state);
            // Where standard error is closed there is nobody to tell.
            let _ = out.write_all(&text);
            text.clear();
        }
    }
}

/// The end of the queue that the subscriber writes to, line by line.
struct Lines(Arc<Queue>);

impl Write for Lines {
    fn write(&mut self, line: &[u8]) -> io::Result<usize> {
        self.0.push(line);
        Ok(line.len())
    }

    fn flush(&mut self) -> io::Result<()> {
        Ok(())
    }
}

/// The line of one answer; every request has one, so as JSON it is written without the detour of
/// events and visitors.
#[derive(Serialize)]
pub struct LogLine<'a> {
    /// The level, in capitals.
    pub level: &'static str,
    /// What it says.
    pub message: &'static str,
    /// The id of the request.
    pub request_id: &'a str,
    /// The trace, or nothing.
    pub trace_id: &'a str,
    /// The method.
    pub method: &'static str,
    /// The path.
    pub path: &'a str,
    /// The status.
    pub status: u16,
    /// From the head of the request to the head of the answer.
    pub seconds: f64,
}

impl LogLine<'_> {
    /// Logs it, if the log is of JSON; otherwise it is left to others.
    pub fn log(&self) -> bool {
        thread_local! {
            static LINE: RefCell<Vec<u8>> = const { RefCell::new(Vec::new()) };
        }
        let Some(queue) = JSON.get() else { return false };
        LINE.with_borrow_mut(|line| {
            line.clear();
            self.write(SystemTime::now(), line);
            queue.push(line);
        });
        true
    }

    /// As the subscriber writes events.
    fn write(&self, now: SystemTime, line: &mut Vec<u8>) {
        // Writing to memory does not fail.
        let _ = write!(line, "{{\"timestamp\":\"{}\",", humantime::format_rfc3339_micros(now));
        let start = line.len();
        let _ = serde_json::to_writer(&mut *line, self);
        // The brace that opens is there already.
        line.remove(start);
        line.push(b'\n');
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn line(write: impl FnOnce(Arc<Queue>)) -> String {
        let queue = Arc::new(Queue::default());
        write(queue.clone());
        String::from_utf8(queue.state().text.clone()).unwrap()
    }

    #[test]
    fn the_line_of_an_answer_is_what_the_subscriber_writes() {
        let (request_id, trace_id, path, status, seconds) =
            ("a\"b\\c", "4bf9", "/v1/\u{1}ü\"", 200_u16, 1.25e-5);
        let theirs = line(|queue| {
            let builder = tracing_subscriber::fmt()
                .with_writer(move || Lines(queue.clone()))
                .with_target(false)
                .json();
            let subscriber =
                builder.flatten_event(true).with_current_span(false).with_span_list(false).finish();
            tracing::subscriber::with_default(subscriber, || {
                let trace_id = trace_id.to_owned();
                tracing::info!(
                    request_id,
                    trace_id,
                    method = "POST",
                    path,
                    status,
                    seconds,
                    "answered"
                );
            });
        });
        let ours = line(|queue| {
            let answered = LogLine {
                level: "INFO",
                message: "answered",
                request_id,
                trace_id,
                method: "POST",
                path,
                status,
                seconds,
            };
            let mut line = Vec::new();
            answered.write(SystemTime::now(), &mut line);
            queue.push(&line);
        });
        let without_time = |line: &str| line[..14].to_owned() + &line[41..];
        assert_eq!(without_time(&ours), without_time(&theirs));
        assert_eq!(ours.len(), theirs.len());
    }

    #[test]
    fn all_lines_are_written_in_order_before_the_end() {
        let queue = Arc::new(Queue::default());
        let writing = queue.clone();
        let thread = thread::spawn(move || {
            let mut out = Vec::new();
            writing.write_all_to(&mut out);
            out
        });
        (0..1_000).for_each(|i| queue.push(format!("{i}\n").as_bytes()));
        drop(Guard(queue));
        let expected: String = (0..1_000).map(|i| format!("{i}\n")).collect();
        assert_eq!(String::from_utf8(thread.join().unwrap()).unwrap(), expected);
    }

    #[test]
    fn a_reader_that_stands_still_costs_lines_and_no_memory() {
        let text = line(|queue| (0..10_000).for_each(|_| queue.push(&[b'x'; 1_000])));
        assert!(text.len() <= MOST && text.len() > MOST - 1_000);
    }
}
