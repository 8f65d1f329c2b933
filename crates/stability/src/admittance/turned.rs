//! The admittance for an object that turns and whose motion does not split into independent parts: one component of a device is pushed, and the velocity of
//! the same or another component is measured.
//!
//! A frame maps the states z to A·z + B·u, where the push has the parts Re and Im of u·e^{jωt}. In steady state every state is e^{jωT} times as large one
//! frame later, so (e^{jωT}·I − A)·z = B·u. The matrix A, and the device's velocity at each tick as a function of z, do not depend on the frequency.

use std::collections::VecDeque;

use cohaptic_scene::Scene;
use num_complex::Complex64;

use super::harmonic::{Seen, phase, solved, turn};
use super::response::AdmittancePoint;
use crate::matrix::ComplexMatrix;
use crate::network::NominalNetwork;
use crate::rounding::real;

use crate::timetable::{Instants, Timetable};
use crate::turning::{Together, mode_of};
use crate::{AnalysisError, Matrix, Method, Radius, Watch};

/// A scene whose object turns, in which one component of a device is pushed.
#[derive(Clone, Debug)]
pub(super) struct Turned {
    together: Together,
    /// Index of the pushed peer's class.
    pushed: usize,
    /// Component that is pushed and component whose velocity is measured; 0 to 2 are along the axes, 3 to 5 about them.
    components: [usize; 2],
    /// The instants of the ticks of the pushed class \[ns\].
    ticks: Vec<u64>,
    frame: Matrix,
    error: f64,
    /// Velocity of the measured component for a unit of each state (row) at each tick of a frame (column), multiplied by the common time.
    velocities: Matrix,
}

impl Turned {
    /// Prepares the push of the device of `peer`. `components` are the pushed and the measured component. Returns the system with the scene's spectral radius.
    pub(super) fn of(
        scene: &Scene,
        peer: usize,
        components: [usize; 2],
        network: &NominalNetwork,
        watch: &dyn Watch,
    ) -> Result<(Self, Radius), AnalysisError> {
        let together = Together::with_alone(scene, network, peer, watch)?;
        let radius = mode_of(&together, Method::Reduced, watch)?.radius;
        let structure = &together.structure;
        let pushed = structure.classes.iter().position(|class| class[0] == peer).expect("every peer is in a class");
        let ticks = Instants::of(&structure.timetable).ticks.swap_remove(pushed);
        let (time, mut seen) = (together.time(), VecDeque::new());
        let mut looks = |node: usize, _: u64, device: &[cohaptic_peer::Motion]| {
            if node == pushed {
                seen.push_back(device[components[1]].velocity * time);
            }
            None
        };
        together.turning().cost().begin(watch)?;
        let (frame, error) = together.turning().monodromy_under(&mut looks, watch).ok_or(AnalysisError::Stopped)?;
        // The frame runs once per state, and each run looks at all ticks, so the velocities come in the order of the matrix's rows.
        let velocities = Matrix::from_fn(frame.rows(), ticks.len(), |_, _| seen.pop_front().unwrap_or(0.0));
        Ok((Self { pushed, components, ticks, frame, error, velocities, together }, radius))
    }

    /// Returns the admittance at a valid frequency `hz` \[Hz\].
    pub(super) fn point(&self, hz: f64) -> AdmittancePoint {
        let Self { together, components, ticks, frame, velocities, .. } = self;
        let (turning, time, node) = (together.turning(), together.time(), together.node(self.pushed));
        // An input divided by the compliance is a force, so that inputs are lengths like the states.
        let compliance = node.mobility * time;
        let mut push = Complex64::ZERO;
        let mut under = |part: fn(Complex64) -> f64, factor: Complex64| {
            let mut hand = |place: usize, at: u64, device: &[cohaptic_peer::Motion]| {
                (place == self.pushed).then(|| {
                    push += factor * phase(hz, at).conj() * device[components[1]].velocity * time;
                    (components[0], part(phase(hz, at)) / compliance)
                })
            };
            turning.forced(&mut hand)
        };
        let (cosine, sine) = (under(|phase| phase.re, Complex64::ONE), under(|phase| phase.im, Complex64::I));
        let size = frame.rows();
        let ahead = turn(hz * together.structure.timetable.frame.as_secs_f64());
        let matrix = ComplexMatrix::from_fn(size, size, |row, column| if row == column { ahead } else { Complex64::ZERO } - frame[(row, column)]);
        let right: Vec<Complex64> = cosine.iter().zip(&sine).map(|(cosine, sine)| Complex64::new(*cosine, *sine)).collect();
        let back: Vec<Complex64> = ticks.iter().map(|at| phase(hz, *at).conj()).collect();
        let states: Vec<Complex64> = (0..size).map(|state| velocities.row(state).iter().zip(&back).map(|(v, back)| back * v).sum()).collect();
        let lengths: f64 = components.iter().map(|component| if *component > 2 { node.length } else { 1.0 }).product();
        let unit = compliance / (real(ticks.len()) * time * lengths);
        solved(hz, &matrix, &right, &Seen { states: &states, push, ticks: ticks.len(), unit }, self.error)
    }

    /// Returns force over acceleration of the object alone at the grip: 1/Wᵢⱼ with W = G·M⁻¹·Gᵀ, grip matrix G and the object's masses and inertias M.
    pub(super) fn mass(&self, scene: &Scene) -> f64 {
        let node = self.together.node(self.pushed);
        let [from, to] = self.components.map(|component| &node.grip[component]);
        let inertia = scene.rotation.as_ref().map_or([0.0; 3], |rotation| rotation.inertia);
        let lengths: f64 = self.components.iter().map(|component| if *component > 2 { node.length } else { 1.0 }).product();
        let mass = |axis: usize| if axis < 3 { scene.object.mass } else { inertia[axis - 3] / (node.length * node.length) };
        lengths / (0..6).map(|axis| from[axis] * to[axis] / mass(axis)).sum::<f64>()
    }

    /// Tells whether something ties the pushed component to ground.
    pub(super) fn tied(&self) -> bool {
        !self.together.turning().moves_freely(self.pushed, self.components[0])
    }

    pub(super) const fn timetable(&self) -> &Timetable {
        &self.together.structure.timetable
    }

    pub(super) const fn pushed(&self) -> usize {
        self.pushed
    }

    /// Returns the approximate number of operations for one frequency: see [`super::Admittance::operations`].
    pub(super) fn operations(&self) -> f64 {
        40.0 * real(self.timetable().events.len()) + 4.0 * real(self.frame.rows()).powi(3)
    }
}
