//! Hand-over of packets that have arrived.

use std::ops::ControlFlow;

use cohaptic_peer::{Reception, Strategy};
use cohaptic_units::Instant;
use cohaptic_wan::{Fate, Network, PacketEvent, Path, TakeArrival};

use super::member::Member;
use super::remote::{Arriving, Remote};
use super::watch::Watch;
use crate::in_flight::{Handle, SamplesInFlight};
use crate::observer::{Ended, Observer};
use crate::rows::HoldRow;

/// Receiving side of the world at an instant: the parts changed by a delivered packet, borrowed apart from the delivering network.
pub(super) struct Receivers<'a, const A: usize, S, E: Remote<A>, O: ?Sized> {
    pub(super) members: &'a mut [Member<A, S, E::Device>],
    pub(super) samples: &'a mut SamplesInFlight<A>,
    pub(super) remote: &'a mut E,
    pub(super) axes: usize,
    pub(super) now: Instant,
    pub(super) observer: &'a mut O,
    pub(super) watch: Watch,
}

/// Takes simple arrivals. The method is inlined at each place where the network hands over a packet, unlike a closure (`benches/peers`, rows of watched
/// packets).
impl<const A: usize, S: Strategy<A>, E: Remote<A>, O: Observer<Error = Ended> + ?Sized> TakeArrival<Handle> for &mut Receivers<'_, A, S, E, O> {
    type Break = Ended;

    #[inline(always)]
    fn take(&mut self, event: PacketEvent<Handle, Path>) -> ControlFlow<Ended> {
        match self.take_event(&event) {
            Ok(()) => ControlFlow::Continue(()),
            Err(ended) => ControlFlow::Break(ended),
        }
    }
}

impl<const A: usize, S: Strategy<A>, E: Remote<A>, O: Observer<Error = Ended> + ?Sized> Receivers<'_, A, S, E, O> {
    /// Handles all events of packets that have happened by now. Not inlined, so that the loop over simple arrivals has the registers for itself
    /// (`benches/peers`, rows of watched packets).
    #[inline(never)]
    pub(super) fn take_all(&mut self, network: &mut Network<Handle>) -> Result<(), Ended> {
        while let Some(event) = network.poll_event() {
            self.take_event(&event)?;
        }
        Ok(())
    }

    /// Handles an event of a packet: hands over a delivered sample, releases the stored sample, shows the packet's record.
    #[inline(always)]
    fn take_event(&mut self, event: &PacketEvent<Handle, Path>) -> Result<(), Ended> {
        let Self { now, watch, .. } = *self;
        if let Fate::Delivered(_) = event.fate {
            let to = event.path.to.index();
            let receiver = &mut self.members[to];
            let sample = Arriving { samples: self.samples, handle: event.payload, to, axes: self.axes };
            match self.remote.receive(now, event, &sample, &mut receiver.peer) {
                Some(Ok(Reception::Newest)) if watch.holds => {
                    self.observer.on_hold(&HoldRow { at: now, from: event.path.from.index(), to, sampled: event.offered })?;
                }
                // `None`: the datagram waits in the outbox of the remote peers.
                // `Added`: a later sample is held already, so no hold begins.
                None | Some(Ok(Reception::Newest | Reception::Added)) => {}
                Some(Ok(Reception::Stale)) => receiver.stale_samples += 1,
                Some(Err(_)) if event.damage.is_some() => receiver.refused_samples += 1,
                Some(Err(error)) => unreachable!("peers of one scene understand each other: {error}"),
            }
        }
        // The store counts the packets of a sample: a copy adds a packet, every other event removes a packet.
        if event.fate == Fate::Duplicated {
            self.samples.retain(event.payload);
        } else {
            self.samples.release(event.payload);
        }
        // `Fate::Duplicated` is not an end: the packet and its copy each get a later record.
        if watch.packets && event.fate.is_end() {
            self.observer.on_packet(&event.record)?;
        }
        Ok(())
    }
}
