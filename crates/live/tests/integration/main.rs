//! Tests of the admission control, called the door here, against its peers and against strangers, and of the example programs against the door.
#![allow(clippy::unwrap_used, clippy::panic, clippy::float_cmp, reason = "tests: what fails here fails the test, and exact values are compared")]
#![allow(clippy::print_stderr, reason = "a test that cannot run here says so")]

mod client;
mod conversation;
#[cfg(feature = "falcon")]
mod ends;
mod examples;
#[cfg(feature = "falcon")]
mod falcons;
mod floods;
mod hostile;
#[cfg(feature = "inverse3")]
mod inverse3s;
mod join;
mod join_engine;
mod join_fitness;
mod join_force;
mod join_sockets;
mod key_files;
mod keyed;
mod keyless;
mod session;
mod support;
mod vectors;
