//! Frames of copies tied by waves.
//!
//! Each pair of copies i and j has a line with waves sᵢⱼ in either direction. Over equal links between equal clocks only two sums of waves act on bodies: the
//! waves to a copy, S = Σⱼ sᵢⱼ, and the waves from the copy to all other copies, P = Σⱼ sⱼᵢ. Waves are written as forces (times ρ). Let d be the
//! motion of a copy since the last sample, ⟨ ⟩ the mean over the ticks since then, and d̄ the mean of d over all other copies. Then
//!
//! ```text
//! S ← 2·b·d̄/(M·h) − ⟨P⟩        P ← 2·b·d/(M·h) − ⟨S⟩        force on the copy: S − b·v
//! ```
//!
//! All other combinations of waves are reflected for ever with eigenvalues of modulus 1, without an effect on bodies (see `unseen.rs` of `cohaptic-stability`).
//! Such combinations are left out here. Averages of classes and differences within a class do not mix, and the number of peers enters d̄ only. The sums of S
//! and of P over all peers are equal, so in the averages the P of one class follows from all other sums. With two peers every P is the S of the other peer.
//!
//! Waves carry no position, so a copy may be anywhere unless an arm holds its device. Positions of a class are therefore counted from its copy.

use std::time::Duration;

use cohaptic_peer::coordination::LawValue;
use cohaptic_peer::{Coordination, Gains};
use cohaptic_scene::Scene;
use cohaptic_stability::Matrix;
use cohaptic_stability::frames::{
    Contacts, Event, LawRow, LinearLaw, Node, NodeClock, NominalNetwork, Scale, Structure, Timetable, UseOfHeld, has_equal_clocks,
    refuse_slow_devices,
};
use cohaptic_stability::numerics::real;

use super::corners::Point;
use super::error::ProofError;
use super::program::{NamedFrame, Operation, Program, Register, Sum};
use super::pushed::{Pushed, copy, coupling, device, moved, negative};

/// Coordination by waves over equal links between equal clocks.
#[derive(Clone, Debug)]
pub(super) struct Waves {
    /// Frame of one node hearing itself, equal to the frame of every peer.
    line: Timetable,
    /// Number M of ticks from one sample to the next.
    every: usize,
    /// Time M·h from one sample to the next \[s\].
    period: f64,
    /// `true` if a wave stays in force after its M ticks until another wave arrives.
    holds: bool,
    /// `true` if an arm ties the copy of a class to ground, indexed by class.
    tied: Vec<bool>,
}

/// Place of the parameter `on-loss` among the parameters of the coordination; `HOLD` is the place of the word `hold` among its words.
const ON_LOSS: usize = 1;
const HOLD: usize = 1;

impl Waves {
    /// Returns the waves of scenes with different numbers, and the classes of the peers of these scenes; `None` if no waves tie the copies.
    pub(super) fn structure(scenes: &[&Scene], network: &NominalNetwork, contacts: &Contacts) -> Result<Option<(Structure, Self)>, ProofError> {
        let scene = scenes[0];
        if !Self::tie(scene) {
            return Ok(None);
        }
        refuse_slow_devices(scene, "a proof of wave coordination")?;
        if scene.object.enclosure.is_some() {
            return Err(ProofError::WallLeftOut { strategy: scene.coordination.strategy.name() });
        }
        // Only equal links and clocks leave two sums of waves. Unequal links would tell the lines of a copy apart.
        if !network.is_uniform() || !has_equal_clocks(scene) || scene.peers.iter().any(|peer| peer.phase != scene.peers[0].phase) {
            return Err(ProofError::UnequalWaves);
        }
        let structure = Structure::of_any_law(scenes, network, contacts, |_, _| false)?;
        let clock = NodeClock::of(scene, 0);
        let line = Timetable::with_use_of_held(&[clock], &[(0, 0, network.timing(0, 1).clone())], UseOfHeld::SamplesAndTicks)?;
        // Any scene of the box may have an arm, and a class tied in one scene has no free position to measure from.
        let arm = |class: &Vec<usize>| contacts.touching[class[0]] && scenes.iter().any(|scene| scene.device_plant(class[0]).stiffness > 0.0);
        let every = usize::try_from(clock.every).unwrap_or(usize::MAX);
        let on_loss = scene.coordination.settings.of(scene.coordination.strategy).get(ON_LOSS);
        let tied = structure.classes.iter().map(arm).collect();
        let period = real(every) * clock.clock.tick.as_secs_f64();
        Ok(Some((structure, Self { line, every, period, holds: on_loss == LawValue::Word(HOLD), tied })))
    }

    /// Returns the node of each class, with the damping b of the wave lines as its law.
    pub(super) fn nodes(structure: &Structure, scene: &Scene) -> Vec<Node> {
        let node = |class: usize| {
            let own = Gains { stiffness: 0.0, damping: scene.own_damping(structure.classes[class][0]) };
            let none = LinearLaw::none();
            structure.node_with(scene, class, LinearLaw { force: LawRow { own, ..none.force.clone() }, ..none })
        };
        (0..structure.classes.len()).map(node).collect()
    }

    /// Returns whether waves tie the copies of a scene.
    pub(super) fn tie(scene: &Scene) -> bool {
        scene.coordination.strategy == Coordination::Wave
    }

    /// Returns a frame over a box. The weights of `points` are the weights of the heard classes, for averages [with shares](with_shares). `ends`:
    /// the nodes of the part at the corners of the box.
    pub(super) fn frame(&self, part: &Part<'_>, points: &[Point], ends: &[Vec<Node>], time: f64) -> Result<NamedFrame, ProofError> {
        let scale = Scale { time, compliance: ends[0][0].compliance(time) };
        let heard = InForce::new(&self.line, self.every, self.holds);
        NamedFrame::of(points, ends, part.apart, scale, |point| Frame { waves: self, part, point, scale, heard: &heard }.program())
    }
}

/// Part of the motion: the averages of all classes, or the differences between the members of the class `apart`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Part<'a> {
    pub(super) structure: &'a Structure,
    pub(super) apart: Option<usize>,
    /// Class whose P follows from all other sums.
    pub(super) rest: usize,
    /// `true` if the scene has exactly two peers, and every P is the S of the other peer.
    pub(super) is_pair: bool,
}

impl<'a> Part<'a> {
    /// Returns the part for the number of peers of the scene.
    pub(super) fn of(structure: &'a Structure, apart: Option<usize>) -> Self {
        Self { structure, apart, rest: structure.classes.len() - 1, is_pair: structure.peers == 2 }
    }

    /// Returns the size of each class divided by the size of the class `rest`.
    pub(super) fn shares(&self) -> Vec<f64> {
        let size = |class: usize| real(self.structure.classes[class].len());
        (0..self.structure.classes.len()).map(|class| size(class) / size(self.rest)).collect()
    }
}

/// Returns the weights of classes, one row per class, with the sizes of all classes relative to one class as a last row.
pub(super) fn with_shares(weights: &Matrix, shares: &[f64]) -> Matrix {
    let classes = weights.columns();
    Matrix::from_fn(classes + 1, classes, |row, column| if row < classes { weights[(row, column)] } else { shares[column] })
}

/// Number of the sampling with its waves in force, indexed by tick of the frame; `None` if no waves are in force.
struct InForce(Vec<Option<i64>>);

impl InForce {
    fn new(line: &Timetable, every: usize, holds: bool) -> Self {
        let mut of = Vec::new();
        // A frame is not shorter than a wave, so the state after one frame is the state after every frame.
        let mut newest: Option<(i64, usize)> = None;
        for frame in [-1, 0] {
            of.clear();
            for event in &line.events {
                match *event {
                    Event::Sample { .. } => {}
                    Event::Deliver { sample, .. } => newest = Some((sample, 0)),
                    Event::Tick { .. } => {
                        // A wave drives for M ticks. With `hold` the last wave drives on until the next wave arrives.
                        of.push(newest.filter(|(_, ticks)| holds || *ticks < every).map(|(sample, _)| sample));
                        newest = newest.map(|(sample, ticks)| (sample, ticks + 1));
                    }
                }
            }
            if frame < 0 {
                // The pass before counts samples from its own frame, which began one frame earlier.
                newest = newest.map(|(sample, ticks)| (sample - whole(line.sent[0]), ticks));
            }
        }
        Self(of)
    }

    /// Returns the number of the sampling in force at a tick. Ticks and samplings are counted from the beginning of the frame and are negative before it.
    fn at(&self, tick: i64, sent: usize) -> Option<i64> {
        let ticks = whole(self.0.len()).max(1);
        let place = usize::try_from(tick.rem_euclid(ticks)).unwrap_or(0);
        self.0.get(place).copied().flatten().map(|sample| sample + tick.div_euclid(ticks) * whole(sent))
    }
}

fn whole(number: usize) -> i64 {
    i64::try_from(number).unwrap_or(i64::MAX)
}

/// Frame of a part of a scene at a point, with the nodes of all classes, or for differences with the node of their class.
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
                    // Equal clocks: all classes tick at the same instant, as one step.
                    steps.push((0..self.point.nodes.len()).flat_map(|place| self.ticked(place, tick, span)).collect());
                    tick += 1;
                }
            }
        }
        let classes = self.part.structure.classes.len();
        let reference = |class: usize| (!self.waves.tied[class]).then_some(Register::Body { class, of_copy: true, velocity: false });
        Program { steps, sent: vec![line.sent[0]; classes], references: (0..classes).map(reference).collect() }
    }

    /// Returns the class of the node at a place of the part.
    fn class(&self, place: usize) -> usize {
        self.part.apart.unwrap_or(place)
    }

    /// Returns the register of S, the waves of a sampling to a class.
    fn gets(&self, place: usize, number: i64) -> Register {
        Register::Waves { class: self.class(place), number, of_others: false }
    }

    /// Returns P, the waves of a sampling from a class to all other peers, as a sum of registers.
    fn others_get(&self, place: usize, number: i64) -> Sum {
        let own = |place: usize| Register::Waves { class: self.class(place), number, of_others: true };
        let places = 0..self.point.nodes.len();
        if self.part.is_pair {
            return places.map(|other| (self.gets(other, number), self.point.weights[(place, other)])).collect();
        }
        if self.part.apart.is_some() || place != self.part.rest {
            return vec![(own(place), 1.0)];
        }
        // The sums of S and of P over all peers are equal. The equality gives the P of the last class.
        let of = |other: usize| {
            let by = self.point.weights[(places.len(), other)];
            [(self.gets(other, number), by), (own(other), -by)]
        };
        places.clone().filter(|other| *other != place).flat_map(of).chain([(self.gets(place, number), 1.0)]).collect()
    }

    /// Returns the motion of a class since the sampling before `number`, times a factor.
    fn moved(&self, place: usize, number: i64, by: f64) -> [(Register, f64); 2] {
        let class = self.class(place);
        [(copy(class)[0], by), (Register::Sample { class, number: number - 1, velocity: false }, -by)]
    }

    /// Returns the operation of taking sampling `number` of all classes, before the tick with the number `tick` of the classes.
    fn sampled(&self, number: i64, tick: i64) -> Operation {
        let places = 0..self.point.nodes.len();
        // Negative mean over the M ticks since the last sampling, −⟨ ⟩.
        let mean = |of: &dyn Fn(i64) -> Sum| -> Sum {
            let in_force = (tick - whole(self.waves.every)..tick).filter_map(|tick| self.heard.at(tick, self.waves.line.sent[0]));
            in_force.flat_map(of).map(|(register, by)| (register, -by / real(self.waves.every))).collect()
        };
        // The factor 2·b/(M·h) of the module head, with forces as lengths.
        let answer = |place: usize| 2.0 * self.point.nodes[place].law.force.own.damping * self.scale.compliance / self.waves.period;
        let mut set = Vec::new();
        for place in places.clone() {
            // All sums of the operation read the values from before, so S and P of a sampling may refer to each other's older samplings.
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
