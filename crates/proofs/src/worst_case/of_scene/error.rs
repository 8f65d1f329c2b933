//! Errors of the worst case of a scene.

use std::fmt;
use std::time::Duration;

use cohaptic_stability::AnalysisError;
use cohaptic_units::print::Span;

use super::super::automaton::AutomatonError;
use super::super::pattern::PatternError;

/// Reasons why the worst case of a scene cannot be bounded.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SceneWorstCaseError {
    /// The scene cannot be analysed at all.
    #[error(transparent)]
    Analysis(#[from] AnalysisError),
    /// The control law of the scene uses the position and the velocity of a sample separately, for example to extrapolate.
    #[error(
        "the worst case does not follow {strategy} coordination, which uses the ages of samples: ask `cohaptic stability point` without bounds, which follows random loss in the mean square"
    )]
    Ages {
        /// Name of the strategy.
        strategy: &'static str,
    },
    /// The pattern is too large, or a matrix overflowed.
    #[error(transparent)]
    Automaton(#[from] AutomatonError),
    /// The first delay of the interval is longer than the second.
    #[error("delays from {} to {}: expected the shorter one first", Span(*.least), Span(*.most))]
    Delays {
        /// First delay.
        least: Duration,
        /// Second delay.
        most: Duration,
    },
    /// The interval of delays is as long as the period of sending or longer, so that samples could overtake each other.
    #[error(
        "delays from {} to {} with a sample every {}: expected an interval shorter than the time between two samples, so that no sample overtakes another",
        Span(*.least), Span(*.most), Span(*.update)
    )]
    Overtaking {
        /// Shortest delay.
        least: Duration,
        /// Longest delay.
        most: Duration,
        /// Period of sending.
        update: Duration,
    },
    /// A frame is not one period of sending.
    #[error("everything repeats after {}, and samples are sent every {}: expected clocks without drift", Span(*.frame), Span(*.step))]
    Frame {
        /// Duration of a frame, after which all clocks repeat.
        frame: Duration,
        /// Period of sending.
        step: Duration,
    },
    /// A link does more than delay by a constant time.
    #[error("what becomes of samples from {from} to {to} follows a pattern of its own: expected a link of constant delay, or an interval of delays")]
    Pattern {
        /// Name of the sender.
        from: String,
        /// Name of the receiver.
        to: String,
    },
    /// The pattern has too many kinds of frame.
    #[error("{} kinds of frame with {links} links: expected at most {most}, or peers and links that are all equal; let links lose together, or narrow the interval of delays", Count(*.symbols))]
    TooMany {
        /// Number of links.
        links: usize,
        /// Number of kinds of frame; `None` if the number exceeds 2¹²⁸ − 1.
        symbols: Option<u128>,
        /// Largest number of kinds of frame.
        most: u128,
    },
    /// The pattern is too large for the number of states.
    #[error(
        "{edges} steps between {nodes} states of the network with {dimension} states of the scene: expected fewer losses in a row, links that lose together, or peers and links that are all equal"
    )]
    TooLarge {
        /// Number of edges of the pattern.
        edges: usize,
        /// Number of nodes of the pattern.
        nodes: usize,
        /// Number of rows of a frame's matrix.
        dimension: usize,
    },
}

impl From<PatternError> for SceneWorstCaseError {
    fn from(error: PatternError) -> Self {
        Self::Automaton(AutomatonError::Pattern(error))
    }
}

/// A number to print; `None` if the number exceeds `u128`.
struct Count(Option<u128>);

impl fmt::Display for Count {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Some(count) => write!(f, "{count}"),
            None => f.write_str("more than 10^38"),
        }
    }
}
