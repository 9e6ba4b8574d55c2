//! The command line.

use std::error::Error;
use std::ffi::OsString;
use std::io::{self, Write, stdout};
use std::process::ExitCode;
use std::time::Duration;

use clap::{ArgMatches, Args, Command, CommandFactory, FromArgMatches, Parser, Subcommand};
use springline::http;
use springline::http::logs;
use springline::server::config::{self as config, Config};
use springline::server::{Server, Signals};
use springline::server::{commands, healthcheck};

/// Requests allocate on one thread and free on another, and answers come in chunks of 256 KiB,
/// which the system's allocator would take from the system and give back each time.
#[global_allocator]
static ALLOCATOR: mimalloc::MiMalloc = mimalloc::MiMalloc;

/// Curves with shape parameters, over HTTP and on the command line
#[derive(Parser)]
#[command(version, after_help = AFTER)]
struct Cli {
    #[command(subcommand)]
    command: Option<Chosen>,
    #[command(flatten)]
    config: Config,
}

const AFTER: &str = "\
An operation reads a request from a file or from standard input and prints the answer: \
`springline help evaluate` has an example.
Exit code: 0 done, 1 refused or failed, 2 a wrong command line or a file that cannot be read.";

/// The operations, which are not here, come from the table of operations.
#[derive(Subcommand)]
enum Chosen {
    /// Serve (the default)
    Serve,
    /// Print the OpenAPI specification
    Openapi,
    /// Print the effective settings, as a file that would set them
    Config,
    /// Ask the service on the configured address whether it is alive
    Healthcheck,
    /// Answer many operations, one a line
    ///
    /// Reads lines of JSON, {"id": ..., "op": "evaluate", "body": {...}}, and prints a line for
    /// each, in the same order, as soon as it can: {"line": 1, "id": ..., "answer": {...}}, or
    /// "problem" in place of "answer". A summary follows on standard error.
    Batch(commands::Batch),
}

fn main() -> ExitCode {
    let matches = command_line();
    if let Some(code) = commands::run(&matches) {
        return code;
    }
    let Cli { command, config } =
        Cli::from_arg_matches(&matches).unwrap_or_else(|error| error.exit());
    let result = match command {
        None | Some(Chosen::Serve) => serve(config),
        Some(Chosen::Openapi) => print_openapi(),
        Some(Chosen::Config) => stdout().write_all(config.to_toml().as_bytes()).map_err(Into::into),
        Some(Chosen::Batch(options)) => return commands::batch(&options),
        Some(Chosen::Healthcheck) => healthcheck::check(&config).map_err(Into::into),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        // Whoever reads what is printed has seen enough.
        Err(error)
            if error
                .downcast_ref()
                .is_some_and(|error: &io::Error| error.kind() == io::ErrorKind::BrokenPipe) =>
        {
            ExitCode::SUCCESS
        }
        Err(error) => {
            eprintln!("springline: {error}");
            ExitCode::FAILURE
        }
    }
}

/// Commands and settings; what computes here without a server does not show the settings of the
/// server.
fn program() -> Command {
    let settings = Config::augment_args(Command::new("settings"));
    let hidden: Vec<_> =
        settings.get_arguments().map(|setting| setting.clone().hide(true)).collect();
    let without = |command: Command| command.args(&hidden);
    let operations = commands::commands().into_iter().map(without);
    Cli::command()
        .mut_subcommand("batch", without)
        .mut_subcommand("openapi", without)
        .subcommands(operations)
}

/// Flags, variables, the file: where one is wrong, the process ends here and says which.
fn command_line() -> ArgMatches {
    let given: Vec<OsString> = std::env::args_os().collect();
    let program = program();
    let matches = program.clone().get_matches_from(&given);
    let from_file = config::flags_of_file(&matches).unwrap_or_else(|error| {
        eprintln!("springline: {error}");
        std::process::exit(2)
    });
    if from_file.is_empty() {
        return matches;
    }
    let (name, rest) = given.split_at(given.len().min(1));
    let all = name.iter().cloned().chain(from_file).chain(rest.iter().cloned());
    program.get_matches_from(all)
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
        let _ = writeln!(
            stdout(),
            "springline {} listens on {url}\ndocumentation: {url}/docs",
            env!("CARGO_PKG_VERSION"),
            url = server.url()?
        );
        server.run(signals).await;
        Ok(())
    });
    runtime.shutdown_timeout(Duration::ZERO);
    result
}

fn print_openapi() -> Result<(), Box<dyn Error>> {
    Ok(writeln!(stdout(), "{}", http::openapi().to_pretty_json()?)?)
}
