//! Stability of a scene: cost of a verdict by each method, and its error against numbers of fifty digits. For random scenes: the information in a number of
//! runs.

mod boundary;
mod every_pattern;
pub mod growth;
mod mean_square;
mod monte_carlo;
mod radius;
pub mod references;

use crate::watch::RowSink;
use crate::{AccuracyError, Row, Subject, Watch};

/// Amount of work in the rows.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Effort {
    /// Number of timed rounds of a verdict. The median of their times gives the cost.
    pub rounds: usize,
    /// Numbers of frames over which a disturbance is simulated.
    pub growth_frames: &'static [u32],
    /// Lengths of the simulations for the verdicts of a boundary \[s\].
    pub boundary_seconds: &'static [u64],
    /// Numbers of runs of a random scene.
    pub runs: &'static [u32],
}

impl Effort {
    /// Effort of some seconds.
    pub const QUICK: Self = Self { rounds: 5, growth_frames: &[50, 200, 800], boundary_seconds: &[1, 4, 16], runs: &[100, 1000, 10_000] };

    /// Effort of about a minute.
    pub const FULL: Self =
        Self { rounds: 15, growth_frames: &[50, 200, 800, 3200], boundary_seconds: &[1, 4, 16, 64, 256], runs: &[100, 1000, 10_000, 100_000] };
}

/// Measures the rows of this subject.
///
/// # Errors
///
/// The errors of [`crate::measure`].
pub fn rows(effort: Effort, watch: &dyn Watch) -> Result<Vec<Row>, AccuracyError> {
    let mut done = RowSink { rows: Vec::new(), watch };
    radius::measure(effort, &mut done)?;
    boundary::measure(effort, &mut done)?;
    mean_square::measure(effort, &mut done)?;
    monte_carlo::measure(effort, &mut done)?;
    Ok(done.rows)
}

/// Returns a row of this subject without an error.
fn row(case: &str, method: &str, setting: String, cost: (f64, &'static str), reference: &'static str) -> Row {
    Row { reference, ..Row::of(Subject::Analysis, case, method, setting, cost) }
}
