//! Connection to peers in other programs: the UDP socket, and the admission of received datagrams. Samples go in and out here; this module knows nothing of the
//! scene's physics.

use std::net::SocketAddr;
use std::os::fd::BorrowedFd;

use cohaptic_harness::live::{RecordedScene, Transmit};
use cohaptic_realtime::udp::{self, ReceiveBuffers, UdpEndpoint};
use cohaptic_realtime::{Clock as _, MonotonicClock};
use cohaptic_scene::{PeerKind, Scene};
use cohaptic_units::Instant;

use super::files::Release;
use super::status::{Connection, SocketCounts};
use super::{SessionConfig, SessionError};
use crate::handshake::{HANDSHAKE_LEN, Notice};
use crate::{
    Admission, AdmissionConfig, AdmissionControl, AdmissionStats, Limits, MAX_DATAGRAM, OtherScene, Place, Refusal, Seat, SystemEntropy, stale_after,
};

/// Socket and admission of a session, with the buffers of both directions.
#[derive(Debug)]
pub(super) struct Outside {
    socket: UdpEndpoint,
    buffers: ReceiveBuffers,
    admission: AdmissionControl,
    /// `true` if the scene has more than one peer in another program. A received sample may then have to be sent on to another program at once.
    passes_on: bool,
    /// `true` if the last reading filled a whole batch, so that more datagrams may wait in the kernel.
    is_more: bool,
    /// Buffer for making each outgoing datagram before the socket copies the datagram into the queue.
    sealed: [u8; MAX_DATAGRAM],
    /// Answers to be sent with the next [`Outside::flush`], with the address of each receiver. At most as many as a batch has datagrams.
    replies: Vec<(SocketAddr, Answer)>,
}

/// Answer of the session to a datagram.
#[derive(Debug)]
enum Answer {
    Welcome([u8; HANDSHAKE_LEN]),
    /// Another program has the seat.
    Taken(Notice),
}

impl Answer {
    fn bytes(&self) -> &[u8] {
        match self {
            Self::Welcome(bytes) => bytes,
            Self::Taken(notice) => notice.bytes(),
        }
    }
}

/// Largest admitted position \[m\] and velocity [m/s]. A hand at a desk stays well below both; a larger number comes from a fault, and would throw every other
/// copy far away through the coordination.
const LIMITS: Limits = Limits { position: 10.0, velocity: 100.0 };
/// Longest datagram handed on by the socket \[byte\]. Longer than [`MAX_DATAGRAM`], so that the admission sees and counts oversized datagrams.
const LARGEST: usize = 2048;
/// Receive buffer of the socket \[byte\]: room for about a thousand datagrams, more than a few peers at 125 Hz send in a second.
const RECEIVE_BUFFER: usize = 1 << 20;

impl Outside {
    /// Binds the socket and makes the admission. Returns `None` in a scene without peers in other programs.
    pub(super) fn open(scene: &Scene, config: &SessionConfig) -> Result<Option<Self>, SessionError> {
        // Without seats the scene has no peer in another program, and needs no socket.
        let Some(stale_after) = stale_after(scene) else { return Ok(None) };
        let elsewhere = scene.peers.iter().zip(0..).filter(|(peer, _)| matches!(peer.kind, PeerKind::Udp(_)));
        let seats: Vec<Seat> = elsewhere.map(|(peer, place)| Seat { place: Place(place), name: peer.name.clone(), tick: peer.clock.tick }).collect();
        let address = config.listen;
        // A mapped IPv4 address must be judged as IPv4: `::ffff:127.0.0.1` is a loopback address, too.
        if !address.ip().to_canonical().is_loopback() && config.key.is_none() && !config.allow_remote {
            return Err(SessionError::NotLoopback { address });
        }
        // With a single peer outside, received samples go to peers of this process only.
        let passes_on = seats.len() > 1;
        let peers = u32::try_from(scene.peers.len()).expect("a scene that runs has few peers");
        let admission = AdmissionConfig {
            stale_after,
            limits: Some(LIMITS),
            kind: scene.sample_kind(),
            scene: config.identity.unwrap_or_else(|| RecordedScene::fingerprint_of(scene)).get(),
            ..AdmissionConfig::new(scene.seed, scene.axes.count(), peers, scene.coordination.update, seats)
        };
        let admission = AdmissionControl::new(admission.with_key(config.key.clone()), &mut SystemEntropy)?;
        // The kernel must not join datagrams: a batch of a flood could then hold 64 times as many datagrams, and a tick would wait for the whole batch.
        let endpoint = udp::EndpointConfig { receive_buffer: RECEIVE_BUFFER, largest: LARGEST, joined: false, ..udp::EndpointConfig::default() };
        let socket = UdpEndpoint::bind(address, endpoint)?;
        let (buffers, sealed, replies) = (ReceiveBuffers::new(), [0; MAX_DATAGRAM], Vec::new());
        Ok(Some(Self { socket, buffers, admission, passes_on, is_more: false, sealed, replies }))
    }

    pub(super) const fn address(&self) -> SocketAddr {
        self.socket.local_address()
    }

    /// Returns the socket if a datagram must wake the loop before the next deadline. With a single peer outside, samples are for peers of this process only,
    /// and can wait in the kernel until the next tick: each sample counts from the instant at which the kernel received the datagram.
    pub(super) fn readable(&self) -> Option<BorrowedFd<'_>> {
        (self.passes_on || self.is_more).then(|| std::os::fd::AsFd::as_fd(&self.socket))
    }

    /// Reads a batch of datagrams. Calls `take` for each admitted sample, with the instant at which the kernel received the datagram and the index of the
    /// sending peer. Answers are sent with the next [`Outside::flush`]. Returns the number of datagrams read.
    pub(super) fn receive(&mut self, clock: &MonotonicClock, mut take: impl FnMut(Instant, usize, &[u8])) -> std::io::Result<usize> {
        let Self { socket, buffers, admission, is_more, replies, .. } = self;
        // A batch is more than arrives between two ticks of an orderly session. Further datagrams stay in the kernel until the next reading, which comes after
        // the next tick if the tick is due: a flood cannot keep the loop from its ticks.
        let count = socket.receive(buffers, clock, |datagram| match admission.handle_datagram(datagram.at, datagram.from, datagram.bytes) {
            Admission::Sample { place, sample, .. } => take(datagram.at, place.0 as usize, sample.bytes()),
            Admission::Reply { to, bytes } => replies.push((to, Answer::Welcome(bytes))),
            Admission::Refused(Refusal::SeatTaken) => {
                replies.extend(admission.notice(datagram.bytes).map(|notice| (datagram.from, Answer::Taken(notice))))
            }
            Admission::Refused(_) => {}
        })?;
        // A batch with room left has emptied the socket.
        *is_more = count == UdpEndpoint::BATCH;
        Ok(count)
    }

    /// Seals a sample for the program at the receiver's seat, and queues the datagram. Returns `None` if no program is present at the seat.
    pub(super) fn queue(&mut self, clock: &MonotonicClock, transmit: &Transmit) -> Option<Release> {
        // Peers of a scene are counted in `u32`, so the conversion does not fail for a receiver in the scene.
        let place = Place(u32::try_from(transmit.to).ok()?);
        // A single reading of the clock serves the admission and the lateness, so that the lateness does not contain the time for the seal.
        let now = clock.now();
        let (to, len) = self.admission.seal(now, place, &transmit.datagram, &mut self.sealed)?;
        self.socket.queue(to, &self.sealed[..len], None);
        Some(Release { to: transmit.to, due: transmit.at, late: now.saturating_duration_since(transmit.at) })
    }

    /// Sends the queued samples, and then the answers. In this order a flood of hellos cannot delay samples. An answer without room in the kernel is dropped
    /// and counted, and the peer repeats the hello or sends the next sample.
    pub(super) fn flush(&mut self) {
        self.socket.flush();
        for (to, answer) in self.replies.drain(..) {
            self.socket.send_or_drop(to, answer.bytes());
        }
    }

    pub(super) const fn admission_stats(&self) -> &AdmissionStats {
        self.admission.stats()
    }

    pub(super) const fn other_scene(&self) -> Option<OtherScene> {
        self.admission.other_scene()
    }

    /// Returns the connection to the program at the seat of a peer. `None` if no program ever took the seat, or if the peer is not another program.
    pub(super) fn connection(&self, now: Instant, peer: usize) -> Option<Connection> {
        let status = self.admission.seat(now, Place(u32::try_from(peer).ok()?))?;
        Some(Connection { address: status.address?, label: status.label, lost: status.lost, sent: status.admitted + status.lost })
    }

    pub(super) fn counts(&self) -> (AdmissionStats, SocketCounts) {
        let kernel_drops = self.socket.kernel_drops().ok().flatten();
        (*self.admission.stats(), SocketCounts { address: self.address(), counts: *self.socket.counts(), kernel_drops })
    }
}
