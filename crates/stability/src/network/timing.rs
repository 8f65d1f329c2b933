//! The time that samples take on a link.

use std::sync::Arc;
use std::time::Duration;

/// The time that the n-th sample of a sender takes on a link.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum LinkTiming {
    /// Every sample takes the same time.
    Constant(Duration),
    /// The n-th sample takes the time at index n modulo the length; `None` if the sample never arrives. Not empty.
    Pattern(Arc<[Option<Duration>]>),
}

impl LinkTiming {
    /// Returns the timing of a repeating pattern. A pattern of a single delay is a constant, so that equal timings compare equal.
    pub(crate) fn repeating(pattern: Vec<Option<Duration>>) -> Self {
        match pattern.as_slice() {
            [Some(delay)] => Self::Constant(*delay),
            _ => Self::Pattern(pattern.into()),
        }
    }

    /// Returns the number of samples after which the timing repeats.
    pub(crate) fn period(&self) -> usize {
        match self {
            Self::Constant(_) => 1,
            Self::Pattern(pattern) => pattern.len(),
        }
    }

    /// Returns the fraction of samples that arrive.
    #[expect(clippy::cast_precision_loss, reason = "a pattern is short")]
    pub(crate) fn arriving(&self) -> f64 {
        match self {
            Self::Constant(_) => 1.0,
            Self::Pattern(pattern) => pattern.iter().flatten().count() as f64 / pattern.len() as f64,
        }
    }

    /// Returns the timing with every sample later by `by`.
    pub(crate) fn later(&self, by: Duration) -> Self {
        match self {
            Self::Constant(delay) => Self::Constant(delay.saturating_add(by)),
            Self::Pattern(pattern) => Self::Pattern(pattern.iter().map(|delay| delay.map(|delay| delay.saturating_add(by))).collect()),
        }
    }
}
