//! Laws of delay and models of loss: what a draw costs, and how far the draws are from the law asked for.
//!
//! - [`ways`] to draw a delay: tables as netem has them and finer ones, the inverse of the law, what the program draws, and others' samplers;
//! - [`errors`] of a way: computed from its table or its function, so that they are the same every time. What can only be drawn is drawn often, and
//!   the row says how much of its error is that of the number of draws.
//! - loss models: how many packets it takes until the mean loss and the mean run of losses are known to some error, compared with theory;
//! - jitter that hangs together from packet to packet: what was asked for, and what comes out.

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
use crate::row::RowSink;
use crate::{AccuracyError, Row, Subject, Watch};

/// How much work there is in the rows.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Effort {
    /// How closely computed errors are looked for.
    pub look: Look,
    /// How many draws there are of a way whose error cannot be computed.
    pub draws: usize,
    /// In how many rounds costs are measured.
    pub rounds: usize,
    /// How many packets are sent for the correlation of jitter.
    pub correlated_packets: usize,
    /// For each number of packets through a loss model, the number of runs.
    pub loss_runs: &'static [(usize, usize)],
}

impl Effort {
    /// Seconds.
    pub const QUICK: Self = Self {
        look: Look { quantile: 0.999, places_a_cell: 2, places_a_side: 4000 },
        draws: 200_000,
        rounds: 7,
        correlated_packets: 200_000,
        loss_runs: &[(1000, 100), (10_000, 30), (100_000, 10)],
    };

    /// About a minute.
    pub const FULL: Self = Self {
        look: Look { quantile: 0.999, places_a_cell: 16, places_a_side: 40_000 },
        draws: 2_000_000,
        rounds: 31,
        correlated_packets: 2_000_000,
        loss_runs: &[(1000, 400), (10_000, 200), (100_000, 50), (1_000_000, 10)],
    };

    pub(crate) const fn rounds(self) -> Rounds {
        Rounds { count: self.rounds, span: Duration::from_micros(200) }
    }
}

/// The rows of this subject.
///
/// # Errors
///
/// As [`crate::measure`].
pub fn rows(effort: Effort, watch: &dyn Watch) -> Result<Vec<Row>, AccuracyError> {
    let mut done = RowSink { rows: Vec::new(), watch };
    delays::measure(effort, &mut done)?;
    losses::measure(effort, &mut done)?;
    correlation::measure(effort, &mut done)?;
    Ok(done.rows)
}

/// A row of this subject without its case, method and errors.
fn row(case: &str, method: &str, setting: String, cost: (f64, &'static str)) -> Row {
    Row::of(Subject::Network, case, method, setting, cost)
}

/// A count as a number.
#[expect(clippy::cast_precision_loss, reason = "counts are small")]
const fn real(count: usize) -> f64 {
    count as f64
}
