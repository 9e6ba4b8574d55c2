//! Runs the service.

use std::io;
use std::net::SocketAddr;

use tokio::net::TcpListener;

use crate::http;

/// Serves on a listener until `shutdown` completes and running requests are answered.
///
/// # Errors
/// When the listener fails.
pub async fn run(listener: TcpListener, shutdown: impl Future<Output = ()> + Send + 'static) -> io::Result<()> {
    axum::serve(listener, http::router()).with_graceful_shutdown(shutdown).await
}

/// What to tell the person who started the service.
pub fn greeting(address: SocketAddr) -> String {
    format!("springline {} listens on http://{address}\ndocumentation: http://{address}/docs", env!("CARGO_PKG_VERSION"))
}

/// Completes when the process is told to stop: SIGINT or SIGTERM.
pub async fn stop_signal() {
    let interrupt = tokio::signal::ctrl_c();
    #[cfg(unix)]
    {
        use tokio::signal::unix::{SignalKind, signal};
        match signal(SignalKind::terminate()) {
            Ok(mut terminate) => {
                tokio::select! {
                    _ = interrupt => {}
                    _ = terminate.recv() => {}
                }
            }
            // Without a handler for SIGTERM the default action still ends the process.
            Err(_) => drop(interrupt.await),
        }
    }
    #[cfg(not(unix))]
    drop(interrupt.await);
}
