//! Signals. In a test bed no signal comes.

use std::io;

pub use real::signal::*;

#[cfg(unix)]
pub mod unix;

/// See `tokio::signal::ctrl_c`. Waits for ever in a test bed, which sends no signals to its programs.
pub async fn ctrl_c() -> io::Result<()> {
    if cohaptic_sockets::is_in_bed() {
        return std::future::pending().await;
    }
    real::signal::ctrl_c().await
}
