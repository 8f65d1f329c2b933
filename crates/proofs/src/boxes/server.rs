//! Frames of a server and its clients. Their samples carry more than the states of copies.
//!
//! As for other laws, averages of classes of equal peers and differences within a class do not mix. The server is a separate class. Clients send the states
//! of their devices to the server and receive the forces of their couplings or the state of the object; a client has no copy. The server feels nothing of
//! differences within a class of clients, and these differences feel nothing of the object. Forces are multiplied by the compliance of the object, so
//! registers hold lengths.

use std::time::Duration;

use cohaptic_peer::coordination::LawValue;
use cohaptic_peer::{Coordination, Gains};
use cohaptic_scene::Scene;
use cohaptic_stability::Matrix;
use cohaptic_stability::frames::{Contacts, Event, LinearLaw, Node, NominalNetwork, Scale, Structure, Timetable};
use cohaptic_stability::numerics::real;

use super::corners::Point;
use super::error::ProofError;
use super::heard::Heard;
use super::program::{NamedFrame, Operation, Program, Register, Sum};
use super::pushed::{Pushed, StateRegisters, coupling, device, moved, negative, state};

/// Coordination of a server with its clients.
#[derive(Clone, Copy, Debug)]
pub(super) struct Server {
    /// Class of the server.
    class: usize,
    /// `true` if clients receive the forces of their couplings, instead of the state of the object.
    returns_forces: bool,
}

/// Place of the parameter `returns` among the parameters of the coordination; `FORCE` is the place of the word `force` among its words.
const RETURNS: usize = 1;
const FORCE: usize = 0;

impl Server {
    /// Returns the server of scenes with different numbers, and the classes of the peers of these scenes; `None` if the scenes have no server.
    pub(super) fn structure(scenes: &[&Scene], network: &NominalNetwork, contacts: &Contacts) -> Result<Option<(Structure, Self)>, ProofError> {
        let coordination = &scenes[0].coordination;
        if coordination.strategy != Coordination::ClientServer {
            return Ok(None);
        }
        if scenes[0].object.enclosure.is_some() {
            return Err(ProofError::WallLeftOut { strategy: coordination.strategy.name() });
        }
        let server = scenes[0].server().unwrap_or(0);
        let structure = Structure::of_any_law(scenes, network, contacts, |one, other| one == server || other == server)?;
        let class = structure.classes.iter().position(|class| class[0] == server).unwrap_or(0);
        if scenes[0].sends_increments() || scenes[0].returns_nothing() {
            return Err(ProofError::Clients);
        }
        let returns = coordination.settings.of(coordination.strategy).get(RETURNS);
        Ok(Some((structure, Self { class, returns_forces: matches!(returns, LawValue::Word(FORCE)) })))
    }

    /// Returns the node of each class.
    pub(super) fn nodes(self, structure: &Structure, scene: &Scene) -> Vec<Node> {
        let mut nodes: Vec<Node> = (0..structure.classes.len()).map(|class| structure.node_with(scene, class, LinearLaw::none())).collect();
        // A client has no copy. The client's node gets the object of the server, so all nodes have the same compliance as the unit of forces.
        let object = nodes[self.class].object;
        nodes.iter_mut().for_each(|node| node.object = object);
        nodes
    }

    /// Returns whether differences of the members of a class have an effect on a device.
    pub(super) fn has_differences(structure: &Structure, class: usize) -> bool {
        structure.classes[class].len() > 1 && structure.touching[class]
    }

    /// Returns a frame over a box, of the averages of classes or of the differences between the members of the class `apart`. `ends`: the nodes of the part at
    /// the corners of the box.
    pub(super) fn frame(self, structure: &Structure, ends: &[Vec<Node>], apart: Option<usize>, time: f64) -> Result<NamedFrame, ProofError> {
        // Number of members of each class. All members send to the server.
        let sizes = Matrix::from_fn(1, structure.classes.len(), |_, class| real(structure.classes[class].len()));
        let points: Vec<Point> = ends.iter().map(|nodes| Point { nodes: nodes.clone(), weights: sizes.clone() }).collect();
        let scale = Scale { time, compliance: ends[0][0].compliance(time) };
        let heard = Heard::new(&structure.timetable);
        let program = |point: &Point| {
            let frame = Frame { server: self, apart, point, scale, heard: &heard };
            // Differences contain no common motion of all bodies, so no position serves as a reference.
            frame.program(&structure.timetable, structure.tied || apart.is_some())
        };
        NamedFrame::of(&points, ends, apart, scale, program)
    }
}

/// Frame of a part of a scene at a point, with the nodes of all classes, or for differences with the node of their class.
struct Frame<'a> {
    server: Server,
    apart: Option<usize>,
    point: &'a Point,
    scale: Scale,
    heard: &'a Heard,
}

impl Frame<'_> {
    fn program(&self, timetable: &Timetable, tied: bool) -> Program {
        let classes = timetable.sent.len();
        let (mut ticks, mut sent) = (vec![0_i64; classes], vec![0_i64; classes]);
        // Consecutive samples form a step, and the ticks of one instant too. The key of a step is the instant of its ticks, or `None` for samples.
        let mut steps: Vec<(Option<u64>, Vec<Operation>)> = Vec::new();
        for event in &timetable.events {
            let (at, operations) = match *event {
                Event::Deliver { .. } => continue,
                Event::Sample { node } => {
                    let operation = self.sample(node, sent[node], ticks[node]);
                    sent[node] += 1;
                    (None, vec![operation])
                }
                Event::Tick { node, at, span, .. } => {
                    let operations = self.tick(node, ticks[node], span);
                    ticks[node] += 1;
                    (Some(at), operations)
                }
            };
            match steps.last_mut() {
                Some((last, step)) if *last == at => step.extend(operations),
                _ => steps.push((at, operations)),
            }
        }
        // Steps without an operation belong to other parts of the motion and leave all registers as they are.
        let steps = steps.into_iter().map(|(_, step)| step).filter(|step| step.iter().any(|operation| !operation.is_empty())).collect();
        let object = Register::Body { class: self.server.class, of_copy: true, velocity: false };
        Program { steps, sent: timetable.sent.clone(), references: vec![(!tied).then_some(object); classes] }
    }

    /// Returns the node of a class; `None` if the part is the differences of another class.
    fn node(&self, class: usize) -> Option<&Node> {
        match self.apart {
            None => self.point.nodes.get(class),
            Some(apart) => self.point.nodes.first().filter(|_| class == apart),
        }
    }

    /// Returns the node of a class with a coupled device; `None` if the device touches nothing.
    fn touching(&self, class: usize) -> Option<&Node> {
        self.node(class).filter(|node| node.device.is_some())
    }

    /// Returns the registers of the object, the copy of the server; `None` for differences of clients.
    fn object(&self) -> Option<StateRegisters> {
        let class = self.server.class;
        self.node(class).map(|_| state(|velocity| Register::Body { class, of_copy: true, velocity }))
    }

    /// Returns the sampled state of `from` held by `to` at a tick of `to`; `None` if no sample ever arrives.
    fn held(&self, from: usize, to: usize, tick: i64) -> Option<StateRegisters> {
        self.heard.at(from, to, tick).map(|number| state(|velocity| Register::Sample { class: from, number, velocity }))
    }

    /// Returns the operation of taking sample `number` of a class, before the tick of the class with the number `tick`.
    fn sample(&self, class: usize, number: i64, tick: i64) -> Operation {
        let Server { class: server, returns_forces } = self.server;
        let of = |bodies: StateRegisters| -> Operation {
            let registers = state(|velocity| Register::Sample { class, number, velocity });
            registers.into_iter().zip(bodies).map(|(register, body)| (register, vec![(body, 1.0)])).collect()
        };
        if class != server {
            return self.touching(class).map(|_| of(device(class))).unwrap_or_default();
        }
        if !returns_forces {
            return self.object().map(of).unwrap_or_default();
        }
        let returned = |client: usize| {
            let node = self.touching(client).filter(|_| client != server)?;
            // The force uses the sample held at the tick before: a delivery at the instant of the sample counts from the next tick on.
            let force = self.coupling(node.coupling, self.held(client, server, tick - 1), self.object());
            Some((Register::Returned { server, class: client, number }, force))
        };
        (0..self.point.weights.columns()).filter_map(returned).collect()
    }

    fn coupling(&self, gains: Gains, device: Option<StateRegisters>, object: Option<StateRegisters>) -> Sum {
        coupling(gains, device, object, self.scale)
    }

    fn tick(&self, class: usize, tick: i64, span: Duration) -> Vec<Operation> {
        let Some(node) = self.node(class) else { return Vec::new() };
        let Server { class: server, returns_forces } = self.server;
        // Force of the coupling of this class on the object.
        let coupling = self.touching(class).map(|_| {
            if class == server {
                self.coupling(node.coupling, Some(device(class)), self.object())
            } else if returns_forces {
                self.heard.at(server, class, tick).map(|number| (Register::Returned { server, class, number }, 1.0)).into_iter().collect()
            } else {
                self.coupling(node.coupling, Some(device(class)), self.object().and_then(|_| self.held(server, class, tick)))
            }
        });
        let mut bodies: Vec<Pushed> = Vec::new();
        if class == server {
            let mut force = coupling.clone().unwrap_or_default();
            // All members of a class of clients pull on the object, so the force of one member counts as often as the class has members.
            for client in (0..self.point.weights.columns()).filter(|client| *client != server) {
                let Some(other) = self.touching(client) else { continue };
                let of_one = self.coupling(other.coupling, self.held(client, server, tick), self.object());
                force.extend(of_one.into_iter().map(|(register, by)| (register, by * self.point.weights[(0, client)])));
            }
            bodies.push(Pushed { body: node.object, is_copy: true, force });
        }
        if let Some((device, force)) = node.device.zip(coupling) {
            bodies.push(Pushed { body: device, is_copy: false, force: negative(force) });
        }
        moved(class, &bodies, node.compute_delay, span, self.scale)
    }
}
