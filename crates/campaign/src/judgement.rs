//! Judgement of a combination of values: a verdict, or the reason why there is none.

use std::sync::Arc;

/// Judgement of a combination.
#[derive(Clone, PartialEq, Debug)]
pub enum Judgement {
    /// The combination has a verdict.
    Known(Verdict),
    /// The combination cannot be judged, for this reason.
    Refused(Arc<str>),
}

/// A verdict and the figures behind it.
#[derive(Clone, PartialEq, Debug)]
pub struct Verdict {
    /// The verdict in a word, such as `stable`.
    pub word: Arc<str>,
    /// The judged property in a word, such as `mean-square`.
    pub judged: Arc<str>,
    /// Radius on which the verdict rests; NaN for a judge without a radius.
    pub radius: f64,
    /// Bound on the difference between `radius` and the true radius; NaN for a judge without a radius.
    pub error: f64,
}

impl Judgement {
    /// Returns the verdict; `None` for a refusal.
    #[must_use]
    pub const fn verdict(&self) -> Option<&Verdict> {
        match self {
            Self::Known(verdict) => Some(verdict),
            Self::Refused(_) => None,
        }
    }

    /// Replaces line feeds in the reason, because a journal has one line per judgement.
    pub(crate) fn in_one_line(self) -> Self {
        match self {
            Self::Refused(reason) if reason.contains(['\n', '\r']) => Self::Refused(reason.replace(['\n', '\r'], " ").into()),
            other @ (Self::Known(_) | Self::Refused(_)) => other,
        }
    }
}
