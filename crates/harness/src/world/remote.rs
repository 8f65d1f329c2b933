//! Interface between a running world and remote peers, and the implementation for virtual time, without remote peers.

use cohaptic_peer::wire::{Extra, MAX_LEN, Sample, SampleKind};
use cohaptic_peer::{Device, Peer, ReceiveError, Reception, RestingDevice, Strategy};
use cohaptic_units::Instant;
use cohaptic_wan::{Damage, PacketEvent, Path};

use super::DeviceModel;
use crate::in_flight::{Handle, SamplesInFlight};
use crate::observer::{Ended, Observer};

/// Remote peers of a running scene: peers in other processes, and peers whose device is in a person's hand.
///
/// A type parameter of the world, not an optional field: in virtual time, peers then carry no ages and the loop over peers asks no questions.
pub(crate) trait Remote<const A: usize> {
    /// Type of the devices that are not simulated.
    type Device: Device<A> + From<RestingDevice<A>>;

    /// `true` if every peer of every scene is local, so all peers can tick in one loop without calls of `attend`.
    const IS_EMPTY: bool;

    /// Returns the index of the first local peer. In lockstep its tick count stands for all local peers.
    fn lead(&self) -> usize;

    /// Returns whether the peer is present, so its copy counts in the discrepancy.
    fn is_there(&self, place: usize) -> bool;

    /// Hands a delivered packet to its receiver and returns the outcome; `None` if the receiver is in another process.
    fn receive<S: Strategy<A>>(
        &mut self,
        now: Instant,
        event: &PacketEvent<Handle, Path>,
        sample: &Arriving<'_, A>,
        receiver: &mut Peer<A, DeviceModel<A, Self::Device>, S>,
    ) -> Option<Result<Reception, ReceiveError>>;

    /// Prepares a peer for its tick: reads a device in a hand, and tells the peer the ages of the remote peers.
    fn attend<S: Strategy<A>>(
        &mut self,
        now: Instant,
        place: usize,
        peer: &mut Peer<A, DeviceModel<A, Self::Device>, S>,
        axes: usize,
        observer: &mut (impl Observer<Error = Ended> + ?Sized),
    ) -> Result<(), Ended>;
}

/// Remote peers of a run in virtual time: none, all peers are local.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NoRemote;

impl<const A: usize> Remote<A> for NoRemote {
    type Device = RestingDevice<A>;

    const IS_EMPTY: bool = true;

    fn lead(&self) -> usize {
        0
    }

    fn is_there(&self, _place: usize) -> bool {
        true
    }

    #[inline(always)]
    fn receive<S: Strategy<A>>(
        &mut self,
        _now: Instant,
        event: &PacketEvent<Handle, Path>,
        sample: &Arriving<'_, A>,
        receiver: &mut Peer<A, DeviceModel<A, Self::Device>, S>,
    ) -> Option<Result<Reception, ReceiveError>> {
        // Only a damaged packet needs its bytes: without damage, encoding and decoding return the sent numbers.
        Some(match &event.damage {
            None if sample.kind() == SampleKind::State => receiver.handle_sample(sample.sample()),
            None => receiver.handle_extended(sample.sample(), &sample.extra()),
            Some(damage) => receiver.handle_datagram(sample.datagram(Some(damage), &mut [0; MAX_LEN])),
        })
    }

    #[inline(always)]
    fn attend<S: Strategy<A>>(
        &mut self,
        _now: Instant,
        _place: usize,
        _peer: &mut Peer<A, DeviceModel<A, Self::Device>, S>,
        _axes: usize,
        _observer: &mut (impl Observer<Error = Ended> + ?Sized),
    ) -> Result<(), Ended> {
        Ok(())
    }
}

/// Stored sample of a packet that arrives.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Arriving<'a, const A: usize> {
    pub(super) samples: &'a SamplesInFlight<A>,
    pub(super) handle: Handle,
    /// Index of the receiver.
    pub(super) to: usize,
    /// Number of axes of the scene.
    pub(super) axes: usize,
}

impl<const A: usize> Arriving<'_, A> {
    #[inline(always)]
    pub(super) fn kind(&self) -> SampleKind {
        self.samples.kind()
    }

    /// Returns the position and velocity of the sample.
    #[inline(always)]
    pub(super) fn sample(&self) -> &Sample<A> {
        self.samples.sample(self.handle)
    }

    /// Returns the attitude and the extra numbers for this receiver.
    #[inline(always)]
    pub(super) fn extra(&self) -> Extra<A> {
        self.samples.extra(self.handle, self.to)
    }

    /// Encodes the sample into `buffer` and applies `damage`. Samples travel as numbers, so bytes are made only here.
    pub(super) fn datagram<'b>(&self, damage: Option<&Damage>, buffer: &'b mut [u8; MAX_LEN]) -> &'b [u8] {
        let len = self.sample().encode_as(self.kind(), &self.extra(), self.axes, buffer);
        if let Some(damage) = damage {
            damage.apply(&mut buffer[..len]);
        }
        &buffer[..len]
    }
}
