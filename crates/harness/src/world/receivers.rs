//! Hand-over of packets that have arrived.

use cohaptic_peer::{Reception, Strategy};
use cohaptic_units::Instant;
use cohaptic_wan::{Fate, Network, PacketEvent, Path};

use super::member::Member;
use super::remote::{Arriving, Remote};
use super::watch::Watch;
use crate::in_flight::{Handle, SamplesInFlight};
use crate::observer::{Ended, Observer};
use crate::rows::HoldRow;

/// Receiving side of the world: the parts changed by a delivered packet, borrowed apart from the delivering network.
pub(super) struct Receivers<'a, const A: usize, S, E: Remote<A>> {
    pub(super) members: &'a mut [Member<A, S, E::Device>],
    pub(super) samples: &'a mut SamplesInFlight<A>,
    pub(super) remote: &'a mut E,
    pub(super) axes: usize,
}

impl<const A: usize, S: Strategy<A>, E: Remote<A>> Receivers<'_, A, S, E> {
    /// Handles all events of packets that have happened by now. Not inlined, so that the loop over simple arrivals has the registers for itself
    /// (`benches/peers`, rows of watched packets).
    #[inline(never)]
    pub(super) fn take_all(
        &mut self,
        network: &mut Network<Handle>,
        now: Instant,
        observer: &mut (impl Observer<Error = Ended> + ?Sized),
        watch: Watch,
    ) -> Result<(), Ended> {
        while let Some(event) = network.poll_event() {
            self.take(now, &event, observer, watch)?;
        }
        Ok(())
    }

    /// Handles an event of a packet: hands over a delivered sample, releases the stored sample, shows the packet's record.
    #[inline(always)]
    pub(super) fn take(
        &mut self,
        now: Instant,
        event: &PacketEvent<Handle, Path>,
        observer: &mut (impl Observer<Error = Ended> + ?Sized),
        watch: Watch,
    ) -> Result<(), Ended> {
        if let Fate::Delivered(_) = event.fate {
            let to = event.path.to.index();
            let receiver = &mut self.members[to];
            let sample = Arriving { samples: self.samples, handle: event.payload, to, axes: self.axes };
            match self.remote.receive(now, event, &sample, &mut receiver.peer) {
                Some(Ok(Reception::Newest)) if watch.holds => {
                    observer.on_hold(&HoldRow { at: now, from: event.path.from.index(), to, sampled: event.offered })?;
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
            observer.on_packet(&event.record)?;
        }
        Ok(())
    }
}
