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
