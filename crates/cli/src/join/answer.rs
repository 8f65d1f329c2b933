//! Answer of `cohaptic join`, as a JSON document and as text.

use std::collections::BTreeMap;
use std::fmt::Write as _;

use cohaptic_answers::motion;
use cohaptic_live::join::{DRIFT_WINDOW, HeardSender, JoinReport};
use cohaptic_realtime::Wish;
use cohaptic_units::print::{Counted, Span};
use serde::Serialize;

use super::joined::Joined;
use crate::document_schema::{document, lateness};
use crate::live::answer::{of_gate, without_force};
use crate::live::exchanges::{DeviceReport, notes};
use crate::output;
use crate::realtime::late;
use crate::run::answer::length;

/// Returns the answer of `cohaptic join --json`. `is_interrupted`: whether a signal ended the run.
pub(super) fn of(joined: &Joined<'_>, report: &JoinReport, devices: &[DeviceReport], is_interrupted: bool) -> impl Serialize {
    let Joined { scene, place, session, device, identity, is_keyed } = joined;
    let status = &report.status;
    let axes = scene.axes.count();
    let senders = scene.peers.iter().zip(&report.senders).enumerate().filter(|(other, _)| other != place).map(|(_, (peer, sender))| {
        document! {
            name: peer.name.as_str(),
            taken: sender.taken,
            out_of_order: sender.late,
            lost: sender.lost(),
            drift_ppm: sender.drift.ppm(),
        }
    });
    document! {
        title: scene.title.as_str(),
        session: session.to_string(),
        scene: identity.to_string(),
        duration_s: status.elapsed.as_secs_f64(),
        ending: if is_interrupted { "interrupted" } else { "complete" },
        valid: report.validity.is_valid(),
        ticks: status.ticks,
        late_ticks: report.late_ticks,
        lateness_us: lateness(&report.ticks),
        #[serde(flatten)]
        // A simulated device is read in no time worth measuring.
        device: report.device.as_ref().map(|device| document! { device_us: lateness(device) }),
        peer: document! {
            kind: device.kind(),
            name: scene.peers[*place].name.as_str(),
            #[serde(flatten)]
            copy: motion(&status.object.position[..axes], &status.object.velocity[..axes], status.attitude),
            device: motion(&status.device.position[..axes], &status.device.velocity[..axes], None),
            #[serde(flatten)]
            gate: report.gate.as_ref().map(|gate| document! { gate: of_gate(gate) }),
            #[serde(flatten)]
            exchanges: devices.first().map(DeviceReport::document),
        },
        sent: status.sent,
        #[serde(flatten)]
        // Without a key no welcome ever comes.
        joinings: is_keyed.then(|| document! { joinings: status.joinings }),
        silences: status.silences,
        senders: senders.collect::<Vec<_>>(),
        send_failures: report.socket.failures.by_reason().into_iter().collect::<BTreeMap<_, _>>(),
        oversized: report.socket.oversized,
        granted: report.prepared.granted.iter().copied().map(Wish::name).collect::<Vec<_>>(),
        refused_wishes: report.prepared.refused.iter().map(ToString::to_string).collect::<Vec<_>>(),
        files: report.files.iter().map(|file| output::path(file)).collect::<Vec<_>>(),
    }
}

/// Returns the answer as text.
pub(super) fn describe(joined: &Joined<'_>, report: &JoinReport, devices: &[DeviceReport]) -> String {
    let Joined { scene, place, session, device, .. } = joined;
    let status = &report.status;
    let name = &scene.peers[*place].name;
    let mut text = format!("{}: {name} at {session}, with the device {}\n", scene.title, device.kind());
    let mut line = |line: String| {
        let _ = writeln!(text, "  {line}");
    };
    line(format!("{}, {}", Span::measured(status.elapsed), Counted(status.ticks, "tick")));
    line(format!("the run is {}", report.validity));
    line(format!("lateness of ticks: {}", late(&report.ticks)));
    if let Some(device) = &report.device {
        line(format!("reading and holding the device took, a tick: {}", late(device)));
    }
    devices.iter().flat_map(|device| device.lines(name)).for_each(&mut line);
    report.gate.iter().filter_map(|gate| without_force(name, gate)).for_each(&mut line);
    let joinings = if joined.is_keyed { format!(" in {}", Counted(status.joinings, "joining")) } else { String::new() };
    line(format!("{} sent{joinings}", Counted(status.sent, "sample")));
    for (peer, sender) in scene.peers.iter().zip(&report.senders).enumerate().filter(|(other, _)| other != place).map(|(_, heard)| heard) {
        line(format!("{}: {}", peer.name, heard(sender)));
    }
    if status.silences > 0 {
        line(format!("the session was silent for a second or more {}", Counted(status.silences, "time")));
    }
    let axes = scene.axes.count();
    let position = |position: &[f64; 3]| position[..axes].iter().map(|x| length(*x)).collect::<Vec<_>>().join(", ");
    line(format!("{name} ends at {}, its device at {}", position(&status.object.position), position(&status.device.position)));
    let lost = report.socket.failures.in_all() + report.socket.oversized;
    if lost > 0 {
        line(format!("lost at the socket: {}", Counted(lost, "datagram")));
    }
    text.push_str(&notes(&report.prepared, report.validity));
    text
}

fn heard(sender: &HeardSender) -> String {
    let lost = sender.lost();
    let came = format!("{} taken, {} late, {lost} of {} lost", Counted(sender.taken, "sample"), sender.late, sender.taken + sender.late + lost);
    match sender.drift.ppm() {
        Some(ppm) => format!("{came}; the clock here is {:.1} ppm {}", ppm.abs(), if ppm < 0.0 { "slower" } else { "faster" }),
        None => format!("{came}; drift not known before {}", Span(2 * DRIFT_WINDOW)),
    }
}
