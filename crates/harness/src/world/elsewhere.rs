//! What a running scene does with peers that live elsewhere.

use cohaptic_peer::wire::Sample;
use cohaptic_peer::{Clock, Device, ReceiveError, RestingDevice, State, Strategy};
use cohaptic_scene::{PeerKind, Scene};
use cohaptic_units::{Bytes, Instant};
use cohaptic_wan::{LinkModel, LinkStats, PacketInfo};

use super::{DeviceModel, Member, Step, Watch, World, node, row};
use crate::live::{Attendance, HandDevice, Input, InputRow, LiveDevice, Presence, SampleError, SeatStats, Transmit, other};
use crate::observer::Observer;
use crate::plan::ticking;
use crate::schedule::Schedule;

impl<const A: usize, S: Strategy<A>> World<A, S> {
    /// The scene at its beginning, with nobody there yet of those who live elsewhere.
    pub(crate) fn with_attendance(mut self, scene: &Scene, mut devices: impl FnMut(usize) -> Option<Box<dyn LiveDevice>>) -> Self {
        let attendance = Attendance::new(scene);
        self.ticking.retain(|place| !attendance.is_process(*place));
        let here = |place: &usize| &scene.peers[*place];
        let clocks: Vec<(usize, &Clock)> = self.ticking.iter().map(|place| (*place, &here(place).clock)).collect();
        self.schedule = Schedule::new(ticking(self.ticking.iter().map(here)), clocks);
        self.lead = self.ticking.first().copied().unwrap_or(0);
        for (place, (peer, member)) in scene.peers.iter().zip(&mut self.members).enumerate() {
            match peer.kind {
                PeerKind::Udp(_) => {
                    member.next_send = u64::MAX;
                    self.latest[place] = [f64::NAN; A];
                }
                PeerKind::Falcon(..) => {
                    let state = member.peer.device().state();
                    let hand = HandDevice::new(devices(place), state);
                    *member.peer.device_mut() = DeviceModel::Resting(RestingDevice { position: state.position }, Some(Box::new(hand)));
                }
                PeerKind::Simulated => {}
                _ => unreachable!("every kind of peer of this workspace is listed"),
            }
        }
        self.attendance = Some(Box::new(attendance));
        self
    }

    /// The next instant at which anything happens; the end of the scene is the last.
    ///
    /// Where all live here it is a tick, as in virtual time: what arrives in between waits for it anyway. A process is to have its packets when they arrive.
    pub(crate) fn next_instant(&self) -> Instant {
        let tick = self.schedule.next_instant().unwrap_or(self.end);
        if !self.attendance.as_ref().is_some_and(|attendance| attendance.has_processes) {
            return tick.min(self.end);
        }
        let change = self.changes.last().map(|change| change.at);
        [self.network.poll_timeout(), change, self.undrained].into_iter().flatten().fold(tick, Instant::min).min(self.end)
    }

    /// Everything that happens at [`World::next_instant`], which is `at`.
    pub(crate) fn happen<O: Observer>(&mut self, at: Instant, observer: &mut O, watch: Watch) -> Result<Step, O::Error> {
        self.undrained = None;
        self.notice_silence(at);
        if at >= self.end {
            return self.finish(observer, watch).map(Step::Ended);
        }
        if self.schedule.next_instant() == Some(at) {
            return self.step(observer, watch);
        }
        self.now = at;
        self.change(at);
        self.deliver(at, observer, watch)?;
        Ok(Step::Ticked)
    }

    /// A sample has come from the process of a peer. Everything before `at` has happened, nothing at it.
    pub(crate) fn take_sample(&mut self, at: Instant, place: usize, datagram: &[u8], session: u64) -> Result<(), SampleError> {
        self.notice_silence(at);
        let Some(attendance) = self.attendance.as_mut().filter(|attendance| attendance.is_process(place)) else {
            return Err(SampleError::NoSeat { peer: place });
        };
        let Some(seat) = attendance.seat_mut(place) else { return Err(SampleError::NoSeat { peer: place }) };
        let read = read_sample::<A>(datagram, self.axes, session, place).inspect_err(|_| seat.stats.refused += 1);
        let mut sample = read?;
        seat.admit(sample.sequence)?;
        let joins = seat.hear(at);
        // A peer that comes back counts from 0 again; for the others its numbers go on.
        sample.sequence = seat.next_sequence;
        seat.next_sequence += 1;
        if joins {
            let others = self.members.iter_mut().enumerate().filter(|(to, _)| *to != place && !attendance.is_process(*to));
            others.for_each(|(to, member)| member.peer.await_return(other(place, to), sample.sequence));
        }
        self.latest[place] = sample.state.position;
        self.members[place].peer.object_mut().set_state(sample.state);
        self.change(at);
        let copies = self.members.len() - 1;
        let stored = self.datagrams.store(copies, self.axes, |bytes| sample.encode(self.axes, bytes));
        let (handle, len) = stored.expect("what was decoded can be decoded again");
        let info = PacketInfo { size: Bytes::new(len as u64), ecn_capable: true };
        self.network.handle_broadcast(at, node(place), info, handle).expect("instants come in order");
        self.undrained = Some(at);
        Ok(())
    }

    /// A link changes from outside. Everything before `at` has happened, nothing at it.
    pub(crate) fn take_link(&mut self, at: Instant, from: usize, to: usize, link: &LinkModel) {
        self.change(at);
        self.set_link(at, from, to, link);
        self.undrained = Some(at);
    }

    /// Nobody feels a force of the session any more.
    pub(crate) fn let_go(&mut self, now: Instant) {
        for member in &mut self.members {
            if let DeviceModel::Resting(_, Some(device)) = member.peer.device_mut() {
                device.let_go(now);
            }
        }
    }

    pub(crate) fn next_transmit(&mut self) -> Option<Transmit> {
        self.attendance.as_mut()?.next_transmit()
    }

    pub(crate) fn presence(&self, place: usize, now: Instant) -> Option<Presence> {
        let attendance = self.attendance.as_ref().filter(|_| place < self.members.len())?;
        Some(attendance.seat(place).map_or(Presence::Here, |seat| seat.presence(now)))
    }

    pub(crate) fn seat_stats(&self, place: usize) -> Option<SeatStats> {
        self.attendance.as_ref()?.seat(place).map(|seat| seat.stats)
    }

    pub(crate) fn note_late(&mut self, place: usize, by: std::time::Duration) {
        if let Some(seat) = self.attendance.as_mut().and_then(|attendance| attendance.seat_mut(place)) {
            seat.stats.late += 1;
            seat.stats.most_late = seat.stats.most_late.max(by);
        }
    }

    pub(crate) fn link_stats(&self, from: usize, to: usize) -> Option<LinkStats> {
        let is_there = |place: usize| place < self.members.len();
        (is_there(from) && is_there(to)).then(|| self.network.link_stats(node(from), node(to))).flatten()
    }

    /// The device, if it is here, and the copy of a peer.
    pub(crate) fn states(&self, place: usize) -> Option<(Option<State<A>>, State<A>)> {
        let member = self.members.get(place)?;
        let is_process = self.attendance.as_ref().is_some_and(|attendance| attendance.is_process(place));
        Some(((!is_process).then(|| member.peer.device().state()), *member.peer.object().state()))
    }

    fn notice_silence(&mut self, now: Instant) {
        let (latest, members) = (&mut self.latest, &self.members);
        if let Some(attendance) = &mut self.attendance {
            // A copy that nobody hears of is no measure of how far copies are apart.
            attendance.notice_silence(now, |place| {
                if !matches!(members[place].peer.device(), DeviceModel::Resting(_, Some(_))) {
                    latest[place] = [f64::NAN; A];
                }
            });
        }
    }
}

/// What those who live elsewhere are to a peer that is about to tick; its own device may be one of them.
pub(super) fn attend<const A: usize, S: Strategy<A>, O: Observer>(
    attendance: &mut Attendance,
    now: Instant,
    place: usize,
    member: &mut Member<A, S>,
    axes: usize,
    observer: &mut O,
) -> Result<(), O::Error> {
    if let (DeviceModel::Resting(_, Some(device)), Some(seat)) = (member.peer.device_mut(), attendance.seat_mut(place)) {
        let read = device.read(now);
        observer.on_input(&InputRow { at: now, what: Input::Device { peer: place, state: read.as_ref().map(|state| row(state, axes)) } })?;
        if let Some(state) = read {
            let joins = seat.hear(now);
            if joins {
                device.keep();
                seat.fades[place].moved(now);
                seat.fades.iter_mut().for_each(|fade| fade.rise(now));
            }
            device.set(state);
        }
        let age = seat.fades[place].age(now);
        device.set_share(age.share);
        member.peer.set_coupling(seat.coupling.scaled(age.weight));
    }
    attendance.tell(place, now, &mut member.peer);
    Ok(())
}

fn read_sample<const A: usize>(datagram: &[u8], axes: usize, session: u64, place: usize) -> Result<Sample<A>, SampleError> {
    let sample = Sample::decode(datagram, axes)?;
    if sample.session != session {
        return Err(ReceiveError::Session { found: sample.session }.into());
    }
    if sample.sender as usize != place {
        return Err(ReceiveError::Sender { sender: sample.sender }.into());
    }
    Ok(sample)
}
