//! Signals of Unix.

use std::io;
use std::task::{Context, Poll};

pub use real::signal::unix::*;

use super::Own;

/// See `tokio::signal::unix::Signal`.
#[derive(Debug)]
pub struct Signal(Which);

#[derive(Debug)]
enum Which {
    Real(real::signal::unix::Signal),
    Bed(Own),
}

/// See `tokio::signal::unix::signal`. In a test bed those signals come that the test sends by `Host::signal`.
#[track_caller]
pub fn signal(kind: SignalKind) -> io::Result<Signal> {
    if cohaptic_sockets::is_in_bed() {
        return Ok(Signal(Which::Bed(Own::new(kind.as_raw_value()))));
    }
    real::signal::unix::signal(kind).map(|signal| Signal(Which::Real(signal)))
}

impl Signal {
    /// See `tokio::signal::unix::Signal::recv`.
    pub async fn recv(&mut self) -> Option<()> {
        std::future::poll_fn(|cx| self.poll_recv(cx)).await
    }

    /// See `tokio::signal::unix::Signal::poll_recv`.
    pub fn poll_recv(&mut self, cx: &mut Context<'_>) -> Poll<Option<()>> {
        match &mut self.0 {
            Which::Real(signal) => signal.poll_recv(cx),
            Which::Bed(own) => own.poll_receive(cx).map(Some),
        }
    }
}
