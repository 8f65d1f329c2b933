//! Whether a scene is stable: what a verdict costs by each method, and how far it is from numbers of fifty digits; and by runs that are left to chance,
//! how much a number of them tells.

mod boundary;
mod every_pattern;
pub mod growth;
mod mean_square;
mod monte_carlo;
mod radius;
pub mod references;

use crate::row::RowSink;
use crate::{AccuracyError, Row, Subject, Watch};

/// How much work there is in the rows.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Effort {
    /// In how many rounds the cost of a verdict is measured.
    pub rounds: usize,
    /// Over how many frames a disturbance is simulated.
    pub growth_frames: &'static [u32],
    /// How many seconds are simulated for the verdicts of a boundary.
    pub boundary_seconds: &'static [u64],
    /// How many runs there are of a scene that is left to chance.
    pub runs: &'static [u32],
}

impl Effort {
    /// Seconds.
    pub const QUICK: Self = Self { rounds: 5, growth_frames: &[50, 200, 800], boundary_seconds: &[1, 4, 16], runs: &[100, 1000, 10_000] };

    /// About a minute.
    pub const FULL: Self =
        Self { rounds: 15, growth_frames: &[50, 200, 800, 3200], boundary_seconds: &[1, 4, 16, 64, 256], runs: &[100, 1000, 10_000, 100_000] };
}

/// The rows of this subject.
///
/// # Errors
///
/// As [`crate::measure`].
pub fn rows(effort: Effort, watch: &dyn Watch) -> Result<Vec<Row>, AccuracyError> {
    let mut done = RowSink { rows: Vec::new(), watch };
    radius::measure(effort, &mut done)?;
    boundary::measure(effort, &mut done)?;
    mean_square::measure(effort, &mut done)?;
    monte_carlo::measure(effort, &mut done)?;
    Ok(done.rows)
}

/// A row of this subject that has no error yet.
fn row(case: &str, method: &str, setting: String, cost: (f64, &'static str), reference: &'static str) -> Row {
    Row { reference, ..Row::of(Subject::Analysis, case, method, setting, cost) }
}
