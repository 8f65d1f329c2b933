//! Losses of links with immediately certain fates, and the fate of a packet.

use cohaptic_units::{Instant, Probability};

use crate::stages::loss::GilbertElliott;

/// Law of the losses of a link.
#[derive(Clone, Debug)]
pub(super) enum Losses {
    None,
    Independent(Probability),
    GilbertElliott(GilbertElliott),
}

/// Fate of a packet.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Verdict {
    Arrives(Instant),
    Lost,
    /// Dropped, but not by loss. The returning function has counted the drop.
    Dropped,
}

impl Verdict {
    /// Returns the verdict with the arrival changed by `change`.
    #[inline(always)]
    pub(super) fn map(self, change: impl FnOnce(Instant) -> Instant) -> Self {
        match self {
            Self::Arrives(at) => Self::Arrives(change(at)),
            Self::Lost | Self::Dropped => self,
        }
    }
}
