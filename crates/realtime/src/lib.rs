//! Logical time driven by the wall clock.
//!
//! Use this crate if a state machine of yours must act on time by the wall clock. It needs Linux.
//!
//! The state machines of this project are told the time. In virtual time a loop tells them; here a [`Clock`] does, and a [`Pacer`] waits until they want to
//! be called. [`drive()`] is the whole loop: it reads sockets, tells the time, sends and waits. What they are told is always the instant at which a thing was due, never the one at which the program got round to it: a late wake-up makes
//! one thing late and nothing after it. By how much is recorded ([`Lateness`]), and beyond a [`Tolerance`] a run says of itself that it was not valid.
//!
//! ```text
//!            due                     woken
//!  ───────────┼─────────────────────────┼──────────▶ wall time
//!             │◀────── lateness ───────▶│
//!   handle_timeout(due)         (not handle_timeout(woken))
//! ```
//!
//! [`prepare_thread`] asks the system for what helps: no timer slack, `SCHED_FIFO`, locked memory; each is granted or refused with a plain message.
//! [`udp`] has sockets that know when each datagram came in. This crate knows nothing of links, peers, or the content of a datagram.
//!
//! ```
//! use std::time::Duration;
//!
//! use cohaptic_realtime::{Clock as _, Lateness, MonotonicClock, Pacer, Pacing};
//!
//! let clock = MonotonicClock::start();
//! let mut pacer = Pacer::new(Pacing::Sleep);
//! let mut lateness = Lateness::new();
//! let mut due = clock.now();
//! for _ in 0..10 {
//!     due += Duration::from_millis(1);
//!     pacer.wait(&clock, Some(due), &[])?;
//!     lateness.record(clock.now().saturating_duration_since(due));
//! }
//! assert_eq!(lateness.summary().count, 10);
//! assert!(clock.now() >= due);
//! # Ok::<(), std::io::Error>(())
//! ```

#[cfg(not(target_os = "linux"))]
compile_error!("cohaptic-realtime needs Linux: its timers, its sockets and the scheduling of its threads are those of Linux");

mod clock;
mod drive;
mod lateness;
mod pacer;
mod thread;
pub mod udp;

pub use clock::{Clock, KernelStamps, MonotonicClock};
pub use drive::{Driven, Received, Schedule, drive};
pub use lateness::{Lateness, LatenessSummary, Tolerance, Validity};
pub use pacer::{Pacer, Pacing, Woken};
pub use thread::{Prepared, Refused, Wish, Wishes, prepare_thread};
