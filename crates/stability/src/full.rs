//! The general path: unit vectors pushed through the code that simulates.
//!
//! Real [`Peer`]s with real strategies are put into a state, stepped through one frame of the timetable, and looked at. Whatever strategy they run is
//! analysed so, as long as it is linear; one that is not, or that depends on more than it shows, is found out and refused.

mod layout;
mod rigid;

use std::time::Duration;

use cohaptic_peer::coordination::Role;
use cohaptic_peer::wire::SampleKind;
use cohaptic_peer::{Acting, Contact, Device as _, Gains, Hand, Held, ObjectCopy, Peer, Signal, SimulatedDevice, State, Strategy};
use cohaptic_scene::{Scene, Strategies};
use cohaptic_units::Instant;

use self::layout::{Layout, Member};
use crate::cost::{PartCost, pushed_operations};
use crate::lifted::majorant::error_of;
use crate::lifted::{Body, Lifted, Node, closer_of};
use crate::network::{LinkTiming, NominalNetwork};
use crate::rounding::real;
use crate::structure::{Contacts, Structure, common_time, has_one_drift, linear_law};
use crate::timetable::{Event, Instants, NodeClock, Timetable, UseOfHeld};
use crate::unseen::felt;
use crate::{AnalysisError, Matrix, StateName, Watch};

/// What the general path finds: the matrix of one frame in relative coordinates.
#[derive(Clone, PartialEq, Debug)]
pub struct FullMap {
    pub(crate) monodromy: Matrix,
    /// A bound of the error of its entries, in the largest sum of sizes of a row.
    pub(crate) error: f64,
    pub(crate) rigid_modes: usize,
    pub(crate) frame: Duration,
    /// What the rows and columns are.
    pub(crate) states: Vec<StateName>,
    /// What velocities are multiplied by \[s\].
    pub(crate) time: f64,
    /// For each peer and axis, whose copy positions are relative to.
    pub(crate) relative: Vec<Vec<Option<usize>>>,
    /// What the states add to the forces that strategies command in the frame, a row for each of them; `None` where samples carry no waves.
    pub(crate) forces: Option<Matrix>,
}

impl FullMap {
    /// The part of the matrix that bodies feel, and the bound of the error of its entries.
    pub fn felt(self) -> (Matrix, f64) {
        let Some(forces) = &self.forces else { return (self.monodromy, self.error) };
        let (felt, rounded) = felt(&self.monodromy, forces, &self.states);
        (felt, self.error + rounded)
    }
}

/// The facts about a strategy that are known before anything is pushed.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Trust {
    /// One of this workspace: linear by its tests. Looking again would push a quarter as many vectors more.
    Linear,
    /// Nothing: it is looked at.
    Nothing,
}

/// Pushes every unit vector of a scene through a frame, along this number of axes.
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
    match axes {
        1 => full::<1, _>(scene, network, contacts, trust, watch, |peer| strategies.strategy(scene, peer)),
        2 => full::<2, _>(scene, network, contacts, trust, watch, |peer| strategies.strategy(scene, peer)),
        _ => full::<3, _>(scene, network, contacts, trust, watch, |peer| strategies.strategy(scene, peer)),
    }
}

/// Pushes every unit vector through a frame of the scene, along A axes.
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
    let mut map = pusher.map(watch)?;
    if trust == Trust::Linear && linear_law(scene, 0).is_some_and(|law| law.pull().is_some()) {
        let nodes = Structure::of_each(scene, network, contacts)?;
        map.error = closer_of(map.error, || error_of_known(scene, &nodes, map.time));
    }
    Ok(map)
}

/// A bound of the errors of what real peers made of unit vectors, for a strategy whose numbers are known: each peer does what its node would.
fn error_of_known(scene: &Scene, structure: &Structure, time: f64) -> f64 {
    let node = |peer: usize| {
        let mut node = structure.node(scene, peer);
        if node.device.is_none() {
            // A device that touches nothing moves on its own, and is pushed with the others.
            let spec = &scene.peers[peer];
            node.device = Some(Body::new(scene.device_plant(peer), scene.integrator, &spec.clock));
            node.coupling = Gains { stiffness: 0.0, damping: 0.0 };
        }
        node
    };
    let nodes: Vec<Node> = (0..scene.peers.len()).map(node).collect();
    let lifted = Lifted { time, ..structure.quotient(scene, &nodes) };
    error_of(&lifted, |peer| compliance(scene, peer, time))
}

/// What the forces of a peer are multiplied by to be lengths [m/N].
fn compliance(scene: &Scene, peer: usize, time: f64) -> f64 {
    time * scene.peers[peer].clock.tick.as_secs_f64() / scene.copy_mass()
}

/// Time that a clock without an offset shows when a frame begins, so that samples of the frames before were sent at instants too.
const EARLIER: Instant = Instant::from_nanos(1 << 60);

/// The peers, and where their states stand in a vector.
struct Pusher<const A: usize, S> {
    members: Vec<Member<A, S>>,
    names: Vec<String>,
    timetable: Timetable,
    instants: Instants,
    layout: Layout,
    /// What velocities \[s\] and forces [m/N] are multiplied by; and the extra numbers of samples, and what strategies remember.
    time: f64,
    compliance: Vec<f64>,
    extra: Vec<f64>,
    remembered: f64,
    /// The samples of each peer: those of earlier frames, oldest first, then those of this one.
    samples: Vec<Vec<State<A>>>,
    /// The extra numbers of each of them, for each other peer; none where samples are states alone.
    extras: Vec<Vec<[f64; A]>>,
    kind: SampleKind,
    /// The forces that strategies command in the frame, tick by tick, where samples carry waves.
    commanded: Vec<f64>,
    /// The largest number seen on the way of the unit vectors, for the bound of errors.
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
        // A position and a velocity of each sample on the way, along each axis: known before there is room for any.
        PartCost::of_eigenvalues(2 * A * timetable.depth.iter().sum::<usize>()).allowed(watch)?;
        let member = |place: usize| {
            let spec = &scene.peers[place];
            let mut config = scene.peer_config(place);
            config.contact = if contacts.touching[place] { Contact::Grasp } else { Contact::None };
            config.enclosure = None;
            // The hand's force moves the device about and has no part in how it moves on its own; the arm has.
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
        let arm = |place: usize| contacts.touching[place] && scene.device_plant(place).stiffness > 0.0;
        // Waves carry no position: each copy may be anywhere, but for what holds its own device.
        let tied = |place: usize| if kind == SampleKind::Wave { arm(place) } else { silent || (0..peers).any(arm) };
        let tied = (0..peers).map(tied).collect();
        let layout = Layout::new(scene, contacts, &members, &timetable, tied);
        let touching = contacts.touching.iter().copied().enumerate();
        let time = common_time(scene, timetable.frame, linear_law(scene, 0).map_or(scene.coordination.gains, |law| law.held_by()), touching, false);
        let compliance: Vec<f64> = (0..peers).map(|peer| compliance(scene, peer, time)).collect();
        // A wave of 1 √W against a line of 1 N·s/m gives √2 N: what that moves a copy by from one sample to the next, at a velocity of a wave.
        let wave = scene.coordination.update.as_secs_f64() * (time / scene.copy_mass()).sqrt();
        let (extra, remembered) = if kind == SampleKind::Wave { (vec![wave; peers], wave) } else { (compliance.clone(), 1.0) };
        let names = scene.peers.iter().map(|peer| peer.name.clone()).collect();
        let instants = Instants::of(&timetable);
        Ok(Self {
            samples: vec![Vec::new(); peers],
            extras: vec![Vec::new(); peers],
            instants,
            members,
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

    /// The matrix, vector by vector.
    fn map(mut self, watch: &dyn Watch) -> Result<FullMap, AnalysisError> {
        let size = self.layout.size;
        let events = self.timetable.events.len();
        PartCost::of_full(size, events, A).begin(watch)?;
        let rest = self.pushed(&vec![0.0; size], Instant::ZERO);
        let free = self.free_translations(&rest);
        // Relative to the copies of reference, and without what nothing depends on.
        let kept: Vec<usize> =
            (0..size).filter(|state| free.iter().all(|free| free.reference != *state) && !self.layout.loose.contains(state)).collect();
        let mut monodromy = Matrix::zeros(kept.len(), kept.len());
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
        // As for the lifted system: each tick rounds, and the rest of the frame magnifies that by at most about the growth.
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

    /// The places of the commanded forces, in the order of peers, axes and ticks.
    fn order_of_forces(&self) -> Vec<usize> {
        let ticks = self.timetable.events.iter().filter_map(|event| if let Event::Tick { node, .. } = event { Some(*node) } else { None });
        let mut order: Vec<(usize, usize, usize)> =
            ticks.flat_map(|node| (0..A).map(move |axis| (node, axis))).enumerate().map(|(place, (node, axis))| (node, axis, place)).collect();
        order.sort_unstable();
        order.into_iter().map(|(.., place)| place).collect()
    }

    /// Refuses a strategy that is not linear, or that depends on more than the state it shows.
    fn check(&mut self) -> Result<(), AnalysisError> {
        let size = self.layout.size;
        let rest = self.pushed(&vec![0.0; size], Instant::ZERO);
        self.growth = 0.0;
        let later = Instant::ZERO.saturating_add(self.timetable.frame).saturating_add(self.timetable.frame);
        let relative = |reached: Vec<f64>| -> Vec<f64> { reached.iter().zip(&rest).map(|(reached, rest)| reached - rest).collect() };
        // Small, middling and large, and each against the others, so that a dead band and a limit are both seen.
        let mut small: Option<Vec<f64>> = None;
        for amplitude in [1e-6, 1e-2, 10.0] {
            let (one, other) = (noise(size, 1, amplitude), noise(size, 2, amplitude));
            let both: Vec<f64> = one.iter().zip(&other).map(|(one, other)| one - 2.0 * other).collect();
            let reached_one = self.pushed(&one, Instant::ZERO);
            if self.pushed(&one, later) != reached_one {
                return Err(AnalysisError::Remembers);
            }
            let (reached_one, reached_other, reached_both) =
                (relative(reached_one), relative(self.pushed(&other, Instant::ZERO)), relative(self.pushed(&both, Instant::ZERO)));
            let scale = [&reached_one, &reached_other, &rest].into_iter().flatten().fold(amplitude, |largest: f64, entry| largest.max(entry.abs()));
            let unit: Vec<f64> = reached_one.iter().map(|entry| entry / amplitude).collect();
            let small = small.get_or_insert_with(|| unit.clone());
            // Of the small one, few digits may be left next to a constant force.
            let homogeneous = |place: usize| (unit[place] - small[place]).abs() * amplitude * 1e-3;
            let apart = |place: usize| (reached_one[place] - 2.0 * reached_other[place] - reached_both[place]).abs().max(homogeneous(place));
            let limit = 1e-9 * scale.max(self.growth);
            if let Some(place) = (0..size).find(|place| apart(*place).is_nan() || apart(*place) > limit) {
                return Err(AnalysisError::NotLinear { peer: self.names[self.layout.owner(place)].clone() });
            }
        }
        Ok(())
    }

    /// Where one frame from the state `z` leads, beginning at `begin`.
    fn pushed(&mut self, z: &[f64], begin: Instant) -> Vec<f64> {
        let mut reached = vec![0.0; z.len()];
        self.push(z, begin, &mut reached);
        reached
    }

    /// The same, written over `reached`.
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
                Event::Tick { node, at, span } => {
                    let now = begin.saturating_add_nanos(at);
                    let member = &mut self.members[node];
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

    /// A peer samples.
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

    /// A peer holds a sample of another; whether its strategy is handed what the sample carries beyond the state.
    fn hold(&mut self, (to, from, sample): (usize, usize, i64), begin_local: Instant, accepts: bool) {
        let state = *self.sample(from, sample);
        let after = self.instants.local(from, self.instants.sent_at(from, sample, self.timetable.frame));
        let sent = Instant::from_nanos(begin_local.as_nanos().saturating_add_signed(after));
        let among_others = |one: usize, other: usize| if one < other { one } else { one - 1 };
        self.members[to].hold(among_others(from, to), sent, state);
        if self.layout.receivers > 0 && accepts {
            let extra = self.extras[from][self.sample_place(from, sample) * self.layout.receivers + among_others(to, from)];
            self.members[to].strategy_mut().accept(among_others(from, to), &extra);
        }
    }

    /// The sample with that number: from 0 if it is of this frame.
    fn sample(&self, from: usize, number: i64) -> &State<A> {
        &self.samples[from][self.sample_place(from, number)]
    }

    /// Where that sample is kept.
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
            let memory: Vec<f64> = z[next..next + layout.memory[place]].iter().map(|number| number / self.remembered).collect();
            member.strategy_mut().set_memory(&memory);
            // Kept with the oldest first, so that a sample's place follows from its number.
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
            // A strategy that shows what it remembers has it back already.
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
        for (entry, number) in z[next..next + layout.memory[place]].iter_mut().zip(member.strategy().memory()) {
            *entry = number * self.remembered;
        }
        let receivers = layout.receivers;
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

/// A row for each of the forces, in that order, with a column for each state; of equal ones in a row the first.
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

/// Numbers of either sign up to `amplitude` in size, always the same ones: multiples of an irrational number, which spread evenly.
fn noise(size: usize, seed: u32, amplitude: f64) -> Vec<f64> {
    const GOLDEN_RATIO: f64 = 0.618_033_988_749_894_9;
    let place = |number: usize| (real(number) + 0.5) * GOLDEN_RATIO * f64::from(seed);
    (0..size).map(|number| amplitude * (2.0 * (place(number) - place(number).floor()) - 1.0)).collect()
}
