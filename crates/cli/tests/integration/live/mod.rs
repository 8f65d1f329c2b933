//! `cohaptic live`: sessions of the real command, with the programs and the people that take part in one.
//!
//! A session prints its address before its time begins, and a test ends the session after the awaited event. The tests do not depend on the speed of the
//! machine: they wait long, and compare records, whose times are logical.

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
mod study;
mod study_page;

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
