//! The admittance that a hand meets: how fast a device moves for the force that pushes it, frequency by frequency.
//!
//! The loop has two rates, so a sine at one frequency makes velocities at many: at ω and at ω plus any multiple of the frame's frequency. The admittance
//! is the *fundamental harmonic*, the part at ω, as if a sine were analysed that pushes with e^{jωt}, sampled and held as every hand force is. It is found
//! without simulating (Rakhsha & Constantinescu 2015, Section 4, plot it for their controllers): in steady state one frame multiplies everything by
//! e^{jωT}, which is one system of linear equations.

mod harmonic;
mod low_frequency;
mod response;

use cohaptic_peer::{Contact, Gains};
use cohaptic_scene::Scene;
use num_complex::Complex64;
use rayon::prelude::*;

use crate::lifted::{Body, Lifted, Node, Sampling};
use crate::linear_form::LinearLaw;
use crate::network::NominalNetwork;
use crate::parts::{radius_of, reduced};
use crate::structure::{Contacts, Structure, count};
use crate::timetable::{Event, NodeClock, Timetable};
use crate::{AnalysisError, Matrix, Method, Radius, UNLOADED, Unwatched, Verdict, Watch};

pub use low_frequency::{Estimate, LowFrequencyFit};
pub use response::{AdmittancePoint, FrequencyResponse, ideal};

use harmonic::Harmonic;

/// How many points the threads share at a time.
const TOGETHER: usize = 256;

/// The admittance of one peer's device, with the hands of all others at rest: ready to be evaluated at any frequency.
///
/// Peers that are equal are treated together, so that it costs the same for any number of them. Arms are part of the scene and stay, that of the peer
/// itself too: the force is added to theirs. A peer that touches nothing has the admittance of its bare device.
///
/// Where a scene is not linear, the linear scene is analysed in which every one-sided contact is closed and no copy is at a wall: see
/// [`Admittance::notes`]. In a scene of several axes it is the admittance along the axis that the peer pushes along, or the first.
#[derive(Clone, Debug)]
pub struct Admittance {
    nodes: Vec<Node>,
    weights: Matrix,
    timetable: Timetable,
    time: f64,
    tied: bool,
    /// Which of the nodes is pushed.
    pushed: usize,
    highest: f64,
    radius: Radius,
    notes: Vec<String>,
    /// The mass of the whole object, or its inertia about the axis.
    mass: f64,
    is_turn: bool,
}

/// The admittance of the peer in that place of [`Scene::peers`] at those frequencies \[Hz\].
///
/// # Errors
///
/// As [`Admittance::of`] and [`Admittance::response`].
pub fn admittance(scene: &Scene, peer: usize, frequencies: &[f64]) -> Result<FrequencyResponse, AdmittanceError> {
    Admittance::of(scene, peer)?.response(frequencies)
}

impl Admittance {
    /// Prepares the admittance of the peer in that place of [`Scene::peers`], as the scene begins.
    ///
    /// # Errors
    ///
    /// [`AdmittanceError`] if there is no such peer, or if the scene has no frame that repeats.
    pub fn of(scene: &Scene, peer: usize) -> Result<Self, AdmittanceError> {
        Self::of_watched(scene, peer, &Unwatched)
    }

    /// [`Admittance::of`], watched while it works out the verdict on the scene.
    ///
    /// # Errors
    ///
    /// As [`Admittance::of`], and [`AnalysisError::Stopped`] if the watch ends it.
    pub fn of_watched(scene: &Scene, peer: usize, watch: &dyn Watch) -> Result<Self, AdmittanceError> {
        Self::along_watched(scene, peer, None, watch)
    }

    /// [`Admittance::of_watched`] along an axis, or about one, where force over velocity means torque over angular velocity; `None`: along the axis that the peer
    /// pushes along, or the first.
    ///
    /// # Errors
    ///
    /// As [`Admittance::of_watched`]; if the scene has no such axis or the device of the peer does not turn; and for an object that turns and is not held at its
    /// centre.
    pub fn along_watched(scene: &Scene, peer: usize, axis: Option<PushedAxis>, watch: &dyn Watch) -> Result<Self, AdmittanceError> {
        let spec = scene.peers.get(peer).ok_or(AdmittanceError::NoSuchPeer { peer, peers: scene.peers.len() })?;
        let first = match spec.contact {
            Contact::Push(direction) => direction.axis,
            Contact::Grasp | Contact::None => 0,
        };
        let axis = axis.unwrap_or(PushedAxis::ALL[first]);
        let network = NominalNetwork::of(scene)?;
        let Some(parts) = scene.rotation_parts() else {
            let place = axis.place();
            return if place < scene.axes.count() {
                Self::in_scene(scene, peer, place, &network, watch)
            } else {
                Err(AdmittanceError::NoSuchAxis { axis: axis.word() })
            };
        };
        let off_centre = |why| AnalysisError::Turns { what: "the admittance", why };
        let parts = parts.map_err(off_centre)?.parts;
        let found = parts.iter().find(|part| part.components.iter().any(|component| component == axis.word()));
        let part = found.ok_or_else(|| off_centre("the object is held off its centre"))?;
        if !part.devices[peer] {
            return Err(AdmittanceError::DoesNotTurn { axis: axis.word(), peer: spec.name.clone() });
        }
        let mut admittance = Self::in_scene(&part.scene, peer, 0, &network, watch)?;
        admittance.is_turn = axis.place() > 2;
        admittance.notes.push(UNLOADED.to_owned());
        if !scene.timeline.is_empty() {
            admittance.notes.push(TIMELINE.to_owned());
        }
        Ok(admittance)
    }

    /// Along that axis of a scene that does not turn.
    fn in_scene(scene: &Scene, peer: usize, axis: usize, network: &NominalNetwork, watch: &dyn Watch) -> Result<Self, AdmittanceError> {
        let spec = &scene.peers[peer];
        let (contacts, notes) = closed_contacts(scene, axis);
        let structure = Structure::with_alone(&[scene], network, &contacts, Some(peer))?;
        let mut admittance = Self::of_classes(scene, structure, peer, watch)?;
        if !contacts.touching[peer] {
            let device = scene.device_plant(peer);
            let body = Some(Body::new(device, scene.integrator, &spec.clock));
            admittance.leave_bare(body, NodeClock::of(scene, peer), device.stiffness > 0.0)?;
        }
        admittance.highest = 0.5 * admittance.tick_rate();
        admittance.notes = network.notes.iter().cloned().chain(notes).collect();
        Ok(admittance)
    }

    /// From classes of which the pushed peer is one by itself.
    fn of_classes(scene: &Scene, structure: Structure, peer: usize, watch: &dyn Watch) -> Result<Self, AnalysisError> {
        let radius = radius_of(&reduced(&structure, scene, 1, Method::Reduced, watch)?.parts);
        let nodes = structure.nodes(scene);
        let time = structure.time(scene, &nodes);
        let pushed = structure.classes.iter().position(|class| class[0] == peer).expect("every peer is in a class");
        let Structure { timetable, weights, tied, .. } = structure;
        Ok(Self { nodes, weights, timetable, time, tied, pushed, highest: 0.0, radius, notes: Vec::new(), mass: scene.object.mass, is_turn: false })
    }

    /// The admittance at a frequency \[Hz\].
    ///
    /// # Errors
    ///
    /// [`AdmittanceError::Frequency`] unless it is above 0 and at most [`Admittance::highest_frequency`].
    pub fn at(&self, hz: f64) -> Result<AdmittancePoint, AdmittanceError> {
        if !(hz > 0.0 && hz <= self.highest) {
            return Err(AdmittanceError::Frequency { hz, highest: self.highest });
        }
        Ok(Harmonic::new(&self.lifted(), self.pushed, hz).point())
    }

    /// The admittance at each of those frequencies \[Hz\], in their order.
    ///
    /// # Errors
    ///
    /// As [`Admittance::at`], for the first frequency that is not one.
    pub fn response(&self, frequencies: &[f64]) -> Result<FrequencyResponse, AdmittanceError> {
        self.response_watched(frequencies, &Unwatched)
    }

    /// [`Admittance::response`] at as many of those frequencies as there is time for: up to the first that was not looked at when the watcher ended it.
    /// A point is [`Admittance::operations`].
    ///
    /// # Errors
    ///
    /// As [`Admittance::at`], for the first frequency that is not one.
    pub fn response_watched(&self, frequencies: &[f64], watch: &dyn Watch) -> Result<FrequencyResponse, AdmittanceError> {
        watch.expects(self.operations() * count(frequencies.len()));
        let at = |hz: &f64| {
            (!watch.stops()).then(|| {
                let point = self.at(*hz);
                watch.done(self.operations());
                point
            })
        };
        let mut points = Vec::with_capacity(frequencies.len());
        // Threads share a few at a time, so that the points that are done at an interruption are the first ones.
        for some in frequencies.chunks(TOGETHER) {
            let found: Vec<Option<Result<AdmittancePoint, AdmittanceError>>> = some.par_iter().map(at).collect();
            for point in found {
                match point {
                    Some(point) => points.push(point?),
                    None => return Ok(FrequencyResponse { points }),
                }
            }
        }
        Ok(FrequencyResponse { points })
    }

    /// About how many operations a point takes: each event of a frame works on all columns of its rows.
    #[must_use]
    pub fn operations(&self) -> f64 {
        let columns = 6 * self.nodes.len() + self.timetable.depth.iter().sum::<usize>();
        20.0 * count(self.timetable.events.len()) * count(columns) + count(columns).powi(3)
    }

    /// What the device feels like when it is moved slowly: see [`LowFrequencyFit`].
    #[must_use]
    pub fn fit_low_frequency(&self) -> LowFrequencyFit {
        LowFrequencyFit::of(|hz| self.impedance(hz), self.highest.min(0.25 / self.timetable.frame.as_secs_f64()), self.tied)
    }

    /// The highest frequency that there is an admittance for, half the rate of the peer's ticks \[Hz\].
    #[must_use]
    pub const fn highest_frequency(&self) -> f64 {
        self.highest
    }

    /// The spectral radius of the linear scene that is analysed, over one frame.
    #[must_use]
    pub const fn radius(&self) -> Radius {
        self.radius
    }

    /// The verdict on that scene. An unstable one has no steady state: its admittance is what the formula says, and nothing that could be measured.
    #[must_use]
    pub fn verdict(&self) -> Verdict {
        self.radius.verdict()
    }

    /// The mass of the whole object \[kg\], or its inertia about the axis [kg·m²].
    #[must_use]
    pub const fn object_mass(&self) -> f64 {
        self.mass
    }

    /// Whether it is angular velocity over torque.
    #[must_use]
    pub const fn is_turn(&self) -> bool {
        self.is_turn
    }

    /// The parts left out or taken as closed, in words.
    #[must_use]
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    fn lifted(&self) -> Lifted<'_> {
        let Self { nodes, weights, timetable, time, tied, .. } = self;
        Lifted { nodes, weights, timetable, sampling: Sampling::of(nodes), time: *time, tied: *tied }
    }

    /// Force over velocity, at a frequency that is one, and how far rounding may have moved it: 1/(v + d) − 1/v is −d/(v·(v + d)).
    fn impedance(&self, hz: f64) -> (Complex64, f64) {
        let AdmittancePoint { value, error, .. } = Harmonic::new(&self.lifted(), self.pushed, hz).point();
        let size = value.norm();
        (value.inv(), if error < size { error / (size * (size - error)) } else { f64::INFINITY })
    }

    /// Leaves nothing but the device of the pushed peer. A node has a copy, which then rests.
    fn leave_bare(&mut self, device: Option<Body>, clock: NodeClock, tied: bool) -> Result<(), AnalysisError> {
        let none = Gains { stiffness: 0.0, damping: 0.0 };
        let bare = self.nodes[self.pushed].clone();
        self.nodes = vec![Node { device, coupling: none, law: LinearLaw::none(), wall: None, compute_delay: false, ..bare }];
        self.weights = Matrix::zeros(1, 1);
        // It sends nothing, so that everything repeats with every tick.
        self.timetable = Timetable::new(&[NodeClock { phase: 0, every: 1, ..clock }], &[])?;
        self.tied = tied;
        self.pushed = 0;
        Ok(())
    }

    /// The rate of the ticks of the pushed node, on average over a frame \[Hz\].
    fn tick_rate(&self) -> f64 {
        let own = |event: &&Event| matches!(event, Event::Tick { node, .. } if *node == self.pushed);
        count(self.timetable.events.iter().filter(own).count()) / self.timetable.frame.as_secs_f64()
    }
}

/// The axis along which a device is pushed, or about which it is turned.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[expect(missing_docs, reason = "x, y and z along the axes of the world, rx, ry and rz about those of the object")]
pub enum PushedAxis {
    X,
    Y,
    Z,
    Rx,
    Ry,
    Rz,
}

impl PushedAxis {
    /// All of them, in order.
    pub const ALL: [Self; 6] = [Self::X, Self::Y, Self::Z, Self::Rx, Self::Ry, Self::Rz];

    /// The word in options: `x` to `rz`.
    #[must_use]
    pub const fn word(self) -> &'static str {
        ["x", "y", "z", "rx", "ry", "rz"][self.place()]
    }

    const fn place(self) -> usize {
        self as usize
    }
}

const TIMELINE: &str = "the timeline is left out: the scene is analysed as it begins";

/// All one-sided contacts along an axis closed, no copy at a wall; and that in words.
fn closed_contacts(scene: &Scene, axis: usize) -> (Contacts, Vec<String>) {
    let pushes = |peer: usize| match scene.peers[peer].contact {
        Contact::Push(direction) => Some(direction.axis),
        Contact::Grasp | Contact::None => None,
    };
    let touching = |peer: usize| scene.peers[peer].contact == Contact::Grasp || pushes(peer) == Some(axis);
    let touching: Vec<bool> = (0..scene.peers.len()).map(touching).collect();
    let mut notes = Vec::new();
    if (0..scene.peers.len()).any(|peer| pushes(peer) == Some(axis)) {
        notes.push("one-sided contacts are taken as closed: a hand that pulls would let go".to_owned());
    }
    if scene.object.enclosure.is_some() {
        notes.push("the enclosure is left out: the object is away from its walls".to_owned());
    }
    if !scene.timeline.is_empty() {
        notes.push(TIMELINE.to_owned());
    }
    let absent = vec![false; scene.peers.len()];
    (Contacts { touching, at_wall: false, absent }, notes)
}

/// Why there is no admittance.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the messages describe the variants")]
pub enum AdmittanceError {
    #[error("no peer in place {peer}: expected one of the {peers} peers of the scene, counted from 0")]
    NoSuchPeer { peer: usize, peers: usize },
    #[error("{hz} Hz: expected a frequency above 0 and at most {highest} Hz, half the rate of the peer's ticks")]
    Frequency { hz: f64, highest: f64 },
    #[error("the scene has no axis {axis}: expected one of those of scene.axes, or an object with an inertia")]
    NoSuchAxis { axis: &'static str },
    #[error("the device of {peer} does not turn, so nothing moves it about {axis}: expected device.inertia")]
    DoesNotTurn { axis: &'static str, peer: String },
    /// The scene cannot be analysed.
    #[error(transparent)]
    Analysis(#[from] AnalysisError),
}

#[cfg(test)]
mod tests {
    use super::*;

    const ONE_TOUCHES: &str = r#"
        scene        = { duration = "1s", count = 50 }
        object       = { mass = 0.45, split-mass = false }
        coordination = { strategy = "average-position", stiffness = 1000.0, damping = 5.0, update = "8ms" }
        peer         = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 }, contact = "none" }
        link         = { delay = "8ms" }
    "#;

    fn fifty() -> Scene {
        Scene::parse(ONE_TOUCHES, "many.toml".as_ref(), &["peers.peer1.contact=grasp".to_owned()]).unwrap()
    }

    /// The scene of 50 peers with any number of them: more than a scene may have.
    fn with_peers(count: usize) -> Admittance {
        let scene = fifty();
        let network = NominalNetwork::of(&scene).unwrap();
        let (contacts, _) = closed_contacts(&scene, 0);
        let mut structure = Structure::with_alone(&[&scene], &network, &contacts, Some(0)).unwrap();
        assert_eq!(structure.classes.len(), 2);
        structure.peers = count;
        let others = crate::structure::count(count - 1);
        structure.weights = Matrix::from_fn(2, 2, |row, column| [[0.0, 1.0], [1.0 / others, (others - 1.0) / others]][row][column]);
        let mut admittance = Admittance::of_classes(&scene, structure, 0, &Unwatched).unwrap();
        admittance.highest = 0.5 * admittance.tick_rate();
        admittance
    }

    /// The more peers, the less the mean of the others moves: in the limit the copy is held by a spring and a damper at rest, and is as far from that as 1/N.
    #[test]
    fn a_hundred_thousand_peers_cost_two_nodes_and_are_near_the_limit() {
        let scene = fifty();
        assert_eq!(with_peers(50).at(1.0).unwrap(), Admittance::of(&scene, 0).unwrap().at(1.0).unwrap());
        let mut limit = with_peers(2);
        limit.weights = Matrix::zeros(2, 2);
        limit.tied = true;
        for hz in [1.0, 8.0, 70.0] {
            let held = limit.at(hz).unwrap().value;
            let apart = |peers: usize| (with_peers(peers).at(hz).unwrap().value - held).norm() / held.norm() * count(peers - 1);
            let (fifty, thousand, most) = (apart(50), apart(1000), apart(100_000));
            assert!((thousand / most - 1.0).abs() < 0.02 && (fifty / most - 1.0).abs() < 0.3, "{hz} Hz: {fifty} {thousand} {most}");
        }
    }

    /// b = bH + N·KT·(τ + δ), δ = BT·(Tc²/m)·(M² − 1)/12: see scenarios/README.md. Met far below the frequency KT/(2πb), 0.14 mHz here.
    /// So low, a bound of what rounding does to an impedance is some 10⁻⁴ of it.
    #[test]
    fn the_viscosity_of_a_hundred_thousand_peers_follows_the_law() {
        let fit = with_peers(100_000).fit_low_frequency();
        let expected = 5.0 + 1e5 * 1000.0 * (0.0115 + 5.0 * 1e-6 / 0.45 * 63.0 / 12.0);
        assert!((fit.viscosity.value / expected - 1.0).abs() < 0.005 && fit.viscosity.error < 1e-3 * expected, "{fit:?}, {expected}");
    }
}
