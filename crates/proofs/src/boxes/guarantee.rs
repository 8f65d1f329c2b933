//! Verdicts on sets of scenes.

/// A proven verdict on all frames of a box.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Proven {
    Stable,
    Unstable,
}

/// The verdict on a set of scenes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Guarantee {
    /// Every one is stable: proven.
    Stable,
    /// Every one is unstable: proven.
    Unstable,
    /// Not decided.
    Undecided,
}

impl Guarantee {
    /// The word in JSON and CSV.
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
