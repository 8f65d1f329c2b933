//! Frames of laws whose samples carry more than a state: waves between copies, and a server with its clients.
//!
//! As for other laws, averages of classes of equal peers and differences within a class do not mix. Forces, and what lines carry, are counted as lengths: multiplied by the compliance of a copy.
//!
//! **Waves.** Each line between two copies carries forces f = ρ·s, with ρ² = 2·b/(N − 1). On average over the lines from class a to class b, times N − 1, a sample carries φ = 2·b·(x − x at the last sample)/(M·h) − (Σ φ of the other way)/M, and a copy of a gets Σ w(a, b)·φ, with the
//! weights w of the others' average. A member that differs from its class gets S from the lines of each class and sends P into them: P ← w(a, b)·2·b·Δx/(M·h) − ⟨S⟩ and S ← −⟨P⟩, and −2·b·ν·Δx/(M·h) more of its own class, ν = 1/(N − 1). Of two members P = −S. All other motions of waves add up to nothing at
//! every copy, so that no body feels them.
//!
//! **A server.** Its clients send what their devices do, and get the forces of their couplings or the object. Of differences within a class of clients the server feels nothing.

use cohaptic_peer::Gains;
use cohaptic_peer::coordination::{Coordination, LawValue};
use cohaptic_scene::Scene;

use super::ProofError;
use super::corners::{Point, States, enclosed};
use super::heard::{Heard, whole};
use super::program::{Displacement, Operation, Program, Register, Sum};
use super::span::StepSpan;
use crate::lifted::Node;
use crate::lifted::node::{Body, Scale};
use crate::linear_form::LinearLaw;
use crate::network::NominalNetwork;
use crate::structure::{Contacts, Structure, count};
use crate::timetable::{Event, Timetable};
use crate::{AnalysisError, Matrix};

/// A law whose samples carry more than a state.
#[derive(Clone, Debug)]
pub(super) enum SampledLaw {
    /// Waves, which end after that number of ticks of each class, by its class, unless they are held; between two samples a copy of a class has as many.
    Waves { every: Vec<u64>, holds: bool, update: f64 },
    /// A server in a class of its own, which returns forces or the object.
    Server { class: usize, returns_forces: bool },
}

impl SampledLaw {
    /// The law of scenes that differ in numbers only, and their classes; `None` if samples carry states alone.
    pub(super) fn structure(scenes: &[&Scene], network: &NominalNetwork, contacts: &Contacts) -> Result<Option<(Structure, Self)>, ProofError> {
        let scene = scenes[0];
        let coordination = &scene.coordination;
        let word = |place: usize| coordination.settings.of(coordination.strategy).get(place);
        // Frames of waves are written down below; no reference has confirmed a proof of one yet, so that none is given.
        if coordination.strategy == Coordination::Wave {
            return Err(AnalysisError::OtherStrategy { strategy: coordination.strategy.name() }.into());
        }
        match coordination.strategy {
            Coordination::Wave => {
                let structure = Structure::of_any_law(scenes, network, contacts, |_, _| false)?;
                if structure.classes.len() > MOST_KINDS {
                    return Err(ProofError::KindsOfPeers { kinds: structure.classes.len() });
                }
                if scenes.iter().any(|scene| scene.peers.iter().any(|peer| peer.clock.spans().0 != peer.clock.spans().1)) {
                    return Err(ProofError::Drift);
                }
                let every = structure.classes.iter().map(|class| scene.samples_every(class[0])).collect();
                let holds = matches!(word(1), LawValue::Word(HOLDS));
                Ok(Some((structure, Self::Waves { every, holds, update: coordination.update.as_secs_f64() })))
            }
            Coordination::ClientServer => {
                let server = scene.server().unwrap_or(0);
                let structure = Structure::of_any_law(scenes, network, contacts, |one, other| one == server || other == server)?;
                let class = structure.classes.iter().position(|class| class[0] == server).unwrap_or(0);
                Ok(Some((structure, Self::Server { class, returns_forces: matches!(word(1), LawValue::Word(RETURNS_FORCES)) })))
            }
            _ => Ok(None),
        }
    }

    /// The nodes of all classes.
    pub(super) fn nodes(&self, structure: &Structure, scene: &Scene) -> Vec<Node> {
        let none = |class: usize| structure.node_with(scene, class, LinearLaw::none());
        let mut nodes: Vec<Node> = (0..structure.classes.len()).map(none).collect();
        if let Self::Server { class, .. } = self {
            // A client has no copy of its own.
            let object = nodes[*class].object;
            nodes.iter_mut().for_each(|node| node.object = object);
        }
        nodes
    }

    /// Whether the members of a class can differ in a way that any body feels.
    pub(super) fn has_differences(&self, structure: &Structure, class: usize) -> bool {
        let touches = structure.touching[class] && !structure.absent[class];
        structure.classes[class].len() > 1 && (touches || matches!(self, Self::Waves { .. }))
    }

    /// Which classes something ties to ground.
    pub(super) fn tied(&self, structure: &Structure, scene: &Scene) -> Vec<bool> {
        let arm = |class: usize| structure.touching[class] && scene.device_plant(structure.classes[class][0]).stiffness > 0.0;
        let silent = structure.silent && matches!(self, Self::Server { .. });
        (0..structure.classes.len()).map(|class| structure.at_wall || silent || arm(class)).collect()
    }

    /// The steps of a frame over the box whose corners are scenes, of the averages of classes or of how the members of one differ, and the states between frames. `ends`: the nodes of that part at the corners.
    pub(super) fn steps(
        &self,
        scenes: &[&Scene],
        structure: &Structure,
        ends: &[Vec<Node>],
        apart: Option<usize>,
        time: f64,
    ) -> Result<(Vec<StepSpan>, States), ProofError> {
        let sizes: Vec<usize> = structure.classes.iter().map(Vec::len).collect();
        // Whether an arm has a stiffness may differ from corner to corner.
        let tied: Vec<Vec<bool>> = scenes.iter().map(|scene| self.tied(structure, scene)).collect();
        let tied: Vec<bool> = (0..sizes.len()).map(|class| tied.iter().any(|tied| tied[class])).collect();
        let points = scenes.iter().zip(ends).map(|(scene, nodes)| Point {
            nodes: nodes.clone(),
            weights: self.weights(structure, apart),
            impedance: self.impedance(scene, structure),
        });
        let points: Vec<Point> = points.collect();
        SampledPart::new(self, &structure.timetable, apart, &sizes, &tied, time).steps(&points, ends)
    }

    /// The impedance at a copy \[N·s/m\].
    pub(super) fn impedance(&self, scene: &Scene, structure: &Structure) -> f64 {
        if matches!(self, Self::Waves { .. }) { scene.own_damping(structure.classes[0][0]) } else { 0.0 }
    }

    /// The weights of a point, a row a class: of the averages of classes in what a class gets of waves, and for a difference ν; or how many members each class of clients has.
    fn weights(&self, structure: &Structure, apart: Option<usize>) -> Matrix {
        let classes = structure.classes.len();
        match (self, apart) {
            (Self::Server { .. }, _) => Matrix::from_fn(classes, classes, |_, column| count(structure.classes[column].len())),
            (Self::Waves { .. }, None) => structure.weights.clone(),
            (Self::Waves { .. }, Some(class)) => {
                Matrix::from_fn(
                    1,
                    classes + 1,
                    |_, column| if column < classes { structure.weights[(class, column)] } else { -structure.difference_weight() },
                )
            }
        }
    }
}

/// Of more kinds of peers than this, averages have waves that no body feels.
const MOST_KINDS: usize = 2;
/// Places of words of parameters.
const HOLDS: usize = 1;
const RETURNS_FORCES: usize = 0;

/// A part of a scene: the averages of all classes, or how the members of one differ; and when what happens.
pub(super) struct SampledPart<'a> {
    pub(super) law: &'a SampledLaw,
    pub(super) timetable: &'a Timetable,
    pub(super) apart: Option<usize>,
    /// How many members each class has: two are not like more, and one is no other.
    pub(super) sizes: &'a [usize],
    /// Which classes something ties to ground.
    pub(super) tied: &'a [bool],
    pub(super) time: f64,
    pub(super) heard: Heard,
}

impl<'a> SampledPart<'a> {
    pub(super) fn new(law: &'a SampledLaw, timetable: &'a Timetable, apart: Option<usize>, sizes: &'a [usize], tied: &'a [bool], time: f64) -> Self {
        let lasting = match law {
            SampledLaw::Waves { every, holds: false, .. } => Some(every.as_slice()),
            SampledLaw::Waves { .. } | SampledLaw::Server { .. } => None,
        };
        Self { law, timetable, apart, sizes, tied, time, heard: Heard::new(timetable, lasting) }
    }

    /// The steps of a frame over the box that points enclose, and the states between frames.
    pub(super) fn steps(&self, points: &[Point], ends: &[Vec<Node>]) -> Result<(Vec<StepSpan>, States), ProofError> {
        let compliance = points[0].nodes[0].compliance(self.time);
        let layout = self.program(&points[0], compliance).layout();
        let steps = enclosed(points, ends, |point| self.program(point, compliance).matrices(&layout))?;
        #[cfg(test)]
        let steps = super::mutation::of_steps(steps);
        Ok((steps, States { names: layout.states(), heard: None }))
    }

    /// The frame with the numbers of a point: nodes of all classes, or of the one whose members differ; weights as [`SampledLaw`] takes them.
    pub(super) fn program(&self, point: &Point, compliance: f64) -> Program {
        let mut steps: Vec<(Option<u64>, Vec<Operation>)> = Vec::new();
        let classes = self.sizes.len();
        let (mut ticks, mut sent) = (vec![0_usize; classes], vec![0_i64; classes]);
        let frame = Numbers { part: self, point, scale: Scale { time: self.time, compliance } };
        for event in &self.timetable.events {
            let operations = match *event {
                Event::Deliver { .. } => continue,
                Event::Sample { node } => {
                    let operations = frame.sample(node, sent[node], whole(ticks[node]));
                    sent[node] += 1;
                    if steps.last().is_none_or(|(at, _)| at.is_some()) {
                        steps.push((None, Vec::new()));
                    }
                    operations
                }
                Event::Tick { node, at, span } => {
                    let operations = frame.tick(node, whole(ticks[node]), span);
                    ticks[node] += 1;
                    if steps.last().is_none_or(|(before, _)| *before != Some(at)) {
                        steps.push((Some(at), Vec::new()));
                    }
                    operations
                }
            };
            if let Some((_, step)) = steps.last_mut() {
                step.extend(operations);
            }
        }
        let displacement = match (self.law, self.apart) {
            (SampledLaw::Server { .. }, Some(_)) => Displacement::Nothing,
            (SampledLaw::Server { .. }, None) => Displacement::Everything,
            (SampledLaw::Waves { .. }, _) => Displacement::EachClass,
        };
        let steps = steps.into_iter().map(|(_, step)| step).filter(|step| !step.is_empty()).collect();
        Program { steps, sent: self.timetable.sent.clone(), displacement, tied: self.tied.to_vec() }
    }
}

/// A part with the numbers of a point.
struct Numbers<'a> {
    part: &'a SampledPart<'a>,
    point: &'a Point,
    scale: Scale,
}

const fn copy(class: usize, velocity: bool) -> Register {
    Register::Body { class, of_copy: true, velocity }
}

const fn device(class: usize, velocity: bool) -> Register {
    Register::Body { class, of_copy: false, velocity }
}

impl Numbers<'_> {
    /// The node of a class; `None` for the others of a difference.
    fn node(&self, class: usize) -> Option<&Node> {
        match self.part.apart {
            None => self.point.nodes.get(class),
            Some(apart) => self.point.nodes.first().filter(|_| class == apart),
        }
    }

    /// The weights of the averages of each class in what one of these gets.
    fn weight(&self, class: usize, other: usize) -> f64 {
        self.point.weights[(if self.part.apart.is_some() { 0 } else { class }, other)]
    }

    /// Whether there is a line between a member of one class and one of another.
    fn has_line(&self, class: usize, other: usize) -> bool {
        class != other || self.part.sizes[class] > 1
    }

    fn sample(&self, class: usize, number: i64, tick: i64) -> Vec<Operation> {
        match self.part.law {
            SampledLaw::Waves { every, update, .. } => self.sampled_waves(class, number, tick, every[class], *update),
            SampledLaw::Server { class: server, returns_forces } if class == *server => self.sampled_by_server(class, number, tick, *returns_forces),
            SampledLaw::Server { .. } => {
                let touches = self.node(class).is_some_and(|node| node.device.is_some());
                let set = [false, true].map(|velocity| (Register::Sample { class, number, velocity }, vec![(device(class, velocity), 1.0)]));
                if touches { vec![set.to_vec()] } else { Vec::new() }
            }
        }
    }

    /// The mean of what lines have brought a class over its ticks since its last sample, with the other sign.
    fn reflected(tick: i64, every: u64, line: impl Fn(i64) -> Option<(Register, f64)>) -> Sum {
        let every = i64::try_from(every).unwrap_or(i64::MAX);
        let mut sum: Sum = Vec::new();
        for past in tick.saturating_sub(every)..tick {
            let Some((register, sign)) = line(past) else { continue };
            #[expect(clippy::cast_precision_loss, reason = "ticks between two samples, far below 2^53")]
            let share = -sign / every as f64;
            match sum.iter_mut().find(|(of, _)| *of == register) {
                Some((_, by)) => *by += share,
                None => sum.push((register, share)),
            }
        }
        sum
    }

    /// What a class sends into its lines.
    fn sampled_waves(&self, class: usize, number: i64, tick: i64, every: u64, update: f64) -> Vec<Operation> {
        let sizes = self.part.sizes;
        let by = 2.0 * self.point.impedance * self.scale.compliance / update;
        let moved = |by: f64| -> Sum { vec![(copy(class, false), by), (Register::Sample { class, number: number - 1, velocity: false }, -by)] };
        let heard = |from: usize, tick: i64| self.part.heard.at(from, class, tick);
        let mut set: Operation = Vec::new();
        if self.part.apart.is_none_or(|apart| apart == class) {
            set.push((Register::Sample { class, number, velocity: false }, vec![(copy(class, false), 1.0)]));
        }
        match self.part.apart {
            None => {
                for other in (0..sizes.len()).filter(|other| self.has_line(class, *other)) {
                    let mut sum = moved(by);
                    sum.extend(Self::reflected(tick, every, |tick| {
                        let number = heard(other, tick)?;
                        Some((Register::Line { from: other, to: class, received: true, number }, 1.0))
                    }));
                    set.push((Register::Line { from: class, to: other, received: true, number }, sum));
                }
            }
            Some(apart) if apart == class => {
                for other in (0..sizes.len()).filter(|other| self.has_line(class, *other)) {
                    let got = |tick| {
                        let number = heard(other, tick)?;
                        Some((Register::Line { from: other, to: class, received: true, number }, 1.0))
                    };
                    let sent = |tick| {
                        let number = heard(class, tick)?;
                        Some(self.sent(class, class, number))
                    };
                    if other == class {
                        let mut sum = moved(-by * self.point.weights[(0, sizes.len())]);
                        sum.extend(Self::reflected(tick, every, sent));
                        set.push((Register::Line { from: class, to: class, received: true, number }, sum));
                    }
                    if other != class || sizes[class] > 2 {
                        let mut sum = moved(by * self.weight(class, other));
                        sum.extend(Self::reflected(tick, every, got));
                        set.push((Register::Line { from: class, to: other, received: false, number }, sum));
                    }
                }
            }
            Some(apart) => {
                let sum = Self::reflected(tick, every, |tick| Some(self.sent(apart, class, heard(apart, tick)?)));
                set.push((Register::Line { from: class, to: apart, received: true, number }, sum));
            }
        }
        vec![set]
    }

    /// What a member that differs has sent to a class: of two members, the one gets what the other has sent.
    fn sent(&self, from: usize, to: usize, number: i64) -> (Register, f64) {
        let two = from == to && self.part.sizes[from] == 2;
        (Register::Line { from, to, received: two, number }, if two { -1.0 } else { 1.0 })
    }

    /// What a server sends to each class.
    fn sampled_by_server(&self, server: usize, number: i64, tick: i64, returns_forces: bool) -> Vec<Operation> {
        if !returns_forces {
            if self.part.apart.is_some() {
                return Vec::new();
            }
            let set = [false, true].map(|velocity| (Register::Sample { class: server, number, velocity }, vec![(copy(server, velocity), 1.0)]));
            return vec![set.to_vec()];
        }
        let clients = (0..self.part.sizes.len()).filter(|class| *class != server);
        let set = clients.filter_map(|class| {
            let node = self.node(class).filter(|node| node.device.is_some())?;
            // Before deliveries of the same instant.
            let force = self.coupling(node, self.of_client(class, server, tick - 1), self.of_copy(server));
            Some((Register::Line { from: server, to: class, received: true, number }, force))
        });
        let set: Operation = set.collect();
        if set.is_empty() { Vec::new() } else { vec![set] }
    }

    /// The position and velocity of the device of a client that the server has at a tick of its own.
    fn of_client(&self, class: usize, server: usize, tick: i64) -> Option<[Register; 2]> {
        let number = self.part.heard.at(class, server, tick)?;
        Some([false, true].map(|velocity| Register::Sample { class, number, velocity }))
    }

    /// Position and velocity of a copy, where it takes part.
    fn of_copy(&self, class: usize) -> Option<[Register; 2]> {
        self.node(class).map(|_| [false, true].map(|velocity| copy(class, velocity)))
    }

    /// The force of a coupling, as a length; what is not there is at rest.
    fn coupling(&self, node: &Node, device: Option<[Register; 2]>, copy: Option<[Register; 2]>) -> Sum {
        let mut sum = self.pulled(node.coupling, device, 1.0);
        sum.extend(self.pulled(node.coupling, copy, -1.0));
        sum
    }

    fn pulled(&self, gains: Gains, body: Option<[Register; 2]>, by: f64) -> Sum {
        let gains = self.scale.gains(gains);
        let of = |[position, velocity]: [Register; 2]| {
            vec![(position, by * (gains.stiffness * self.scale.compliance)), (velocity, by * (gains.damping * self.scale.compliance))]
        };
        body.map(of).unwrap_or_default()
    }

    fn tick(&self, class: usize, tick: i64, span: std::time::Duration) -> Vec<Operation> {
        let Some(node) = self.node(class) else { return Vec::new() };
        let has_device = node.device.is_some();
        let of_device = has_device.then(|| [false, true].map(|velocity| device(class, velocity)));
        let heard = |from: usize| self.part.heard.at(from, class, tick);
        let mut operations = Vec::new();
        let mut on_copy: Option<Sum> = None;
        // FC; what a device feels has the other sign.
        let mut felt: Sum = Vec::new();
        match self.part.law {
            SampledLaw::Waves { .. } => {
                felt = if has_device { self.coupling(node, of_device, self.of_copy(class)) } else { Vec::new() };
                let mut force = felt.clone();
                for other in (0..self.part.sizes.len()).filter(|other| self.has_line(class, *other)) {
                    let Some(number) = heard(other) else { continue };
                    let by = if self.part.apart.is_some() { 1.0 } else { self.weight(class, other) };
                    force.push((Register::Line { from: other, to: class, received: true, number }, by));
                }
                on_copy = Some(force);
            }
            SampledLaw::Server { class: server, .. } if class == *server => {
                felt = if has_device { self.coupling(node, of_device, self.of_copy(class)) } else { Vec::new() };
                let mut force = felt.clone();
                for other in (0..self.part.sizes.len()).filter(|other| other != server) {
                    let Some(client) = self.point.nodes.get(other).filter(|node| node.device.is_some()) else { continue };
                    let of = self.coupling(client, self.of_client(other, class, tick), self.of_copy(class));
                    force.extend(of.into_iter().map(|(register, by)| (register, by * self.weight(class, other))));
                }
                on_copy = Some(force);
            }
            SampledLaw::Server { class: server, returns_forces } => {
                if has_device && *returns_forces {
                    felt.extend(heard(*server).map(|number| (Register::Line { from: *server, to: class, received: true, number }, 1.0)));
                } else if has_device {
                    let object = heard(*server).filter(|_| self.part.apart.is_none());
                    let object = object.map(|number| [false, true].map(|velocity| Register::Sample { class: *server, number, velocity }));
                    felt = self.coupling(node, of_device, object);
                }
            }
        }
        if let Some(mut force) = on_copy {
            if let Some(wall) = node.wall {
                force.extend(self.pulled(wall, self.of_copy(class), -1.0));
            }
            operations.extend(self.moved(node, &node.object, (class, true), force, span));
        }
        if let Some(body) = &node.device {
            let felt = felt.into_iter().map(|(register, by)| (register, -by)).collect();
            operations.extend(self.moved(node, body, (class, false), felt, span));
        }
        forces_first(operations)
    }

    /// A body under a force, which acts a tick later where the node computes for so long.
    fn moved(&self, node: &Node, body: &Body, (class, on_copy): (usize, bool), force: Sum, span: std::time::Duration) -> Vec<Operation> {
        let (acting, pending) = (Register::Force { class, on_copy }, Register::Pending { class, on_copy });
        let set = if node.compute_delay { vec![(acting, vec![(pending, 1.0)]), (pending, force)] } else { vec![(acting, force)] };
        let (e, g) = body.scaled_map(span, self.scale.time).coefficients();
        let [x, v] = [false, true].map(|velocity| Register::Body { class, of_copy: on_copy, velocity });
        let by = |row: usize| g[row] / self.scale.compliance;
        let map = vec![(x, vec![(x, 1.0 + e[0][0]), (v, e[0][1]), (acting, by(0))]), (v, vec![(x, e[1][0]), (v, 1.0 + e[1][1]), (acting, by(1))])];
        vec![set, map]
    }
}

/// All forces of a tick follow from where bodies are before any of them moves.
fn forces_first(operations: Vec<Operation>) -> Vec<Operation> {
    let is_force = |operation: &Operation| operation.iter().any(|(register, _)| matches!(register, Register::Force { .. }));
    let (mut forces, bodies): (Vec<Operation>, Vec<Operation>) = operations.into_iter().partition(is_force);
    forces.extend(bodies);
    forces
}
