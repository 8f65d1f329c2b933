//! `cohaptic live`: sessions of the real command, with the programs and the people that take part in one.
//!
//! A session says where it listens before its time begins, and is ended when a test has seen what it waited for. Nothing here depends on how fast the machine
//! is: what is awaited is awaited long, and what is compared are records, which say in logical time what happened.

mod alone;
mod browser;
mod control;
mod examples;
mod http;
mod jump;
mod peer;
mod peer_elsewhere;
mod play;
mod play_access;
mod play_page;
mod records;
mod session;
mod strangers;

use std::time::{Duration, Instant};

/// Far more than anything here takes on a busy machine.
const PATIENCE: Duration = Duration::from_secs(60);

/// Waits until there is something.
fn wait_for<T>(what: &str, mut found: impl FnMut() -> Option<T>) -> T {
    let begin = Instant::now();
    loop {
        if let Some(found) = found() {
            return found;
        }
        assert!(begin.elapsed() < PATIENCE, "{what}: not within {PATIENCE:?}");
        std::thread::sleep(Duration::from_millis(10));
    }
}
