//! The command line.

use std::process::ExitCode;

use clap::{Parser, Subcommand};
use springline::config::Config;
use springline::{healthcheck, http, server};
use tokio::net::TcpListener;

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
    Serve(Config),
    /// Print the OpenAPI specification
    Openapi,
    /// Ask the service on the configured address whether it is alive
    Healthcheck(Config),
}

fn main() -> ExitCode {
    let cli = Cli::parse();
    let result = match cli.command {
        None => serve(&cli.config),
        Some(Command::Serve(config)) => serve(&config),
        Some(Command::Openapi) => print_openapi(),
        Some(Command::Healthcheck(config)) => healthcheck::check(config.listen).map_err(Into::into),
    };
    match result {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("springline: {error}");
            ExitCode::FAILURE
        }
    }
}

#[tokio::main]
async fn serve(config: &Config) -> Result<(), Box<dyn std::error::Error>> {
    let listen = config.listen;
    let listener = TcpListener::bind(listen).await.map_err(|error| format!("cannot listen on {listen}: {error}"))?;
    println!("{}", server::greeting(listener.local_addr()?));
    Ok(server::run(listener, server::stop_signal()).await?)
}

fn print_openapi() -> Result<(), Box<dyn std::error::Error>> {
    println!("{}", http::openapi().to_pretty_json()?);
    Ok(())
}
