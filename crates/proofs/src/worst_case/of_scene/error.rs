//! Why a scene has no worst case that can be looked at.

use std::fmt;
use std::time::Duration;

use cohaptic_stability::AnalysisError;
use cohaptic_units::print::Span;

use super::super::automaton::AutomatonError;
use super::super::pattern::PatternError;

/// Why the worst case of a scene cannot be bounded.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SceneWorstCaseError {
    /// The scene cannot be analysed at all.
    #[error(transparent)]
    Analysis(#[from] AnalysisError),
    /// The law of the scene uses position and velocity of a sample by themselves, as one that extrapolates does.
    #[error(
        "the worst case does not follow {strategy} coordination, which uses the ages of samples: ask `cohaptic stability point` without bounds, which follows random loss in the mean square"
    )]
    Ages {
        /// Its name.
        strategy: &'static str,
    },
    /// The pattern is too large, or a matrix overflowed.
    #[error(transparent)]
    Automaton(#[from] AutomatonError),
    /// The interval of delays is none.
    #[error("delays from {} to {}: expected the shorter one first", Span(*.least), Span(*.most))]
    Delays {
        /// The first.
        least: Duration,
        /// The second.
        most: Duration,
    },
    /// Samples might overtake each other.
    #[error(
        "delays from {} to {} with a sample every {}: expected an interval shorter than that, so that no sample overtakes another",
        Span(*.least), Span(*.most), Span(*.update)
    )]
    Overtaking {
        /// The shortest delay.
        least: Duration,
        /// The longest.
        most: Duration,
        /// The period of sending.
        update: Duration,
    },
    /// A frame is more than one period of sending.
    #[error("everything repeats after {}, and samples are sent every {}: expected clocks without drift", Span(*.frame), Span(*.step))]
    Frame {
        /// After how long everything repeats.
        frame: Duration,
        /// The period of sending.
        step: Duration,
    },
    /// A link does more than delay.
    #[error("what becomes of samples from {from} to {to} follows a pattern of its own: expected a link of constant delay, or an interval of delays")]
    Pattern {
        /// The sender.
        from: String,
        /// The receiver.
        to: String,
    },
    /// There are too many kinds of frame.
    #[error("{} kinds of frame with {links} links: expected at most {most}, or peers and links that are all equal; let links lose together, or narrow the interval of delays", Count(*.symbols))]
    TooMany {
        /// How many links.
        links: usize,
        /// How many kinds of frame; `None`: too many to count.
        symbols: Option<u128>,
        /// How many are looked at at most.
        most: u128,
    },
    /// The pattern is too large for states of that size.
    #[error(
        "{edges} steps between {nodes} states of the network with {dimension} states of the scene: expected fewer losses in a row, links that lose together, or peers and links that are all equal"
    )]
    TooLarge {
        /// The edges of the pattern.
        edges: usize,
        /// Its nodes.
        nodes: usize,
        /// The rows of a frame's matrix.
        dimension: usize,
    },
}

impl From<PatternError> for SceneWorstCaseError {
    fn from(error: PatternError) -> Self {
        Self::Automaton(AutomatonError::Pattern(error))
    }
}

/// A number that may be beyond counting.
struct Count(Option<u128>);

impl fmt::Display for Count {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.0 {
            Some(count) => write!(f, "{count}"),
            None => f.write_str("more than 10^38"),
        }
    }
}
