//! Signals of Unix.

use std::io;
use std::task::{Context, Poll};

pub use real::signal::unix::*;

/// See `tokio::signal::unix::Signal`.
#[derive(Debug)]
pub struct Signal(Option<real::signal::unix::Signal>);

/// See `tokio::signal::unix::signal`. No signal comes in a test bed.
#[track_caller]
pub fn signal(kind: SignalKind) -> io::Result<Signal> {
    if cohaptic_sockets::is_in_bed() {
        return Ok(Signal(None));
    }
    real::signal::unix::signal(kind).map(|signal| Signal(Some(signal)))
}

impl Signal {
    /// See `tokio::signal::unix::Signal::recv`.
    pub async fn recv(&mut self) -> Option<()> {
        std::future::poll_fn(|cx| self.poll_recv(cx)).await
    }

    /// See `tokio::signal::unix::Signal::poll_recv`.
    pub fn poll_recv(&mut self, cx: &mut Context<'_>) -> Poll<Option<()>> {
        match &mut self.0 {
            Some(signal) => signal.poll_recv(cx),
            None => Poll::Pending,
        }
    }
}
