//! Parts of a running scene for sessions only: datagrams from other processes, devices in hands, changes of links by the operator.

mod device;
mod fade;
mod gated;
mod presence;
mod pulled;
mod seat;

use cohaptic_peer::rotation::Attitude;
use cohaptic_peer::wire::{Extra, MAX_LEN, Sample, SampleKind};
use cohaptic_peer::{Clock, Device, Peer, ReceiveError, Reception, SimulatedDevice, State, Strategy};
use cohaptic_scene::{PeerKind, Scene};
use cohaptic_units::Instant;
use cohaptic_wan::{LinkModel, LinkStats, NodeId, PacketEvent, Path};

use super::{Arriving, DeviceModel, Remote, Step, Watch, World, row};
use crate::in_flight::Handle;
use crate::observer::{Ended, Observer};
use crate::plan::ticking;
use crate::rows::{Input, InputRow};
use crate::schedule::Schedule;

use device::{HandDevice, UnsimulatedDevice};
use pulled::PulledDevice;
use seat::Seat;

pub use fade::Fade;
pub use gated::{GateStats, GatedDevice};
pub(crate) use presence::RemotePeers;
pub use presence::{Datagram, Transmit};
pub use seat::{Presence, SampleError, SeatStats};

/// Attitudes of a peer, at the same instants as its [`PeerState`](crate::live::PeerState).
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct TurnState {
    /// Attitude of the device; `None` for a device without attitude and for a peer in another process.
    pub device: Option<Attitude>,
    /// Attitude of the copy.
    pub object: Attitude,
}

impl<const A: usize, S: Strategy<A>> World<A, S, RemotePeers<A>> {
    /// Returns the scene before its first instant with all remote peers absent. `devices` gives the device in the hand at the given index of a peer.
    pub(crate) fn seated(mut self, scene: &Scene, mut devices: impl FnMut(usize) -> Option<Box<dyn cohaptic_device::Device>>) -> Self {
        // A peer in another process ticks there. The schedule holds the peers of this process only.
        self.ticking.retain(|place| !self.remote.is_process(*place));
        let here = |place: &usize| &scene.peers[*place];
        let clocks: Vec<(usize, &Clock)> = self.ticking.iter().map(|place| (*place, &here(place).clock)).collect();
        self.schedule = Schedule::new(ticking(self.ticking.iter().map(here)), clocks);
        // Packets for other processes must leave at their arrival, so the network tells the next of these instants.
        if self.remote.has_processes {
            let processes = (0..self.members.len()).filter(|place| self.remote.is_process(*place));
            self.network = self.network.awaiting(processes.map(NodeId::new));
        }
        for (place, (peer, member)) in scene.peers.iter().zip(&mut self.members).enumerate() {
            let mut device = || devices(place).map(|device| GatedDevice::new(device, peer.clock.spans().1));
            match peer.kind {
                PeerKind::Udp(_) => {
                    // The world never sends for this peer, and its unknown position is left out of the discrepancy.
                    member.next_send = u64::MAX;
                    self.latest[place] = [f64::NAN; A];
                }
                PeerKind::Falcon(..) | PeerKind::Inverse3(..) => {
                    member.peer.set_exchange(peer.exchange_in_hand());
                    let state = member.peer.device().state();
                    let hand = Box::new(HandDevice::new(device(), state));
                    *member.peer.device_mut() = DeviceModel::Unsimulated(UnsimulatedDevice::InHand(hand));
                }
                PeerKind::Pointer(_, arm) => {
                    // A pointer pulls a simulated device, so the peer keeps a body with mass and damping.
                    let body = SimulatedDevice::new(peer.device, None, member.peer.device().state(), scene.integrator, &peer.clock);
                    let hand = Box::new(HandDevice::pulling(device(), PulledDevice::new(body, arm)));
                    *member.peer.device_mut() = DeviceModel::Unsimulated(UnsimulatedDevice::InHand(hand));
                }
                PeerKind::Simulated => {}
            }
        }
        self
    }

    /// Returns the next instant with any event, at latest the end of the scene.
    ///
    /// Without peers in other processes this is a tick, as in virtual time: a packet arriving between two ticks is read at the later tick anyway. With such
    /// a peer, every arrival is a separate instant, because the record of the session has one order for all receivers.
    pub(crate) fn next_instant(&self) -> Instant {
        let tick = self.next_tick();
        if !self.remote.has_processes {
            return tick;
        }
        let change = self.changes.last().map(|change| change.at);
        [self.network.poll_timeout(), change, self.remote.undrained].into_iter().flatten().fold(tick, Instant::min)
    }

    fn next_tick(&self) -> Instant {
        self.schedule.next_instant().map_or(self.end, |tick| tick.min(self.end))
    }

    /// Returns the next instant of need for the driver: a tick, a change of the timeline or the arrival of a packet for another process. Arrivals at
    /// local peers before this instant can be computed when it comes.
    pub(crate) fn next_wake(&self) -> Instant {
        if self.schedule.next_instant().is_none() {
            // Without local ticks, every arrival is for another process.
            return self.next_instant();
        }
        let awaited = self.network.poll_awaited().unwrap_or(self.end);
        // A change without peers in other processes takes effect at the next tick anyway.
        let change = self.changes.last().filter(|_| self.remote.has_processes).map_or(self.end, |change| change.at);
        self.next_tick().min(awaited).min(change)
    }

    /// Computes all events at `at`, the instant of [`World::next_instant`].
    pub(crate) fn happen(&mut self, at: Instant, observer: &mut (impl Observer<Error = Ended> + ?Sized), watch: Watch) -> Result<Step, Ended> {
        self.remote.undrained = None;
        // Silence first: a peer that falls silent at this instant must not count in the discrepancy of the instant.
        self.notice_silence(at);
        if at >= self.end {
            return self.finish(observer, watch).map(Step::Ended);
        }
        // A tick includes the changes and deliveries of its instant.
        if self.schedule.next_instant() == Some(at) {
            return self.step(1, observer, watch);
        }
        self.now = at;
        self.change(at);
        self.deliver(at, observer, watch)?;
        Ok(Step::Ticked(1))
    }

    /// Takes in a sample from the process of the peer at index `place`. Everything before `at` must have been computed, nothing at `at`.
    pub(crate) fn take_sample(&mut self, at: Instant, place: usize, datagram: &[u8], session: u64) -> Result<(), SampleError> {
        self.notice_silence(at);
        let Some(seat) = self.remote.seat_mut(place).filter(|seat| seat.is_process) else {
            return Err(SampleError::NoSeat { peer: place });
        };
        let peers = self.members.len();
        let kind = self.samples.kind();
        // A refused sample changes a counter only, since the record of the session has no row for the sample.
        let read = read_sample::<A>(datagram, kind, self.axes, session, (place, peers)).inspect_err(|_| seat.stats.refused += 1);
        let (mut sample, extra) = read?;
        // Admitted before `hear`, because a silent seat admits any number.
        seat.admit(sample.sequence)?;
        let joins = seat.hear(at);
        // A peer that joins again counts its samples from 0. The receivers see numbers that go on, or they would take the samples for stale.
        sample.sequence = seat.next_sequence;
        seat.next_sequence += 1;
        // Receivers fade the peer in from the first sample of its return, and not from samples sent before its silence.
        if joins {
            // Peers of other processes keep ages of their own.
            for (to, member) in self.members.iter_mut().enumerate() {
                if to != place && !self.remote.is_process(to) {
                    self.remote.await_return(place, to, sample.sequence, &mut member.peer);
                }
            }
        }
        // The copy in this process shows the newest sample, so the discrepancy and displays know where the remote copy is.
        self.latest[place] = sample.state.position;
        let peer = &mut self.members[place].peer;
        peer.object_mut().set_state(sample.state);
        if let (Some(rotation), Some(turning)) = (peer.rotation_mut(), &mut self.turning) {
            rotation.set_copy(extra.attitude);
            turning.latest[place] = extra.attitude;
        }
        // Changes that are due apply to the links before the sample enters the network.
        self.change(at);
        // A personal sample has one receiver, a sample for all has the other peers of the scene.
        let copies = if kind.is_personal() { 1 } else { peers - 1 };
        let handle = if kind == SampleKind::State {
            self.samples.store(copies, sample)
        } else {
            let stored = self.samples.store_extended((copies, self.axes), sample, extra.attitude, |numbers| numbers.push(extra.numbers));
            stored.expect("numbers that were decoded are finite")
        };
        let from = NodeId::new(place);
        let sent = if kind.is_personal() {
            self.network.handle_packet(at, from, NodeId::new(extra.receiver as usize), self.packet, handle)
        } else {
            self.network.handle_broadcast(at, from, self.packet, handle)
        };
        sent.expect("instants come in order");
        self.remote.undrained = Some(at);
        Ok(())
    }

    /// Changes the configuration of a link from outside of the scene. Everything before `at` must have been computed, nothing at `at`.
    // A change of the timeline at the same instant comes first, so the operator's change wins.
    pub(crate) fn take_link(&mut self, at: Instant, from: usize, to: usize, link: &LinkModel) {
        self.change(at);
        self.set_link(at, from, to, link);
        self.remote.undrained = Some(at);
    }

    /// Stops all devices in hands: no hand feels a force of the session after `now`.
    pub(crate) fn stop_devices(&mut self, now: Instant) {
        for member in &mut self.members {
            if let Some(device) = member.peer.device_mut().hand_mut() {
                device.stop(now);
            }
        }
    }

    pub(crate) fn next_transmit(&mut self) -> Option<Transmit> {
        self.remote.next_transmit()
    }

    pub(crate) fn presence(&self, place: usize, now: Instant) -> Option<Presence> {
        (place < self.members.len()).then(|| self.remote.seat(place).map_or(Presence::Here, |seat| seat.presence(now)))
    }

    pub(crate) fn heard(&self, place: usize) -> Option<Instant> {
        self.remote.seat(place)?.heard
    }

    pub(crate) fn seat_stats(&self, place: usize) -> Option<SeatStats> {
        self.remote.seat(place).map(|seat| seat.stats)
    }

    /// Sets the time on the clock of the session, by which the gates of devices in hands judge ages and changes. See [`crate::live::LiveScene::set_clock`].
    pub(crate) const fn set_clock(&mut self, clock: Instant) {
        self.remote.clock = clock;
    }

    /// Returns the counts of the gate of a device in a hand; `None` for another peer, and for a device that is never present.
    pub(crate) fn gate_stats(&self, place: usize) -> Option<GateStats> {
        let DeviceModel::Unsimulated(UnsimulatedDevice::InHand(device)) = self.members.get(place)?.peer.device() else { return None };
        device.gate_stats().copied()
    }

    pub(crate) fn note_late(&mut self, place: usize, by: std::time::Duration) {
        if let Some(seat) = self.remote.seat_mut(place) {
            seat.stats.late += 1;
            seat.stats.most_late = seat.stats.most_late.max(by);
        }
    }

    pub(crate) fn link_stats(&self, from: usize, to: usize) -> Option<LinkStats> {
        let is_there = |place: usize| place < self.members.len();
        (is_there(from) && is_there(to)).then(|| self.network.link_stats(NodeId::new(from), NodeId::new(to))).flatten()
    }

    /// Returns the states of a peer's device and copy. The device is `None` for a peer in another process; the result is `None` without a peer `place`.
    pub(crate) fn states(&self, place: usize) -> Option<(Option<State<A>>, State<A>)> {
        let member = self.members.get(place)?;
        let is_process = self.remote.is_process(place);
        Some(((!is_process).then(|| member.peer.device().state()), *member.peer.object().state()))
    }

    /// Returns the attitudes of a peer. `None` if the object does not turn or if the scene has no peer `place`.
    pub(crate) fn turn(&self, place: usize) -> Option<TurnState> {
        let rotation = self.members.get(place)?.peer.rotation()?;
        let device = rotation.device().filter(|_| !self.remote.is_process(place));
        Some(TurnState { device: device.copied(), object: *rotation.copy() })
    }

    fn notice_silence(&mut self, now: Instant) {
        let (latest, members) = (&mut self.latest, &self.members);
        // The position of a silent peer is unknown, so the discrepancy leaves the peer out. A device in a hand keeps its copy in this process.
        self.remote.notice_silence(now, |place| {
            if !matches!(members[place].peer.device(), DeviceModel::Unsimulated(UnsimulatedDevice::InHand(_))) {
                latest[place] = [f64::NAN; A];
            }
        });
    }
}

impl<const A: usize> DeviceModel<A, UnsimulatedDevice<A>> {
    fn hand_mut(&mut self) -> Option<&mut HandDevice<A>> {
        if let Self::Unsimulated(UnsimulatedDevice::InHand(device)) = self { Some(device) } else { None }
    }
}

impl<const A: usize> Remote<A> for RemotePeers<A> {
    type Device = UnsimulatedDevice<A>;

    const IS_EMPTY: bool = false;

    fn lead(&self) -> usize {
        self.lead
    }

    fn is_there(&self, place: usize) -> bool {
        self.seat(place).is_none_or(Seat::is_there)
    }

    fn receive<S: Strategy<A>>(
        &mut self,
        now: Instant,
        event: &PacketEvent<Handle, Path>,
        sample: &Arriving<'_, A>,
        receiver: &mut Peer<A, DeviceModel<A, Self::Device>, S>,
    ) -> Option<Result<Reception, ReceiveError>> {
        let ends = (event.path.from.index(), event.path.to.index());
        let mut buffer = [0; MAX_LEN];
        // A datagram to another process is damaged as on the link and sent on; the other process decodes or refuses it.
        if self.is_process(ends.1) {
            let len = sample.datagram(event.damage.as_ref(), &mut buffer).len();
            self.send_out(ends.1, event.at, Datagram::new(buffer, len));
            return None;
        }
        Some(match &event.damage {
            None => self.take_in(now, ends, sample.sample(), &sample.extra(), receiver),
            Some(damage) => match Sample::decode_as(sample.datagram(Some(damage), &mut buffer), sample.kind(), sample.axes) {
                // Damage can change the index of the receiver. Only a personal sample carries the index.
                Ok((_, extra)) if sample.kind().is_personal() && extra.receiver as usize != ends.1 => {
                    Err(ReceiveError::Receiver { receiver: extra.receiver })
                }
                Ok((damaged, extra)) => self.take_in(now, ends, &damaged, &extra, receiver),
                Err(error) => Err(error.into()),
            },
        })
    }

    fn attend<S: Strategy<A>>(
        &mut self,
        now: Instant,
        place: usize,
        peer: &mut Peer<A, DeviceModel<A, Self::Device>, S>,
        axes: usize,
        observer: &mut (impl Observer<Error = Ended> + ?Sized),
    ) -> Result<(), Ended> {
        let clock = self.clock;
        if let (Some(device), Some(seat)) = (peer.device_mut().hand_mut(), self.seat_mut(place)) {
            // In virtual time nobody sets the clock, and the logical time is the clock.
            let read = device.read(now, clock.max(now), axes);
            // Every reading is recorded, a missing reading too: a replay must see the same silences.
            observer.on_input(&InputRow { at: now, what: Input::Device { peer: place, state: read.as_ref().map(|state| row(state, axes)) } })?;
            if let Some(state) = read {
                let joins = seat.hear(now);
                // A returning device fades in, with all fades that follow its presence.
                if joins {
                    device.keep();
                    seat.fades[place].moved(now);
                    seat.followed_mut().iter_mut().for_each(|fade| fade.rise(now));
                }
                device.set(state);
            }
            // The coupling falls with the weight of the hand: a silent device must not hold the copy at its last place.
            let coupled = device.set_age(seat.fades[place].age(now));
            peer.set_coupling(seat.coupling.scaled(coupled));
        }
        self.tell(place, now, peer);
        Ok(())
    }
}

/// Decodes a datagram as a sample of the peer at index `place` of `peers` peers, and refuses samples of wrong sessions, senders and receivers.
fn read_sample<const A: usize>(
    datagram: &[u8],
    kind: SampleKind,
    axes: usize,
    session: u64,
    (place, peers): (usize, usize),
) -> Result<(Sample<A>, Extra<A>), SampleError> {
    let (sample, extra) = Sample::decode_as(datagram, kind, axes)?;
    // A process of an earlier session may still send.
    if sample.session != session {
        return Err(ReceiveError::Session { found: sample.session }.into());
    }
    if sample.sender as usize != place {
        return Err(ReceiveError::Sender { sender: sample.sender }.into());
    }
    let receiver = extra.receiver as usize;
    if kind.is_personal() && (receiver == place || receiver >= peers) {
        return Err(ReceiveError::Receiver { receiver: extra.receiver }.into());
    }
    Ok((sample, extra))
}
