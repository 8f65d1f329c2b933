//! A router in words.

use std::fmt::Write as _;

use cohaptic_linkfile::router::{RouterFile, Side};
use cohaptic_router::{LaneSnapshot, Received, Written};
use cohaptic_units::print::Counted;

use super::attached;
use super::conduct::{Ending, RouterRun};
use super::status::elapsed;
use crate::output;
use crate::realtime::{ConfiguredDelay, carried, counts, lasted, late, notes};

pub(super) fn describe(file: &RouterFile, ran: &RouterRun) -> String {
    let RouterRun { report, prepared, validity, asked, ending } = ran;
    let mut text = format!("{}\n", output::path(&file.file));
    // Writing to a string does not fail.
    let mut line = |line: String| {
        let _ = writeln!(text, "  {line}");
    };
    let (span, held) = (lasted(elapsed(report)), report.counters.held.packets);
    if let Ending::Failed(error) = ending {
        line(format!("FAILED after {span}: {error}"));
    }
    line(format!("{} came in within {span}, {} dropped, {held} on the way at the end", Counted(report.packets(), "packet"), report.dropped()));
    line(format!("the run is {validity}"));
    if report.release.count > 0 {
        line(format!("release error: {}", late(&report.release)));
    }
    for side in Side::BOTH {
        let (received, written) = (&report.counters.received[side.index()], &report.written[side.index()]);
        line(format!("{}: {}", attached(file, side), side_in_words(received, written)));
    }
    report.counters.lanes.iter().zip(asked).for_each(|(lane, asked)| line(lane_in_words(lane, asked)));
    text.push_str(&notes(prepared));
    text
}

fn side_in_words(received: &Received, written: &Written) -> String {
    let mut text = format!("{} came from it, {} were handed to it", received.all.packets, written.packets);
    let apart = [
        ("passed by a rule", received.passed),
        ("passed because they are not IP", received.not_ip),
        ("dropped by a rule", received.dropped),
        ("malformed", received.malformed),
    ];
    if let Some(apart) = counts(&apart) {
        let _ = write!(text, "; of what came {apart}");
    }
    if let Some(lost) = counts(&[("for want of room", written.full), ("too long", written.too_long), ("refused", written.refused)]) {
        let _ = write!(text, "; its device did not take {lost}");
    }
    text
}

fn lane_in_words(lane: &LaneSnapshot, asked: &ConfiguredDelay) -> String {
    let (from, to) = (lane.from.name(), lane.from.opposite().name());
    format!("{}, {from} -> {to}: {}", lane.link, carried(&lane.stats, asked, &[("overload", lane.overload)]))
}
