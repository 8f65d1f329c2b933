//! The steady state under a sine, at one frequency.
//!
//! A frame is a linear map from its unknowns u (states relative to the reference, samples of earlier frames) and the push e^{jωt} to the states at its end
//! and the samples it sends. In steady state a frame later everything is e^{jωT} times as large, and a sample from q frames ago was e^{−jωqT} times
//! as large as its like of this frame, whatever q: a long delay costs nothing. A sample relative to a reference that moved in between is corrected by how
//! far that went, D·e^{−jωT}·Σ_{i<q} e^{−jωiT} if it goes by D in this frame. That leaves as many equations as unknowns.

use std::f64::consts::TAU;

use num_complex::Complex64;

use super::response::AdmittancePoint;
use crate::factorisation::Lu;
use crate::lifted::{FrameMap, Instrument, Lifted};
use crate::matrix::ComplexMatrix;
use crate::rounding::real;

/// e^{jωt} after that number of periods, whole ones left out first.
pub(super) fn turn(periods: f64) -> Complex64 {
    let angle = TAU * (periods - periods.round());
    Complex64::new(libm::cos(angle), libm::sin(angle))
}

/// e^{jωt} at an instant \[ns\].
pub(super) fn phase(hz: f64, at: u64) -> Complex64 {
    #[expect(clippy::cast_precision_loss, reason = "a rounding of 2⁻⁵³ of the phase, as that of the product")]
    let seconds = at as f64 * 1e-9;
    turn(hz * seconds)
}

/// Pushes one device with a sine and looks at the same frequency. The inputs are the parts of the force that are a cosine and a sine.
struct Sine {
    node: usize,
    hz: f64,
    /// What an input is divided by to make it a force, so that inputs are lengths as states are [m/N].
    compliance: f64,
    /// The sum of e^{−jωt}·v over the ticks, one entry for each column.
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

/// The equations of the steady state.
pub(super) struct Harmonic {
    hz: f64,
    map: FrameMap,
    sine: Sine,
    /// e^{−jωT}, and the periods in a frame.
    back: Complex64,
    periods: f64,
    /// What the mean velocity over the push is multiplied by [1/(N·s)].
    unit: f64,
    matrix: ComplexMatrix,
    right: Vec<Complex64>,
}

impl Harmonic {
    /// A sine of that frequency \[Hz\] at the device of a node.
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

    /// States: what the frame makes of them, less the way of the reference, is e^{jωT} times what they were.
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

    /// Samples of earlier frames: e^{−jωqT} times what this frame sends, less the way of the reference since.
    fn write_samples(&mut self) {
        let states = self.map.state_unknowns();
        for number in 0..self.map.used.len() {
            let (node, age) = self.map.used[number];
            let sent = self.map.sent_by(node);
            let frames = 1 + (age - 1) / sent.len();
            let place = states + number;
            self.matrix[(place, place)] += Complex64::ONE;
            self.subtract(place, Source::Sent(sent.end - 1 - (age - 1) % sent.len()), turn(-self.periods * real(frames)));
            self.subtract_reference(place, self.back * self.sum_of_turns(frames) * self.map.translation(age));
        }
    }

    /// Σ e^{−jωiT} over i below this number of frames, in a closed form that loses no digits where the turns are small or whole.
    fn sum_of_turns(&self, frames: usize) -> Complex64 {
        let angle = TAU * (self.periods - self.periods.round());
        let half = 0.5 * angle;
        let ratio = if half == 0.0 { real(frames) } else { libm::sin(real(frames) * half) / libm::sin(half) };
        let middle = -half * (real(frames) - 1.0);
        Complex64::new(libm::cos(middle), libm::sin(middle)) * ratio
    }

    /// Takes `factor` times a row of the frame's map to the left of an equation, and its push to the right.
    fn subtract(&mut self, equation: usize, source: Source, factor: Complex64) {
        let row = match source {
            Source::State(row) => self.map.states.row(row),
            Source::Sent(row) => self.map.sent.row(row),
        };
        let size = self.matrix.columns();
        for (column, entry) in row.iter().enumerate().take(size) {
            self.matrix[(equation, column)] -= factor * entry;
        }
        self.right[equation] += factor * Complex64::new(row[size], row[size + 1]);
    }

    fn subtract_reference(&mut self, equation: usize, factor: Complex64) {
        if let Some(reference) = self.map.reference() {
            self.subtract(equation, Source::State(reference), -factor);
        }
    }

    /// Solves them, and says how exact the answer is.
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

/// What a steady state is looked at by.
pub(super) struct Seen<'a> {
    /// What each unknown, and the push by itself, adds to the sum of e^{−jωt}·v over the ticks.
    pub(super) states: &'a [Complex64],
    pub(super) push: Complex64,
    pub(super) ticks: usize,
    /// What the sum is multiplied by.
    pub(super) unit: f64,
}

/// Solves the equations of a steady state, of whose coefficients `error` bounds the rounding, and says how exact the answer is.
pub(super) fn solved(hz: f64, matrix: &ComplexMatrix, right: &[Complex64], seen: &Seen<'_>, error: f64) -> AdmittancePoint {
    let size = matrix.columns();
    let factors = Lu::of(matrix);
    let solution = factors.solve(right);
    let of_states: Complex64 = seen.states.iter().zip(&solution).map(|(state, value)| state * value).sum();
    // A change δM of the equations changes the answer by yᵀ·δM·u, where Mᵀ·y picks the output.
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
