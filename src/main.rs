//! The command line.

use std::error::Error;
use std::ffi::OsString;
use std::io::{BufReader, BufWriter, Write, stdin, stdout};
use std::process::ExitCode;
use std::time::Duration;

use clap::{CommandFactory, FromArgMatches, Parser, Subcommand};
use springline::config::{self, Config};
use springline::server::{Server, Signals};
use springline::{healthcheck, http, logs, offline};

/// Requests allocate on one thread and free on another, and answers come in sheets of 256 KiB, which the system's allocator would take from
/// the system and give back each time.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

/// Curves with shape parameters, over HTTP
#[derive(Parser)]
#[command(version)]
struct Cli {
    #[command(subcommand)]
    command: Option<Command>,
    #[command(flatten)]
    config: Config,
}

#[derive(Subcommand)]
enum Command {
    /// Serve (the default)
    Serve,
    /// Print the OpenAPI specification
    Openapi,
    /// Print the effective settings, as a file that would set them
    Config,
    /// Answer a batch: lines of JSON from standard input to standard output
    Batch,
    /// Any operation by its name (evaluate, surfaces/evaluate, ...): a request from standard input, its answer to standard output
    #[command(external_subcommand)]
    Operation(Vec<OsString>),
    /// Ask the service on the configured address whether it is alive
    Healthcheck,
}

fn main() -> ExitCode {
    let Cli { command, config } = command_line();
    let result = match command {
        None | Some(Command::Serve) => serve(config),
        Some(Command::Openapi) => print_openapi(),
        Some(Command::Config) => {
            print!("{}", config.to_toml());
            Ok(())
        }
        Some(Command::Batch) => batch().map_err(Into::into),
        Some(Command::Operation(words)) => operation(&words).map_err(Into::into),
        Some(Command::Healthcheck) => healthcheck::check(&config).map_err(Into::into),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("springline: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Flags, variables, the file: where one is wrong, the process ends here and says which.
fn command_line() -> Cli {
    let given: Vec<OsString> = std::env::args_os().collect();
    let matches = Cli::command().get_matches_from(&given);
    let from_file = config::flags_of_file(&matches).unwrap_or_else(|error| {
        eprintln!("springline: {error}");
        std::process::exit(2)
    });
    let (program, rest) = given.split_at(given.len().min(1));
    let all = program.iter().cloned().chain(from_file).chain(rest.iter().cloned());
    Cli::from_arg_matches(&Cli::command().get_matches_from(all)).unwrap_or_else(|error| error.exit())
}

fn serve(config: Config) -> Result<(), Box<dyn Error>> {
    let _logs = logs::start(&config.log, config.log_format)?;
    for name in config::unknown_variables(&Cli::command()) {
        tracing::warn!(name, "no setting has this name; `springline config` prints them all");
    }
    let runtime = tokio::runtime::Builder::new_multi_thread().enable_all().build()?;
    let result = runtime.block_on(async {
        let signals = Signals::catch()?;
        let server = Server::bind(config).await?;
        // Who starts it need not read this.
        let _ =
            writeln!(stdout(), "springline {} listens on {url}\ndocumentation: {url}/docs", env!("CARGO_PKG_VERSION"), url = server.url()?);
        server.run(signals).await;
        Ok(())
    });
    runtime.shutdown_timeout(Duration::ZERO);
    result
}

/// Standard input, if it is a file, has a size.
fn batch() -> std::io::Result<()> {
    let total = std::fs::metadata("/dev/stdin").ok().filter(std::fs::Metadata::is_file).map(|file| file.len());
    let input = BufReader::with_capacity(1 << 20, stdin().lock());
    offline::batch(input, BufWriter::with_capacity(1 << 20, stdout().lock()), total)
}

fn operation(words: &[OsString]) -> Result<(), String> {
    match words {
        [name] => offline::operation(&name.to_string_lossy(), stdin().lock(), stdout().lock()),
        _ => Err("an operation reads its request from standard input and takes nothing after its name".into()),
    }
}

fn print_openapi() -> Result<(), Box<dyn Error>> {
    Ok(writeln!(stdout(), "{}", http::openapi().to_pretty_json()?)?)
}
