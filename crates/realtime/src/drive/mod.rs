//! The loop of a program in real time: what has come in is read, logical time passes, what leaves is sent, and the thread waits for the next deadline.
//!
//! Relay, router and sessions run in this loop. In which they differ stands in the constants of their [`Driven`], each with its reason.

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

/// A state machine together with its sockets or devices, to be run by [`drive()`].
pub trait Driven {
    /// The clock of the run.
    type Clock: Clock;
    /// Why the program cannot go on. One reason is that the system refuses to wait.
    type Error: From<io::Error>;

    /// Time before a deadline at which the last reading may begin, about as long as one reading takes. From then on the departures of the deadline are made
    /// ready: [`handle_timeout`](Self::handle_timeout) is called with the deadline ahead of its time, and [`send`](Self::send) at the deadline.
    ///
    /// `None`: nothing is read while the loop spins, and no instant is told ahead of its time. That is right for a program that reads a device at its
    /// deadline, and where strangers can make one reading longer than the program may be late.
    const AHEAD: Option<Duration>;

    /// Whether the loop rests for 50 µs between two readings while many packets come and go and the thread may sleep ([`Pacing::Sleep`]). Packets that leave
    /// together then go in one call of the kernel, and each is late by up to the rest.
    const RESTS: bool;

    /// Returns the clock of the run.
    fn clock(&self) -> &Self::Clock;

    /// Returns the file descriptors that become readable when something has come in for which the loop is to wake up.
    fn readable(&self) -> impl IntoIterator<Item = BorrowedFd<'_>>;

    /// Reads what has come in, without waiting, and hands it to the state machine. `now` is what the clock showed just before this call.
    ///
    /// # Errors
    ///
    /// The program cannot go on.
    fn receive(&mut self, now: Instant) -> Result<Received, Self::Error>;

    /// Returns the next deadline; `None` if nothing is under way.
    fn poll_timeout(&self) -> Option<Instant>;

    /// Lets logical time pass until `now` and makes ready what leaves by then. Returns whether anything that is due was left for another call: the loop then
    /// reads and calls again before it waits.
    fn handle_timeout(&mut self, now: Instant) -> bool;

    /// Sends what was made ready, and returns the number of packets sent.
    fn send(&mut self) -> u64;

    /// Returns whether the run has come to its end by itself. The default is never.
    fn is_over(&self) -> bool {
        false
    }
}

/// The result of one reading.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Received {
    /// Packets that came in.
    pub count: usize,
    /// Instant up to which everything that came in has been handed on. Logical time passes up to this instant only: a packet that is still unread came later.
    pub until: Instant,
}

/// How a program is driven.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Schedule {
    /// How the thread waits for deadlines.
    pub pacing: Pacing,
    /// End of the run on its clock; `None`: the run ends when the program or a look ends it.
    pub end: Option<Instant>,
    /// Time between two looks.
    pub look_every: Duration,
}

/// A look waits this long for a deadline that is near. After the deadline a look makes nothing late; before the deadline it would make the deadline late.
const LOOK_WAITS: Duration = Duration::from_millis(1);

/// Rest between two readings under load: see [`Driven::RESTS`]. Of 250,000 datagrams a second, each took the relay 2.1 µs of processor time in place of
/// 3.3 µs without rests (`relay-table` in `benches/realtime`).
const REST: Duration = Duration::from_micros(50);

/// Runs the program on the calling thread, to its end, to the end of the schedule, or until `look` breaks. `look` is called at the beginning and about every
/// [`look_every`](Schedule::look_every), between two deadlines; packets wait meanwhile.
///
/// # Errors
///
/// The first error of the program, or of the system when it refuses to wait.
pub fn drive<D: Driven>(driven: &mut D, schedule: &Schedule, mut look: impl FnMut(&mut D, Instant) -> ControlFlow<()>) -> Result<(), D::Error> {
    let mut pacer = Pacer::new(schedule.pacing);
    let (mut density, mut look_at) = (Density::new(), Instant::ZERO);
    let mut waited = Waited { now: driven.clock().now(), received: None };
    loop {
        // Arrivals first: no unread packet came before the instant up to which time passes.
        let Received { count, until } = match waited.received {
            Some(received) => received,
            None => driven.receive(waited.now)?,
        };
        let is_left = driven.handle_timeout(until);
        let sent = driven.send();
        let now = driven.clock().now();
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
        waited = if !is_left && D::RESTS && schedule.pacing == Pacing::Sleep && density.is_dense() {
            let clock = driven.clock();
            clock.block(Some(clock.now() + REST), &[])?;
            Waited::until_now(driven)
        } else {
            let due = driven.poll_timeout();
            if is_left || due.is_some_and(|due| due <= now) {
                Waited::until_now(driven)
            } else {
                wait(driven, &mut pacer, due, look_at, schedule.end)?
            }
        };
    }
}

/// The end of a wait.
struct Waited {
    /// What the clock showed at the end.
    now: Instant,
    /// What was read meanwhile.
    received: Option<Received>,
}

impl Waited {
    fn until_now(driven: &impl Driven) -> Self {
        Self { now: driven.clock().now(), received: None }
    }
}

/// Waits until something is due or can be read.
fn wait<D: Driven>(driven: &mut D, pacer: &mut Pacer, due: Option<Instant>, look_at: Instant, end: Option<Instant>) -> Result<Waited, D::Error> {
    let next = due.filter(|due| *due <= look_at.saturating_add(LOOK_WAITS)).unwrap_or(look_at);
    let until = end.map_or(next, |end| next.min(end));
    let readable: Vec<_> = driven.readable().into_iter().collect();
    if due != Some(until) {
        // A look need not be on time to the microsecond: no margin, and no spinning.
        driven.clock().block(Some(until), &readable)?;
        return Ok(Waited::until_now(driven));
    }
    let woken = pacer.approach(driven.clock(), due, &readable)?;
    drop(readable);
    if woken == Woken::Deadline { meet(driven, until) } else { Ok(Waited::until_now(driven)) }
}

/// Waits for the last moments before `due`, and sends what leaves then.
fn meet<D: Driven>(driven: &mut D, due: Instant) -> Result<Waited, D::Error> {
    let mut now = driven.clock().now();
    if let Some(ahead) = D::AHEAD {
        let ready_at = Instant::ZERO + due.saturating_duration_since(Instant::ZERO).saturating_sub(ahead);
        while now < ready_at {
            let received = driven.receive(now)?;
            if received.count > 0 {
                // The packet may leave before `due`.
                return Ok(Waited { now, received: Some(received) });
            }
            now = driven.clock().now();
        }
        if now >= due {
            return Ok(Waited { now, received: None });
        }
        // Nothing is due earlier, so that all that is made ready leaves at `due`.
        driven.handle_timeout(due);
    }
    while now < due {
        core::hint::spin_loop();
        now = driven.clock().now();
    }
    if D::AHEAD.is_some() {
        driven.send();
        now = driven.clock().now();
    }
    Ok(Waited { now, received: None })
}
