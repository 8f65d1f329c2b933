//! Peer at this computer and its session, with the words during a run: the line of status, and the reasons for no welcome.

use std::net::SocketAddr;
use std::time::Duration;

use cohaptic_live::join::JoinedStatus;
use cohaptic_scene::{Fingerprint, PeerKind, Scene};
use cohaptic_units::print::Span;

use crate::arguments::JoinDevice;

/// Time after a welcome in which a refusal of the first sample would have come.
const SETTLED: Duration = Duration::from_millis(500);

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

    /// Returns whether the session takes samples of this peer: the session has sent a sample, or has refused none since the welcome. Nobody else may send.
    pub(super) fn takes_part(&self, status: &JoinedStatus) -> bool {
        let is_settled = self.is_keyed && status.began.is_some() && status.elapsed >= SETTLED;
        !status.is_seat_taken && (status.age.is_some() || is_settled)
    }

    /// Returns the sentence that another program has the seat of this peer.
    pub(super) fn taken(&self) -> String {
        let Self { scene, place, session, .. } = self;
        let name = &scene.peers[*place].name;
        format!("the seat of {name} is taken: another program has joined the session at {session} as {name}")
    }

    /// Returns what a user can do about a taken seat.
    pub(super) fn ways_out(&self) -> String {
        let others = self.scene.peers.iter().enumerate().filter(|(place, peer)| *place != self.place && matches!(peer.kind, PeerKind::Udp(_)));
        let names: Vec<String> = others.map(|(_, peer)| format!("--peer {}", peer.name)).collect();
        let otherwise = if names.is_empty() { "join another session".to_owned() } else { format!("join with {}", names.join(" or ")) };
        format!("End that program, whose address the session's report and page show, or {otherwise}")
    }

    /// Returns the line of status: `left: falcon here, session present, last sample 3 ms ago, 2 of 1000 lost`.
    pub(super) fn line(&self, status: &JoinedStatus) -> String {
        let name = &self.scene.peers[self.place].name;
        let device = if status.is_device_there { "here" } else { "not ready" };
        let session = match (status.began, status.is_session_there) {
            _ if status.is_seat_taken => "refuses: the seat is taken",
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
                 --device simulated joins without a device"
            );
        }
        let everywhere =
            format!("no session listens there, or a firewall on the way drops UDP; the number of the session, the seed of its scene, is not {seed}");
        let seat = format!("the peer at place {place} of the session ({name} here) is not of kind \"udp\", or another program has its seat");
        if self.is_keyed {
            format!(
                "no welcome from {session} yet. Possible reasons: {everywhere}; the session has no key, or another one than --key-file; {seat}; the \
                 session has another scene than {identity}, and then prints both fingerprints"
            )
        } else {
            format!("nothing from {session} yet. Possible reasons: {everywhere}; the session has a key, which --key-file must name here, too; {seat}")
        }
    }
}
