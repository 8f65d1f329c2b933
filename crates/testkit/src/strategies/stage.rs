//! Impairments of a link, and their removal.

use core::fmt;

use cohaptic_wan::netem::{ChanceSpec, DelaySpec, LossSpec, Netem, Percent};

/// Impairment of a link. The order is that of netem's words.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
#[non_exhaustive]
pub enum Stage {
    /// `limit PACKETS`.
    Limit,
    /// `delay TIME`, equal for every packet. With jitter or reordering, the delay belongs to the jitter or the reordering and does not count by itself.
    Delay,
    /// `delay TIME JITTER`, including the mean delay.
    Jitter,
    /// `loss`, with any model.
    Loss,
    /// `corrupt`.
    Corrupt,
    /// `duplicate`.
    Duplicate,
    /// `delay TIME reorder PERCENT`, including the delay of the packets that are overtaken.
    Reorder,
    /// `rate`.
    Rate,
    /// `slot`.
    Slot,
}

impl Stage {
    /// Stages, in the order of netem's words.
    pub const ALL: [Self; 9] =
        [Self::Limit, Self::Delay, Self::Jitter, Self::Loss, Self::Corrupt, Self::Duplicate, Self::Reorder, Self::Rate, Self::Slot];

    /// Returns the name of the stage: its word in netem, or `jitter`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Limit => "limit",
            Self::Delay => "delay",
            Self::Jitter => "jitter",
            Self::Loss => "loss",
            Self::Corrupt => "corrupt",
            Self::Duplicate => "duplicate",
            Self::Reorder => "reorder",
            Self::Rate => "rate",
            Self::Slot => "slot",
        }
    }

    /// Returns the index of the stage in [`Stage::ALL`].
    pub(super) const fn place(self) -> usize {
        self as usize
    }
}

impl fmt::Display for Stage {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name())
    }
}

fn happens(chance: Option<&ChanceSpec>) -> bool {
    chance.is_some_and(|chance| chance.percent > Percent::ZERO)
}

fn reorders(netem: &Netem) -> bool {
    happens(netem.reorder.as_ref().map(|reorder| &reorder.chance))
}

fn jitters(netem: &Netem) -> bool {
    netem.delay.as_ref().and_then(|delay| delay.jitter.as_ref()).is_some_and(|jitter| !jitter.time.is_zero())
}

/// Returns whether the words contain the stage. An option with the value zero does not count.
pub(super) fn has(netem: &Netem, stage: Stage) -> bool {
    match stage {
        Stage::Limit => netem.limit.is_some(),
        Stage::Delay => netem.delay.as_ref().is_some_and(|delay| !delay.time.is_zero()) && !jitters(netem) && !reorders(netem),
        Stage::Jitter => jitters(netem),
        Stage::Loss => match &netem.loss {
            None => false,
            Some(LossSpec::Random(chance)) => happens(Some(chance)),
            Some(LossSpec::State(_) | LossSpec::Gemodel(_)) => true,
        },
        Stage::Corrupt => happens(netem.corrupt.as_ref()),
        Stage::Duplicate => happens(netem.duplicate.as_ref()),
        Stage::Reorder => reorders(netem),
        Stage::Rate => netem.rate.is_some(),
        Stage::Slot => netem.slot.is_some(),
    }
}

/// Returns the words without the given stages. The delay of jitter or reordering is removed together with the last stage that needs it, unless `keeps_delay`.
pub(super) fn without(netem: &Netem, stages: &[Stage], keeps_delay: bool) -> Netem {
    let mut less = netem.clone();
    for stage in stages {
        match stage {
            Stage::Limit => less.limit = None,
            // Removed below, where all stages that need the delay are known.
            Stage::Delay => {}
            Stage::Jitter => less.delay = less.delay.map(|delay| DelaySpec { jitter: None, ..delay }),
            // `ecn` marks packets in place of losing packets, and netem refuses `ecn` without loss.
            Stage::Loss => (less.loss, less.ecn) = (None, false),
            Stage::Corrupt => less.corrupt = None,
            Stage::Duplicate => less.duplicate = None,
            Stage::Reorder => less.reorder = None,
            Stage::Rate => less.rate = None,
            Stage::Slot => less.slot = None,
        }
    }
    let carried = jitters(&less) || reorders(&less);
    let was_carried = jitters(netem) || reorders(netem);
    if !carried && !keeps_delay && (was_carried || stages.contains(&Stage::Delay)) {
        // A reordering with the probability zero may be left, which has no effect without a delay either.
        less.delay = None;
        less.reorder = None;
    }
    less
}
