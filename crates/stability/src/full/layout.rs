//! The layout of all peers' states in a vector: device, copy, pending forces, memory and person of each peer, then the samples of earlier frames.

use cohaptic_peer::wire::SampleKind;
use cohaptic_peer::{Exchange, Peer, SimulatedDevice, Strategy};
use cohaptic_scene::Scene;

use super::person::Person;
use crate::structure::Contacts;
use crate::timetable::Timetable;
use crate::{StateKind, StateName};

/// A peer whose device is simulated.
pub(super) type Member<const A: usize, S> = Peer<A, SimulatedDevice<A>, S>;

/// Offsets and numbers of the states of each peer. Every `Vec` but `loose` is indexed by peer.
pub(super) struct Layout {
    /// Index of the first state of each peer.
    pub(super) first: Vec<usize>,
    pub(super) touching: Vec<bool>,
    /// Number of numbers that the strategy of each peer remembers.
    pub(super) memory: Vec<usize>,
    /// Number of states of the person who holds the device of each peer; 0 without a person.
    pub(super) people: Vec<usize>,
    /// `true` if each peer has computed forces that wait to be applied, as with a compute delay.
    pub(super) pending: Vec<bool>,
    /// Exchanges with the device of each peer; at each tick for a device that touches nothing.
    pub(super) exchange: Vec<Exchange>,
    /// Index of the newest sample of earlier frames of each peer; older samples follow.
    pub(super) samples: Vec<usize>,
    /// Number of receivers for which a sample carries extra numbers.
    pub(super) receivers: usize,
    /// `true` if the extra numbers are waves.
    pub(super) has_waves: bool,
    pub(super) size: usize,
    /// Indices of states on which nothing depends: positions of devices that touch nothing and have no arm.
    pub(super) loose: Vec<usize>,
    /// Indices of states of persons on which nothing depends: the wanted places of arms without a spring.
    pub(super) unfelt: Vec<usize>,
    /// `true` if something ties the copy of each peer to ground.
    pub(super) tied: Vec<bool>,
}

impl Layout {
    pub(super) fn new<const A: usize, S: Strategy<A>>(
        scene: &Scene,
        contacts: &Contacts,
        members: &[Member<A, S>],
        people: &[Option<Person<A>>],
        timetable: &Timetable,
        tied: Vec<bool>,
    ) -> Self {
        let mut layout = Self {
            first: Vec::new(),
            touching: contacts.touching.clone(),
            memory: Vec::new(),
            people: people.iter().map(|person| person.as_ref().map_or(0, Person::states)).collect(),
            pending: Vec::new(),
            exchange: Vec::new(),
            samples: Vec::new(),
            receivers: if members.iter().any(|member| member.kind().is_personal()) { members.len() - 1 } else { 0 },
            has_waves: members.iter().any(|member| member.kind() == SampleKind::Wave),
            size: 0,
            loose: Vec::new(),
            unfelt: Vec::new(),
            tied,
        };
        for (place, member) in members.iter().enumerate() {
            let (pending, memory) = (scene.peers[place].compute_delay, member.strategy().memory().len());
            layout.first.push(layout.size);
            layout.pending.push(pending);
            layout.exchange.push(if contacts.touching[place] { scene.peers[place].exchange } else { Exchange::EACH_TICK });
            layout.memory.push(memory);
            if !contacts.touching[place] && scene.device_plant(place).stiffness == 0.0 {
                layout.loose.extend((0..A).map(|axis| layout.size + axis));
            }
            layout.size += layout.before_memory::<A>(place) + memory;
            if people[place].as_ref().is_some_and(Person::is_limp) {
                layout.unfelt.extend((0..A).map(|axis| layout.size + axis));
            }
            layout.size += layout.people[place];
        }
        for depth in &timetable.depth {
            layout.samples.push(layout.size);
            layout.size += depth * layout.sample_len::<A>();
        }
        layout
    }

    /// Returns the number of states of a peer before the memory of its strategy: of its bodies, of pending forces, and of the exchanges with its device.
    fn before_memory<const A: usize>(&self, place: usize) -> usize {
        let Exchange { late, .. } = self.exchange[place];
        let exchange = if late { 2 * A } else { 0 } + if self.exchange[place].holds() { 3 * A } else { 0 };
        4 * A + if self.pending[place] { 2 * A } else { 0 } + exchange
    }

    /// Returns the indices of states that hold a position of the device of a peer along an axis.
    pub(super) fn positions_of_device<const A: usize>(&self, place: usize, axis: usize) -> impl Iterator<Item = usize> {
        let first = self.first[place];
        let next = first + 4 * A + if self.pending[place] { 2 * A } else { 0 };
        let exchange = self.exchange[place];
        let latest = exchange.late.then_some(next);
        let reading = exchange.holds().then_some(next + if exchange.late { 2 * A } else { 0 });
        std::iter::once(first).chain(latest).chain(reading).map(move |first| first + axis)
    }

    /// Returns the range of states that hold the memory of a peer's strategy.
    pub(super) fn memory_of<const A: usize>(&self, place: usize) -> std::ops::Range<usize> {
        let first = self.first[place] + self.before_memory::<A>(place);
        first..first + self.memory[place]
    }

    /// Returns the number of states of a sample: position, velocity, and extra numbers for each receiver, along each axis.
    pub(super) const fn sample_len<const A: usize>(&self) -> usize {
        (2 + self.receivers) * A
    }

    /// Returns the name of every state, in the order of the vector. `depth` is the number of samples of earlier frames, indexed by peer.
    pub(super) fn names<const A: usize>(&self, depth: &[usize]) -> Vec<StateName> {
        let mut names = Vec::with_capacity(self.size);
        for peer in 0..self.first.len() {
            let kinds: [fn(usize) -> StateKind; 6] = [
                |axis| StateKind::DevicePosition { axis },
                |axis| StateKind::DeviceVelocity { axis },
                |axis| StateKind::ObjectPosition { axis },
                |axis| StateKind::ObjectVelocity { axis },
                |axis| StateKind::PendingCoupling { axis },
                |axis| StateKind::PendingForce { axis },
            ];
            let count = if self.pending[peer] { 6 } else { 4 };
            names.extend(kinds.iter().take(count).flat_map(|kind| (0..A).map(move |axis| StateName { peer, kind: kind(axis) })));
            let exchange = self.exchange[peer];
            let latest: [fn(usize) -> StateKind; 2] = [|axis| StateKind::LatestPosition { axis }, |axis| StateKind::LatestVelocity { axis }];
            let kept: [fn(usize) -> StateKind; 3] =
                [|axis| StateKind::ReadingPosition { axis }, |axis| StateKind::ReadingVelocity { axis }, |axis| StateKind::KeptCoupling { axis }];
            let latest = latest.iter().filter(|_| exchange.late);
            let kinds = latest.chain(kept.iter().filter(|_| exchange.holds()));
            names.extend(kinds.flat_map(|kind| (0..A).map(move |axis| StateName { peer, kind: kind(axis) })));
            names.extend((0..self.memory[peer]).map(|number| StateName { peer, kind: StateKind::Memory { number } }));
            let places = (0..self.people[peer] / A).flat_map(|age| (0..A).map(move |axis| (axis, age)));
            let kind = |axis, age| if age == 0 { StateKind::WantedPosition { axis } } else { StateKind::SeenPosition { axis, age } };
            names.extend(places.map(|(axis, age)| StateName { peer, kind: kind(axis, age) }));
        }
        for (peer, depth) in depth.iter().enumerate() {
            for age in 1..=*depth {
                names.extend((0..A).map(|axis| StateName { peer, kind: StateKind::SamplePosition { axis, age } }));
                names.extend((0..A).map(|axis| StateName { peer, kind: StateKind::SampleVelocity { axis, age } }));
                let extras = (0..self.receivers).flat_map(|other| (0..A).map(move |axis| (if other < peer { other } else { other + 1 }, axis)));
                let kind = |axis, receiver| {
                    if self.has_waves { StateKind::SampleWave { axis, age, receiver } } else { StateKind::SampleForce { axis, age, receiver } }
                };
                names.extend(extras.map(|(receiver, axis)| StateName { peer, kind: kind(axis, receiver) }));
            }
        }
        names
    }

    /// Returns the peer to which the state at index `place` belongs.
    pub(super) fn owner(&self, place: usize) -> usize {
        let firsts = if self.samples.first().is_some_and(|first| place >= *first) { &self.samples } else { &self.first };
        firsts.partition_point(|first| *first <= place).saturating_sub(1)
    }
}
