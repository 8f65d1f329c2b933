//! Logical time driven by the wall clock.
//!
//! Use this crate if a state machine of yours must act on time by the wall clock. Clock, loop and sockets need Linux; [`Lateness`], [`Recent`] and [`own`] do
//! not.
//!
//! The state machines of this project do not read a clock; a caller tells them the time. In virtual time the caller is a loop. In real time a [`Clock`] gives
//! the time, a [`Pacer`] waits for the next deadline, and [`drive`] is the whole loop: it reads sockets, tells the time, sends and waits. A state machine is
//! always told the instant at which an event was due, never the instant at which the program was ready: a late wake-up makes one event late, and nothing after
//! the event. The lateness is recorded ([`Lateness`]). A run with more lateness than its [`Tolerance`] reports itself as not valid.
//!
//! ```text
//!            due                     woken
//!  ───────────┼─────────────────────────┼──────────▶ wall time
//!             │◀────── lateness ───────▶│
//!   handle_timeout(due)         (not handle_timeout(woken))
//! ```
//!
//! [`prepare_thread`] asks the system for help: no timer slack, `SCHED_FIFO`, locked memory. Each request is granted, or refused with a plain message. [`udp`]
//! has sockets that record the arrival of each datagram. The crate knows nothing of links, peers, or the content of datagrams.
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

#[cfg(target_os = "linux")]
mod clock;
#[cfg(target_os = "linux")]
mod drive;
mod lateness;
pub mod own;
#[cfg(target_os = "linux")]
mod pacer;
mod recent;
#[cfg(target_os = "linux")]
mod thread;
#[cfg(target_os = "linux")]
pub mod udp;

#[cfg(target_os = "linux")]
pub use clock::{Clock, KernelStamps, MonotonicClock};
#[cfg(target_os = "linux")]
pub use drive::{Driven, Received, Schedule, drive};
pub use lateness::{Lateness, LatenessSummary, Tolerance, Validity};
#[cfg(target_os = "linux")]
pub use pacer::{Pacer, Pacing, Woken};
pub use recent::Recent;
#[cfg(target_os = "linux")]
pub use thread::{Prepared, Refused, Wish, Wishes, prepare_thread};
