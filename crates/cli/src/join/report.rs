//! Words of `cohaptic join`: the line of status, the reasons for no welcome, and the report at the end.

use std::fmt::Write as _;
use std::net::SocketAddr;

use cohaptic_live::join::{DRIFT_WINDOW, HeardSender, JoinReport, JoinedStatus};
use cohaptic_scene::{Fingerprint, Scene};
use cohaptic_units::print::{Counted, Span};

use crate::arguments::JoinDevice;
use crate::live::answer::without_force;
use crate::live::exchanges::{DeviceReport, notes};
use crate::realtime::late;
use crate::run::answer::length;

/// Peer at this computer, and its session.
pub(super) struct Joined<'a> {
    /// Scene of the session.
    pub(super) scene: &'a Scene,
    pub(super) place: usize,
    pub(super) session: SocketAddr,
    pub(super) device: JoinDevice,
    pub(super) identity: Fingerprint,
    pub(super) is_keyed: bool,
}

impl Joined<'_> {
    /// Returns whether the session has answered: with a welcome or, without a key, with a sample.
    pub(super) const fn was_heard(&self, status: &JoinedStatus) -> bool {
        if self.is_keyed { status.began.is_some() } else { status.age.is_some() }
    }

    /// Returns the line of status: `left: falcon here, session present, last sample 3 ms ago, 2 of 1000 lost`.
    pub(super) fn line(&self, status: &JoinedStatus) -> String {
        let name = &self.scene.peers[self.place].name;
        let device = if status.is_device_there { "here" } else { "not ready" };
        let session = match (status.began, status.is_session_there) {
            (None, _) => "not heard",
            (Some(_), true) => "present",
            (Some(_), false) => "silent",
        };
        let age = status.age.map_or_else(|| "no sample yet".to_owned(), |age| format!("last sample {} ago", Span::measured(age)));
        let of = status.taken + status.lost;
        format!("{name}: {} {device}, session {session}, {age}, {} of {of} lost", self.device.kind(), status.lost)
    }

    /// Returns the sentence about a session that does not answer.
    pub(super) fn reasons(&self, status: &JoinedStatus) -> String {
        let Self { scene, place, session, identity, .. } = self;
        let (name, seed) = (&scene.peers[*place].name, scene.seed);
        // Without a key a session answers samples alone, and a peer whose device is not ready sends no sample: the session is not to blame.
        if !self.is_keyed && !status.is_device_there {
            let device = self.device.kind();
            return format!(
                "nothing is sent to {session} yet: the {device} of {name} is not there, or not ready. cohaptic {device} probe says why; \
                 --device simulated joins without one"
            );
        }
        let everywhere = format!("no session listens there, or a firewall on the way drops UDP; its number, the seed of its scene, is not {seed}");
        let seat = format!("its peer at place {place} is not of kind \"udp\", or has another computer ({name} here)");
        if self.is_keyed {
            format!(
                "no welcome from {session} yet. Possible reasons: {everywhere}; it has no key, or another one than --key-file; {seat}; its scene is \
                 another one than {identity}, and then the session prints both fingerprints"
            )
        } else {
            format!("nothing from {session} yet. Possible reasons: {everywhere}; it has a key, which --key-file must name here, too; {seat}")
        }
    }
}

/// Returns the report.
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
