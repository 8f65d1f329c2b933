//! Stands in for tokio in a test. `cohaptic tokio` generates this package; do not edit it.
//!
//! Everything is re-exported from the real tokio, apart from sockets, tasks, runtimes, signals, processes and two functions of `time`. These ask `cohaptic-sockets`
//! whether a test bed runs on the present thread. Outside of a test bed each of them does what the real one does.
#![allow(rustdoc::broken_intra_doc_links, reason = "the documentation of a function is that of tokio")]

pub use real::*;

// Linked for its functions, which stand in for those of the C library.
#[cfg(all(unix, feature = "net"))]
use cohaptic_libc as _;

#[cfg(feature = "rt")]
mod hosted;
pub mod net;
#[cfg(feature = "process")]
pub mod process;
#[cfg(feature = "rt")]
pub mod runtime;
#[cfg(feature = "signal")]
pub mod signal;
pub mod task;
#[cfg(feature = "time")]
pub mod time;

#[cfg(feature = "rt")]
pub use task::spawn;
