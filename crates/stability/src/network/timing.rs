//! How long samples take on a link.

use std::sync::Arc;
use std::time::Duration;

/// How long the n-th sample of a sender takes on a link.
#[derive(Clone, PartialEq, Eq, PartialOrd, Ord, Debug)]
pub enum LinkTiming {
    /// All the same.
    Constant(Duration),
    /// The n-th sample takes the entry n modulo the length; `None`: it never arrives.
    Pattern(Arc<[Option<Duration>]>),
}

impl LinkTiming {
    /// What a repeating pattern comes to: one delay that repeats is a constant.
    pub(crate) fn repeating(pattern: Vec<Option<Duration>>) -> Self {
        match pattern.as_slice() {
            [Some(delay)] => Self::Constant(*delay),
            _ => Self::Pattern(pattern.into()),
        }
    }

    /// After how many samples it repeats.
    pub(crate) fn period(&self) -> usize {
        match self {
            Self::Constant(_) => 1,
            Self::Pattern(pattern) => pattern.len(),
        }
    }

    /// The fraction of samples that arrive.
    #[expect(clippy::cast_precision_loss, reason = "a pattern is short")]
    pub(crate) fn arriving(&self) -> f64 {
        match self {
            Self::Constant(_) => 1.0,
            Self::Pattern(pattern) => pattern.iter().flatten().count() as f64 / pattern.len() as f64,
        }
    }

    /// The timing with every sample later by that.
    pub(crate) fn later(&self, by: Duration) -> Self {
        match self {
            Self::Constant(delay) => Self::Constant(delay.saturating_add(by)),
            Self::Pattern(pattern) => Self::Pattern(pattern.iter().map(|delay| delay.map(|delay| delay.saturating_add(by))).collect()),
        }
    }
}
