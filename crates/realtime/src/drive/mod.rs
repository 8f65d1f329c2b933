//! The loop of a program in real time. Each round reads arrived packets, lets logical time pass, sends what leaves, and waits for the next deadline.
//!
//! Relay, router and sessions run in this loop. The constants of each implementation of [`Driven`] state how the programs differ, each with its reason.

mod density;
#[cfg(test)]
mod tests;

use core::ops::ControlFlow;
use std::io;
use std::os::fd::BorrowedFd;
use std::time::Duration;

use cohaptic_units::Instant;

use crate::{Clock, Pacer, Pacing, Woken};
use density::Density;

/// State machine with its sockets or devices, to be run by [`drive`].
pub trait Driven {
    /// Clock of the run.
    type Clock: Clock;
    /// Reason why the program cannot go on, such as a system that refuses to wait.
    type Error: From<io::Error>;

    /// Time before a deadline at which the last reading may begin, about as long as one reading takes. From then on the departures of the deadline are made
    /// ready: [`handle_timeout`](Self::handle_timeout) is called with the deadline ahead of its time, and [`send`](Self::send) at the deadline.
    ///
    /// `None`: nothing is read while the loop spins, and no instant is told ahead of its time. A program needs `None` if it reads a device at its deadline, or
    /// if strangers can make one reading longer than the program may be late.
    const AHEAD: Option<Duration>;

    /// `true` if the loop rests for 50 µs between two readings while traffic is dense and the thread may sleep ([`Pacing::Sleep`]). Packets with nearly equal
    /// departures then go in one call of the kernel, and each packet is late by up to the rest.
    const RESTS: bool;

    /// Returns the clock of the run.
    fn clock(&self) -> &Self::Clock;

    /// Returns the file descriptors that wake the loop when readable.
    fn readable(&self) -> impl IntoIterator<Item = BorrowedFd<'_>>;

    /// Reads arrived packets without waiting, and hands the packets to the state machine. `now` is the reading of the clock just before this call.
    ///
    /// # Errors
    ///
    /// The reason why the program cannot go on.
    fn receive(&mut self, now: Instant) -> Result<Received, Self::Error>;

    /// Returns the next deadline, or `None` if nothing is under way.
    fn poll_timeout(&self) -> Option<Instant>;

    /// Lets logical time pass until `now` and makes ready the packets that leave by then. Returns whether due packets were left for another call: the loop then
    /// reads and calls again before it waits.
    fn handle_timeout(&mut self, now: Instant) -> bool;

    /// Sends the packets made ready, and returns the number of packets sent.
    fn send(&mut self) -> u64;

    /// Returns whether the run has ended by itself. The default is `false`.
    fn is_over(&self) -> bool {
        false
    }
}

/// Result of one reading.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Received {
    /// Number of packets read.
    pub count: usize,
    /// Instant up to which every arrived packet has been handed on. Logical time passes up to this instant only, because a packet that is still unread arrived
    /// later.
    pub until: Instant,
}

/// Pace and end of a run.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Schedule {
    /// Way of waiting for deadlines.
    pub pacing: Pacing,
    /// End of the run on its clock. `None`: the run ends when the program or a look ends the run.
    pub end: Option<Instant>,
    /// Time between two looks.
    pub look_every: Duration,
}

/// Time that a look waits for a near deadline. A look just after a deadline makes nothing late; a look just before a deadline would make the deadline late.
const LOOK_WAITS: Duration = Duration::from_millis(1);

/// Rest between two readings under load: see [`Driven::RESTS`]. At 250,000 datagrams a second the relay took 2.1 µs of processor time per datagram with rests,
/// and 3.3 µs without (`relay-table` in `benches/realtime`).
const REST: Duration = Duration::from_micros(50);

/// Runs the program on the calling thread, until the program or the schedule ends the run, or until `look` breaks. `look` is called at the beginning and about
/// every [`look_every`](Schedule::look_every), between two deadlines; packets wait meanwhile.
///
/// # Errors
///
/// The first error of the program, or of the system if it refuses to wait.
pub fn drive<D: Driven>(driven: &mut D, schedule: &Schedule, mut look: impl FnMut(&mut D, Instant) -> ControlFlow<()>) -> Result<(), D::Error> {
    let mut pacer = Pacer::new(schedule.pacing);
    let (mut density, mut look_at) = (Density::new(), Instant::ZERO);
    let mut waited = Waited { now: driven.clock().now(), received: None };
    loop {
        // Reading comes first, because no unread packet may have arrived before the instant up to which time passes. `meet` may have read already.
        let Received { count, until } = match waited.received {
            Some(received) => received,
            None => driven.receive(waited.now)?,
        };
        let is_left = driven.handle_timeout(until);
        let sent = driven.send();
        let now = driven.clock().now();
        // Both directions count, because both are work for the loop.
        density.note(now, count as u64 + sent);
        if driven.is_over() || schedule.end.is_some_and(|end| now >= end) {
            return Ok(());
        }
        if now >= look_at {
            if look(driven, now).is_break() {
                return Ok(());
            }
            look_at = now.saturating_add(schedule.look_every);
        }
        // A rest replaces the wait only if nothing due was left, because a left packet would wait for the whole rest.
        waited = if !is_left && D::RESTS && schedule.pacing == Pacing::Sleep && density.is_dense() {
            let clock = driven.clock();
            clock.block(Some(clock.now() + REST), &[])?;
            Waited::until_now(driven)
        } else {
            let due = driven.poll_timeout();
            // Something is due already: the next round reads first, so that packets arrived meanwhile keep their order.
            if is_left || due.is_some_and(|due| due <= now) {
                Waited::until_now(driven)
            } else {
                wait(driven, &mut pacer, due, look_at, schedule.end)?
            }
        };
    }
}

/// End of a wait.
struct Waited {
    /// Reading of the clock at the end of the wait.
    now: Instant,
    /// Result of a reading during the wait, if the reading brought packets.
    received: Option<Received>,
}

impl Waited {
    /// Returns the end of a wait without a reading, at the present time.
    fn until_now(driven: &impl Driven) -> Self {
        Self { now: driven.clock().now(), received: None }
    }
}

/// Waits until something is due, until a socket can be read, until the next look, or until the end of the run.
fn wait<D: Driven>(driven: &mut D, pacer: &mut Pacer, due: Option<Instant>, look_at: Instant, end: Option<Instant>) -> Result<Waited, D::Error> {
    // A deadline shortly after the look comes first: see [`LOOK_WAITS`].
    let next = due.filter(|due| *due <= look_at.saturating_add(LOOK_WAITS)).unwrap_or(look_at);
    let until = end.map_or(next, |end| next.min(end));
    let readable: Vec<_> = driven.readable().into_iter().collect();
    if due != Some(until) {
        // A look and the end need no microsecond precision: no margin, and no spinning.
        driven.clock().block(Some(until), &readable)?;
        return Ok(Waited::until_now(driven));
    }
    let woken = pacer.approach(driven.clock(), due, &readable)?;
    // `meet` needs `driven` without the borrow of its file descriptors.
    drop(readable);
    if woken == Woken::Deadline { meet(driven, until) } else { Ok(Waited::until_now(driven)) }
}

/// Waits for the last moments before `due`, and sends the packets that leave at `due`.
fn meet<D: Driven>(driven: &mut D, due: Instant) -> Result<Waited, D::Error> {
    let mut now = driven.clock().now();
    if let Some(ahead) = D::AHEAD {
        let ready_at = Instant::ZERO + due.saturating_duration_since(Instant::ZERO).saturating_sub(ahead);
        while now < ready_at {
            let received = driven.receive(now)?;
            if received.count > 0 {
                // The packet may leave before `due`, so the loop computes the next deadline anew.
                return Ok(Waited { now, received: Some(received) });
            }
            now = driven.clock().now();
        }
        if now >= due {
            return Ok(Waited { now, received: None });
        }
        // No earlier deadline exists, so everything made ready leaves at `due`.
        driven.handle_timeout(due);
    }
    while now < due {
        core::hint::spin_loop();
        now = driven.clock().now();
    }
    // Without `AHEAD` nothing is ready yet: the loop reads first and then lets time pass.
    if D::AHEAD.is_some() {
        driven.send();
        now = driven.clock().now();
    }
    Ok(Waited { now, received: None })
}
