//! Answer of `cohaptic router`, as a JSON document and as text.

use std::fmt::Write as _;

use cohaptic_linkfile::router::{RouterFile, Side};
use cohaptic_realtime::Wish;
use cohaptic_router::{Count, LaneSnapshot, Received, Written};
use cohaptic_units::print::{Counted, Span};
use serde::Serialize;

use super::{Ending, RouterRun, attached, elapsed};
use crate::document_schema::{document, lateness};
use crate::output;
use crate::realtime::{ConfiguredDelay, carried, counts, late, notes};

/// Returns the answer of `cohaptic router --json`.
pub(super) fn document(file: &RouterFile, ran: &RouterRun) -> impl Serialize {
    let RouterRun { report, prepared, validity, asked, ending } = ran;
    let counters = &report.counters;
    // Counts of one side: packets received from the device of the side, and packets written to that device.
    let side = |side: Side, device: &str| {
        let Received { all, not_ip, malformed, passed, dropped } = counters.received[side.index()];
        let Written { packets, bytes, full, too_long, refused } = report.written[side.index()];
        document! {
            name: side.name(),
            device: device.to_owned(),
            received: document! {
                #[serde(flatten)]
                all: count(all),
                not_ip: not_ip,
                malformed: malformed,
                passed: passed,
                dropped: dropped,
            },
            by_default: count(counters.by_default[side.index()]),
            written: document! { packets: packets, bytes: bytes, full: full, too_long: too_long, refused: refused },
        }
    };
    document! {
        title: output::path(&file.file),
        duration_s: elapsed(report).as_secs_f64(),
        ending: match ending {
            Ending::Complete => "complete",
            Ending::Interrupted => "interrupted",
            Ending::Failed(_) => "failed",
        },
        valid: validity.is_valid(),
        packets: report.packets(),
        dropped: report.dropped(),
        release_error_us: lateness(&report.release),
        sides: [side(Side::Left, file.left.device()), side(Side::Right, file.right.device())],
        links: counters.lanes.iter().zip(asked).map(|(lane, asked)| of_lane(lane, asked)).collect::<Vec<_>>(),
        rules: counters.by_rule.iter().copied().map(count).collect::<Vec<_>>(),
        in_flight: document! { packets: counters.held.packets, bytes: counters.held.bytes.get() },
        granted: prepared.granted.iter().copied().map(Wish::name).collect::<Vec<_>>(),
        refused_wishes: prepared.refused.iter().map(ToString::to_string).collect::<Vec<_>>(),
    }
}

/// Returns the counts of one direction of a link.
fn of_lane(lane: &LaneSnapshot, asked: &ConfiguredDelay) -> impl Serialize + use<> {
    let (from, to) = (lane.from.name().to_owned(), lane.from.opposite().name().to_owned());
    document! {
        name: lane.link.clone(),
        #[serde(flatten)]
        link: cohaptic_answers::link(from, to, &lane.stats),
        delivered_bytes: lane.delivered_bytes,
        overload: lane.overload,
        asked_mean_delay_s: asked.first.map(|delay| delay.as_secs_f64()),
        changes: asked.changes,
    }
}

fn count(Count { packets, bytes }: Count) -> impl Serialize {
    document! { packets: packets, bytes: bytes }
}

pub(super) fn describe(file: &RouterFile, ran: &RouterRun) -> String {
    let RouterRun { report, prepared, validity, asked, ending } = ran;
    let mut text = format!("{}\n", output::path(&file.file));
    // Writing to a string cannot fail.
    let mut line = |line: String| {
        let _ = writeln!(text, "  {line}");
    };
    let (span, held) = (Span::measured(elapsed(report)), report.counters.held.packets);
    // The failure comes first: everything below is a result only until then.
    if let Ending::Failed(error) = ending {
        line(format!("FAILED after {span}: {error}"));
    }
    line(format!("{} arrived in {span}: {} dropped, {held} on the way at the end", Counted(report.packets(), "packet"), report.dropped()));
    line(format!("the run is {validity}"));
    if report.release.count > 0 {
        line(format!("release error: {}", late(&report.release)));
    }
    // Both sides are listed, also without a packet, because a silent side may tell of a mistake in the setup.
    for side in Side::BOTH {
        let (received, written) = (&report.counters.received[side.index()], &report.written[side.index()]);
        line(format!("{}: {}", attached(file, side), side_in_words(received, written)));
    }
    report.counters.lanes.iter().zip(asked).for_each(|(lane, asked)| line(lane_in_words(lane, asked)));
    text.push_str(&notes(prepared, *validity));
    text
}

fn side_in_words(received: &Received, written: &Written) -> String {
    let mut text = format!("{} came from it, {} were handed to it", Counted(received.all.packets, "packet"), written.packets);
    let apart = [
        ("passed by a rule", received.passed),
        ("passed because they are not IP", received.not_ip),
        ("dropped by a rule", received.dropped),
        ("malformed", received.malformed),
    ];
    if let Some(apart) = counts(&apart) {
        let _ = write!(text, "; of those that came {apart}");
    }
    if let Some(lost) = counts(&[("because its queue was full", written.full), ("too long", written.too_long), ("refused", written.refused)]) {
        let _ = write!(text, "; its device did not take {lost}");
    }
    text
}

fn lane_in_words(lane: &LaneSnapshot, asked: &ConfiguredDelay) -> String {
    let (from, to) = (lane.from.name(), lane.from.opposite().name());
    format!("{}, {from} -> {to}: {}", lane.link, carried(&lane.stats, asked, &[("overload", lane.overload)]))
}
