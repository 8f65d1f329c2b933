//! Tests of the server from outside: over a real socket, and in a real browser.
#![expect(clippy::unwrap_used, clippy::panic, reason = "a test may fail")]
#![expect(clippy::print_stderr, reason = "a test that is skipped says so")]

mod browser;
mod contrast;
mod floods;
mod run;
mod server;
mod study;
