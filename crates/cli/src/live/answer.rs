//! Answer of `cohaptic live`, as a JSON document and as text.

use std::collections::BTreeMap;

use cohaptic_answers::{links_and_distances, measured_lines, measures_of, peer, task_of};
use cohaptic_harness::Ending;
use cohaptic_harness::live::{GateStats, SeatStats};
use cohaptic_harness::task::task_words;
use cohaptic_live::{AdmissionStats, Connection, OtherScene, Report, SocketCounts};
use cohaptic_realtime::Wish;
use cohaptic_scene::Scene;
use cohaptic_units::print::{Counted, Span};
use serde::Serialize;

use super::exchanges::{DeviceReport, notes};
use crate::document_schema::{document, lateness, micros};
use crate::output;
use crate::realtime::late;
use crate::run::answer::{diverged, length, packets};

/// Returns the answer of `cohaptic live --json`.
pub(super) fn of(scene: &Scene, report: &Report, devices: &[DeviceReport]) -> impl Serialize {
    let summary = &report.summary;
    let peers = summary.peers.iter().enumerate().map(|(place, summary)| {
        document! {
            kind: scene.peers[place].kind.name(),
            #[serde(flatten)]
            peer: peer(summary),
            #[serde(flatten)]
            seat: report.seats[place].as_ref().map(|seat| document! { seat: of_seat(seat) }),
            #[serde(flatten)]
            gate: report.gates[place].as_ref().map(|gate| document! { gate: of_gate(gate) }),
            #[serde(flatten)]
            exchanges: devices.iter().find(|device| device.peer == place).map(DeviceReport::document),
        }
    });
    document! {
        title: scene.title.as_str(),
        duration_s: summary.duration.as_secs_f64(),
        ending: summary.ending_name(),
        valid: report.validity.is_valid(),
        ticks: summary.ticks,
        late_ticks: report.late_ticks,
        lateness_us: lateness(&report.ticks),
        release_lateness_us: lateness(&report.releases),
        behind_us: micros(report.behind),
        peers: peers.collect::<Vec<_>>(),
        #[serde(flatten)]
        links: links_and_distances(scene, summary),
        #[serde(flatten)]
        measures: measures_of(scene, &report.measures),
        #[serde(flatten)]
        task: report.task.as_ref().map(|task| document! { task: task_of(scene, task) }),
        #[serde(flatten)]
        // A session without peers in other programs has no door.
        admission: report.admission.as_ref().map(|(stats, socket)| document! { door: of_admission(stats, socket) }),
        granted: report.prepared.granted.iter().copied().map(Wish::name).collect::<Vec<_>>(),
        refused_wishes: report.prepared.refused.iter().map(ToString::to_string).collect::<Vec<_>>(),
        files: report.files.iter().map(|file| output::path(file)).collect::<Vec<_>>(),
    }
}

/// Returns the counts of datagrams that arrived from a remote peer.
fn of_seat(seat: &SeatStats) -> impl Serialize + use<> {
    let SeatStats { taken, joined, refused, out_of_order, late, most_late } = *seat;
    document! { taken: taken, joined: joined, refused: refused, out_of_order: out_of_order, late: late, most_late_us: micros(most_late) }
}

/// Returns the forces on a hand that the gate of the session changed or made zero.
pub(crate) fn of_gate(gate: &GateStats) -> impl Serialize + use<> {
    document! {
        zeroed: gate.causes().map(|(cause, count)| (cause.name(), count)).collect::<BTreeMap<_, _>>(),
        limited: gate.limited,
        slewed: gate.slewed,
    }
}

fn of_admission(stats: &AdmissionStats, socket: &SocketCounts) -> impl Serialize + use<> {
    document! {
        address: socket.address.to_string(),
        handled: stats.handled,
        admitted: stats.admitted,
        welcomed: stats.welcomed,
        joinings: stats.joinings,
        refused: stats.refusals().map(|(cause, count)| (cause.name(), count)).collect::<BTreeMap<_, _>>(),
        sent: stats.sent,
        nobody_there: stats.nobody_there,
        send_failures: socket.counts.failures.by_reason().into_iter().collect::<BTreeMap<_, _>>(),
        oversized: socket.counts.oversized,
        kernel_drops: socket.kernel_drops,
    }
}

pub(super) fn describe(scene: &Scene, report: &Report, devices: &[DeviceReport]) -> String {
    let mut text = format!("{}\n", scene.title);
    let mut line = |line: String| text.push_str(&format!("  {line}\n"));
    let summary = &report.summary;
    let lasted = Span(summary.duration);
    match summary.ending {
        Ending::Complete | Ending::Diverged(_) => line(format!("{lasted}, {}", Counted(summary.ticks, "tick"))),
        Ending::Interrupted(_) => {
            line(format!("ended after {} of {}, {}", Span::measured(summary.duration), Span(scene.duration), Counted(summary.ticks, "tick")))
        }
    }
    diverged(summary).into_iter().for_each(|why| line(format!("DIVERGED: {why}")));
    line(format!("the run is {}", report.validity));
    line(format!("lateness of ticks: {}", late(&report.ticks)));
    // Without peers in other programs nothing was sent, and zeros would look like measurements.
    if report.releases.count > 0 {
        line(format!("lateness of {} to other programs: {}", Counted(report.releases.count, "datagram"), late(&report.releases)));
    }
    line(format!("at the end logical time was {:.1} µs behind the clock", micros(report.behind)));
    line(format!("largest discrepancy between two copies: {}", length(summary.max_discrepancy)));
    for (((peer, spec), seat), connection) in summary.peers.iter().zip(&scene.peers).zip(&report.seats).zip(&report.connections) {
        let position: Vec<String> = peer.position.iter().map(|x| length(*x)).collect();
        let seat = seat.as_ref().map(came).unwrap_or_default();
        let way = connection.as_ref().map(way).unwrap_or_default();
        line(format!("{} ({}) ends at {}{seat}{way}", peer.name, spec.kind.name(), position.join(", ")));
    }
    report.gates.iter().zip(&scene.peers).filter_map(|(gate, spec)| without_force(&spec.name, gate.as_ref()?)).for_each(&mut line);
    devices.iter().flat_map(|device| device.lines(&scene.peers[device.peer].name)).for_each(&mut line);
    line(packets(summary));
    report.task.iter().for_each(|task| line(format!("task: {}", task_words(task, scene))));
    measured_lines(scene, &report.measures).into_iter().for_each(&mut line);
    if let Some((door, socket)) = &report.admission {
        line(format!("session at {}: {} accepted, {} sent", socket.address, Counted(door.admitted, "sample"), door.sent));
        let refused: Vec<String> = door.refusals().filter(|(_, count)| *count > 0).map(|(cause, count)| format!("{count} {cause}")).collect();
        if !refused.is_empty() {
            line(format!("refused: {}", refused.join(", ")));
        }
        if let Some(other) = &report.other_scene {
            line(other_scene(scene, other));
        }
        // The sum is a lower bound on systems that do not tell the drops of the kernel.
        let lost = socket.counts.failures.in_all() + socket.counts.oversized + socket.kernel_drops.unwrap_or(0);
        if lost > 0 {
            line(format!("lost at the socket: {}", Counted(lost, "datagram")));
        }
    }
    text.push_str(&notes(&report.prepared, report.validity));
    text
}

/// Returns the sentence about the ticks at which the gate of a device gave no force, by cause; `None` without such ticks.
pub(crate) fn without_force(name: &str, gate: &GateStats) -> Option<String> {
    let causes: Vec<String> = gate.causes().map(|(cause, count)| format!("{}: {count}", cause.name())).collect();
    (!causes.is_empty()).then(|| format!("ticks without force on the hand of {name}: {}", causes.join(", ")))
}

/// Returns the device of a program, if the program told it, and the samples that never came, if there are any.
fn way(connection: &Connection) -> String {
    let Connection { address, label, lost, sent } = connection;
    let device = label.text().map(|label| format!(", of {label} at {}", address.ip().to_canonical())).unwrap_or_default();
    let lost = if *lost > 0 { format!(", {lost} of {sent} lost on the way here") } else { String::new() };
    device + &lost
}

/// Returns the sentence about a peer that asked with another scene.
pub(super) fn other_scene(scene: &Scene, other: &OtherScene) -> String {
    let OtherScene { place, from, theirs, ours } = other;
    let name = &scene.peers[place.0 as usize].name;
    format!(
        "{from} asked to be {name} with another scene: {theirs:016x}, and this session's is {ours:016x}. Give both the same file and the same --set"
    )
}

fn came(seat: &SeatStats) -> String {
    let late = if seat.late > 0 { format!(", {} of them {:.0} µs late at most", seat.late, micros(seat.most_late)) } else { String::new() };
    match seat.joined {
        0 => "; it never joined".to_owned(),
        1 => format!("; {} taken{late}", Counted(seat.taken, "sample")),
        joined => format!("; it joined {joined} times, {} taken{late}", Counted(seat.taken, "sample")),
    }
}
