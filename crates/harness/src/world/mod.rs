//! A running scene in virtual time or in a session: peers, network and schedule, with A simulated axes.
//!
//! A [`World`] is made from a checked scene and a [`Plan`]. Each step computes an instant, and the following instants with nothing but ticks, and shows rows to
//! the observer; the summary is read at the end. No file, socket or clock of the machine is known here.

mod bounds;
mod changes;
mod judging;
pub(crate) mod live;
mod member;
mod operators;
mod receivers;
mod remote;
mod turning;
mod watch;

use std::sync::Arc;
use std::time::Duration;

use cohaptic_peer::coordination::Role;
use cohaptic_peer::rotation::Attitude;
use cohaptic_peer::wire::{Sample, SampleKind};
use cohaptic_peer::{Contact, Device, LastSent, Peer, SendWhen, State, Strategy};
use cohaptic_scene::{Change, Scene, Topology};
use cohaptic_units::{Bytes, Ecn, Instant};
use cohaptic_wan::{AccessLine, LinkModel, Network, NetworkConfig, NodeId, PacketInfo};

use crate::disturbance::Disturbance;
use crate::in_flight::{Handle, SamplesInFlight};
use crate::observer::{Ended, Observer};
use crate::plan::Plan;
use crate::rows::{InstantRow, SendRow, StateRow, TickRow};
use crate::schedule::Schedule;
use crate::summary::{AccessSummary, Ending, LinkSummaries, PeerSummary, Summary};

use bounds::Bounds;
use changes::{ParameterChange, parameter_changes};
use judging::Judging;
use member::{DeviceModel, Member};
use operators::Operators;
use receivers::Receivers;
pub(crate) use remote::{Arriving, NoRemote, Remote};
use turning::Turning;
pub(crate) use watch::Watch;

/// A scene during a run. The type parameter E holds the remote peers.
pub(crate) struct World<const A: usize, S, E: Remote<A> = NoRemote> {
    /// Number of axes of the scene, at most A. The arrays have A axes; the rows of observers have this number of axes.
    axes: usize,
    names: Vec<String>,
    members: Vec<Member<A, S, E::Device>>,
    network: Network<Handle>,
    samples: SamplesInFlight<A>,
    /// Size and ECN capability of every sample's packet.
    packet: PacketInfo,
    /// Condition under which a due sample is sent; `None` if every due sample is sent.
    send_when: Option<SendWhen>,
    /// Age up to which receivers extrapolate samples \[s\]; `None` if receivers hold samples.
    horizon: Option<f64>,
    schedule: Schedule,
    /// Future changes of the timeline, in reverse order of time: the next change is popped from the end.
    changes: Vec<Change>,
    /// New parameter values of the `ChangeKind::Parameters` changes in `changes`, in the same reverse order.
    parameters: Vec<ParameterChange>,
    /// Factors of the coordination gains, indexed by peer, or a single factor if all peers have the same gains.
    coordination_factors: Vec<f64>,
    /// Neighbours of each peer; `None` if every peer sends to all other peers.
    topology: Option<Arc<Topology>>,
    /// End of the run: the end of the scene, or the outcome of a task that ends the run.
    end: Instant,
    /// Judge of the task; `None` for a scene without a task.
    judging: Option<Box<Judging>>,
    now: Instant,
    /// Position of each copy at its latest tick \[m\], indexed by peer. NaN for a silent peer in another process.
    latest: Vec<[f64; A]>,
    /// Attitudes of the copies; `None` if the object does not turn.
    turning: Option<Box<Turning>>,
    /// Modelled persons at the hands; `None` without persons.
    operators: Option<Box<Operators<A>>>,
    max_discrepancy: f64,
    finite: bool,
    /// Peers that tick at the present instant, by index. In lockstep all local peers.
    ticking: Vec<usize>,
    /// Next tick of a sending of a local peer. Read in lockstep only, since all peers then count the same ticks.
    earliest_send: u64,
    remote: E,
}

/// Positions of a peer's device and of its copy of the object \[m\].
#[derive(Clone, Copy, Debug)]
pub(crate) struct Bodies<const A: usize> {
    pub(crate) device: [f64; A],
    pub(crate) object: [f64; A],
    pub(crate) contact: Contact,
    /// Grasped point of the copy \[m\]: the centre of the copy if the object does not turn.
    pub(crate) grasp: [f64; A],
    pub(crate) turns: Option<Turns>,
}

/// Attitudes of a peer's device and of its copy. An angle \[rad\] times `length` \[m\] is comparable with a distance.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Turns {
    pub(crate) object: Attitude,
    pub(crate) device: Option<Attitude>,
    pub(crate) length: f64,
}

/// Outcome of one step of a run.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Step {
    /// Number of computed instants, at least 1.
    Ticked(u32),
    Ended(Ending),
}

impl<const A: usize, S: Strategy<A>, E: Remote<A>> World<A, S, E> {
    /// Returns the scene before its first instant. `strategy` makes the strategy of the peer at the given index.
    pub(crate) fn new(scene: &Scene, plan: &Plan, disturbance: Option<Disturbance>, remote: E, strategy: impl Fn(usize) -> S) -> Self {
        let initial: Vec<State<A>> = (0..scene.peers.len()).map(|place| scene.initial_state(place)).collect();
        let member = |place| Member::new(scene, plan, &initial, disturbance, place, strategy(place));
        let mut members: Vec<Member<A, S, E::Device>> = (0..scene.peers.len()).map(member).collect();
        let operators = Operators::new(scene, &mut members);
        Self {
            axes: scene.axes.count(),
            names: scene.peers.iter().map(|peer| peer.name.clone()).collect(),
            latest: members.iter().map(|member| member.peer.object().state().position).collect(),
            packet: packet(members[0].peer.kind(), scene),
            samples: SamplesInFlight::new(members[0].peer.kind()),
            send_when: scene.coordination.send_when,
            horizon: members[0].peer.strategy().horizon(),
            parameters: parameter_changes(scene),
            turning: Turning::new(scene),
            members,
            judging: Judging::of(scene, operators.is_some()),
            operators,
            network: network(scene, plan),
            schedule: Schedule::new(plan.ticking, scene.peers.iter().map(|peer| &peer.clock).enumerate()),
            changes: scene.timeline.iter().rev().cloned().collect(),
            coordination_factors: (0..if scene.has_gains_by_peer() { scene.peers.len() } else { 1 })
                .map(|peer| scene.coordination_factor(peer))
                .collect(),
            topology: scene.topology.clone(),
            end: Instant::ZERO.saturating_add(scene.duration),
            now: Instant::ZERO,
            max_discrepancy: 0.0,
            finite: true,
            ticking: (0..scene.peers.len()).collect(),
            earliest_send: 0,
            remote,
        }
    }

    /// Lets the outcome of the task end the run, if the task says so.
    pub(crate) fn stopping_with_task(mut self, scene: &Scene) -> Self {
        if let Some(judging) = self.judging.as_mut().filter(|_| scene.ends_with_task()) {
            judging.stop();
        }
        self.judge_instant();
        self
    }

    /// Returns the instant of the latest step.
    pub(crate) fn now(&self) -> Instant {
        self.now
    }

    /// Returns the end of the run: the end of the scene, unless its task has ended the run.
    pub(crate) fn end(&self) -> Instant {
        self.end
    }

    /// Computes the next instant of a tick, and the instants after it at which nothing but ticks happens, together at most `most` instants. Ends the run if the
    /// instant is not before the end of the scene, or if a number is not finite.
    pub(crate) fn step(&mut self, most: u32, observer: &mut (impl Observer<Error = Ended> + ?Sized), watch: Watch) -> Result<Step, Ended> {
        let Some(now) = self.schedule.next_instant().filter(|now| *now < self.end) else {
            return self.finish(observer, watch).map(Step::Ended);
        };
        if !self.finite {
            // The tick before this instant led to a number that is not finite.
            return Ok(Step::Ended(Ending::Diverged(now)));
        }
        self.now = now;
        // Changes come first, so a change at an instant already holds for the samples and forces of the instant.
        if !self.changes.is_empty() {
            self.change(now);
        }
        // Samples precede deliveries, and deliveries precede forces: a sample of a link without delay counts at the same instant.
        self.schedule.take(now, &mut self.ticking);
        self.send(now, observer, watch)?;
        // Without remote peers nothing else polls the network, so an instant without events need not be delivered.
        if !E::IS_EMPTY || self.network.may_have_events(now) {
            self.deliver(now, observer, watch)?;
        }
        // A person sees what has arrived by now, and the hand pulls during the tick that begins now.
        if let (Some(operators), Some(judging)) = (&mut self.operators, &self.judging) {
            operators.act(now, &self.ticking, &mut self.members, judging.judge());
        }
        let instants = self.compute_and_move(now, most, observer, watch)?;
        self.judge_instant();
        Ok(Step::Ticked(instants))
    }

    /// Judges the task after all ticks of an instant, and ends the run at the outcome if the task says so. The next step then finds the run at its end.
    fn judge_instant(&mut self) {
        if let Some(judging) = &mut self.judging
            && let Some(end) = judging.end(self.schedule.next_instant())
        {
            self.end = self.end.min(end);
        }
    }

    /// Returns the results of the run up to `ending`.
    pub(crate) fn summary(&self, ending: Ending) -> Summary {
        let stop = match ending {
            Ending::Complete => self.end,
            Ending::Diverged(at) | Ending::Interrupted(at) => at,
        };
        let peers = self.members.iter().zip(&self.names).map(|(member, name)| {
            let State { position, velocity } = member.peer.object().state();
            PeerSummary {
                name: name.clone(),
                position: position[..self.axes].to_vec(),
                velocity: velocity[..self.axes].to_vec(),
                attitude: member.peer.rotation().map(|rotation| *rotation.copy()),
                stale_samples: member.stale_samples,
                refused_samples: member.refused_samples,
            }
        });
        Summary {
            ending,
            duration: stop - Instant::ZERO,
            ticks: self.members.iter().map(|member| member.tick).max().unwrap_or(0),
            peers: peers.collect(),
            links: self.link_summaries(),
            access_lines: self.access_summaries(),
            max_discrepancy: self.max_discrepancy,
            max_rotation_discrepancy: self.turning.as_ref().map(|turning| turning.spread.angle()),
        }
    }

    /// Returns the positions and attitudes of each peer's device and copy, and their contact, in the order of the peers.
    pub(crate) fn bodies(&self) -> impl Iterator<Item = Bodies<A>> {
        let length = self.turning.as_ref().map_or(1.0, |turning| turning.length());
        self.members.iter().map(move |member| {
            let (object, rotation) = (member.peer.object().state(), member.peer.rotation());
            Bodies {
                device: member.peer.device().state().position,
                object: object.position,
                contact: member.peer.contact(),
                grasp: rotation.map_or(object.position, |rotation| rotation.copy().point(rotation.config().grasp, object).position),
                turns: rotation.map(|rotation| Turns { object: *rotation.copy(), device: rotation.device().copied(), length }),
            }
        })
    }

    /// Step 1 of an instant: each ticking peer with a due sample sends the sample to all other peers, to its neighbours, or as a client to its server.
    fn send(&mut self, now: Instant, observer: &mut (impl Observer<Error = Ended> + ?Sized), watch: Watch) -> Result<(), Ended> {
        // In lockstep all local peers have the tick of the leading peer, so one comparison skips the loop at ticks without samples.
        if matches!(self.schedule, Schedule::Lockstep { .. }) && self.members[self.remote.lead()].tick < self.earliest_send {
            return Ok(());
        }
        for index in 0..self.ticking.len() {
            let from = self.ticking[index];
            let member = &mut self.members[from];
            if member.tick != member.next_send {
                continue;
            }
            // The next due tick moves on even if `send_when` keeps back this sample: the condition is evaluated at due ticks only.
            member.next_send += member.send_every;
            let local_time = member.peer.local_time();
            if let Some(when) = &self.send_when {
                let own = member.peer.object().state();
                if !when.is_due(member.last_sent.as_ref(), local_time, own, self.horizon) {
                    continue;
                }
                member.last_sent = Some(LastSent { at: local_time, state: *own });
            }
            let role = member.peer.role();
            let packets = match role {
                Role::Copy => self.topology.as_ref().map_or(self.names.len() - 1, |topology| topology.neighbours(from).len()),
                Role::Client { .. } => 1,
            };
            let sample = member.peer.next_sample(local_time);
            let handle = if self.samples.kind() == SampleKind::State {
                self.samples.store(packets, sample)
            } else if let Some(handle) =
                store_extended(&mut self.samples, (packets, self.axes), sample, (from, self.names.len() - 1, &mut member.peer))
            {
                handle
            } else {
                // The states are finite, because the run ends at the first state with a number that is not. A number computed from the states has overflowed.
                self.finite = false;
                continue;
            };
            let sender = NodeId::new(from);
            let sent = match role {
                Role::Copy => self.network.handle_broadcast(now, sender, self.packet, handle),
                Role::Client { server } => {
                    // The role counts servers without the client itself; nodes of the network count all peers.
                    // Servers after the client have moved down by one in the client's count.
                    let server = if server < from { server } else { server + 1 };
                    self.network.handle_packet(now, sender, NodeId::new(server), self.packet, handle)
                }
            };
            sent.expect("instants come in order");
            if watch.sends {
                observer.on_send(&SendRow { at: now, peer: from, packets: packets as u64, size: self.packet.size })?;
            }
        }
        self.earliest_send = self.members.iter().map(|member| member.next_send).min().unwrap_or(0);
        Ok(())
    }

    /// Step 2 of an instant: each arrived packet is handed to its receiver.
    fn deliver(&mut self, now: Instant, observer: &mut (impl Observer<Error = Ended> + ?Sized), watch: Watch) -> Result<(), Ended> {
        let Self { network, members, samples, remote, axes, .. } = self;
        // The network first computes everything due by now. The events are then polled in the order of time.
        network.handle_timeout(now).expect("instants come in order");
        let mut receivers = Receivers { members, samples, remote, axes: *axes, now, observer, watch };
        // Nearly all events are simple arrivals. For these the network need not build a complete event.
        if let Some(ended) = network.take_mere_arrivals(&mut receivers) {
            return Err(ended);
        }
        // A driver with remote peers asks for awaited instants, which a poll without an event passes.
        if E::IS_EMPTY && !network.may_have_events(now) { Ok(()) } else { receivers.take_all(network) }
    }

    /// Steps 3 and 4 of an instant: each ticking peer computes its forces and moves to its next tick. Goes on with the instants after `now` at which nothing else
    /// happens, and returns the number of instants, at most `most`.
    fn compute_and_move(
        &mut self,
        now: Instant,
        most: u32,
        observer: &mut (impl Observer<Error = Ended> + ?Sized),
        watch: Watch,
    ) -> Result<u32, Ended> {
        // In lockstep all ticks have the same length and no queue of ticks is needed.
        let lockstep = self.schedule.tick_together(now);
        let takes_ticks = self.judging.as_ref().is_some_and(|judging| judging.takes_ticks());
        let shows_ticks = watch.ticks || takes_ticks;
        if let (Some(lockstep), false, true) = (lockstep, shows_ticks || watch.steps, E::IS_EMPTY) {
            return self.move_together(now, lockstep, most, observer, watch);
        }
        let span_of_all = lockstep.map(|(_, span)| span);
        let mut judging = self.judging.as_mut().filter(|_| takes_ticks);
        for &place in &self.ticking {
            let member = &mut self.members[place];
            self.remote.attend(now, place, &mut member.peer, self.axes, observer)?;
            let span = span_of_all.unwrap_or_else(|| {
                let next = member.clock.instant(member.tick + 1);
                self.schedule.tick_again(place, next);
                next.unwrap_or(Instant::MAX) - now
            });
            let forces = member.peer.compute_over(now, span);
            let object = member.peer.object().state();
            // Noted between `compute_over` and `advance`: the positions of the present instant, not of the next tick.
            self.latest[place] = object.position;
            if let (Some(turning), Some(rotation)) = (&mut self.turning, member.peer.rotation()) {
                turning.latest[place] = *rotation.copy();
            }
            if shows_ticks {
                let axes = self.axes;
                let device = member.peer.device().state();
                let tick = TickRow {
                    at: now,
                    peer: place,
                    device: row(&device, axes),
                    object: row(object, axes),
                    target: row(&forces.target, axes),
                    coupling_force: &forces.coupling[..axes],
                    coordination_force: &forces.coordination[..axes],
                    turn: None,
                };
                let mut show = |row: &TickRow<'_>| {
                    if let Some(judging) = &mut judging {
                        judging.on_tick(row);
                    }
                    if watch.ticks { observer.on_tick(row) } else { Ok(()) }
                };
                match member.peer.rotation() {
                    None => show(&tick)?,
                    Some(rotation) => turning::on_tick(show, tick, rotation)?,
                }
            }
            member.tick += 1;
            if watch.steps {
                member.advance_watched(now, span, forces.commanded, (place, self.axes), observer)?;
            } else {
                member.peer.advance(now, span);
            }
            // Checked after the move: the next step ends the run before the number reaches a row.
            self.finite &= member.is_finite();
        }
        let mut bounds = Bounds::NONE;
        for (_, position) in self.latest.iter().enumerate().filter(|(place, _)| self.remote.is_there(*place)) {
            bounds.add(position);
        }
        self.end_instant(now, &bounds, observer, watch)?;
        Ok(1)
    }

    /// Computes and moves all peers in one loop, for runs in lockstep without an observer of ticks or steps. The results equal those of the general loop. Goes
    /// on with the next instants as long as nothing but ticks happens, and returns the number of instants, at most `most`.
    fn move_together(
        &mut self,
        mut now: Instant,
        (nanos, span): (u64, Duration),
        most: u32,
        observer: &mut (impl Observer<Error = Ended> + ?Sized),
        watch: Watch,
    ) -> Result<u32, Ended> {
        // Asked once: ticks send nothing, so nothing comes closer during them.
        let (most, until) = self.quiet(most);
        let mut instants = 1;
        loop {
            if let Some(turning) = &mut self.turning {
                for (latest, rotation) in turning.latest.iter_mut().zip(self.members.iter().filter_map(|member| member.peer.rotation())) {
                    *latest = *rotation.copy();
                }
            }
            let (mut sum, mut bounds) = (State::REST, Bounds::NONE);
            for member in &mut self.members {
                // The positions before the move, so the discrepancy belongs to `now`.
                bounds.add(&member.peer.tick(now, span));
                member.tick += 1;
                member.add_states(&mut sum);
            }
            // One test of a sum shows whether all states are finite. Only if the sum has overflowed, each state is tested.
            let are_finite = sum.is_finite() || self.members.iter().all(Member::is_finite);
            self.finite &= are_finite && (self.turning.is_none() || self.members.iter().all(Member::turns_finitely));
            self.end_instant(now, &bounds, observer, watch)?;
            let next = now.saturating_add_nanos(nanos);
            if instants >= most || next >= until || !self.finite {
                self.now = now;
                self.schedule.tick_together(now);
                return Ok(instants);
            }
            (now, instants) = (next, instants + 1);
        }
    }

    /// Returns how long a run in lockstep has nothing but ticks after the present instant: the number of instants, at most `most` and with the present instant,
    /// up to the next sample, and an instant before which no change of the timeline, no packet and no end of the run comes.
    fn quiet(&self, most: u32) -> (u32, Instant) {
        // A judge and modelled persons see each instant.
        if self.judging.is_some() || self.operators.is_some() {
            return (1, self.now);
        }
        let change = self.changes.last().map_or(self.end, |change| change.at);
        let until = self.network.quiet_until().min(change).min(self.end);
        let ticks = self.earliest_send - self.members[self.remote.lead()].tick;
        (u32::try_from(ticks).unwrap_or(u32::MAX).min(most), until)
    }

    /// Ends the ticks of an instant, given the positions of all copies: measures their discrepancy, and shows the instant.
    #[inline(always)]
    fn end_instant(
        &mut self,
        now: Instant,
        bounds: &Bounds<A>,
        observer: &mut (impl Observer<Error = Ended> + ?Sized),
        watch: Watch,
    ) -> Result<(), Ended> {
        let discrepancy = bounds.discrepancy();
        self.max_discrepancy = if discrepancy > self.max_discrepancy { discrepancy } else { self.max_discrepancy };
        if let Some(turning) = &mut self.turning {
            turning.measure(|place| self.remote.is_there(place));
        }
        if watch.instants { observer.on_instant(&InstantRow { at: now, discrepancy }) } else { Ok(()) }
    }

    /// Ends the scene: applies the changes and delivers the packets due at the end.
    fn finish(&mut self, observer: &mut (impl Observer<Error = Ended> + ?Sized), watch: Watch) -> Result<Ending, Ended> {
        self.change(self.end);
        self.deliver(self.end, observer, watch)?;
        Ok(if self.finite { Ending::Complete } else { Ending::Diverged(self.end) })
    }

    fn link_summaries(&self) -> LinkSummaries {
        if let Some(topology) = &self.topology {
            let stats = topology.pairs().filter_map(|(from, to)| self.network.link_stats(NodeId::new(from), NodeId::new(to)));
            return LinkSummaries::on(Arc::clone(topology), stats.collect());
        }
        let nodes = || (0..self.members.len()).map(NodeId::new);
        let stats = nodes().flat_map(|from| nodes().filter_map(move |to| self.network.link_stats(from, to)));
        LinkSummaries::each(self.members.len(), stats.collect())
    }

    fn access_summaries(&self) -> Vec<AccessSummary> {
        let lines = (0..self.members.len()).flat_map(|peer| [(peer, true), (peer, false)]);
        lines
            .filter_map(|(peer, uplink)| {
                let line = if uplink { AccessLine::Uplink(NodeId::new(peer)) } else { AccessLine::Downlink(NodeId::new(peer)) };
                self.network.access_stats(line).map(|stats| AccessSummary { peer, uplink, stats })
            })
            .collect()
    }
}

/// Builds the network of the scene's links and access lines.
fn network<T: Clone>(scene: &Scene, plan: &Plan) -> Network<T> {
    let config = NetworkConfig { seed: scene.seed, nodes: scene.peers.iter().map(|peer| peer.name.clone()).collect(), general: plan.general_links };
    let link = |from: NodeId, to: NodeId| scene.links.between(from.index(), to.index()).clone();
    let mut network = match &scene.topology {
        // Every peer has a link to every other peer.
        None => Network::new(config, link),
        Some(topology) => {
            let receivers = |from: NodeId| topology.neighbours(from.index()).iter().map(|to| NodeId::new(*to as usize));
            Network::of_some(config, receivers, link)
        }
    };
    for (place, peer) in scene.peers.iter().enumerate() {
        let lines = [(AccessLine::Uplink(NodeId::new(place)), &peer.uplink), (AccessLine::Downlink(NodeId::new(place)), &peer.downlink)];
        for (line, config) in lines {
            if let Some(config) = config {
                network = network.with_access_line(line, LinkModel::clone(config)).expect("the network has a node for every peer");
            }
        }
    }
    if scene.relay { network.with_relay() } else { network }
}

/// Returns the properties of each sample's packet for the network.
fn packet(kind: SampleKind, scene: &Scene) -> PacketInfo {
    // Packets are ECN-capable, so a marking queue has packets to mark. No sender reacts to a mark, and a marked packet arrives.
    PacketInfo { size: Bytes::new(kind.datagram_len(scene.axes.count()) as u64), ecn: Ecn::Capable0 }
}

/// Stores a sample with the attitude and the extra numbers of the peer at index `from`: numbers for each receiver if the kind is personal, else one set for
/// all. Returns `None` if a number is not finite.
fn store_extended<const A: usize, D: Device<A>, S: Strategy<A>>(
    samples: &mut SamplesInFlight<A>,
    packets: (usize, usize),
    sample: Sample<A>,
    (from, others, peer): (usize, usize, &mut Peer<A, D, S>),
) -> Option<Handle> {
    let kind = samples.kind();
    samples.store_extended(packets, sample, peer.attitude(), |numbers| {
        if kind.is_personal() {
            // Numbers are indexed by node, but the peer counts the other peers without itself. The zeros in its own place are never sent.
            numbers.extend((0..from).map(|other| peer.extra(other)));
            numbers.push([0.0; A]);
            numbers.extend((from..others).map(|other| peer.extra(other)));
        } else {
            numbers.push(peer.extra(0));
        }
        peer.all_sent();
    })
}

fn row<const A: usize>(state: &State<A>, axes: usize) -> StateRow<'_> {
    StateRow { position: &state.position[..axes], velocity: &state.velocity[..axes] }
}
