//! The router from outside: its packets compared with another implementation, its engine in virtual time, its loop with an artificial clock, and real traffic
//! between network namespaces.
#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stderr, clippy::print_stdout, reason = "tests")]
#![allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, clippy::cast_precision_loss, reason = "tests count small numbers")]

mod damage;
mod engine;
mod headers;
mod kernel;
mod rules;
mod run;
mod sides;
mod support;
