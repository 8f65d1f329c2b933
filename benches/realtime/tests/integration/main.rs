//! The soaks and the floods, for a few seconds, and that verdicts can be bad.
#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stderr, reason = "tests")]

mod flooded;
mod hello_floods;
mod soak;
mod verdicts;
