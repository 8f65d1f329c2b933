//! Motion between ticks: the exact propagator compared with integrators that use sub-steps.
//!
//! All methods do the same work: two peers compute their forces at ticks of 1 ms and hold them. The methods differ in the motion of a body under a held
//! force. The reference is the same loop with at least 100 bits and the exact exponential.

mod advance;
mod boundary;
mod exponential;
mod method;
mod number;
mod scenes;
#[cfg(test)]
mod tests;
mod world;

use std::time::Duration;

use cohaptic_peer::{Motion, Number as _, StepMap};
use cohaptic_stability::{Boundary, BoundaryOptions, KeyRange};
use qd::Quad;

use crate::cost::median_time;
use crate::watch::RowSink;
use crate::{AccuracyError, Options, Row, Subject, Watch};
use method::Method;
use number::{Number as _, absolute};
use scenes::{MotionScene, SCENES, TICK_NANOS};
use world::{Pair, energy, run};

const COST: &str = "ns a tick";
const POSITION: &str = "position [m]";
const ENERGY: &str = "energy [J]";
const STIFFNESS: &str = "critical stiffness [N/m]";
const LOOP: &str = "the same loop with 100 bits and the exact exponential";
const ROOT: &str = "root of the characteristic equation with 100 bits and the exact exponential";

/// Measures the rows of this subject.
///
/// # Errors
///
/// The errors of [`crate::measure`].
pub fn rows(options: Options, watch: &dyn Watch) -> Result<Vec<Row>, AccuracyError> {
    let mut sink = RowSink { rows: Vec::new(), watch };
    for motion in &SCENES {
        let work = Work::prepare(motion, options)?;
        for method in Method::all(options) {
            sink.check()?;
            work.rows(motion, method).into_iter().try_for_each(|row| sink.push(row))?;
        }
        work.second_witness(motion)?.map_or(Ok(()), |row| sink.push(row))?;
    }
    Ok(sink.rows)
}

/// A scene and its reference.
pub(crate) struct Work {
    pub(crate) pair: Pair,
    /// Bodies of the reference after every tick.
    pub(crate) reference: Vec<[Motion<Quad>; 4]>,
    /// Critical stiffness of the reference \[N/m\]; `None` for a scene without a boundary.
    pub(crate) critical: Option<Quad>,
    /// Number of timed runs of each method. The median of their times gives the cost.
    rounds: usize,
}

impl Work {
    /// Computes the reference of a scene.
    pub(crate) fn prepare(motion: &MotionScene, options: Options) -> Result<Self, AccuracyError> {
        // The full run lasts four seconds of simulated time, many time constants of each scene.
        let (ticks, rounds) = if options.quick { (1000, 7) } else { (4000, 31) };
        let pair = Pair::of(motion, &motion.scene()?, ticks);
        // One exact map per body, computed from the exact values of the parameters.
        let maps: [StepMap<Quad>; 4] = pair.plants.map(|plant| exponential::exact_map(&plant, TICK_NANOS));
        let mut reference = Vec::with_capacity(ticks);
        run(&pair, &maps, |_, bodies| reference.push(*bodies));
        let critical = motion.boundary.and_then(|range| boundary::critical(&pair, range, &maps));
        Ok(Self { pair, reference, critical, rounds })
    }

    /// Returns cost and errors of a method.
    fn rows(&self, motion: &MotionScene, method: Method) -> Vec<Row> {
        let work = || method.run(&self.pair, |_, _| {});
        let cost = nanos(median_time(self.rounds, work)) / f64_of(self.pair.hands.len());
        let (position, energy) = self.errors(method);
        let row = |error: Option<f64>, error_unit, reference, note: &str| Row {
            error,
            error_unit,
            reference,
            note: note.to_owned(),
            ..Row::of(Subject::Motion, motion.name, method.name(), method.setting(), (cost, COST))
        };
        let note = |error: Option<f64>| if error.is_none() { "diverged: not a finite number within the run" } else { "" };
        let mut rows = vec![row(position, POSITION, LOOP, note(position)), row(energy, ENERGY, LOOP, note(energy))];
        if let (Some(range), Some(right)) = (motion.boundary, self.critical) {
            let found = boundary::critical(&self.pair, range, &boundary::quadruple(&method.maps(&self.pair)));
            let error = found.map(|found| absolute(found - right).rounded());
            let note = if error.is_none() { "it sees no stiffness in the range at which the loop turns unstable" } else { "" };
            rows.push(row(error, STIFFNESS, ROOT, note));
        }
        rows
    }

    /// Returns the largest error of a position \[m\] and of the energy \[J\] over all ticks; `None` for an error that is not finite.
    pub(crate) fn errors(&self, method: Method) -> (Option<f64>, Option<f64>) {
        let (mut position, mut stored) = (0.0, 0.0);
        // Differences are taken with 100 bits: the errors of the exact propagator are a few units in the last place.
        method.run(&self.pair, |tick, bodies| {
            let exactly = bodies.map(|body| Motion { position: Quad::of(body.position), velocity: Quad::of(body.velocity) });
            let right = &self.reference[tick];
            for (body, right) in exactly.iter().zip(right) {
                position = worse(position, absolute(body.position - right.position).rounded());
            }
            stored = worse(stored, absolute(energy(&self.pair, &exactly) - energy(&self.pair, right)).rounded());
        });
        // A diverged run has no error to plot, and its row says so.
        let finite = |error: f64| error.is_finite().then_some(error);
        (finite(position), finite(stored))
    }

    /// Measures the boundary as `cohaptic stability boundary` finds it: another matrix, made by other code, in doubles.
    fn second_witness(&self, motion: &MotionScene) -> Result<Option<Row>, AccuracyError> {
        let (Some((along, low, high)), Some(right)) = (motion.boundary, self.critical) else { return Ok(None) };
        let start = crate::cost::processor_time();
        let Some(found) = program_boundary(motion, (along.key(), low, high))? else { return Ok(None) };
        let cost = crate::cost::processor_time() - start;
        let cost = (nanos(cost) / 1e6, "ms a boundary");
        Ok(Some(Row {
            error: Some(absolute(Quad::of(found) - right).rounded()),
            error_unit: STIFFNESS,
            reference: ROOT,
            note: "a second witness: another matrix by other code, halved until a radius cannot be told from 1".to_owned(),
            ..Row::of(Subject::Motion, motion.name, "stability boundary of the program", String::new(), cost)
        }))
    }
}

/// Returns the first crossing that the program finds \[N/m\].
pub(crate) fn program_boundary(motion: &MotionScene, (key, low, high): (&str, f64, f64)) -> Result<Option<f64>, AccuracyError> {
    let range = KeyRange { key: key.to_owned(), low, high, unit: String::new() };
    // The second witness is asked for as many digits as its radius can resolve.
    let options = BoundaryOptions { tolerance: 1e-9, ..BoundaryOptions::of(&range) };
    let family = motion.family(range)?;
    let boundary = Boundary::find(&family, options, &[], |_| (), || false)?;
    Ok(boundary.crossings.first().map(|crossing| crossing.value))
}

/// Returns the larger error; a NaN counts as infinite.
fn worse(before: f64, now: f64) -> f64 {
    if now.is_nan() { f64::INFINITY } else { before.max(now) }
}

fn nanos(time: Duration) -> f64 {
    time.as_secs_f64() * 1e9
}

#[expect(clippy::cast_precision_loss, reason = "far below 2^53")]
fn f64_of(count: usize) -> f64 {
    count as f64
}
