//! The admittance of a peer's device: velocity of the device over the force of the hand that pushes the device, at each frequency.
//!
//! The loop has two rates, so a sine of one frequency ω causes velocities at ω and at ω plus each multiple of the frame's frequency. The admittance here is
//! the *fundamental harmonic*, the part of the velocity at ω, for a push e^{jωt} that is sampled and held as every hand force is. The steady state is solved
//! without a simulation (Rakhsha & Constantinescu 2015, Section 4, plot the same admittance for their controllers): one frame of length T multiplies every
//! state by e^{jωT}, which gives one system of linear equations for each frequency.

mod harmonic;
mod low_frequency;
mod one_axis;
mod response;
mod turned;

use cohaptic_peer::Contact;
use cohaptic_scene::Scene;
use num_complex::Complex64;
use rayon::prelude::*;

use crate::analysis::arms_alone;
use crate::network::NominalNetwork;
use crate::pieces::refuse_operators;
use crate::rounding::real;

use crate::timetable::{Event, Timetable};
use crate::{AnalysisError, Radius, UNLOADED, Unwatched, Verdict, Watch};

pub use low_frequency::{Estimate, LowFrequencyFit};
pub use response::{AdmittancePoint, FrequencyResponse, ideal};

use one_axis::{OneAxis, TIMELINE};
use turned::Turned;

/// Number of frequencies that the threads share between two looks at the results.
const TOGETHER: usize = 256;

/// The admittance of one peer's device while the hands of all other peers are at rest, prepared for evaluation at any frequency.
///
/// Equal peers are treated as one class, so the cost does not depend on the number of equal peers. The arms of the scene stay in place, also the arm of the
/// pushed peer: the push is added to the force of the arm. A peer that touches nothing has the admittance of its bare device.
///
/// If a scene is not linear, a linear scene is analysed in its place: every one-sided contact is closed and no copy is at a wall. The changes are listed by
/// [`Admittance::notes`]. In a scene of several axes the push is along the axis along which the peer pushes the object, or along the first axis.
///
/// If the object turns, a push along one axis can also cause motion along or about another axis: see [`Admittance::between_watched`].
#[derive(Clone, Debug)]
pub struct Admittance {
    system: System,
    highest: f64,
    radius: Radius,
    notes: Vec<String>,
    mass: f64,
    axes: [PushedAxis; 2],
}

/// The linear system whose steady state gives the admittance.
#[derive(Clone, Debug)]
enum System {
    OneAxis(Box<OneAxis>),
    Turned(Box<Turned>),
}

/// Returns the admittance of the device of `peer`, an index of [`Scene::peers`], at the given frequencies \[Hz\].
///
/// # Errors
///
/// As [`Admittance::of`] and [`Admittance::response`].
pub fn admittance(scene: &Scene, peer: usize, frequencies: &[f64]) -> Result<FrequencyResponse, AdmittanceError> {
    Admittance::of(scene, peer)?.response(frequencies)
}

impl Admittance {
    /// Prepares the admittance of the device of `peer`, an index of [`Scene::peers`], for the scene at its beginning, before any change by the timeline.
    ///
    /// # Errors
    ///
    /// [`AdmittanceError`] if the scene has no peer with this index, or if the scene cannot be analysed, for example because no frame of it repeats.
    pub fn of(scene: &Scene, peer: usize) -> Result<Self, AdmittanceError> {
        Self::between_watched(scene, peer, None, None, &Unwatched)
    }

    /// Like [`Admittance::of`], for a push along or about the given axis, and the velocity of the same device along or about the axis `seen`. About an axis the
    /// push is a torque and the velocity is an angular velocity. Without `axis` the push is along the axis along which the peer pushes the object, or along the
    /// first axis. Without `seen` the velocity is taken on the axis of the push. The watch can stop the computation of the scene's verdict.
    ///
    /// # Errors
    ///
    /// As [`Admittance::of`]; if the scene does not have one of the axes; if an axis is a rotation and the device of the peer does not turn; if nothing
    /// couples the two axes; for a finger that pushes an object off its centre; and [`AnalysisError::Stopped`] if the watch ends the computation.
    pub fn between_watched(
        scene: &Scene,
        peer: usize,
        axis: Option<PushedAxis>,
        seen: Option<PushedAxis>,
        watch: &dyn Watch,
    ) -> Result<Self, AdmittanceError> {
        let spec = scene.peers.get(peer).ok_or(AdmittanceError::NoSuchPeer { peer, peers: scene.peers.len() })?;
        // All other hands are at rest in an admittance, and an operator who holds an object in place is felt as a stiffness without end.
        refuse_operators(scene, "the admittance")?;
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
        // If the motion of the turning object splits into independent parts, the part with this axis is a scene of one axis. A push seen on another axis
        // always needs the whole motion.
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
        admittance.notes.extend(arms_alone(scene));
        if !scene.timeline.is_empty() {
            admittance.notes.push(TIMELINE.to_owned());
        }
        Ok(admittance)
    }

    fn new(system: System, radius: Radius, notes: Vec<String>, mass: f64, axes: [PushedAxis; 2]) -> Self {
        let mut admittance = Self { system, highest: 0.0, radius, notes, mass, axes };
        // Nyquist's limit of the force and the velocity, which change and are seen once per tick.
        admittance.highest = 0.5 * admittance.tick_rate();
        admittance
    }

    /// Returns the admittance at a frequency \[Hz\].
    ///
    /// # Errors
    ///
    /// [`AdmittanceError::Frequency`] unless the frequency is above 0 and at most [`Admittance::highest_frequency`].
    pub fn at(&self, hz: f64) -> Result<AdmittancePoint, AdmittanceError> {
        if !(hz > 0.0 && hz <= self.highest) {
            return Err(AdmittanceError::Frequency { hz, highest: self.highest });
        }
        Ok(self.point(hz))
    }

    /// Returns the admittance at each of the given frequencies \[Hz\], in their order.
    ///
    /// # Errors
    ///
    /// As [`Admittance::at`], for the first frequency that is out of range.
    pub fn response(&self, frequencies: &[f64]) -> Result<FrequencyResponse, AdmittanceError> {
        self.response_watched(frequencies, &Unwatched)
    }

    /// Like [`Admittance::response`], with a watch. If the watch stops the computation, the points before the first missing frequency are returned. The watch is
    /// told the operations of each point.
    ///
    /// # Errors
    ///
    /// As [`Admittance::at`], for the first frequency that is out of range.
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
        // The threads share one chunk at a time, so that an interruption loses at most the points of one chunk and the finished points are the first.
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

    /// Returns the approximate number of operations for one frequency: each event of a frame works on all columns of its rows, and then a system of linear
    /// equations is solved.
    #[must_use]
    fn operations(&self) -> f64 {
        match &self.system {
            System::OneAxis(axis) => {
                let columns = 6 * axis.nodes.len() + axis.timetable.depth.iter().sum::<usize>();
                20.0 * real(axis.timetable.events.len()) * real(columns) + real(columns).powi(3)
            }
            System::Turned(turned) => turned.operations(),
        }
    }

    /// Returns the stiffness, viscosity and inertia that a hand feels in slow motion of the device: see [`LowFrequencyFit`]. If the velocity is taken on
    /// another axis than the push, all three estimates are NaN with an infinite error.
    #[must_use]
    pub fn fit_low_frequency(&self) -> LowFrequencyFit {
        if self.axes[0] != self.axes[1] {
            return LowFrequencyFit::NONE;
        }
        let tied = match &self.system {
            System::OneAxis(axis) => axis.tied,
            System::Turned(turned) => turned.tied(),
        };
        // Slow motion is slow compared with the frame: a quarter of the rate of frames leaves four frames per period.
        LowFrequencyFit::of(|hz| self.impedance(hz), self.highest.min(0.25 / self.timetable().frame.as_secs_f64()), tied)
    }

    /// Returns the highest frequency with an admittance: half the rate of the peer's ticks \[Hz\].
    #[must_use]
    pub const fn highest_frequency(&self) -> f64 {
        self.highest
    }

    /// Returns the spectral radius over one frame of the linear scene that is analysed.
    #[must_use]
    pub const fn radius(&self) -> Radius {
        self.radius
    }

    /// Returns the verdict on the linear scene that is analysed. An unstable scene has no steady state: its admittance follows from the equations, but cannot
    /// be measured.
    #[must_use]
    pub fn verdict(&self) -> Verdict {
        self.radius.verdict()
    }

    /// Returns force over acceleration of the undamped object alone at the point where the peer holds the object: the object's mass \[kg\], or its inertia
    /// about the axis [kg·m²]. For a grip off the centre or two different axes the quotient is in the units of the axes. The quotient is infinite if the push
    /// causes no acceleration on the second axis, and negative if the acceleration has the opposite sign.
    #[must_use]
    pub const fn object_mass(&self) -> f64 {
        self.mass
    }

    /// Returns the axis of the push and the axis of the motion, in this order.
    #[must_use]
    pub const fn axes(&self) -> [PushedAxis; 2] {
        self.axes
    }

    /// Returns sentences about the parts of the scene that are left out or simplified, such as walls left out and one-sided contacts taken as closed.
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

    /// Tells whether the admittance is within its rounding error of zero at six frequencies, each a quarter of the frequency before.
    fn is_zero(&self) -> bool {
        let octaves = std::iter::successors(Some(self.highest), |hz| Some(0.25 * hz)).take(6);
        octaves.map(|hz| self.point(hz)).all(|point| point.value.norm() <= point.error)
    }

    /// Returns force over velocity at a valid frequency \[Hz\], and a bound of its rounding error. With admittance v and rounding d of the admittance, the
    /// difference 1/(v + d) − 1/v is −d/(v·(v + d)). The bound is infinite if the rounding can be as large as the admittance.
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

    /// Returns the mean rate of the pushed node's ticks over a frame \[Hz\].
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

/// An axis of a device: along `X`, `Y` and `Z` the device is pushed, about `Rx`, `Ry` and `Rz` the device is turned.
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
    /// All six axes, in the order `X` to `Rz`.
    pub const ALL: [Self; 6] = [Self::X, Self::Y, Self::Z, Self::Rx, Self::Ry, Self::Rz];

    /// Returns the name of the axis in options of the program: `x` to `rz`.
    #[must_use]
    pub const fn word(self) -> &'static str {
        ["x", "y", "z", "rx", "ry", "rz"][self.place()]
    }

    /// Tells whether the axis is one of rotation: `Rx`, `Ry` or `Rz`.
    #[must_use]
    pub const fn is_turn(self) -> bool {
        self.place() > 2
    }

    const fn place(self) -> usize {
        self as usize
    }
}

/// Reason for which an admittance cannot be computed.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
#[expect(missing_docs, reason = "the messages describe the variants")]
#[non_exhaustive]
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

    /// Returns the admittance of the first peer of [`fifty`] with `count` peers, which may be more peers than a scene can have.
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

    /// The more peers, the less the mean of the other peers moves. In the limit the copy is held by a spring and a damper at rest; the distance of the
    /// admittance from the limit is proportional to 1/N.
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

    /// b = bH + N·KT·(τ + δ), δ = BT·(Tc²/m)·(M² − 1)/12: see scenarios/README.md. The law holds far below the frequency KT/(2πb), which is 0.14 mHz here.
    /// At such a frequency the bound of the impedance's rounding error is some 10⁻⁴ of the impedance.
    #[test]
    fn the_viscosity_of_a_hundred_thousand_peers_follows_the_law() {
        let fit = with_peers(100_000).fit_low_frequency();
        let expected = 5.0 + 1e5 * 1000.0 * (0.0115 + 5.0 * 1e-6 / 0.45 * 63.0 / 12.0);
        assert!((fit.viscosity.value / expected - 1.0).abs() < 0.005 && fit.viscosity.error < 1e-3 * expected, "{fit:?}, {expected}");
    }
}
