//! Reasons for the refusal of a netem as a qdisc.

use core::fmt;
use core::time::Duration;

use crate::netem::{Contradiction, TableName};

/// Reason for the refusal of a netem as a qdisc.
#[derive(Clone, PartialEq, Eq, Debug)]
#[non_exhaustive]
pub enum QdiscError {
    /// The options contradict each other.
    Contradiction(Contradiction),
    /// A distribution has no table.
    UnknownTable {
        /// Name of the distribution.
        name: TableName,
    },
    /// A delay beyond the 2³² ticks of 64 ns of `tc`.
    DelayTooLong {
        /// The delay or the jitter.
        delay: Duration,
    },
}

impl fmt::Display for QdiscError {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Contradiction(error) => fmt::Display::fmt(error, f),
            Self::UnknownTable { name } => write!(
                f,
                "no table for the distribution \"{}\": expected uniform, normal, pareto, paretonormal or a table that was given",
                name.as_str()
            ),
            Self::DelayTooLong { delay } => {
                write!(f, "a delay of {}: expected less than 274.877907s, which is what 32 bits of ticks hold", cohaptic_units::print::Span(*delay))
            }
        }
    }
}

impl core::error::Error for QdiscError {}

impl From<Contradiction> for QdiscError {
    fn from(error: Contradiction) -> Self {
        Self::Contradiction(error)
    }
}
