//! The admittance that a hand meets: how fast a device moves for the force that pushes it, frequency by frequency.
//!
//! The loop has two rates, so a sine at one frequency makes velocities at many: at ω and at ω plus any multiple of the frame's frequency. The admittance
//! is the *fundamental harmonic*, the part at ω, as if a sine were analysed that pushes with e^{jωt}, sampled and held as every hand force is. It is found
//! without simulating (Rakhsha & Constantinescu 2015, Section 4, plot it for their controllers): in steady state one frame multiplies everything by
//! e^{jωT}, which is one system of linear equations.

mod harmonic;
mod low_frequency;
mod one_axis;
mod response;
mod turned;

use cohaptic_peer::Contact;
use cohaptic_scene::Scene;
use num_complex::Complex64;
use rayon::prelude::*;

use crate::network::NominalNetwork;
use crate::rounding::real;

use crate::timetable::{Event, Timetable};
use crate::{AnalysisError, Radius, UNLOADED, Unwatched, Verdict, Watch};

pub use low_frequency::{Estimate, LowFrequencyFit};
pub use response::{AdmittancePoint, FrequencyResponse, ideal};

use one_axis::{OneAxis, TIMELINE};
use turned::Turned;

/// How many points the threads share at a time.
const TOGETHER: usize = 256;

/// The admittance of one peer's device, with the hands of all others at rest: ready to be evaluated at any frequency.
///
/// Peers that are equal are treated together, so that it costs the same for any number of them. Arms are part of the scene and stay, that of the peer
/// itself too: the force is added to theirs. A peer that touches nothing has the admittance of its bare device.
///
/// Where a scene is not linear, the linear scene is analysed in which every one-sided contact is closed and no copy is at a wall: see
/// [`Admittance::notes`]. In a scene of several axes it is the admittance along the axis that the peer pushes along, or the first.
///
/// Of an object that turns, a push along one axis may be seen in the motion along or about another: see [`Admittance::between_watched`].
#[derive(Clone, Debug)]
pub struct Admittance {
    system: System,
    highest: f64,
    radius: Radius,
    notes: Vec<String>,
    mass: f64,
    axes: [PushedAxis; 2],
}

/// What moves.
#[derive(Clone, Debug)]
enum System {
    OneAxis(Box<OneAxis>),
    Turned(Box<Turned>),
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
    /// As [`Admittance::between_watched`].
    pub fn along_watched(scene: &Scene, peer: usize, axis: Option<PushedAxis>, watch: &dyn Watch) -> Result<Self, AdmittanceError> {
        Self::between_watched(scene, peer, axis, None, watch)
    }

    /// [`Admittance::along_watched`] with the velocity of the same device along or about another axis; `None`: the same one.
    ///
    /// # Errors
    ///
    /// As [`Admittance::of_watched`]; if the scene has no such axis or the device of the peer does not turn; if nothing couples the axes; and for a finger that
    /// pushes an object off its centre.
    pub fn between_watched(
        scene: &Scene,
        peer: usize,
        axis: Option<PushedAxis>,
        seen: Option<PushedAxis>,
        watch: &dyn Watch,
    ) -> Result<Self, AdmittanceError> {
        let spec = scene.peers.get(peer).ok_or(AdmittanceError::NoSuchPeer { peer, peers: scene.peers.len() })?;
        let first = match spec.contact {
            Contact::Push(direction) => direction.axis,
            Contact::Grasp | Contact::None => 0,
        };
        let axis = axis.unwrap_or(PushedAxis::ALL[first]);
        let axes = [axis, seen.unwrap_or(axis)];
        for axis in axes {
            match &scene.rotation {
                None if axis.place() >= scene.axes.count() => return Err(AdmittanceError::NoSuchAxis { axis: axis.word() }),
                Some(rotation) if axis.is_turn() && rotation.peers[peer].device.is_none() => {
                    return Err(AdmittanceError::DoesNotTurn { axis: axis.word(), peer: spec.name.clone() });
                }
                _ => {}
            }
        }
        let uncoupled = || AdmittanceError::Uncoupled { from: axes[0].word(), to: axes[1].word() };
        let is_cross = axes[0] != axes[1];
        let network = NominalNetwork::of(scene)?;
        let Some(rotation) = &scene.rotation else {
            if is_cross {
                return Err(uncoupled());
            }
            let (system, radius, notes) = OneAxis::of(scene, peer, axis.place(), &network, watch)?;
            return Ok(Self::new(System::OneAxis(Box::new(system)), radius, notes, scene.object.mass, axes));
        };
        let parts = scene.rotation_parts().and_then(Result::ok).map_or_else(Vec::new, |parts| parts.parts);
        let part = parts.iter().find(|part| !is_cross && part.components.iter().any(|component| component == axis.word()));
        let mut admittance = if let Some(part) = part {
            let (system, radius, notes) = OneAxis::of(&part.scene, peer, 0, &network, watch)?;
            let mass = if axis.is_turn() { rotation.inertia[axis.place() - 3] } else { scene.object.mass };
            Self::new(System::OneAxis(Box::new(system)), radius, notes, mass, axes)
        } else {
            let (system, radius) = Turned::of(scene, peer, axes.map(PushedAxis::place), &network, watch)?;
            let (mass, mut notes) = (system.mass(scene), network.notes.clone());
            if scene.object.enclosure.is_some() {
                notes.push("the enclosure is left out: the object is away from its walls".to_owned());
            }
            Self::new(System::Turned(Box::new(system)), radius, notes, mass, axes)
        };
        if is_cross && admittance.is_zero() {
            return Err(uncoupled());
        }
        admittance.notes.push(UNLOADED.to_owned());
        if !scene.timeline.is_empty() {
            admittance.notes.push(TIMELINE.to_owned());
        }
        Ok(admittance)
    }

    fn new(system: System, radius: Radius, notes: Vec<String>, mass: f64, axes: [PushedAxis; 2]) -> Self {
        let mut admittance = Self { system, highest: 0.0, radius, notes, mass, axes };
        admittance.highest = 0.5 * admittance.tick_rate();
        admittance
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
        Ok(self.point(hz))
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
        watch.expects(self.operations() * real(frequencies.len()));
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
        match &self.system {
            System::OneAxis(axis) => {
                let columns = 6 * axis.nodes.len() + axis.timetable.depth.iter().sum::<usize>();
                20.0 * real(axis.timetable.events.len()) * real(columns) + real(columns).powi(3)
            }
            System::Turned(turned) => turned.operations(),
        }
    }

    /// What the device feels like when it is moved slowly: see [`LowFrequencyFit`]. Of a motion along or about another axis than that of the push no size is
    /// definite.
    #[must_use]
    pub fn fit_low_frequency(&self) -> LowFrequencyFit {
        if self.axes[0] != self.axes[1] {
            return LowFrequencyFit::NONE;
        }
        let tied = match &self.system {
            System::OneAxis(axis) => axis.tied,
            System::Turned(turned) => turned.tied(),
        };
        LowFrequencyFit::of(|hz| self.impedance(hz), self.highest.min(0.25 / self.timetable().frame.as_secs_f64()), tied)
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

    /// What the undamped object alone would be felt as where it is held: its mass \[kg\], or its inertia about the axis [kg·m²]. Off the centre, and from one axis to
    /// another, force over acceleration there, in the units of the axes: infinite where such a push would not move it so, and below zero for the other way.
    #[must_use]
    pub const fn object_mass(&self) -> f64 {
        self.mass
    }

    /// The axis of the push, and that of the motion.
    #[must_use]
    pub const fn axes(&self) -> [PushedAxis; 2] {
        self.axes
    }

    /// The parts left out or taken as closed, in words.
    #[must_use]
    pub fn notes(&self) -> &[String] {
        &self.notes
    }

    fn point(&self, hz: f64) -> AdmittancePoint {
        match &self.system {
            System::OneAxis(axis) => axis.point(hz),
            System::Turned(turned) => turned.point(hz),
        }
    }

    /// Whether nothing is left beyond rounding, over some octaves.
    fn is_zero(&self) -> bool {
        let octaves = std::iter::successors(Some(self.highest), |hz| Some(0.25 * hz)).take(6);
        octaves.map(|hz| self.point(hz)).all(|point| point.value.norm() <= point.error)
    }

    /// Force over velocity, at a frequency that is one, and how far rounding may have moved it: 1/(v + d) − 1/v is −d/(v·(v + d)).
    fn impedance(&self, hz: f64) -> (Complex64, f64) {
        let AdmittancePoint { value, error, .. } = self.point(hz);
        let size = value.norm();
        (value.inv(), if error < size { error / (size * (size - error)) } else { f64::INFINITY })
    }

    fn timetable(&self) -> &Timetable {
        match &self.system {
            System::OneAxis(axis) => &axis.timetable,
            System::Turned(turned) => turned.timetable(),
        }
    }

    /// The rate of the ticks of the pushed node, on average over a frame \[Hz\].
    fn tick_rate(&self) -> f64 {
        let pushed = match &self.system {
            System::OneAxis(axis) => axis.pushed,
            System::Turned(turned) => turned.pushed(),
        };
        let own = |event: &&Event| matches!(event, Event::Tick { node, .. } if *node == pushed);
        let timetable = self.timetable();
        real(timetable.events.iter().filter(own).count()) / timetable.frame.as_secs_f64()
    }
}

/// The axis along which a device is pushed, or about which it is turned.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[expect(missing_docs, reason = "x, y and z along the axes of the world, of an object that turns along its own; rx, ry and rz about those")]
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

    /// Whether it is about an axis.
    #[must_use]
    pub const fn is_turn(self) -> bool {
        self.place() > 2
    }

    const fn place(self) -> usize {
        self as usize
    }
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
    #[error(
        "a push along {from} moves the device by nothing along {to}: expected an object with an inertia that is held off its centre, and axes that it couples"
    )]
    Uncoupled { from: &'static str, to: &'static str },
    /// The scene cannot be analysed.
    #[error(transparent)]
    Analysis(#[from] AnalysisError),
}

#[cfg(test)]
mod tests {
    use super::one_axis::closed_contacts;
    use super::*;
    use crate::Matrix;
    use crate::structure::Structure;

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
        let others = real(count - 1);
        structure.weights = Matrix::from_fn(2, 2, |row, column| [[0.0, 1.0], [1.0 / others, (others - 1.0) / others]][row][column]);
        let (axis, radius) = OneAxis::of_classes(&scene, structure, 0, &Unwatched).unwrap();
        Admittance::new(System::OneAxis(Box::new(axis)), radius, Vec::new(), 0.45, [PushedAxis::X; 2])
    }

    /// The more peers, the less the mean of the others moves: in the limit the copy is held by a spring and a damper at rest, and is as far from that as 1/N.
    #[test]
    fn a_hundred_thousand_peers_cost_two_nodes_and_are_near_the_limit() {
        let scene = fifty();
        assert_eq!(with_peers(50).at(1.0).unwrap(), Admittance::of(&scene, 0).unwrap().at(1.0).unwrap());
        let mut limit = with_peers(2);
        let System::OneAxis(axis) = &mut limit.system else { unreachable!("the object does not turn") };
        (axis.weights, axis.tied) = (Matrix::zeros(2, 2), true);
        for hz in [1.0, 8.0, 70.0] {
            let held = limit.at(hz).unwrap().value;
            let apart = |peers: usize| (with_peers(peers).at(hz).unwrap().value - held).norm() / held.norm() * real(peers - 1);
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
