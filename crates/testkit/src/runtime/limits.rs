//! Ends of runs that are given up: nothing will ever happen, or the run does not end.

use std::fmt::Write as _;

use cohaptic_units::Instant;
use cohaptic_units::print::{Seconds, Span};

use crate::core::{Core, Shared};
use crate::settings::Reached;
use crate::task::Tasks;

/// Maximum number of lines of each kind in a message.
const SHOWN: usize = 8;

fn write_lines<T: std::fmt::Display>(text: &mut String, what: &str, lines: impl ExactSizeIterator<Item = T>) {
    let more = lines.len().saturating_sub(SHOWN);
    // Writing to a `String` cannot fail.
    for line in lines.take(SHOWN) {
        let _ = write!(text, "\n  {line}");
    }
    if more > 0 {
        let _ = write!(text, "\n  and {more} more{what}");
    }
}

/// Returns a line for each waiting task, with the beginning of the wait and the awaited sockets and timers. A line for each awaited socket follows.
fn who_waits(core: &Core, tasks: &Tasks) -> String {
    let mut text = String::new();
    write_lines(&mut text, "", tasks.waiting().iter().map(|task| task.waits(core)));
    write_lines(&mut text, " sockets", core.waits().into_iter());
    text
}

/// Fails the run, because nothing will ever happen any more after `since`. With tokio, the clock may have jumped since then.
///
/// # Panics
///
/// Always.
#[expect(clippy::panic, reason = "the program waits for ever; says who does, and the way out")]
pub(super) fn nothing_will_happen(shared: &Shared, tasks: &Tasks, since: Instant) -> ! {
    let mut text = shared.with(|core| who_waits(core, tasks));
    // A future of another program beside the tasks is not listed, and its waker belongs to another thread.
    if text.is_empty() {
        text.push_str(
            "\n  nobody waits for a socket of the test bed. Another thread, such as one that holds a lock, does not count: run tests that share a lock one \
             after the other (`RUST_TEST_THREADS=1`)",
        );
    }
    panic!(
        "nothing will ever happen after {} s: no packet is under way, no timer is set, and tasks still wait. Put a `timeout` around each wait for a packet \
         that may be lost. Who waits:{text}",
        Seconds(since)
    );
}

/// Fails the run, because the run does not end. `limit` is the limit that was reached.
///
/// # Panics
///
/// Always.
#[expect(clippy::panic, reason = "the program goes on for ever; says who does, over which network, and the way out")]
pub(super) fn goes_on(shared: &Shared, tasks: &Tasks, limit: Reached) -> ! {
    let (now, is_loopback, text) = shared.with(|core| {
        let mut text = String::new();
        write_lines(&mut text, " links", core.settings.said.lines(core.plan.names()).into_iter());
        let network = if text.is_empty() { "\n  ideal links".to_owned() } else { text };
        (core.now(), core.settings.loopback.is_some(), format!("The network:{network}\nWho waits:{}", who_waits(core, tasks)))
    });
    let (limit, way) = match limit {
        // Tests on a loopback know of no test bed.
        Reached::Time(time) if is_loopback => (format!("its time limit of {}", Span(time)), "the variable COHAPTIC_TEST_LIMIT"),
        Reached::Time(time) => (format!("its time limit of {}", Span(time)), "`Testbed::time_limit`"),
        Reached::Steps(steps) => (format!("its step limit of {steps} polls of tasks"), "`Testbed::step_limit`"),
    };
    panic!(
        "the run goes on beyond {limit}, at {} s. A program that tries again needs a last attempt, or a `timeout` around all attempts; \
         {way} sets another limit. {text}",
        Seconds(now)
    );
}
