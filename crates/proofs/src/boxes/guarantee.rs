//! Verdicts on sets of scenes.

/// Proven verdict on all frames of a box. [`Guarantee`] adds the case that nothing is proven.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Proven {
    Stable,
    Unstable,
}

/// Verdict on a set of scenes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Guarantee {
    /// Every scene of the set is proven stable.
    Stable,
    /// Every scene of the set is proven unstable.
    Unstable,
    /// Nothing is proven: the set may hold stable scenes, unstable scenes, or both.
    Undecided,
}

impl Guarantee {
    /// Returns the word for the verdict in JSON and CSV.
    #[must_use]
    pub const fn word(self) -> &'static str {
        match self {
            Self::Stable => "stable",
            Self::Unstable => "unstable",
            Self::Undecided => "undecided",
        }
    }
}

impl From<Proven> for Guarantee {
    fn from(proven: Proven) -> Self {
        match proven {
            Proven::Stable => Self::Stable,
            Proven::Unstable => Self::Unstable,
        }
    }
}
