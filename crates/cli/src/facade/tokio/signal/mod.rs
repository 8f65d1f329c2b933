//! Signals. In a test bed those come that the test sends.

use std::io;
use std::task::{Context, Poll};

use cohaptic_sockets::Signals;

pub use real::signal::*;

#[cfg(unix)]
pub mod unix;

/// Number of the signal of Ctrl-C.
const INTERRUPT: i32 = 2;

/// See `tokio::signal::ctrl_c`. In a test bed, waits for the signal that the test sends to the host by `Host::signal(2)`.
pub async fn ctrl_c() -> io::Result<()> {
    if cohaptic_sockets::is_in_bed() {
        let mut own = Own::new(INTERRUPT);
        std::future::poll_fn(|cx| own.poll_receive(cx)).await;
        return Ok(());
    }
    real::signal::ctrl_c().await
}

/// Signals of a test bed. None comes to a task that lives on no host.
#[derive(Debug)]
struct Own(Option<Box<dyn Signals>>);

impl Own {
    fn new(number: i32) -> Self {
        Self(cohaptic_sockets::host().map(|host| host.listen_for(number)))
    }

    fn poll_receive(&mut self, cx: &mut Context<'_>) -> Poll<()> {
        self.0.as_mut().map_or(Poll::Pending, |signals| signals.poll_receive(cx))
    }
}
