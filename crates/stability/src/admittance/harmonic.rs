//! The steady state of a linear scene under a sine of one frequency.
//!
//! A frame is a linear map from the unknowns u (states relative to the reference, samples of earlier frames) and the push e^{jωt} to the states at the end
//! of the frame and the samples that the frame sends. In steady state every state is e^{jωT} times as large one frame later. A sample from q frames ago was
//! e^{−jωqT} times as large as the sample at the same place of this frame; the number of unknowns does not grow with q, so a long delay adds no cost. A
//! sample is relative to the reference, which has moved since: if the reference moves by D in this frame, the correction is D·e^{−jωT}·Σ_{i<q} e^{−jωiT}.
//! These relations are as many equations as there are unknowns.

use std::f64::consts::TAU;

use num_complex::Complex64;

use super::response::AdmittancePoint;
use crate::factorisation::Lu;
use crate::lifted::{FrameMap, Instrument, Lifted};
use crate::matrix::ComplexMatrix;
use crate::rounding::real;

/// Returns e^{jωt} after the given number of periods. Whole periods are removed first, so that large numbers of periods keep their digits.
pub(super) fn turn(periods: f64) -> Complex64 {
    let angle = TAU * (periods - periods.round());
    Complex64::new(libm::cos(angle), libm::sin(angle))
}

/// Returns e^{jωt} for the frequency `hz` \[Hz\] at the instant `at` \[ns\].
pub(super) fn phase(hz: f64, at: u64) -> Complex64 {
    #[expect(clippy::cast_precision_loss, reason = "a rounding of 2⁻⁵³ of the phase, as that of the product")]
    let seconds = at as f64 * 1e-9;
    turn(hz * seconds)
}

/// Instrument that pushes one device with a sine and sums the component of the device's velocity at the same frequency. Input 0 is the amplitude of the
/// cosine part of the force, input 1 that of the sine part.
struct Sine {
    node: usize,
    hz: f64,
    /// Compliance of the pushed node [m/N]. An input divided by the compliance is a force, so that inputs are lengths like the states.
    compliance: f64,
    /// Sum of e^{−jωt}·v over the ticks so far, one entry per column of the frame's map.
    seen: Vec<Complex64>,
    ticks: usize,
}

impl Instrument for Sine {
    fn inputs(&self) -> usize {
        2
    }

    fn push(&mut self, node: usize, at: u64, inputs: &mut [f64]) -> bool {
        if node != self.node {
            return false;
        }
        let phase = phase(self.hz, at);
        inputs[0] = phase.re / self.compliance;
        inputs[1] = phase.im / self.compliance;
        true
    }

    fn see(&mut self, node: usize, at: u64, velocity: &[f64]) {
        if node != self.node {
            return;
        }
        self.seen.resize(velocity.len(), Complex64::ZERO);
        let back = phase(self.hz, at).conj();
        for (sum, entry) in self.seen.iter_mut().zip(velocity) {
            *sum += back * entry;
        }
        self.ticks += 1;
    }
}

/// The linear equations of the steady state at one frequency.
pub(super) struct Harmonic {
    hz: f64,
    map: FrameMap,
    sine: Sine,
    /// e^{−jωT} with the length T of a frame.
    back: Complex64,
    /// Number of periods of the sine in a frame.
    periods: f64,
    /// Factor from the sum over the ticks, of lengths per length of input, to the mean velocity over the force [1/(N·s)].
    unit: f64,
    matrix: ComplexMatrix,
    right: Vec<Complex64>,
}

impl Harmonic {
    /// Sets up the equations for a sine of frequency `hz` \[Hz\] that pushes the device of `node`.
    pub(super) fn new(lifted: &Lifted<'_>, node: usize, hz: f64) -> Self {
        let compliance = lifted.nodes[node].compliance(lifted.time);
        let mut sine = Sine { node, hz, compliance, seen: Vec::new(), ticks: 0 };
        let map = lifted.frame(&mut sine);
        let periods = hz * lifted.timetable.frame.as_secs_f64();
        let size = map.state_unknowns() + map.used.len();
        let (matrix, right) = (ComplexMatrix::zeros(size, size), vec![Complex64::ZERO; size]);
        let unit = compliance / (real(sine.ticks) * lifted.time);
        let mut harmonic = Self { hz, map, sine, back: turn(-periods), periods, unit, matrix, right };
        harmonic.write_states();
        harmonic.write_samples();
        harmonic
    }

    /// Writes one equation per state: the state after the frame, minus the displacement of the reference, is e^{jωT} times the state before.
    fn write_states(&mut self) {
        let reference = self.map.reference();
        let ahead = self.back.conj();
        for (place, row) in (0..self.map.states.rows()).filter(|row| Some(*row) != reference).enumerate() {
            self.matrix[(place, place)] += ahead;
            let moved = Complex64::from(self.map.displacement(row));
            self.subtract(place, Source::State(row), Complex64::ONE);
            self.subtract_reference(place, moved);
        }
    }

    /// Writes one equation per sample of an earlier frame: e^{−jωqT} times the sample at the same place of this frame, corrected by the displacement of the
    /// reference since then.
    fn write_samples(&mut self) {
        let states = self.map.state_unknowns();
        for number in 0..self.map.used.len() {
            let (node, age) = self.map.used[number];
            let sent = self.map.sent_by(node);
            // Age 1 is the newest sample at the beginning of this frame, that is the last of the frame before; `sent` has the rows of one frame.
            let frames = 1 + (age - 1) / sent.len();
            let place = states + number;
            self.matrix[(place, place)] += Complex64::ONE;
            self.subtract(place, Source::Sent(sent.end - 1 - (age - 1) % sent.len()), turn(-self.periods * real(frames)));
            self.subtract_reference(place, self.back * self.sum_of_turns(frames) * self.map.translation(age));
        }
    }

    /// Returns Σ e^{−jωiT} over i from 0 to `frames` − 1, in a closed form that keeps its digits if ωT is near a multiple of 2π.
    fn sum_of_turns(&self, frames: usize) -> Complex64 {
        let angle = TAU * (self.periods - self.periods.round());
        let half = 0.5 * angle;
        let ratio = if half == 0.0 { real(frames) } else { libm::sin(real(frames) * half) / libm::sin(half) };
        let middle = -half * (real(frames) - 1.0);
        Complex64::new(libm::cos(middle), libm::sin(middle)) * ratio
    }

    /// Subtracts `factor` times a row of the frame's map from the left side of an equation, and adds the row's part of the push to the right side.
    fn subtract(&mut self, equation: usize, source: Source, factor: Complex64) {
        let row = match source {
            Source::State(row) => self.map.states.row(row),
            Source::Sent(row) => self.map.sent.row(row),
        };
        let size = self.matrix.columns();
        for (column, entry) in row.iter().enumerate().take(size) {
            self.matrix[(equation, column)] -= factor * entry;
        }
        // The two columns after the unknowns belong to the inputs, the cosine part and the sine part of the push.
        self.right[equation] += factor * Complex64::new(row[size], row[size + 1]);
    }

    fn subtract_reference(&mut self, equation: usize, factor: Complex64) {
        if let Some(reference) = self.map.reference() {
            self.subtract(equation, Source::State(reference), -factor);
        }
    }

    /// Solves the equations. Returns the admittance with a bound of its rounding error.
    pub(super) fn point(&self) -> AdmittancePoint {
        let size = self.matrix.columns();
        let seen = Seen {
            states: &self.sine.seen[..size],
            push: self.sine.seen[size] + Complex64::I * self.sine.seen[size + 1],
            ticks: self.sine.ticks,
            unit: self.unit,
        };
        solved(self.hz, &self.matrix, &self.right, &seen, self.map.error)
    }
}

/// Coefficients that turn the solution of a steady state into the admittance.
pub(super) struct Seen<'a> {
    /// Coefficient of each unknown in the sum of e^{−jωt}·v over the ticks, indexed by unknown.
    pub(super) states: &'a [Complex64],
    /// Part of the same sum that the push causes without any unknown.
    pub(super) push: Complex64,
    pub(super) ticks: usize,
    /// Factor from the sum to the admittance.
    pub(super) unit: f64,
}

/// Solves the equations of a steady state and returns the admittance with a bound of its rounding error, to first order. `error` bounds the rounding of the
/// coefficients.
pub(super) fn solved(hz: f64, matrix: &ComplexMatrix, right: &[Complex64], seen: &Seen<'_>, error: f64) -> AdmittancePoint {
    let size = matrix.columns();
    let factors = Lu::of(matrix);
    let solution = factors.solve(right);
    let of_states: Complex64 = seen.states.iter().zip(&solution).map(|(state, value)| state * value).sum();
    // A change δM of the matrix M changes the output cᵀ·u by yᵀ·δM·u to first order, where Mᵀ·y = c are the coefficients of the output.
    let weight: f64 = factors.solve_transposed(seen.states).iter().map(|entry| entry.norm()).sum();
    let largest = solution.iter().map(|value| value.norm()).fold(1.0, f64::max);
    let row_sum = |row: usize| (0..size).map(|column| matrix[(row, column)].norm()).sum::<f64>();
    let norm = (0..size).map(row_sum).fold(0.0, f64::max);
    let change = 4.0 * error + f64::EPSILON * real(size) * norm;
    let error = (weight + real(seen.ticks)) * change * largest * seen.unit;
    AdmittancePoint { hz, value: (of_states + seen.push) * seen.unit, error }
}

/// A row of the frame's map.
#[derive(Clone, Copy)]
enum Source {
    State(usize),
    Sent(usize),
}
