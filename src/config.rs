//! The settings.

use std::net::SocketAddr;

use clap::Args;

/// How the service runs: flags, or the environment variables named beside them.
#[derive(Debug, Clone, Args)]
pub struct Config {
    /// The address to listen on; port 0 takes any free port
    #[arg(long, env = "SPRINGLINE_LISTEN", value_name = "ADDR", default_value = "127.0.0.1:8080")]
    pub listen: SocketAddr,
}
