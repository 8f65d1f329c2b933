//! Losses of links whose fates are known at once, and the fate of a packet.

use cohaptic_units::{Instant, Probability};

use crate::stages::loss::GilbertElliott;

/// Law by which a link loses packets.
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
    /// Dropped for a cause other than loss. The function that returns this value has counted the drop.
    Dropped,
}
