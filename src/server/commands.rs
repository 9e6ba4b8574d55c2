//! The operations as commands: what they take, their help, and what they print.

use std::fmt::Write as _;
use std::fs::File;
use std::io::{self, BufWriter, IsTerminal, Read, Write, stdin, stdout};
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::time::Instant;

use clap::builder::PossibleValue;
use clap::{ArgMatches, Args, Command, FromArgMatches, ValueEnum};
use indicatif::{HumanCount, ProgressBar, ProgressStyle};
use serde_json::json;
use utoipa::openapi::path::Operation;

use crate::api::lines::Tally;
use crate::api::operations::{Entry, OutputKind, TABLE};
use crate::api::output::{Format, Layout, Precision};
use crate::api::problem::{Problem, Status};
use crate::http::{self, negotiate};
use crate::server::offline::{self as offline, Failure};
use crate::server::pretty::pretty;

/// The request was refused, or input or output failed.
const REFUSED: u8 = 1;
/// The command line is wrong, or names a file that cannot be read.
const USAGE: u8 = 2;

/// Where the request is, and how errors are told.
#[derive(Debug, Args)]
pub struct Source {
    /// A file with the request; without it, or with `-`, standard input
    #[arg(value_name = "FILE")]
    file: Option<PathBuf>,
    /// Write errors as JSON to standard error, for programs
    #[arg(long)]
    json: bool,
}

/// How numbers are written.
#[derive(Debug, Args)]
pub struct Numbers {
    /// `full`: numbers parse back to the same double; `single`: as in single precision; 1 to 17: so
    /// many significant digits
    #[arg(long, value_name = "DIGITS", default_value = "full", value_parser = precision)]
    precision: Precision,
    /// How points are written
    #[arg(long, value_enum, default_value = "nested")]
    layout: Layout,
}

impl ValueEnum for Layout {
    fn value_variants<'a>() -> &'a [Self] {
        &[Layout::Nested, Layout::Flat]
    }

    fn to_possible_value(&self) -> Option<PossibleValue> {
        Some(match self {
            Layout::Nested => PossibleValue::new("nested").help("One list for each point"),
            Layout::Flat => PossibleValue::new("flat").help("One list for all coordinates"),
        })
    }
}

/// How an answer is laid out.
#[derive(Debug, Args)]
struct Spacing {
    /// Lay the answer out in lines, as is done on a terminal
    #[arg(long, conflicts_with = "compact")]
    pretty: bool,
    /// Write the answer on one line, as is done into files and pipes
    #[arg(long)]
    compact: bool,
}

/// What `batch` takes.
#[derive(Debug, Args)]
pub struct Batch {
    #[command(flatten)]
    source: Source,
    #[command(flatten)]
    numbers: Numbers,
    /// Exit with 1 if a line failed
    #[arg(long)]
    strict: bool,
    /// Leave out the summary on standard error
    #[arg(long)]
    quiet: bool,
}

impl Numbers {
    fn format(&self) -> Format {
        Format { precision: self.precision, layout: self.layout, raw: false }
    }
}

fn precision(text: &str) -> Result<Precision, String> {
    negotiate::precision(text).map_err(|_| "allowed is full, single, or 1 to 17".into())
}

/// An operation on the command line.
struct Named(&'static Entry);

/// Every operation, from the table that the service has them from.
fn all() -> impl Iterator<Item = Named> {
    TABLE.iter().map(Named)
}

/// A command for each operation; those with a slash in their name also as two words: `surfaces
/// evaluate`.
pub fn commands() -> Vec<Command> {
    let mut api = http::openapi();
    let mut documented = |named: &Named| {
        let path = api.paths.paths.get_mut(&format!("/v1/{}", named.0.name()));
        let post = path.and_then(|item| item.post.take()).unwrap_or_default();
        named.command(&post)
    };
    let mut commands = Vec::new();
    let mut groups: Vec<Command> = Vec::new();
    for named in all() {
        let command = documented(&named);
        if let Some((first, second)) = named.0.name().split_once('/') {
            let index =
                groups.iter().position(|group| group.get_name() == first).unwrap_or(groups.len());
            if index == groups.len() {
                let group = Command::new(first).about(format!("Operations on {first}")).hide(true);
                groups.push(group.subcommand_required(true).arg_required_else_help(true));
            }
            groups[index] =
                std::mem::take(&mut groups[index]).subcommand(command.clone().name(second));
        }
        commands.push(command);
    }
    commands.extend(groups);
    commands
}

impl Named {
    fn is_picture(&self) -> bool {
        self.0.kind == OutputKind::Picture
    }

    fn command(&self, operation: &Operation) -> Command {
        let summary = operation.summary.clone().unwrap_or_default();
        let description = wrapped(operation.description.as_deref().unwrap_or(""));
        let source = Source::augment_args(Command::new(self.0.name()));
        let command = if self.is_picture() {
            source
        } else {
            Spacing::augment_args(Numbers::augment_args(source))
        };
        let long_about = format!("{summary}\n\n{description}");
        command.about(summary).long_about(long_about).after_help(self.example())
    }

    /// The shortest example, to be pasted into a shell.
    fn example(&self) -> String {
        let Some(example) = self.0.examples.iter().min_by_key(|example| example.body.len()) else {
            return String::new();
        };
        let into = if self.is_picture() { " > picture.svg" } else { "" };
        format!(
            "Example: {}\n  echo '{}' | springline {}{into}\n\nThe fields of requests and answers: `springline openapi`, or /docs of a running service.\n\
             Exit code: 0 answered, 1 refused, 2 a wrong command line or a file that cannot be read.",
            example.summary,
            example.body.trim(),
            self.0.name(),
        )
    }

    fn run(&self, matches: &ArgMatches) -> ExitCode {
        let source = parsed::<Source>(matches);
        match self.answer(&source, matches) {
            Ok(()) => ExitCode::SUCCESS,
            Err(end) => end.told(self.0.name(), source.json),
        }
    }

    fn answer(&self, source: &Source, matches: &ArgMatches) -> Result<(), End> {
        let input = source.open(self.0.name(), "a request")?;
        if self.is_picture() {
            let chunks = offline::operation(self.0.answer, Format::default(), input)?;
            return Ok(printed(chunks)?);
        }
        let chunks = offline::operation(self.0.answer, parsed::<Numbers>(matches).format(), input)?;
        let spacing = parsed::<Spacing>(matches);
        let newline = b"\n".as_slice();
        if spacing.pretty || (stdout().is_terminal() && !spacing.compact) {
            return Ok(printed([pretty(&chunks.concat()).as_slice(), newline])?);
        }
        printed(chunks)?;
        Ok(printed([newline])?)
    }
}

/// The arguments were checked when the command line was.
fn parsed<A: FromArgMatches>(matches: &ArgMatches) -> A {
    A::from_arg_matches(matches).unwrap_or_else(|error| error.exit())
}

fn printed(texts: impl IntoIterator<Item: AsRef<[u8]>>) -> io::Result<()> {
    let mut output = stdout().lock();
    texts.into_iter().try_for_each(|text| output.write_all(text.as_ref()))?;
    output.flush()
}

/// Lines of the specification's texts, as long as a terminal likes them.
fn wrapped(text: &str) -> String {
    let mut out = String::new();
    let mut column = 0;
    for word in text.split_whitespace() {
        let fits = column + word.len() < 90;
        let between = if column == 0 {
            ""
        } else if fits {
            " "
        } else {
            "\n"
        };
        column = if fits { column + between.len() } else { 0 } + word.len();
        let _ = write!(out, "{between}{word}");
    }
    out
}

/// Runs the operation that the command line names, if it names one.
pub fn run(matches: &ArgMatches) -> Option<ExitCode> {
    let (first, matches) = matches.subcommand()?;
    let (name, matches) = match matches.subcommand() {
        Some((second, matches)) => (format!("{first}/{second}"), matches),
        None => (first.to_owned(), matches),
    };
    all().find(|named| named.0.name() == name).map(|named| named.run(matches))
}

/// Answers a batch.
pub fn batch(options: &Batch) -> ExitCode {
    let started = Instant::now();
    match answer_batch(options) {
        Ok(tally) => {
            if !options.quiet {
                eprintln!(
                    "{}",
                    summary(tally, started.elapsed().as_secs_f64(), options.source.json)
                );
            }
            if options.strict && tally.failed > 0 {
                ExitCode::from(REFUSED)
            } else {
                ExitCode::SUCCESS
            }
        }
        Err(end) => end.told("batch", options.source.json),
    }
}

fn answer_batch(options: &Batch) -> Result<Tally, End> {
    let input = options.source.open("batch", "lines of JSON")?;
    let bar = bar(options.source.size());
    let counted = bar.clone();
    let output = BufWriter::with_capacity(1 << 20, stdout().lock());
    let tally = offline::batch(input, output, options.numbers.format(), move |bytes| {
        counted.inc(bytes as u64)
    })?;
    bar.finish_and_clear();
    Ok(tally)
}

fn summary(tally: Tally, seconds: f64, as_json: bool) -> String {
    let Tally { lines, failed } = tally;
    if as_json {
        return json!({"lines": lines, "failed": failed, "seconds": seconds}).to_string();
    }
    let noun = if lines == 1 { "line" } else { "lines" };
    let [count, failures] = [lines, failed].map(|count| HumanCount(count as u64));
    format!("springline batch: {count} {noun}, {failures} failed, {seconds:.1} s")
}

/// Shown where a person looks, and sees nothing else.
fn bar(total: Option<u64>) -> ProgressBar {
    if !io::stderr().is_terminal() || stdout().is_terminal() {
        return ProgressBar::hidden();
    }
    let (bar, template) = match total {
        Some(total) => (
            ProgressBar::new(total),
            "{wide_bar} {bytes} of {total_bytes}, {bytes_per_sec}, {eta} left",
        ),
        None => (ProgressBar::new_spinner(), "{spinner} {bytes}, {bytes_per_sec}"),
    };
    bar.with_style(
        ProgressStyle::with_template(template).unwrap_or_else(|_| ProgressStyle::default_bar()),
    )
}

impl Source {
    fn path(&self) -> Option<&Path> {
        self.file.as_deref().filter(|path| *path != Path::new("-"))
    }

    fn open(&self, command: &str, what: &str) -> Result<Box<dyn Read + Send>, End> {
        let Some(path) = self.path() else {
            if stdin().is_terminal() {
                eprintln!(
                    "springline {command} reads {what} from standard input: end it with Ctrl-D, or see `springline {command} --help`"
                );
            }
            return Ok(Box::new(stdin()));
        };
        let unreadable = |error: &dyn std::fmt::Display| {
            let detail = format!("{}: {error}", path.display());
            End::Problem(
                Box::new(Problem::new(
                    Status::BAD_REQUEST,
                    "unreadable_file",
                    "The file cannot be read",
                    detail,
                )),
                USAGE,
            )
        };
        let file = File::open(path).map_err(|error| unreadable(&error))?;
        if file.metadata().is_ok_and(|about| about.is_dir()) {
            return Err(unreadable(&"it is a folder"));
        }
        Ok(Box::new(file))
    }

    /// Bytes to read, where that is known.
    fn size(&self) -> Option<u64> {
        let path = self.path().unwrap_or(Path::new("/dev/stdin"));
        path.metadata().ok().filter(std::fs::Metadata::is_file).map(|about| about.len())
    }
}

/// How a command ends that does not end well.
enum End {
    /// With this to tell, and this exit code.
    Problem(Box<Problem>, u8),
    /// Nobody reads what is printed any more: `| head` has seen enough.
    Closed,
}

impl From<Failure> for End {
    fn from(failure: Failure) -> Self {
        match failure {
            Failure::Refused(problem) => End::Problem(problem, REFUSED),
            Failure::Io(error) => error.into(),
        }
    }
}

impl From<io::Error> for End {
    fn from(error: io::Error) -> Self {
        if error.kind() == io::ErrorKind::BrokenPipe {
            return End::Closed;
        }
        let title = "Reading or writing failed";
        let problem =
            Problem::new(Status::INTERNAL_SERVER_ERROR, "input_output", title, error.to_string());
        End::Problem(Box::new(problem), REFUSED)
    }
}

impl End {
    fn told(self, command: &str, as_json: bool) -> ExitCode {
        let End::Problem(problem, code) = self else { return ExitCode::SUCCESS };
        if as_json {
            eprintln!("{}", serde_json::to_string(&problem).unwrap_or_default());
        } else {
            eprintln!("springline {command}: {}", problem.in_words());
            if code == REFUSED && command != "batch" {
                eprintln!("`springline {command} --help` shows a request that works.");
            }
        }
        ExitCode::from(code)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn texts_are_wrapped_between_words() {
        let text = "word ".repeat(40);
        let lines: Vec<String> = wrapped(&text).lines().map(str::to_owned).collect();
        assert_eq!(lines.len(), 3);
        assert!(
            lines
                .iter()
                .all(|line| line.len() <= 90 && line.starts_with("word") && line.ends_with("word"))
        );
        assert_eq!(lines.join(" "), text.trim());
    }
}
