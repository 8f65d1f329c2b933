//! What the commands that carry foreign packets share.

use std::fmt::Write as _;
use std::io::{self, Write as _};
use std::time::{Duration, Instant as Clock};

use cohaptic_control::Snapshot;
use cohaptic_units::print::{Counted, Span};
use cohaptic_units::visible_lines;
use cohaptic_wan::{DropCause, LinkStats};

use super::{ConfiguredDelay, Look};
use crate::documents::micros;
use crate::failure::Failure;

/// Says something on standard error.
pub(crate) fn say(line: &str) {
    // What cannot be said does not keep the run from beginning.
    let _ = writeln!(io::stderr(), "{}", visible_lines(line));
}

/// How long a run is to last, if that was said.
pub(crate) fn some_length(length: Option<Duration>) -> Result<Option<Duration>, Failure> {
    if length.is_some_and(|length| length.is_zero()) {
        return Err(Failure::Input("--for 0s: expected more than nothing".to_owned()));
    }
    Ok(length)
}

/// Publishes what a run does, not more often than is worth its time: to take a snapshot makes packets wait.
pub(crate) struct Publisher {
    look: Option<Look>,
    every: Duration,
    last: Option<Clock>,
}

impl Publisher {
    pub(crate) const fn new(look: Option<Look>, every: Duration) -> Self {
        Self { look, every, last: None }
    }

    /// Publishes if somebody looks and it is time.
    pub(crate) fn offer(&mut self, snapshot: impl FnOnce() -> Snapshot) {
        let Some(look) = &self.look else { return };
        let now = Clock::now();
        if self.last.is_none_or(|last| now.duration_since(last) >= self.every) {
            look.publish(snapshot());
            self.last = Some(now);
        }
    }
}

/// One line for a terminal.
pub(crate) fn status(snapshot: &Snapshot) -> String {
    let packets: u64 = snapshot.links.iter().map(|link| link.offered).sum();
    let in_links: u64 = snapshot.links.iter().map(cohaptic_control::LinkCounters::dropped_in_all).sum();
    let beside: u64 = snapshot.refused.iter().map(|(_, count)| count).sum();
    let p99 = snapshot.lateness.first().map_or(0.0, |lateness| micros(lateness.p99));
    format!("{} over links, {} dropped, release error p99 {p99:.0} µs", Counted(packets, "packet"), in_links + beside)
}

/// `4000 offered, 3960 delivered, 40 dropped (loss), 8 on the way; mean delay 24.031 ms, asked 24.000 ms`. `beside` is what was dropped outside the link.
pub(crate) fn carried(stats: &LinkStats, asked: &ConfiguredDelay, beside: &[(&str, u64)]) -> String {
    let mut text = format!("{} offered, {} delivered", stats.offered(), stats.delivered());
    let in_link = DropCause::ALL.into_iter().map(|cause| (cause.name(), stats.dropped(cause)));
    for (cause, count) in in_link.chain(beside.iter().copied()).filter(|(_, count)| *count > 0) {
        let _ = write!(text, ", {count} dropped ({cause})");
    }
    for (what, count) in [("copies", stats.duplicated()), ("marked", stats.marked()), ("damaged", stats.damaged()), ("on the way", stats.in_flight())]
    {
        if count > 0 {
            let _ = write!(text, ", {count} {what}");
        }
    }
    if let Some(delays) = asked.beside(stats) {
        let _ = write!(text, "; {delays}");
    }
    text
}

/// How long a run lasted, to the millisecond.
pub(crate) fn lasted(span: Duration) -> Span {
    Span(Duration::from_millis(u64::try_from(span.as_millis()).unwrap_or(u64::MAX)))
}

/// Those that are not zero: `3 strangers, 1 to itself`. `None` if all are.
pub(crate) fn counts(all: &[(&str, u64)]) -> Option<String> {
    let some: Vec<String> = all.iter().filter(|(_, count)| *count > 0).map(|(name, count)| format!("{count} {name}")).collect();
    (!some.is_empty()).then(|| some.join(", "))
}
