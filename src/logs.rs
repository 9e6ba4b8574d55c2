//! Log lines: text on a terminal, JSON otherwise, on standard error.

use std::io::{BufWriter, IsTerminal, stderr};

use tracing_appender::non_blocking::{NonBlockingBuilder, WorkerGuard};
use tracing_subscriber::EnvFilter;

use crate::config::LogFormat;

/// Starts logging. The guard, when dropped, waits until all is written.
///
/// Lines are written by a thread of their own, as many at once as there are: a reader of the log that stands still costs lines, not answers.
///
/// # Errors
/// A filter that makes no sense.
pub fn start(filter: &str, format: LogFormat) -> Result<WorkerGuard, String> {
    let filter = EnvFilter::builder().parse(filter).map_err(|error| format!("the setting `log`: {error}"))?;
    let (writer, guard) = NonBlockingBuilder::default().lossy(true).finish(BufWriter::new(stderr()));
    let is_terminal = stderr().is_terminal();
    let builder = tracing_subscriber::fmt().with_env_filter(filter).with_writer(writer).with_ansi(is_terminal).with_target(false);
    if format == LogFormat::Text || (format == LogFormat::Auto && is_terminal) {
        builder.init();
    } else {
        builder.json().flatten_event(true).with_current_span(false).with_span_list(false).init();
    }
    Ok(guard)
}
