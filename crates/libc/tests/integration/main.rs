//! Sockets of the standard library, of `socket2` and of `quinn-udp` on a test bed.
#![cfg(all(target_os = "linux", target_env = "gnu", not(target_feature = "crt-static")))]
#![expect(clippy::unwrap_used, reason = "a test may fail")]

// The functions with the names of the C library.
use cohaptic_libc as _;

mod clocks;
mod faults;
mod names;
mod quinn_udp;
mod tcp;
mod udp;

use cohaptic_testkit::{Bed, Testbed};

/// Runs a program of a client and a server, 10 ms from each other.
fn run<F: Future<Output = ()> + 'static>(program: impl Fn(Bed) -> F) {
    Testbed::new(["client", "server"]).links("delay 10ms").run_twice(program);
}
