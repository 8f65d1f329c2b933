//! Losses of links with immediately certain fates, and the fate of a packet.

use core::time::Duration;

use cohaptic_units::{Instant, Probability};

use crate::stages::loss::{GilbertElliott, GilbertElliottInTime};

/// Law of the losses of a link.
#[derive(Clone, Debug)]
pub(super) enum Losses {
    None,
    Independent(Probability),
    GilbertElliott(GilbertElliott),
    InTime(InTime),
}

/// Chain of losses in time, shared by the links of a kind.
#[derive(Clone, Debug)]
pub(super) struct InTime {
    pub(super) chain: GilbertElliottInTime,
    /// Instant from which on the links have this chain. The chain of a link begins anew there, so that states before this instant do not count.
    pub(super) since: Instant,
    /// Gap between two packets, and the probabilities of the bad state at the second packet, by the state at the first packet (good, bad). Links that are
    /// offered packets together have one gap, and a probability takes an exponential.
    after: (Duration, [Probability; 2]),
}

impl InTime {
    pub(super) fn new(chain: GilbertElliottInTime) -> Self {
        Self { chain, since: Instant::ZERO, after: Self::after(&chain, Duration::ZERO) }
    }

    /// Returns the probability of the bad state at a packet that comes `gap` after the packet before, at which the chain was in the bad state if `was_bad`
    /// is set.
    pub(super) fn bad_after(&mut self, gap: Duration, was_bad: bool) -> Probability {
        if self.after.0 != gap {
            self.after = Self::after(&self.chain, gap);
        }
        self.after.1[usize::from(was_bad)]
    }

    fn after(chain: &GilbertElliottInTime, gap: Duration) -> (Duration, [Probability; 2]) {
        (gap, [false, true].map(|was_bad| chain.bad_after(gap, was_bad)))
    }
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
