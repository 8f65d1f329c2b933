//! Laws of delay and models of loss: cost of a draw, and distance between the draws and the requested law.
//!
//! - [`ways`] to draw a delay: tables as in netem, finer tables, the inverse of the law, the program's own draws, and samplers of other programs;
//! - [`errors`] of a way, computed from its table or its function, and so the same in every run. A way without such a table or function is sampled often, and
//!   the row states the part of the error due to the number of draws;
//! - loss models: number of packets until the mean loss and the mean run of losses are known to some error, compared with theory;
//! - correlated jitter: requested and delivered correlation.

mod chain;
mod correlation;
mod delays;
pub mod errors;
mod losses;
mod other_ways;
pub mod ways;

use std::time::Duration;

use crate::cost::Rounds;
use crate::network::errors::Look;
use crate::watch::RowSink;
use crate::{AccuracyError, Row, Subject, Watch};

/// Amount of work in the rows.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Effort {
    /// Resolution of computed errors.
    pub look: Look,
    /// Number of draws of a way whose error cannot be computed.
    pub draws: usize,
    /// Number of timed rounds of each way. The median of their times gives the cost.
    pub rounds: usize,
    /// Number of packets for the correlation of jitter.
    pub correlated_packets: usize,
    /// Pairs of a number of packets through a loss model and the number of runs.
    pub loss_runs: &'static [(usize, usize)],
}

impl Effort {
    /// Effort of some seconds.
    pub const QUICK: Self = Self {
        look: Look { quantile: 0.999, places_a_cell: 2, places_a_side: 4000 },
        draws: 200_000,
        rounds: 7,
        correlated_packets: 200_000,
        loss_runs: &[(1000, 100), (10_000, 30), (100_000, 10)],
    };

    /// Effort of about a minute.
    pub const FULL: Self = Self {
        look: Look { quantile: 0.999, places_a_cell: 16, places_a_side: 40_000 },
        draws: 2_000_000,
        rounds: 31,
        correlated_packets: 2_000_000,
        loss_runs: &[(1000, 400), (10_000, 200), (100_000, 50), (1_000_000, 10)],
    };

    /// Returns rounds of 200 µs.
    pub(crate) const fn rounds(self) -> Rounds {
        Rounds { count: self.rounds, span: Duration::from_micros(200) }
    }
}

/// Measures the rows of this subject.
///
/// # Errors
///
/// The errors of [`crate::measure`].
pub fn rows(effort: Effort, watch: &dyn Watch) -> Result<Vec<Row>, AccuracyError> {
    let mut done = RowSink { rows: Vec::new(), watch };
    delays::measure(effort, &mut done)?;
    losses::measure(effort, &mut done)?;
    correlation::measure(effort, &mut done)?;
    Ok(done.rows)
}

/// Returns a row of this subject without an error.
fn row(case: &str, method: &str, setting: String, cost: (f64, &'static str)) -> Row {
    Row::of(Subject::Network, case, method, setting, cost)
}

/// Returns a count as a floating-point number.
#[expect(clippy::cast_precision_loss, reason = "counts are small")]
const fn real(count: usize) -> f64 {
    count as f64
}
