//! Implementation of [`cohaptic_realtime::Driven`] for a session: the steps of the loop of [`cohaptic_realtime::drive()`].

use std::os::fd::BorrowedFd;
use std::time::Duration;

use cohaptic_realtime::{Driven, MonotonicClock, Received};
use cohaptic_units::Instant;

use super::outside::Outside;
use super::{Session, SessionError};

impl Driven for Session {
    type Clock = MonotonicClock;
    type Error = SessionError;

    /// `None`: nothing is made ready before a deadline, for two reasons. A tick reads the devices of its peers, and must not read the devices before its time.
    /// A flood of forged datagrams can make one reading of the socket take as long as a tick may be late, so no such reading may begin shortly before a tick.
    const AHEAD: Option<Duration> = None;
    /// `false`: a rest between two readings would make ticks late.
    const RESTS: bool = false;

    fn clock(&self) -> &MonotonicClock {
        &self.clock
    }

    fn readable(&self) -> impl IntoIterator<Item = BorrowedFd<'_>> {
        self.outside.as_ref().and_then(Outside::readable)
    }

    /// Reads a batch of datagrams and hands each admitted sample to the scene, at the instant at which the kernel received the datagram.
    fn receive(&mut self, now: Instant) -> Result<Received, SessionError> {
        let Self { outside, live, watch, clock, is_stopped, .. } = self;
        // Before a sample is handed over, the scene handles the ticks due before the sample. The lateness of these ticks counts up to now.
        watch.woken = now;
        live.set_clock(now);
        let Some(outside) = outside else { return Ok(Received { count: 0, until: now }) };
        let count = outside.receive(clock, |at, peer, sample| {
            if !*is_stopped {
                // `handle_sample` fails only if the record cannot be written. A sample refused by the scene is counted by the scene. Once the record has
                // failed, the rest of the batch is dropped: the run is over.
                *is_stopped = live.handle_sample(at, peer, sample, watch).is_err();
            }
        })?;
        // Logical time passes to `now` even if more datagrams wait than a batch holds: otherwise a flood would delay ticks.
        Ok(Received { count, until: now })
    }

    fn poll_timeout(&self) -> Option<Instant> {
        self.live.poll_timeout()
    }

    /// Handles the next deadline, if due. Handles a single deadline per call, so that samples received before the following deadline are read first.
    fn handle_timeout(&mut self, now: Instant) -> bool {
        // The tick is handled with its deadline as instant, not with `now`: the lateness must not change the motion.
        if let Some(due) = self.live.poll_timeout().filter(|due| *due <= now && !self.is_stopped) {
            // The gates of devices in hands go by the clock: the hand feels how late the tick is.
            self.live.set_clock(now);
            let passed = self.live.handle_timeout(due, &mut self.watch);
            self.note(passed);
        }
        false
    }

    /// Queues and sends the samples for peers in other programs that the network has delivered. Returns the number of samples with a receiver.
    fn send(&mut self) -> u64 {
        let Self { outside, live, watch, clock, is_stopped, .. } = self;
        let Some(outside) = outside else { return 0 };
        let mut count = 0;
        while let Some(transmit) = live.poll_transmit() {
            // `queue` returns `None` if nobody holds the seat of the receiver: the sample is then dropped and counted by the admission.
            if let Some(release) = outside.queue(clock, &transmit) {
                *is_stopped |= watch.released(release).is_err();
                count += 1;
            }
        }
        // All samples are queued before the first is sent, so that a call of the kernel can send many samples.
        outside.flush();
        count
    }

    fn is_over(&self) -> bool {
        self.is_stopped || self.live.poll_timeout().is_none()
    }
}
