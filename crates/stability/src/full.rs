//! The general path of the analysis: unit vectors of the state are pushed through the code of the simulator.
//!
//! Real [`Peer`]s with real strategies are set to a state, stepped through one frame of the timetable, and read again. Any linear strategy can be analysed in
//! this way. A strategy with a nonlinear force, or with more memory than the shown state, is detected and refused.

mod exchanges;
mod layout;
mod person;
mod rigid;

use std::time::Duration;

use cohaptic_peer::coordination::Role;
use cohaptic_peer::wire::SampleKind;
use cohaptic_peer::{Acting, Contact, Device as _, Exchange, Gains, Hand, Held, ObjectCopy, Peer, Signal, SimulatedDevice, State, Strategy};
use cohaptic_scene::{Scene, Strategies};
use cohaptic_units::Instant;

use self::exchanges::{read_exchange, restore_exchange, ticks_until_exchange};
use self::layout::{Layout, Member};
use self::person::Person;
use crate::cost::{PartCost, pushed_operations};
use crate::lifted::majorant::error_of;
use crate::lifted::{Body, Lifted, Node, closer_of};
use crate::network::{LinkTiming, NominalNetwork};
use crate::rounding::real;
use crate::structure::{Contacts, Structure, common_time, has_one_drift, knows_origin, linear_law};
use crate::timetable::{Event, Instants, NodeClock, Timetable, UseOfHeld};
use crate::unseen::felt;
use crate::{AnalysisError, Matrix, StateName, Watch};

/// Result of the general path: the matrix of one frame in relative coordinates.
#[derive(Clone, PartialEq, Debug)]
pub struct FullMap {
    pub(crate) monodromy: Matrix,
    /// Bound of the error of `monodromy` in the norm of the largest row sum of absolute values.
    pub(crate) error: f64,
    pub(crate) rigid_modes: usize,
    pub(crate) frame: Duration,
    /// Names of the states, indexed by row or column of `monodromy`.
    pub(crate) states: Vec<StateName>,
    /// Common time by which velocities are multiplied \[s\], so that all states are lengths.
    pub(crate) time: f64,
    /// Peer with the reference copy of relative positions, indexed by peer and axis. `None` for absolute positions.
    pub(crate) relative: Vec<Vec<Option<usize>>>,
    /// Contribution of each state (column) to the commanded forces of strategies in the frame, one row per force. `None` if samples carry no waves.
    pub(crate) forces: Option<Matrix>,
}

impl FullMap {
    /// Returns the part of the matrix with an effect on bodies, and a bound of its error: without waves the whole matrix.
    pub fn felt(self) -> (Matrix, f64) {
        let Some(forces) = &self.forces else { return (self.monodromy, self.error) };
        let (felt, rounded) = felt(&self.monodromy, forces, &self.states);
        (felt, self.error + rounded)
    }
}

/// The knowledge about a strategy before any vector is pushed.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Trust {
    /// A strategy of this workspace, linear by the tests of the workspace. The check is left out.
    Linear,
    /// An unknown strategy. Linearity is checked before the matrix is built.
    Nothing,
}

/// Pushes every unit vector of a scene's state through a frame, with the motion along `axes` axes (1 to 3). Displacements that clients send are followed as the
/// positions that these displacements add up to: the nominal network of such a scene has lines of constant delay to the server.
///
/// # Errors
///
/// [`AnalysisError`] as for [`analyse_with`](crate::analyse_with).
pub fn full_along(
    axes: usize,
    scene: &Scene,
    network: &NominalNetwork,
    contacts: &Contacts,
    trust: Trust,
    watch: &dyn Watch,
    strategies: &impl Strategies,
) -> Result<FullMap, AnalysisError> {
    let with_states = scene.sends_increments().then(|| scene.with_states());
    let scene = with_states.as_ref().unwrap_or(scene);
    match axes {
        1 => full::<1, _>(scene, network, contacts, trust, watch, |peer| strategies.strategy(scene, peer)),
        2 => full::<2, _>(scene, network, contacts, trust, watch, |peer| strategies.strategy(scene, peer)),
        _ => full::<3, _>(scene, network, contacts, trust, watch, |peer| strategies.strategy(scene, peer)),
    }
}

/// Pushes every unit vector of a scene's state through a frame, with the motion along `A` axes.
fn full<const A: usize, S: Strategy<A>>(
    scene: &Scene,
    network: &NominalNetwork,
    contacts: &Contacts,
    trust: Trust,
    watch: &dyn Watch,
    strategy: impl Fn(usize) -> S,
) -> Result<FullMap, AnalysisError> {
    let mut pusher = Pusher::<A, S>::new(scene, network, contacts, strategy, watch)?;
    pusher.settle();
    if trust == Trust::Nothing {
        pusher.check()?;
    }
    // `map` bounds the error by the growth of the vectors. The numbers of a known law give a second bound; the closer one is kept.
    let mut map = pusher.map(watch)?;
    if trust == Trust::Linear && linear_law(scene, 0).is_some_and(|law| law.pull().is_some()) {
        let nodes = Structure::of_each(scene, network, contacts)?;
        map.error = closer_of(map.error, || error_of_known(scene, &nodes, map.time));
    }
    Ok(map)
}

/// Returns a bound of the matrix's error for a strategy with a known law. Each real peer computes the same as its node of the lifted system, so the bound
/// of the lifted system holds.
fn error_of_known(scene: &Scene, structure: &Structure, time: f64) -> f64 {
    let node = |peer: usize| {
        let mut node = structure.node(scene, peer);
        if node.device.is_none() {
            // The structure leaves out a loose device, but the general path pushes its states too. The node gets the device without a coupling.
            let spec = &scene.peers[peer];
            node.device = Some(Body::new(scene.device_plant(peer), scene.integrator, &spec.clock));
            node.coupling = Gains { stiffness: 0.0, damping: 0.0 };
            node.exchange = Exchange::EACH_TICK;
        }
        node
    };
    let nodes: Vec<Node> = (0..scene.peers.len()).map(node).collect();
    let lifted = Lifted { time, ..structure.quotient(scene, &nodes) };
    error_of(&lifted, |peer| compliance(scene, peer, time))
}

/// Returns the factor from forces of a peer to lengths [m/N].
fn compliance(scene: &Scene, peer: usize, time: f64) -> f64 {
    time * scene.peers[peer].clock.tick.as_secs_f64() / scene.copy_mass()
}

/// Local time of a clock without offset at the beginning of a frame. Large, so that samples of earlier frames have instants of sending above zero.
const EARLIER: Instant = Instant::from_nanos(1 << 60);

/// The simulated peers of a scene with the layout of their states in a vector, for pushing vectors through a frame.
struct Pusher<const A: usize, S> {
    members: Vec<Member<A, S>>,
    /// Person who holds the device of each peer; `None` where the wanted motion of the hand is given, and where the device touches nothing.
    people: Vec<Option<Person<A>>>,
    names: Vec<String>,
    timetable: Timetable,
    instants: Instants,
    /// Number of ticks before the first exchange with the device in a frame, indexed by peer.
    until: Vec<u32>,
    layout: Layout,
    /// Factor of velocities in the vector \[s\].
    time: f64,
    /// Factor of forces in the vector [m/N], indexed by peer.
    compliance: Vec<f64>,
    /// Factor of the extra numbers of samples, indexed by the sending peer.
    extra: Vec<f64>,
    /// Factor of the numbers that strategies remember.
    remembered: f64,
    /// Samples indexed by sending peer: first the samples of earlier frames, oldest first, then the samples of this frame.
    samples: Vec<Vec<State<A>>>,
    /// Extra numbers of the samples, indexed by sending peer, then by sample and receiver. Empty if samples carry states only.
    extras: Vec<Vec<[f64; A]>>,
    kind: SampleKind,
    /// Forces commanded by strategies in the frame pushed last, by tick and axis. Empty unless samples carry waves.
    commanded: Vec<f64>,
    /// Largest position plus scaled velocity of a body in any frame so far, for the bound of errors.
    growth: f64,
}

impl<const A: usize, S: Strategy<A>> Pusher<A, S> {
    fn new(
        scene: &Scene,
        network: &NominalNetwork,
        contacts: &Contacts,
        strategy: impl Fn(usize) -> S,
        watch: &dyn Watch,
    ) -> Result<Self, AnalysisError> {
        let peers = scene.peers.len();
        let clocks: Vec<NodeClock> = (0..peers).map(|place| NodeClock::of(scene, place)).collect();
        let pairs = (0..peers).flat_map(|to| (0..peers).filter(move |from| *from != to).map(move |from| (from, to)));
        let links: Vec<(usize, usize, LinkTiming)> = pairs.map(|(from, to)| (from, to, network.timing(from, to).clone())).collect();
        let uses = if scene.sample_kind() == SampleKind::State { UseOfHeld::Ticks } else { UseOfHeld::SamplesAndTicks };
        let timetable = Timetable::with_use_of_held(&clocks, &links, uses)?;
        // A hand without a contact moves nothing but its own device.
        let people: Vec<Option<Person<A>>> = (0..peers).map(|place| Person::of(scene, place).filter(|_| contacts.touching[place])).collect();
        let remembered = people.iter().flatten().map(Person::states).sum::<usize>();
        // The states include a position and a velocity per axis of each sample in flight. The limit is checked before memory for them is allocated.
        PartCost::of_eigenvalues(2 * A * timetable.depth.iter().sum::<usize>() + remembered).allowed(watch)?;
        let member = |place: usize| {
            let spec = &scene.peers[place];
            let mut config = scene.peer_config(place);
            config.contact = if contacts.touching[place] { Contact::Grasp } else { Contact::None };
            config.enclosure = None;
            if !contacts.touching[place] {
                // Exchanges of a device that touches nothing move nothing.
                config.exchange = Exchange::EACH_TICK;
            }
            // Stability does not depend on the outer force of a hand, so this force is zero here. The arm's impedance remains.
            let hand = spec.hand.as_ref().and_then(Hand::arm).map(|arm| Hand::Arm { arm, follows: Signal::Constant([0.0; 3]) });
            let device = SimulatedDevice::new(spec.device, hand.as_ref(), State::REST, scene.integrator, &spec.clock);
            let object = ObjectCopy::new(scene.copy_config(place), State::REST, scene.integrator, &spec.clock);
            Peer::new(config, device, object, strategy(place), Held::new((1..peers).map(|_| State::REST)))
        };
        let members: Vec<Member<A, S>> = (0..peers).map(member).collect();
        let kind = members.first().map_or(SampleKind::State, Peer::kind);
        if kind == SampleKind::Energy {
            return Err(AnalysisError::NoAnalysis { strategy: scene.coordination.strategy.name() });
        }
        if members.iter().any(|member| member.strategy().horizon().is_some()) && !has_one_drift(scene) {
            return Err(AnalysisError::AgesByClocks { strategy: scene.coordination.strategy.name() });
        }
        let silent = links.iter().any(|(_, _, timing)| matches!(timing, LinkTiming::Pattern(pattern) if pattern.iter().all(Option::is_none)));
        let arm = |place: usize| contacts.touching[place] && knows_origin(scene, place);
        // Waves carry no position, so only the arm of the same peer ties a copy. With other samples one arm ties all copies.
        let tied = |place: usize| if kind == SampleKind::Wave { arm(place) } else { silent || (0..peers).any(arm) };
        let tied = (0..peers).map(tied).collect();
        let layout = Layout::new(scene, contacts, &members, &people, &timetable, tied);
        let touching = contacts.touching.iter().copied().enumerate();
        let time = common_time(scene, timetable.frame, linear_law(scene, 0).map_or(scene.coordination.gains, |law| law.held_by()), touching, false);
        let compliance: Vec<f64> = (0..peers).map(|peer| compliance(scene, peer, time)).collect();
        // Length for a wave of 1 √W, equal to √2 N on a line of 1 N·s/m: the motion of a copy from one sample to the next under this wave.
        let wave = scene.coordination.update.as_secs_f64() * (time / scene.copy_mass()).sqrt();
        let (extra, remembered) = if kind == SampleKind::Wave { (vec![wave; peers], wave) } else { (compliance.clone(), 1.0) };
        let names = scene.peers.iter().map(|peer| peer.name.clone()).collect();
        let instants = Instants::of(&timetable);
        Ok(Self {
            samples: vec![Vec::new(); peers],
            extras: vec![Vec::new(); peers],
            until: ticks_until_exchange(&timetable),
            instants,
            members,
            people,
            names,
            timetable,
            layout,
            time,
            compliance,
            extra,
            remembered,
            kind,
            commanded: Vec::new(),
            growth: 1.0,
        })
    }

    /// Builds the matrix of a frame column by column, by pushing a unit vector for each kept state.
    fn map(mut self, watch: &dyn Watch) -> Result<FullMap, AnalysisError> {
        let size = self.layout.size;
        let events = self.timetable.events.len();
        PartCost::of_full(size, events, A).begin(watch)?;
        let rest = self.pushed(&vec![0.0; size], Instant::ZERO);
        let free = self.free_translations(&rest);
        // Positions are relative to the reference copies, so the reference copies' own positions are dropped. Loose positions and unfelt places are dropped
        // too, since nothing depends on them.
        let is_dropped = |state: &usize| self.layout.loose.contains(state) || self.layout.unfelt.contains(state);
        let kept: Vec<usize> = (0..size).filter(|state| free.iter().all(|free| free.reference != *state) && !is_dropped(state)).collect();
        let mut monodromy = Matrix::zeros(kept.len(), kept.len());
        // Rest and displacements were pushed before. Only the growth of unit vectors enters the bound of the error.
        self.growth = 1.0;
        let mut commanded = Vec::new();
        let (mut unit, mut reached) = (vec![0.0; size], vec![0.0; size]);
        for (column, state) in kept.iter().enumerate() {
            if watch.stops() {
                return Err(AnalysisError::Stopped);
            }
            unit[*state] = 1.0;
            self.push(&unit, Instant::ZERO, &mut reached);
            unit[*state] = 0.0;
            // A constant force moves even the zero vector; the difference is the linear part.
            for (entry, rest) in reached.iter_mut().zip(&rest) {
                *entry -= rest;
            }
            for (row, target) in kept.iter().enumerate() {
                let moved: f64 = free.iter().map(|free| reached[free.reference] * free.moved[*target]).sum();
                monodromy[(row, column)] = reached[*target] - moved;
            }
            commanded.push(self.commanded.clone());
            watch.done(pushed_operations(events, A));
        }
        let ticks = self.timetable.events.iter().filter(|event| matches!(event, Event::Tick { .. })).count();
        // As for the lifted system: each tick rounds, and the rest of the frame magnifies the rounding by at most about the growth.
        let error = 10.0 * f64::EPSILON * real(ticks) * self.growth * self.growth * real(kept.len()).sqrt();
        let names = self.layout.names::<A>(&self.timetable.depth);
        Ok(FullMap {
            monodromy,
            error,
            rigid_modes: free.len() + self.layout.loose.len(),
            frame: self.timetable.frame,
            states: kept.iter().map(|state| names[*state]).collect(),
            time: self.time,
            relative: self.relative_to(&free),
            forces: self.layout.has_waves.then(|| forces_of(&commanded, &self.order_of_forces())),
        })
    }

    /// Returns indices into `commanded`, ordered by peer, then axis, then tick.
    fn order_of_forces(&self) -> Vec<usize> {
        let ticks = self.timetable.events.iter().filter_map(|event| if let Event::Tick { node, .. } = event { Some(*node) } else { None });
        let mut order: Vec<(usize, usize, usize)> =
            ticks.flat_map(|node| (0..A).map(move |axis| (node, axis))).enumerate().map(|(place, (node, axis))| (node, axis, place)).collect();
        order.sort_unstable();
        order.into_iter().map(|(.., place)| place).collect()
    }

    /// Refuses a strategy with a nonlinear force, or with a dependence on more than the shown state.
    fn check(&mut self) -> Result<(), AnalysisError> {
        let size = self.layout.size;
        let rest = self.pushed(&vec![0.0; size], Instant::ZERO);
        self.growth = 0.0;
        let later = Instant::ZERO.saturating_add(self.timetable.frame).saturating_add(self.timetable.frame);
        let relative = |reached: Vec<f64>| -> Vec<f64> { reached.iter().zip(&rest).map(|(reached, rest)| reached - rest).collect() };
        // Amplitudes of three sizes are compared with one another: a dead band shows at the small amplitude, a saturation at the large one.
        let mut small: Option<Vec<f64>> = None;
        for amplitude in [1e-6, 1e-2, 10.0] {
            let (one, other) = (noise(size, 1, amplitude), noise(size, 2, amplitude));
            // A linear f has f(one − 2·other) = f(one) − 2·f(other), with the motion from rest taken off on both sides.
            let both: Vec<f64> = one.iter().zip(&other).map(|(one, other)| one - 2.0 * other).collect();
            let reached_one = self.pushed(&one, Instant::ZERO);
            // The same state must lead to the same result at a later time. Otherwise the strategy remembers more than the shown state, or uses the time.
            if self.pushed(&one, later) != reached_one {
                return Err(AnalysisError::Remembers);
            }
            let (reached_one, reached_other, reached_both) =
                (relative(reached_one), relative(self.pushed(&other, Instant::ZERO)), relative(self.pushed(&both, Instant::ZERO)));
            let scale = [&reached_one, &reached_other, &rest].into_iter().flatten().fold(amplitude, |largest: f64, entry| largest.max(entry.abs()));
            let unit: Vec<f64> = reached_one.iter().map(|entry| entry / amplitude).collect();
            let small = small.get_or_insert_with(|| unit.clone());
            // Next to a constant force the small amplitude may have few exact digits, so this difference counts by a thousandth.
            let homogeneous = |place: usize| (unit[place] - small[place]).abs() * amplitude * 1e-3;
            let apart = |place: usize| (reached_one[place] - 2.0 * reached_other[place] - reached_both[place]).abs().max(homogeneous(place));
            let limit = 1e-9 * scale.max(self.growth);
            if let Some(place) = (0..size).find(|place| apart(*place).is_nan() || apart(*place) > limit) {
                return Err(AnalysisError::NotLinear { peer: self.names[self.layout.owner(place)].clone() });
            }
        }
        Ok(())
    }

    /// Returns the state after one frame from the state `z` at the instant `begin`.
    fn pushed(&mut self, z: &[f64], begin: Instant) -> Vec<f64> {
        let mut reached = vec![0.0; z.len()];
        self.push(z, begin, &mut reached);
        reached
    }

    /// Like [`pushed`](Self::pushed), with the state after the frame written to `reached`.
    fn push(&mut self, z: &[f64], begin: Instant, reached: &mut [f64]) {
        let begin_local = EARLIER.saturating_add(begin - Instant::ZERO);
        self.restore(z, begin_local);
        self.commanded.clear();
        let peers = self.members.len();
        for event in 0..self.timetable.events.len() {
            match self.timetable.events[event] {
                Event::Sample { node } => self.sample_now(node),
                Event::Deliver { from, to, sample } => {
                    self.hold((to, from, sample), begin_local, true);
                }
                Event::Tick { node, at, span, .. } => {
                    let now = begin.saturating_add_nanos(at);
                    let member = &mut self.members[node];
                    if let Some(person) = &mut self.people[node] {
                        // A person who hears nothing of the peer that he looks at sees the object where it was at first.
                        let wanted = person.tick(member.seen(person.sees).unwrap_or([0.0; A]));
                        member.device_mut().want(&person.arm, &wanted);
                    }
                    // Forces first, motion after: the forces belong to the state at the tick.
                    let forces = member.compute(now);
                    member.advance(now, span);
                    if self.layout.has_waves {
                        self.commanded.extend(forces.commanded);
                    }
                    let (device, object) = (member.device().state(), member.object().state());
                    for axis in 0..A {
                        let largest = object.position[axis].abs().max(device.position[axis].abs());
                        self.growth = self.growth.max(largest + self.time * object.velocity[axis].abs().max(device.velocity[axis].abs()));
                    }
                }
            }
        }
        for place in 0..peers {
            self.read(place, reached);
        }
    }

    /// Takes a sample of a peer at the current event, with the extra numbers for each receiver.
    fn sample_now(&mut self, node: usize) {
        let member = &mut self.members[node];
        let state = match member.role() {
            Role::Copy => *member.object().state(),
            Role::Client { .. } => member.device().state(),
        };
        self.samples[node].push(state);
        if self.kind != SampleKind::State {
            self.extras[node].extend((0..self.layout.receivers).map(|receiver| member.extra(receiver)));
            member.all_sent();
        }
    }

    /// Lets peer `to` hold a sample of peer `from`. If `accepts` is true, the strategy of `to` also receives the sample's extra numbers.
    fn hold(&mut self, (to, from, sample): (usize, usize, i64), begin_local: Instant, accepts: bool) {
        let state = *self.sample(from, sample);
        let after = self.instants.local(from, self.instants.sent_at(from, sample, self.timetable.frame));
        let sent = Instant::from_nanos(begin_local.as_nanos().saturating_add_signed(after));
        // Peers number their senders without themselves, so indices above the own index move down by one.
        let among_others = |one: usize, other: usize| if one < other { one } else { one - 1 };
        self.members[to].hold(among_others(from, to), sent, state);
        if self.layout.receivers > 0 && accepts {
            let extra = self.extras[from][self.sample_place(from, sample) * self.layout.receivers + among_others(to, from)];
            self.members[to].strategy_mut().accept(among_others(from, to), &extra);
        }
    }

    /// Returns a sample of a peer. Samples of this frame have the numbers 0, 1, …; earlier samples have negative numbers.
    fn sample(&self, from: usize, number: i64) -> &State<A> {
        &self.samples[from][self.sample_place(from, number)]
    }

    /// Returns the index in `samples[from]` of a sample: the samples of earlier frames stand first, and number 0 follows them.
    fn sample_place(&self, from: usize, number: i64) -> usize {
        usize::try_from(i64::try_from(self.timetable.depth[from]).unwrap_or(0) + number).unwrap_or(0)
    }

    fn restore(&mut self, z: &[f64], begin_local: Instant) {
        let layout = &self.layout;
        for (place, member) in self.members.iter_mut().enumerate() {
            let first = layout.first[place];
            let first_tick = self.instants.ticks[place].first().map_or(0, |at| i64::try_from(*at).unwrap_or(i64::MAX));
            let shown = begin_local.as_nanos().saturating_add_signed(self.instants.local(place, first_tick));
            member.set_local_time(Instant::from_nanos(shown));
            member.device_mut().set_state(state(&z[first..], self.time));
            member.object_mut().set_state(state(&z[first + 2 * A..], self.time));
            let mut next = first + 4 * A;
            if layout.pending[place] {
                let force = |from: usize| core::array::from_fn(|axis| z[from + axis] / self.compliance[place]);
                member.set_computed(Acting { coupling: force(next), on_object: force(next + A) });
                next += 2 * A;
            }
            next += restore_exchange(member, layout.exchange[place], self.until[place], &z[next..], self.time, self.compliance[place]);
            let memory: Vec<f64> = z[next..next + layout.memory[place]].iter().map(|number| number / self.remembered).collect();
            member.strategy_mut().set_memory(&memory);
            if let Some(person) = &mut self.people[place] {
                person.restore(&z[next + layout.memory[place]..]);
            }
            // The vector has the newest sample first, `samples` the oldest, so the index in `samples` grows with the sample's number.
            let depth = self.timetable.depth[place];
            let begin = |age: usize| layout.samples[place] + age * layout.sample_len::<A>();
            let samples = (0..depth).rev().map(|age| state(&z[begin(age)..], self.time));
            self.samples[place].clear();
            self.samples[place].extend(samples);
            let extra = |first: usize| core::array::from_fn(|axis| z[first + axis] / self.extra[place]);
            let extras = (0..depth).rev().flat_map(|age| (0..layout.receivers).map(move |receiver| begin(age) + (2 + receiver) * A));
            self.extras[place].clear();
            self.extras[place].extend(extras.map(extra));
        }
        for held in 0..self.timetable.held.len() {
            let (to, from, sample) = self.timetable.held[held];
            // The memory of a strategy contains the effect of earlier samples, so a strategy with memory must not accept the samples' extra numbers again.
            self.hold((to, from, sample), begin_local, self.layout.memory[to] == 0);
        }
    }

    fn read(&self, place: usize, z: &mut [f64]) {
        let (layout, member) = (&self.layout, &self.members[place]);
        let first = layout.first[place];
        write(&member.device().state(), &mut z[first..], self.time);
        write(member.object().state(), &mut z[first + 2 * A..], self.time);
        let mut next = first + 4 * A;
        if layout.pending[place] {
            let Acting { coupling, on_object } = member.computed();
            for axis in 0..A {
                z[next + axis] = coupling[axis] * self.compliance[place];
                z[next + A + axis] = on_object[axis] * self.compliance[place];
            }
            next += 2 * A;
        }
        next += read_exchange(member, layout.exchange[place], &mut z[next..], self.time, self.compliance[place]);
        for (entry, number) in z[next..next + layout.memory[place]].iter_mut().zip(member.strategy().memory()) {
            *entry = number * self.remembered;
        }
        if let Some(person) = &self.people[place] {
            person.read(&mut z[next + layout.memory[place]..][..person.states()]);
        }
        let receivers = layout.receivers;
        // Only the newest `depth` samples pass into the next frame, newest first as in `restore`.
        for (age, (number, sample)) in self.samples[place].iter().enumerate().rev().take(self.timetable.depth[place]).enumerate() {
            let first = layout.samples[place] + age * layout.sample_len::<A>();
            write(sample, &mut z[first..], self.time);
            for (entry, extra) in z[first + 2 * A..].iter_mut().zip(self.extras[place][number * receivers..(number + 1) * receivers].iter().flatten())
            {
                *entry = extra * self.extra[place];
            }
        }
    }
}

/// Returns the matrix of commanded forces: one row per force in the given order, one column per state. Equal consecutive rows are kept once.
fn forces_of(commanded: &[Vec<f64>], order: &[usize]) -> Matrix {
    let mut rows: Vec<Vec<f64>> = order.iter().map(|place| commanded.iter().map(|forces| forces[*place]).collect()).collect();
    rows.dedup();
    Matrix::from_fn(rows.len(), commanded.len(), |row, column| rows[row][column])
}

fn state<const A: usize>(z: &[f64], time: f64) -> State<A> {
    State { position: core::array::from_fn(|axis| z[axis]), velocity: core::array::from_fn(|axis| z[A + axis] / time) }
}

fn write<const A: usize>(state: &State<A>, z: &mut [f64], time: f64) {
    for axis in 0..A {
        z[axis] = state.position[axis];
        z[A + axis] = state.velocity[axis] * time;
    }
}

/// Returns numbers of both signs of at most `amplitude` in size, the same at every call. Multiples of an irrational number modulo 1 spread evenly.
fn noise(size: usize, seed: u32, amplitude: f64) -> Vec<f64> {
    const GOLDEN_RATIO: f64 = 0.618_033_988_749_894_9;
    let place = |number: usize| (real(number) + 0.5) * GOLDEN_RATIO * f64::from(seed);
    (0..size).map(|number| amplitude * (2.0 * (place(number) - place(number).floor()) - 1.0)).collect()
}
