//! The questions of a running scene about its remote peers.

use cohaptic_peer::wire::{Extra, MAX_LEN, Sample, SampleKind};
use cohaptic_peer::{Device, Peer, ReceiveError, Reception, RestingDevice, Strategy};
use cohaptic_units::Instant;
use cohaptic_wan::{Damage, PacketEvent, Path};

use super::DeviceModel;
use crate::in_flight::{Handle, SamplesInFlight};
use crate::observer::{Ended, Observer};

/// The peers of a running scene that are remote: in other processes, or with their device in somebody's hand.
///
/// A type parameter of the world and not a field that may be empty: virtual time, where all peers are local, is not to carry what live scenes need. As a
/// field, with ages in every peer, it cost two peers a seventh of a tick and ten of them a tenth, though nothing ever came of its questions.
pub(crate) trait Remote<const A: usize> {
    /// What stands for a device that nobody simulates.
    type Device: Device<A> + From<RestingDevice<A>>;

    /// Whether all peers are local whatever the scene, so that they may tick in one loop that asks nothing.
    const IS_EMPTY: bool;

    /// The first local peer, by whose ticks all of them tick in lockstep.
    fn lead(&self) -> usize;

    /// Whether a peer is there, so that it is of interest how far its copy is from the others.
    fn is_there(&self, place: usize) -> bool;

    /// Hands a packet that the network has delivered to its receiver, and says what became of it; `None` if that lives in another process.
    fn receive<S: Strategy<A>>(
        &mut self,
        now: Instant,
        event: &PacketEvent<Handle, Path>,
        sample: &Arriving<'_, A>,
        receiver: &mut Peer<A, DeviceModel<A, Self::Device>, S>,
    ) -> Option<Result<Reception, ReceiveError>>;

    /// Tells a peer that is about to tick the ages of the remote peers; its own device may be one of them.
    fn attend<S: Strategy<A>>(
        &mut self,
        now: Instant,
        place: usize,
        peer: &mut Peer<A, DeviceModel<A, Self::Device>, S>,
        axes: usize,
        observer: &mut (impl Observer<Error = Ended> + ?Sized),
    ) -> Result<(), Ended>;
}

/// All peers are local: virtual time.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NoRemote;

impl<const A: usize> Remote<A> for NoRemote {
    type Device = RestingDevice<A>;

    const IS_EMPTY: bool = true;

    #[inline(always)]
    fn lead(&self) -> usize {
        0
    }

    #[inline(always)]
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

/// A sample that arrives.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Arriving<'a, const A: usize> {
    pub(super) samples: &'a SamplesInFlight<A>,
    pub(super) handle: Handle,
    /// The place of the receiver.
    pub(super) to: usize,
    /// How many axes the scene has.
    pub(super) axes: usize,
}

impl<const A: usize> Arriving<'_, A> {
    #[inline(always)]
    pub(super) fn kind(&self) -> SampleKind {
        self.samples.kind()
    }

    /// Position and velocity.
    #[inline(always)]
    pub(super) fn sample(&self) -> &Sample<A> {
        self.samples.sample(self.handle)
    }

    /// What else the sample says to its receiver.
    #[inline(always)]
    pub(super) fn extra(&self) -> Extra<A> {
        self.samples.extra(self.handle, self.to)
    }

    /// Its bytes, which nobody has made before.
    pub(super) fn datagram<'b>(&self, damage: Option<&Damage>, buffer: &'b mut [u8; MAX_LEN]) -> &'b [u8] {
        let len = self.sample().encode_as(self.kind(), &self.extra(), self.axes, buffer);
        if let Some(damage) = damage {
            damage.apply(&mut buffer[..len]);
        }
        &buffer[..len]
    }
}
