//! Why a scene cannot be analysed.

use std::time::Duration;

use cohaptic_units::print::Span;

/// Why a scene cannot be analysed.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum AnalysisError {
    /// Its clocks never come back to where they were.
    #[error("the clocks of this scene have no common period: expected ticks, updates and drifts whose multiples meet within 584 years")]
    NoFrame,
    /// Its clocks come back to where they were, and too late.
    #[error("everything repeats only after {}: expected clocks that meet sooner; set the drift of the clocks to 0 to analyse the scene without it", Span(*.frame))]
    FrameTooLong {
        /// After how long.
        frame: Duration,
    },
    /// A strategy is not linear.
    #[error("the strategy of peer {peer} is not linear: twice the disturbance does not lead twice as far; simulate the scene instead")]
    NotLinear {
        /// The first peer whose motion shows it.
        peer: String,
    },
    /// A strategy depends on the time, or on more than it shows.
    #[error("from one state a strategy leads to two: expected one that shows all that it remembers (Strategy::memory) and does not look at the time")]
    Remembers,
    /// A scene of several axes has both a one-sided contact and a strategy of its own.
    #[error("a one-sided contact with a strategy that may mix axes cannot be analysed axis by axis: expected contact = \"grasp\" or \"none\"")]
    MixedAxes,
    /// Too many combinations of contacts.
    #[error("{modes} combinations of open and closed contacts: expected at most {most}")]
    TooManyModes {
        /// How many there are.
        modes: u128,
        /// How many are looked at at most.
        most: u128,
    },
}
