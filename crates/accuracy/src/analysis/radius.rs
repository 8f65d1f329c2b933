//! Spectral radius of a scene by each method.

use std::time::Duration;

use cohaptic_stability::{Analysis, Method, analyse};

use super::growth::growth_over;
use super::references::{Reference, references};
use super::{Effort, row};
use crate::cost::{median_time, processor_time};
use crate::watch::RowSink;
use crate::{AccuracyError, Row};

const UNIT: &str = "spectral radius [1]";
const COST: &str = "µs a verdict";
const REFERENCE: &str = "50 digits";

/// Measures the rows of all reference scenes.
pub(super) fn measure(effort: Effort, done: &mut RowSink<'_>) -> Result<(), AccuracyError> {
    for reference in references() {
        done.check()?;
        of_scene(&reference, effort, done)?;
    }
    Ok(())
}

/// Measures the rows of one reference scene.
fn of_scene(reference: &Reference, effort: Effort, done: &mut RowSink<'_>) -> Result<(), AccuracyError> {
    let Reference { name, scene, radius, frames } = reference;
    let case = format!("radius, {name}");
    // The full matrix of a thousand frames or of 4096 peers takes more than a minute, and so does a simulation of these scenes.
    let small = frames.is_none_or(|frames| frames < 100) && scene.peers.len() < 100;
    for method in [Method::Full, Method::Reduced, Method::Determinant] {
        if method == Method::Full && !small {
            continue;
        }
        let start = processor_time();
        let analysis = analyse(scene, method)?;
        let once = processor_time() - start;
        // For a small matrix the analysis does not use the determinant, even if asked.
        if analysis.method != method {
            continue;
        }
        done.push(verdict_row(&case, &analysis, *radius, cost(once, effort, || analyse(scene, method))))?;
    }
    // Simulations of the large scenes take too long, see above.
    if !small {
        return Ok(());
    }
    for frames in effort.growth_frames {
        let start = processor_time();
        let Some(found) = growth_over(scene, *frames) else { continue };
        let once = processor_time() - start;
        let note =
            "growth of a disturbance from three tenths to eight tenths of the time; claims no error, and ends where the disturbance is rounding";
        let cost = cost(once, effort, || growth_over(scene, *frames));
        let row = row(&case, "growth", format!("{frames} frames"), (micros(cost), COST), REFERENCE);
        done.push(Row { error: Some((found - radius).abs()), error_unit: UNIT, note: note.to_owned(), ..row })?;
    }
    Ok(())
}

/// Returns the row of an analysis.
fn verdict_row(case: &str, analysis: &Analysis, radius: f64, cost: Duration) -> Row {
    let note = format!("claims an error of at most {:.0e}; {} states, from the scene on", analysis.radius.error, analysis.dimension);
    let row = row(case, analysis.method.word(), String::new(), (micros(cost), COST), REFERENCE);
    Row { error: Some((analysis.radius.value - radius).abs()), error_unit: UNIT, note, ..row }
}

/// Returns the median of some rounds, or the time `once` of the first run if it was long.
fn cost<T>(once: Duration, effort: Effort, work: impl FnMut() -> T) -> Duration {
    if once > Duration::from_millis(100) { once } else { median_time(effort.rounds, work) }
}

fn micros(cost: Duration) -> f64 {
    cost.as_secs_f64() * 1e6
}
