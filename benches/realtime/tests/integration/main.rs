//! The soak, for a few seconds, and that its verdicts can be bad.
#![allow(clippy::unwrap_used, clippy::panic, clippy::print_stderr, reason = "tests")]

mod soak;
mod verdicts;
