//! Frames of copies that are tied by waves.
//!
//! Each two copies i and j have a line with waves sᵢⱼ to either side. Over equal links between equal clocks bodies feel two sums of them alone: those that a
//! copy gets, S = Σⱼ sᵢⱼ, and those that others get of it, P = Σⱼ sⱼᵢ. With forces in place of waves (times ρ), d how far a copy has moved since the last
//! sample, ⟨ ⟩ the mean over the ticks since then, and d̄ the mean of all others,
//!
//! ```text
//! S ← 2·b·d̄/(M·h) − ⟨P⟩        P ← 2·b·d/(M·h) − ⟨S⟩        force on the copy: S − b·v
//! ```
//!
//! All other waves bounce to and fro unfelt with eigenvalues of modulus 1 (see `unseen.rs` of `cohaptic-stability`), and have no part here. Averages of classes
//! and differences within one do not mix; the number of peers counts in d̄ alone. The sums of S and of P over all peers are equal, so that of the averages the
//! P of one class follows from all else; and of two peers every P is the S of the other.
//!
//! Waves carry no position, so that each copy may be anywhere, unless an arm holds its device: positions of a class are counted from its copy.

use std::time::Duration;

use cohaptic_peer::Gains;
use cohaptic_peer::coordination::{Coordination, LawValue};
use cohaptic_scene::Scene;
use cohaptic_stability::Matrix;
use cohaptic_stability::frames::{
    Contacts, Event, LawRow, LinearLaw, Node, NodeClock, NominalNetwork, Scale, Structure, Timetable, UseOfHeld, has_equal_clocks,
};
use cohaptic_stability::numerics::real;

use super::corners::Point;
use super::error::ProofError;
use super::program::{NamedFrame, Operation, Program, Register, Sum};
use super::pushed::{Pushed, copy, coupling, device, moved, negative};

/// Coordination by waves over equal links.
#[derive(Clone, Debug)]
pub(super) struct Waves {
    /// A frame of one node that hears itself: that of every peer.
    line: Timetable,
    /// M.
    every: usize,
    /// M·h \[s\].
    period: f64,
    /// Whether a wave goes on when its ticks are over.
    holds: bool,
    /// For each class, whether an arm ties its copy to ground.
    tied: Vec<bool>,
}

/// The place of the parameter `on-loss`, and that of its word `hold`.
const ON_LOSS: usize = 1;
const HOLD: usize = 1;

impl Waves {
    /// The waves of scenes that differ in numbers only, and the classes of their peers; `None` if they have none.
    pub(super) fn structure(scenes: &[&Scene], network: &NominalNetwork, contacts: &Contacts) -> Result<Option<(Structure, Self)>, ProofError> {
        let scene = scenes[0];
        if !Self::tie(scene) {
            return Ok(None);
        }
        if scene.object.enclosure.is_some() {
            return Err(ProofError::WallLeftOut { strategy: scene.coordination.strategy.name() });
        }
        if !network.is_uniform() || !has_equal_clocks(scene) || scene.peers.iter().any(|peer| peer.phase != scene.peers[0].phase) {
            return Err(ProofError::UnequalWaves);
        }
        let structure = Structure::of_any_law(scenes, network, contacts, |_, _| false)?;
        let clock = NodeClock::of(scene, 0);
        let line = Timetable::with_use_of_held(&[clock], &[(0, 0, network.timing(0, 1).clone())], UseOfHeld::SamplesAndTicks)?;
        let arm = |class: &Vec<usize>| contacts.touching[class[0]] && scenes.iter().any(|scene| scene.device_plant(class[0]).stiffness > 0.0);
        let every = usize::try_from(clock.every).unwrap_or(usize::MAX);
        let on_loss = scene.coordination.settings.of(scene.coordination.strategy).get(ON_LOSS);
        let tied = structure.classes.iter().map(arm).collect();
        let period = real(every) * clock.clock.tick.as_secs_f64();
        Ok(Some((structure, Self { line, every, period, holds: on_loss == LawValue::Word(HOLD), tied })))
    }

    /// The nodes of all classes, whose laws have b as their damping.
    pub(super) fn nodes(structure: &Structure, scene: &Scene) -> Vec<Node> {
        let node = |class: usize| {
            let own = Gains { stiffness: 0.0, damping: scene.own_damping(structure.classes[class][0]) };
            let none = LinearLaw::none();
            structure.node_with(scene, class, LinearLaw { force: LawRow { own, ..none.force.clone() }, ..none })
        };
        (0..structure.classes.len()).map(node).collect()
    }

    /// Whether waves tie the copies of a scene.
    pub(super) fn tie(scene: &Scene) -> bool {
        scene.coordination.strategy == Coordination::Wave
    }

    /// A frame over a box. Weights are those with which classes hear each other, of averages [with shares](with_shares). `ends`: the nodes of the part at the
    /// corners of the box.
    pub(super) fn frame(&self, part: &Part<'_>, points: &[Point], ends: &[Vec<Node>], time: f64) -> Result<NamedFrame, ProofError> {
        let scale = Scale { time, compliance: ends[0][0].compliance(time) };
        let heard = InForce::new(&self.line, self.every, self.holds);
        NamedFrame::of(points, ends, part.apart, scale, |point| Frame { waves: self, part, point, scale, heard: &heard }.program())
    }
}

/// The averages of all classes, or how the members of one differ.
#[derive(Clone, Copy, Debug)]
pub(super) struct Part<'a> {
    pub(super) structure: &'a Structure,
    pub(super) apart: Option<usize>,
    /// The class whose P follows from all else.
    pub(super) rest: usize,
    /// Whether there are two peers.
    pub(super) is_pair: bool,
}

impl<'a> Part<'a> {
    /// For the number of peers that a scene has.
    pub(super) fn of(structure: &'a Structure, apart: Option<usize>) -> Self {
        Self { structure, apart, rest: structure.classes.len() - 1, is_pair: structure.peers == 2 }
    }

    /// The sizes of all classes in units of the size of the class whose P follows.
    pub(super) fn shares(&self) -> Vec<f64> {
        let size = |class: usize| real(self.structure.classes[class].len());
        (0..self.structure.classes.len()).map(|class| size(class) / size(self.rest)).collect()
    }
}

/// The weights of classes, a row for each, and below them the sizes of all classes beside one.
pub(super) fn with_shares(weights: &Matrix, shares: &[f64]) -> Matrix {
    let classes = weights.columns();
    Matrix::from_fn(classes + 1, classes, |row, column| if row < classes { weights[(row, column)] } else { shares[column] })
}

/// The sampling whose waves are in force at each tick.
struct InForce(Vec<Option<i64>>);

impl InForce {
    fn new(line: &Timetable, every: usize, holds: bool) -> Self {
        let mut of = Vec::new();
        // A frame is not shorter than a wave: after one of them all is as in every other.
        let mut newest: Option<(i64, usize)> = None;
        for frame in [-1, 0] {
            of.clear();
            for event in &line.events {
                match *event {
                    Event::Sample { .. } => {}
                    Event::Deliver { sample, .. } => newest = Some((sample, 0)),
                    Event::Tick { .. } => {
                        of.push(newest.filter(|(_, ticks)| holds || *ticks < every).map(|(sample, _)| sample));
                        newest = newest.map(|(sample, ticks)| (sample, ticks + 1));
                    }
                }
            }
            if frame < 0 {
                newest = newest.map(|(sample, ticks)| (sample - whole(line.sent[0]), ticks));
            }
        }
        Self(of)
    }

    /// At a tick that is counted from the beginning of the frame, also before it.
    fn at(&self, tick: i64, sent: usize) -> Option<i64> {
        let ticks = whole(self.0.len()).max(1);
        let place = usize::try_from(tick.rem_euclid(ticks)).unwrap_or(0);
        self.0.get(place).copied().flatten().map(|sample| sample + tick.div_euclid(ticks) * whole(sent))
    }
}

fn whole(number: usize) -> i64 {
    i64::try_from(number).unwrap_or(i64::MAX)
}

/// A frame of a part of a scene with the numbers of a point: nodes of all classes, or of the one whose members differ.
struct Frame<'a> {
    waves: &'a Waves,
    part: &'a Part<'a>,
    point: &'a Point,
    scale: Scale,
    heard: &'a InForce,
}

impl Frame<'_> {
    fn program(&self) -> Program {
        let line = &self.waves.line;
        let (mut tick, mut sample) = (0, 0);
        let mut steps: Vec<Vec<Operation>> = Vec::new();
        for event in &line.events {
            match *event {
                Event::Deliver { .. } => {}
                Event::Sample { .. } => {
                    steps.push(vec![self.sampled(sample, tick)]);
                    sample += 1;
                }
                Event::Tick { span, .. } => {
                    steps.push((0..self.point.nodes.len()).flat_map(|place| self.ticked(place, tick, span)).collect());
                    tick += 1;
                }
            }
        }
        let classes = self.part.structure.classes.len();
        let reference = |class: usize| (!self.waves.tied[class]).then_some(Register::Body { class, of_copy: true, velocity: false });
        Program { steps, sent: vec![line.sent[0]; classes], references: (0..classes).map(reference).collect() }
    }

    /// The class of a node.
    fn class(&self, place: usize) -> usize {
        self.part.apart.unwrap_or(place)
    }

    /// The waves of a sampling that a class gets.
    fn gets(&self, place: usize, number: i64) -> Register {
        Register::Waves { class: self.class(place), number, of_others: false }
    }

    /// Those that others get of it.
    fn others_get(&self, place: usize, number: i64) -> Sum {
        let own = |place: usize| Register::Waves { class: self.class(place), number, of_others: true };
        let places = 0..self.point.nodes.len();
        if self.part.is_pair {
            return places.map(|other| (self.gets(other, number), self.point.weights[(place, other)])).collect();
        }
        if self.part.apart.is_some() || place != self.part.rest {
            return vec![(own(place), 1.0)];
        }
        // Of all averages the sums over all peers are equal.
        let of = |other: usize| {
            let by = self.point.weights[(places.len(), other)];
            [(self.gets(other, number), by), (own(other), -by)]
        };
        places.clone().filter(|other| *other != place).flat_map(of).chain([(self.gets(place, number), 1.0)]).collect()
    }

    /// What a class has moved by since the sampling before, times a factor.
    fn moved(&self, place: usize, number: i64, by: f64) -> [(Register, f64); 2] {
        let class = self.class(place);
        [(copy(class)[0], by), (Register::Sample { class, number: number - 1, velocity: false }, -by)]
    }

    /// A sampling of all classes, before their tick of that number.
    fn sampled(&self, number: i64, tick: i64) -> Operation {
        let places = 0..self.point.nodes.len();
        // The mean over the ticks since the last one, with the other sign.
        let mean = |of: &dyn Fn(i64) -> Sum| -> Sum {
            let in_force = (tick - whole(self.waves.every)..tick).filter_map(|tick| self.heard.at(tick, self.waves.line.sent[0]));
            in_force.flat_map(of).map(|(register, by)| (register, -by / real(self.waves.every))).collect()
        };
        let answer = |place: usize| 2.0 * self.point.nodes[place].law.force.own.damping * self.scale.compliance / self.waves.period;
        let mut set = Vec::new();
        for place in places.clone() {
            let others = places.clone().flat_map(|other| self.moved(other, number, answer(other) * self.point.weights[(place, other)]));
            set.push((self.gets(place, number), others.chain(mean(&|sample| self.others_get(place, sample))).collect()));
            let own = self.moved(place, number, answer(place));
            let class = self.class(place);
            let of_others = Register::Waves { class, number, of_others: true };
            set.push((of_others, own.into_iter().chain(mean(&|sample| vec![(self.gets(place, sample), 1.0)])).collect()));
            set.push((Register::Sample { class, number, velocity: false }, vec![(copy(class)[0], 1.0)]));
        }
        set
    }

    fn ticked(&self, place: usize, tick: i64, span: Duration) -> Vec<Operation> {
        let (node, class) = (&self.point.nodes[place], self.class(place));
        let grasp = node.device.map(|_| coupling(node.coupling, Some(device(class)), Some(copy(class)), self.scale));
        let waves = self.heard.at(tick, self.waves.line.sent[0]).map(|number| (self.gets(place, number), 1.0));
        let on_copy = grasp.iter().flatten().copied().chain(waves).collect();
        let on_device = node.device.zip(grasp).map(|(device, force)| Pushed { body: device, is_copy: false, force: negative(force) });
        let bodies: Vec<Pushed> = [Pushed { body: node.object, is_copy: true, force: on_copy }].into_iter().chain(on_device).collect();
        moved(class, &bodies, node.compute_delay, span, self.scale)
    }
}
