//! A session in words.

use cohaptic_harness::Ending;
use cohaptic_harness::live::SeatStats;
use cohaptic_live::Report;
use cohaptic_scene::Scene;
use cohaptic_units::print::{Counted, Span};

use crate::documents::micros;
use crate::realtime::{late, notes};
use crate::run::words::{length, packets};

pub(super) fn describe(scene: &Scene, report: &Report) -> String {
    let mut text = format!("{}\n", scene.title);
    let mut line = |line: String| text.push_str(&format!("  {line}\n"));
    let summary = &report.summary;
    let lasted = Span(summary.duration);
    match summary.ending {
        Ending::Complete => line(format!("{lasted}, {}", Counted(summary.ticks, "tick"))),
        Ending::Diverged(at) => line(format!("DIVERGED: at {at} a position or a velocity is no finite number any more")),
        Ending::Interrupted(_) => line(format!("ended after {lasted} of {}, {}", Span(scene.duration), Counted(summary.ticks, "tick"))),
    }
    line(format!("the run is {}", report.validity));
    line(format!("lateness of ticks: {}", late(&report.ticks)));
    if report.releases.count > 0 {
        line(format!("lateness of {} to other programs: {}", Counted(report.releases.count, "datagram"), late(&report.releases)));
    }
    line(format!("at the end logical time was {:.1} µs behind the clock", micros(report.behind)));
    line(format!("largest discrepancy between two copies: {}", length(summary.max_discrepancy)));
    for ((peer, spec), seat) in summary.peers.iter().zip(&scene.peers).zip(&report.seats) {
        let position: Vec<String> = peer.position.iter().map(|x| length(*x)).collect();
        let seat = seat.as_ref().map(came).unwrap_or_default();
        line(format!("{} ({}) ends at {}{seat}", peer.name, spec.kind.name(), position.join(", ")));
    }
    line(packets(summary));
    if let Some((door, socket)) = &report.admission {
        line(format!("door at {}: {} let in, {} sent", socket.address, Counted(door.admitted, "sample"), door.sent));
        let refused: Vec<String> = door.refusals().filter(|(_, count)| *count > 0).map(|(cause, count)| format!("{count} {cause}")).collect();
        if !refused.is_empty() {
            line(format!("refused: {}", refused.join(", ")));
        }
        let lost = socket.counts.failures.in_all() + socket.counts.oversized + socket.kernel_drops.unwrap_or(0);
        if lost > 0 {
            line(format!("lost at the socket: {}", Counted(lost, "datagram")));
        }
    }
    text.push_str(&notes(&report.prepared));
    text
}

fn came(seat: &SeatStats) -> String {
    let late = if seat.late > 0 { format!(", {} of them {:.0} µs late at most", seat.late, micros(seat.most_late)) } else { String::new() };
    match seat.joined {
        0 => "; it never came".to_owned(),
        1 => format!("; {} taken{late}", Counted(seat.taken, "sample")),
        joined => format!("; it came {joined} times, {} taken{late}", Counted(seat.taken, "sample")),
    }
}
