//! A session in the loop of [`cohaptic_realtime::drive()`].

use std::os::fd::BorrowedFd;
use std::time::Duration;

use cohaptic_realtime::{Driven, MonotonicClock, Received};
use cohaptic_units::Instant;

use super::outside::Outside;
use super::{Session, SessionError};

impl Driven for Session {
    type Clock = MonotonicClock;
    type Error = SessionError;

    /// A tick reads the devices of its peers, which must not happen before its time. A flood of forged datagrams makes one reading as long as a tick may be
    /// late, so that none begins shortly before a tick.
    const AHEAD: Option<Duration> = None;
    /// A rest would make ticks late.
    const RESTS: bool = false;

    fn clock(&self) -> &MonotonicClock {
        &self.clock
    }

    fn readable(&self) -> impl IntoIterator<Item = BorrowedFd<'_>> {
        self.outside.as_ref().and_then(Outside::readable)
    }

    /// Reads one batch of datagrams. Each sample counts at the instant at which the kernel saw it.
    fn receive(&mut self, now: Instant) -> Result<Received, SessionError> {
        let Self { outside, live, watch, clock, is_stopped, .. } = self;
        watch.woken = now;
        let Some(outside) = outside else { return Ok(Received { count: 0, until: now }) };
        let count = outside.receive(clock, |at, peer, sample| {
            if !*is_stopped {
                // A sample that the scene refuses is counted there.
                *is_stopped = live.handle_sample(at, peer, sample, watch).is_err();
            }
        })?;
        // Time passes to now also if more datagrams wait than one batch: a tick does not wait for a flood.
        Ok(Received { count, until: now })
    }

    fn poll_timeout(&self) -> Option<Instant> {
        self.live.poll_timeout()
    }

    /// Lets the next deadline pass, if it is due: one at a time, so that samples that came before the next one are read before it.
    fn handle_timeout(&mut self, now: Instant) -> bool {
        if let Some(due) = self.live.poll_timeout().filter(|due| *due <= now && !self.is_stopped) {
            let passed = self.live.handle_timeout(due, &mut self.watch);
            self.note(passed);
        }
        false
    }

    /// Sends on what the network has delivered.
    fn send(&mut self) -> u64 {
        let Self { outside, live, watch, clock, is_stopped, .. } = self;
        let Some(outside) = outside else { return 0 };
        let mut count = 0;
        while let Some(transmit) = live.poll_transmit() {
            if let Some(release) = outside.queue(clock, &transmit) {
                *is_stopped |= watch.released(release).is_err();
                count += 1;
            }
        }
        outside.flush();
        count
    }

    fn is_over(&self) -> bool {
        self.is_stopped || self.live.poll_timeout().is_none()
    }
}
