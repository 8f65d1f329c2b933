//! Rotation between ticks: a free top near its unstable axis, by the methods of the program and by other methods.
//!
//! No torque acts on the top, so its energy and its angular momentum in world axes are constant, and its motion has a closed form. The top flips repeatedly,
//! so an error of the angular velocity becomes an error of the angle.

mod closed_form;
mod elliptic;
mod methods;
#[cfg(test)]
mod tests;

use std::array::from_fn;
use std::time::Duration;

use cohaptic_peer::rotation::{Attitude, Triple};

use crate::cost::{median_time, nanos};
use crate::watch::RowSink;
use crate::{AccuracyError, Options, Row, Subject, Watch};
use closed_form::FreeTop;
use methods::Method;

const CASE: &str = "free top near its unstable axis";
const COST: &str = "µs per second of motion";
const ERRORS: [&str; 3] = ["angle [rad]", "energy [relative]", "momentum in world axes [relative]"];
const REFERENCES: [&str; 3] = ["closed form by Jacobi's functions", "its first value", "its first value"];

/// Principal moments of inertia [kg·m²].
const INERTIA: Triple = [3e-5, 5e-5, 9e-5];
/// Initial angular velocity [rad/s].
const RATE: Triple = [0.02, 12.0, 0.02];
/// Length of the motion \[s\].
const SECONDS: u32 = 20;
/// Time between two comparisons with the reference, a multiple of every step.
const LOOK: Duration = Duration::from_millis(4);

/// Measures the rows of this subject.
///
/// # Errors
///
/// The errors of [`crate::measure`].
pub fn rows(options: Options, watch: &dyn Watch) -> Result<Vec<Row>, AccuracyError> {
    let micros: &[u64] = options.of(&[4000, 2000, 1000, 500, 250, 125], &[4000, 1000, 250]);
    let rounds = options.of(31, 7);
    let mut sink = RowSink { rows: Vec::new(), watch };
    let reference = reference();
    for method in Method::ALL {
        for step in micros.iter().copied().map(Duration::from_micros) {
            sink.check()?;
            let work = || method.run(INERTIA, START, step, steps(Duration::from_secs(1), step), |_, _| {});
            let cost = (nanos(median_time(rounds, work)) / 1e3, COST);
            for ((error, error_unit), reference) in errors(&reference, method, step).into_iter().zip(ERRORS).zip(REFERENCES) {
                sink.push(Row {
                    error: error.is_finite().then_some(error),
                    error_unit,
                    reference,
                    note: method.note().to_owned(),
                    ..Row::of(Subject::Rotation, CASE, method.name(), format!("{step:?} a step"), cost)
                })?;
            }
        }
    }
    Ok(sink.rows)
}

const START: Attitude = Attitude { rate: RATE, ..Attitude::REST };

/// Returns the number of steps in a span.
fn steps(span: Duration, step: Duration) -> u32 {
    u32::try_from(span.as_nanos() / step.as_nanos()).unwrap_or(u32::MAX)
}

/// Returns the attitudes of the closed form at the instants of comparison.
fn reference() -> Vec<Attitude> {
    FreeTop::new(INERTIA, RATE).attitudes(LOOK.as_secs_f64(), steps(Duration::from_secs(SECONDS.into()), LOOK))
}

/// Returns the largest errors: of the angle \[rad\], and of energy and momentum relative to their initial values.
fn errors(reference: &[Attitude], method: Method, step: Duration) -> [f64; 3] {
    let (energy, momentum) = (energy(&START), momentum(&START));
    let size = norm(momentum);
    let every = steps(LOOK, step);
    let count = u32::try_from(reference.len()).unwrap_or(u32::MAX) * every;
    let mut errors = [0.0_f64; 3];
    method.run(INERTIA, START, step, count, |done, body| {
        // The reference exists only at the instants of comparison.
        if !done.is_multiple_of(every) {
            return;
        }
        let right = &reference[(done / every - 1) as usize];
        let apart: Triple = from_fn(|axis| self::momentum(body)[axis] - momentum[axis]);
        let found = [body.angle_to(&right.orientation), (self::energy(body) / energy - 1.0).abs(), norm(apart) / size];
        // `max` would ignore a NaN, so a NaN counts as infinite.
        errors = from_fn(|kind| if found[kind].is_nan() { f64::INFINITY } else { errors[kind].max(found[kind]) });
    });
    errors
}

/// Returns twice the energy \[J\].
fn energy(body: &Attitude) -> f64 {
    (0..3).map(|axis| INERTIA[axis] * body.rate[axis] * body.rate[axis]).sum()
}

/// Returns the angular momentum in world axes [N·m·s].
fn momentum(body: &Attitude) -> Triple {
    let matrix = body.matrix();
    from_fn(|row| (0..3).map(|axis| matrix[row][axis] * INERTIA[axis] * body.rate[axis]).sum())
}

fn norm(vector: Triple) -> f64 {
    libm::sqrt(vector.iter().map(|component| component * component).sum())
}
