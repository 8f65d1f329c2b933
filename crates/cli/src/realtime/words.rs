//! Messages of the commands in real time, and the publisher, which limits the number of snapshots of a run.

use std::ffi::OsString;
use std::fmt::Write as _;
use std::io::{self, Write as _};
use std::time::{Duration, Instant as Clock};

use cohaptic_control::Snapshot;
use cohaptic_realtime::LatenessSummary;
#[cfg(target_os = "linux")]
use cohaptic_realtime::{Prepared, Validity, Wish};
use cohaptic_units::print::Counted;
use cohaptic_units::visible_lines;
use cohaptic_wan::{DropCause, LinkModel, LinkStats};

use super::Look;
use crate::document_schema::micros;
use crate::failure::Failure;
use crate::output;

/// Formats a summary of lateness: `p50 31.2 µs, p99 76.0 µs, p99.9 120.0 µs, worst 1.20 ms`.
pub(crate) fn late(summary: &LatenessSummary) -> String {
    let LatenessSummary { p50, p99, p999, max, .. } = *summary;
    let [p50, p99, p999, max] = [p50, p99, p999, max].map(|span| {
        let micros = micros(span);
        // From a millisecond on, digits of microseconds tell nothing.
        if micros < 1000.0 { format!("{micros:.1} µs") } else { format!("{:.2} ms", micros / 1e3) }
    });
    format!("p50 {p50}, p99 {p99}, p99.9 {p999}, worst {max}")
}

/// Lists the granted real-time privileges, each refused privilege with advice, and measures against an invalid run, as indented lines.
#[cfg(target_os = "linux")]
pub(crate) fn notes(prepared: &Prepared, validity: Validity) -> String {
    let mut text = String::new();
    let granted: Vec<&str> = prepared.granted.iter().copied().map(Wish::name).collect();
    if !granted.is_empty() {
        let _ = writeln!(text, "  granted by the system: {}", granted.join(", "));
    }
    for refused in &prepared.refused {
        let _ = writeln!(text, "  {refused}");
    }
    if !validity.is_valid() {
        // A run without priority and without a refusal was started with `--no-priority`.
        let missing = match (prepared.refused.is_empty(), prepared.granted.contains(&Wish::Priority)) {
            (false, _) => ", allow what the system refused above",
            (true, false) => ", leave out --no-priority",
            (true, true) => "",
        };
        let _ = writeln!(
            text,
            "  what to do: this machine was too busy to be on time. End other programs{missing}, try --spin, or accept more lateness with --tolerance"
        );
    }
    text
}

/// Prints a line on standard error, with control characters escaped. Prints nothing under `--quiet`, which keeps standard error for errors.
pub(crate) fn say(line: &str) {
    if output::is_quiet() {
        return;
    }
    // A failed write to standard error does not keep the run from beginning.
    let _ = writeln!(io::stderr(), "{}", visible_lines(line));
}

/// Checks the length of a run (`--for`). `None` stands for a run without an end.
///
/// # Errors
///
/// [`Failure::Input`] if the length is zero.
pub(crate) fn some_length(length: Option<Duration>) -> Result<Option<Duration>, Failure> {
    if length.is_some_and(|length| length.is_zero()) {
        return Err(Failure::Input("--for 0s: expected a time above zero".to_owned()));
    }
    Ok(length)
}

/// Returns the words of a spec as texts.
pub(crate) fn unicode_words(spec: &[OsString]) -> Result<Vec<String>, Failure> {
    let word = |word: &OsString| {
        let text = word.to_str().ok_or_else(|| Failure::Input(format!("{}: expected words in Unicode", word.to_string_lossy())))?;
        Ok(text.to_owned())
    };
    spec.iter().map(word).collect()
}

/// Publishes snapshots of a run at limited intervals, because packets wait while a snapshot is taken.
pub(crate) struct Publisher {
    look: Option<Look>,
    every: Duration,
    last: Option<Clock>,
}

impl Publisher {
    pub(crate) const fn new(look: Option<Look>, every: Duration) -> Self {
        Self { look, every, last: None }
    }

    /// Takes and publishes a snapshot if a server or terminal shows snapshots and the interval since the last snapshot is over.
    pub(crate) fn offer(&mut self, snapshot: impl FnOnce() -> Snapshot) {
        let Some(look) = &self.look else { return };
        let now = Clock::now();
        if self.last.is_none_or(|last| now.duration_since(last) >= self.every) {
            look.publish(snapshot());
            self.last = Some(now);
        }
    }
}

/// Formats a snapshot as one line for a terminal.
pub(crate) fn status(snapshot: &Snapshot) -> String {
    let packets: u64 = snapshot.links.iter().map(|link| link.offered).sum();
    let in_links: u64 = snapshot.links.iter().map(cohaptic_control::LinkCounters::dropped_in_all).sum();
    let beside: u64 = snapshot.refused.iter().map(|(_, count)| count).sum();
    let p99 = snapshot.lateness.first().map_or(0.0, |lateness| micros(lateness.p99));
    format!("{} over links, {} dropped, release error p99 {p99:.0} µs", Counted(packets, "packet"), in_links + beside)
}

/// Formats the statistics of a link: `4000 offered, 3952 delivered, 40 dropped (loss), 8 on the way; mean delay 24.031 ms, asked 24.000 ms`.
/// `beside` holds the causes and numbers of packets dropped outside the link.
pub(crate) fn carried(stats: &LinkStats, asked: &ConfiguredDelay, beside: &[(&str, u64)]) -> String {
    let mut text = format!("{} offered, {} delivered", stats.offered(), stats.delivered());
    let in_link = DropCause::ALL.into_iter().map(|cause| (cause.name(), stats.dropped(cause)));
    // Causes without a drop are left out, so that the line stays short.
    for (cause, count) in in_link.chain(beside.iter().copied()).filter(|(_, count)| *count > 0) {
        let _ = write!(text, ", {count} dropped ({cause})");
    }
    for (what, count) in [("copies", stats.duplicated()), ("marked", stats.marked()), ("damaged", stats.damaged()), ("on the way", stats.in_flight())]
    {
        if count > 0 {
            let _ = write!(text, ", {count} {what}");
        }
    }
    if stats.cross_traffic().offered > 0 {
        let _ = write!(text, ", beside {}", stats.cross_traffic());
    }
    if let Some(delays) = asked.beside(stats) {
        let _ = write!(text, "; {delays}");
    }
    text
}

/// Lists all counts above zero with the name of each count: `3 stranger, 1 to-itself`. Returns `None` if all counts are zero.
pub(crate) fn counts(all: &[(&str, u64)]) -> Option<String> {
    let some: Vec<String> = all.iter().filter(|(_, count)| *count > 0).map(|(name, count)| format!("{count} {name}")).collect();
    (!some.is_empty()).then(|| some.join(", "))
}

/// Configured mean delay of a link at the start of a run, and the number of changes of the link since.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub(crate) struct ConfiguredDelay {
    /// Configured mean delay at the start. `None` for the replay of a recording, because a recording has no configured delay.
    pub(crate) first: Option<Duration>,
    pub(crate) changes: u64,
}

impl ConfiguredDelay {
    pub(crate) fn of(model: &LinkModel) -> Self {
        let is_recording = matches!(model, LinkModel::Replay(_));
        Self { first: (!is_recording).then(|| model.mean_delay()), changes: 0 }
    }

    /// Formats the measured and the configured mean delay. Returns `None` if the link has delivered nothing.
    pub(crate) fn beside(&self, stats: &LinkStats) -> Option<String> {
        let mean = stats.mean_delay()?;
        let asked = self.first.map_or_else(String::new, |first| format!(", asked {}", millis(first)));
        let changed = match self.changes {
            0 => String::new(),
            1 => " at first, changed once".to_owned(),
            more => format!(" at first, changed {more} times"),
        };
        Some(format!("mean delay {}{asked}{changed}", millis(mean)))
    }
}

fn millis(span: Duration) -> String {
    format!("{:.3} ms", span.as_secs_f64() * 1e3)
}

#[cfg(all(test, target_os = "linux"))]
mod tests {
    use cohaptic_realtime::Refused;
    use cohaptic_units::{Bytes, Ecn, Instant};
    use cohaptic_wan::{Link, LinkName, PacketInfo};

    use super::*;

    #[test]
    fn a_run_that_is_not_valid_says_what_to_do() {
        let late = Validity::NotValid { late: 5066, of: 14_492, what: "ticks", limit: Duration::from_millis(1) };
        let prepared = Prepared::default();
        assert_eq!(notes(&prepared, Validity::Valid), "");
        let advice = notes(&prepared, late);
        assert!(
            advice.contains("End other programs, leave out --no-priority, try --spin")
                && advice.contains("--tolerance")
                && !advice.contains("refused"),
            "{advice}"
        );
        let granted = Prepared { granted: vec![Wish::Priority], ..Prepared::default() };
        assert!(notes(&granted, late).contains("End other programs, try --spin"));
        let refused =
            Prepared { refused: vec![Refused { wish: Wish::Priority, error: io::ErrorKind::PermissionDenied.into() }], ..Prepared::default() };
        let advice = notes(&refused, late);
        assert!(advice.contains("End other programs, allow what the system refused above, try --spin"), "{advice}");
    }

    #[test]
    fn both_delays_are_said_and_that_it_was_changed() {
        let model = cohaptic_linkfile::link_from_keys(&["delay=24ms".to_owned()]).unwrap();
        let mut link = Link::new(0, &LinkName::between("a", "b"), model.clone());
        let asked = ConfiguredDelay::of(&model);
        assert_eq!(asked.beside(&link.stats()), None, "nothing was delivered yet");
        link.handle_packet(Instant::ZERO, PacketInfo { size: Bytes::new(1), ecn: Ecn::NotCapable }, ()).unwrap();
        link.handle_timeout(Instant::from_nanos(24_000_000)).unwrap();
        assert_eq!(asked.beside(&link.stats()).unwrap(), "mean delay 24.000 ms, asked 24.000 ms");
        let changed = ConfiguredDelay { changes: 2, ..asked };
        assert_eq!(changed.beside(&link.stats()).unwrap(), "mean delay 24.000 ms, asked 24.000 ms at first, changed 2 times");
    }
}
