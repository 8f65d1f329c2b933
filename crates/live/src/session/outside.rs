//! Peers in other programs: the socket and the admission behind it.

use std::net::SocketAddr;
use std::os::fd::BorrowedFd;
use std::time::Duration;

use cohaptic_harness::live::Transmit;
use cohaptic_realtime::udp::{self, ReceiveBuffers, UdpEndpoint};
use cohaptic_realtime::{Clock as _, MonotonicClock};
use cohaptic_scene::{PeerKind, Scene};
use cohaptic_units::Instant;

use super::files::Release;
use super::status::SocketCounts;
use super::{SessionConfig, SessionError};
use crate::handshake::HANDSHAKE_LEN;
use crate::{Admission, AdmissionConfig, AdmissionControl, AdmissionStats, Limits, MAX_DATAGRAM, Place, Seat, SystemEntropy};

/// The way to peers in other programs.
#[derive(Debug)]
pub(super) struct Outside {
    socket: UdpEndpoint,
    buffers: ReceiveBuffers,
    admission: AdmissionControl,
    /// Whether a sample may have to be sent on to another program at once.
    passes_on: bool,
    /// Whether more waited than was read at once.
    is_more: bool,
    sealed: [u8; MAX_DATAGRAM],
    /// Answers to hellos, with where to: at most a batch.
    replies: Vec<(SocketAddr, [u8; HANDSHAKE_LEN])>,
}

/// Nobody at a desk moves a copy farther or faster than this; what says so is no motion but a fault, and would throw every other copy out of the room.
const LIMITS: Limits = Limits { position: 10.0, velocity: 100.0 };
/// A sample that is too long is refused by the admission, and counted there.
const LARGEST: usize = 2048;
/// Datagrams of a few peers at 125 Hz: a second of a thousand of them.
const RECEIVE_BUFFER: usize = 1 << 20;

impl Outside {
    /// `None` in a scene without peers in other programs.
    pub(super) fn open(scene: &Scene, config: &SessionConfig) -> Result<Option<Self>, SessionError> {
        let seats: Vec<(Seat, Duration)> = scene
            .peers
            .iter()
            .zip(0..)
            .filter_map(|(peer, place)| {
                let PeerKind::Udp(silence) = peer.kind else { return None };
                Some((Seat { place: Place(place), name: peer.name.clone(), tick: peer.clock.tick }, silence.after))
            })
            .collect();
        // A seat is free to be taken again once every peer counts as silent that was not heard for so long.
        let Some(stale_after) = seats.iter().map(|(_, after)| *after).max() else { return Ok(None) };
        let address = config.listen;
        if !address.ip().to_canonical().is_loopback() && config.key.is_none() && !config.allow_remote {
            return Err(SessionError::NotLoopback { address });
        }
        let passes_on = seats.len() > 1;
        let peers = u32::try_from(scene.peers.len()).expect("a scene that runs has few peers");
        let seats = seats.into_iter().map(|(seat, _)| seat).collect();
        let admission = AdmissionConfig {
            stale_after,
            limits: Some(LIMITS),
            kind: scene.sample_kind(),
            ..AdmissionConfig::new(scene.seed, scene.axes.count(), peers, scene.coordination.update, seats)
        };
        let admission = AdmissionControl::new(admission.with_key(config.key.clone()), &mut SystemEntropy)?;
        // Single datagrams: put together, a batch of a flood would be 64 times as long, and a tick would wait for it.
        let endpoint = udp::EndpointConfig { receive_buffer: RECEIVE_BUFFER, largest: LARGEST, joined: false, ..udp::EndpointConfig::default() };
        let socket = UdpEndpoint::bind(address, endpoint)?;
        let (buffers, sealed, replies) = (ReceiveBuffers::new(), [0; MAX_DATAGRAM], Vec::new());
        Ok(Some(Self { socket, buffers, admission, passes_on, is_more: false, sealed, replies }))
    }

    pub(super) const fn address(&self) -> SocketAddr {
        self.socket.local_address()
    }

    /// What to wake up for before something is due. A sample that is only for peers here waits for their next tick: it counts from when the kernel saw it.
    pub(super) fn readable(&self) -> Option<BorrowedFd<'_>> {
        (self.passes_on || self.is_more).then(|| std::os::fd::AsFd::as_fd(&self.socket))
    }

    /// Hands on the samples that have come in and may, with the instant at which the kernel saw them. Hellos are answered with the next [`Outside::flush`].
    /// Returns the number of datagrams.
    pub(super) fn receive(&mut self, clock: &MonotonicClock, mut take: impl FnMut(Instant, usize, &[u8])) -> std::io::Result<usize> {
        let Self { socket, buffers, admission, is_more, replies, .. } = self;
        // One batch: more than come in between two ticks of a session in order. The rest waits in the kernel until the next look, which is after the next
        // tick if that is due, so that a flood cannot keep the loop from its ticks.
        let count = socket.receive(buffers, clock, |datagram| match admission.handle_datagram(datagram.at, datagram.from, datagram.bytes) {
            Admission::Sample { place, sample, .. } => take(datagram.at, place.0 as usize, sample.bytes()),
            Admission::Reply { to, bytes } => replies.push((to, bytes)),
            Admission::Refused(_) => {}
        })?;
        *is_more = count == UdpEndpoint::BATCH;
        Ok(count)
    }

    /// Makes a datagram ready for the program that has the seat; `None` if nobody has it.
    pub(super) fn queue(&mut self, clock: &MonotonicClock, transmit: &Transmit) -> Option<Release> {
        let place = Place(u32::try_from(transmit.to).ok()?);
        let now = clock.now();
        let (to, len) = self.admission.seal(now, place, &transmit.datagram, &mut self.sealed)?;
        self.socket.queue(to, &self.sealed[..len], None);
        Some(Release { to: transmit.to, due: transmit.at, late: now.saturating_duration_since(transmit.at) })
    }

    /// Sends samples, and then answers to hellos. A flood of hellos must not delay samples: an answer for which the kernel has no room is dropped and counted,
    /// and its peer says hello again.
    pub(super) fn flush(&mut self) {
        self.socket.flush();
        for (to, bytes) in self.replies.drain(..) {
            self.socket.send_or_drop(to, &bytes);
        }
    }

    pub(super) const fn admission_stats(&self) -> &AdmissionStats {
        self.admission.stats()
    }

    pub(super) fn counts(&self) -> (AdmissionStats, SocketCounts) {
        let kernel_drops = self.socket.kernel_drops().ok().flatten();
        (*self.admission.stats(), SocketCounts { address: self.address(), counts: *self.socket.counts(), kernel_drops })
    }
}
