//! Check whether a link is within bounds, and fitting of chains to a long-run loss.

use cohaptic_wan::netem::{ChanceSpec, LossSpec, Netem, SlotGap};

use super::bounds::{LinkBounds, LossModel, Presence};
use super::link::ImpairedLink;
use super::stage::{self, Stage};
use super::units::{ALL, nanos, units, whole};

/// Tolerance of the long-run loss of a model with bursts: a hundredth of a percent, in ten-thousandths of a percent.
pub(super) const SLACK: u64 = 100;

impl LinkBounds {
    /// Returns whether the link may be drawn or be the result of shrinking.
    #[must_use]
    pub fn admits(&self, link: &ImpairedLink) -> bool {
        let netem = link.netem();
        let present = |stage: Stage| stage::has(netem, stage);
        let right = |stage: Stage| match self.presence(stage) {
            Presence::Never => !present(stage),
            Presence::Maybe => true,
            // Jitter and reordering include a delay.
            Presence::Always => present(stage) || (stage == Stage::Delay && netem.delay.is_some()),
        };
        Stage::ALL.into_iter().all(|stage| right(stage) && (number(netem, stage).is_none_or(|number| self.span(stage).contains(number))))
            && netem.delay.as_ref().is_none_or(|delay| self.span(Stage::Delay).contains(nanos(delay.time)))
            && loss(self, link)
            && shapes(self, netem)
    }
}

/// Returns the number of a stage, or `None` if the stage is absent or has no single number.
fn number(netem: &Netem, stage: Stage) -> Option<u64> {
    if !stage::has(netem, stage) {
        return None;
    }
    let share = |chance: &ChanceSpec| whole(chance.percent);
    match stage {
        Stage::Limit => netem.limit.map(Into::into),
        // `admits` checks the delay by itself, because jitter and reordering have a delay too.
        Stage::Delay => None,
        Stage::Jitter => netem.delay.as_ref().and_then(|delay| delay.jitter.as_ref()).map(|jitter| nanos(jitter.time)),
        Stage::Loss => match &netem.loss {
            Some(LossSpec::Random(chance)) => Some(share(chance)),
            Some(LossSpec::Gemodel(_) | LossSpec::State(_)) | None => None,
        },
        Stage::Corrupt => netem.corrupt.as_ref().map(share),
        Stage::Duplicate => netem.duplicate.as_ref().map(share),
        Stage::Reorder => netem.reorder.as_ref().map(|reorder| share(&reorder.chance)),
        Stage::Rate => netem.rate.map(|rate| rate.bytes_per_sec.get().saturating_mul(8)),
        Stage::Slot => netem.slot.as_ref().map(|slot| match &slot.gap {
            SlotGap::Range { min, .. } => nanos(*min),
            SlotGap::Drawn { delay, .. } => nanos(*delay),
        }),
    }
}

/// Returns the long-run loss of a link, in ten-thousandths of a percent.
pub(super) fn long_run(link: &ImpairedLink) -> Option<u64> {
    link.config().loss.mean().map(|mean| units(mean * 100.0).min(ALL))
}

fn loss(bounds: &LinkBounds, link: &ImpairedLink) -> bool {
    let model = match link.netem().loss {
        None => return true,
        Some(LossSpec::Random(_)) => LossModel::Random,
        Some(LossSpec::Gemodel(_)) => LossModel::Gemodel,
        Some(LossSpec::State(_)) => LossModel::State,
    };
    let span = bounds.span(Stage::Loss);
    // The loss of a chain is fitted to a share, and hits the share only within the tolerance.
    let within = |loss: u64| span.low <= loss + SLACK && loss <= span.high + SLACK;
    bounds.models.contains(&model) && (model == LossModel::Random || long_run(link).is_some_and(within))
}

/// Returns whether correlations, distributions and jitter are of permitted forms.
fn shapes(bounds: &LinkBounds, netem: &Netem) -> bool {
    let jitter = netem.delay.as_ref().and_then(|delay| delay.jitter.as_ref());
    let random = if let Some(LossSpec::Random(chance)) = &netem.loss { Some(chance) } else { None };
    let reorder = netem.reorder.as_ref().map(|reorder| &reorder.chance);
    let chances = [random, netem.corrupt.as_ref(), netem.duplicate.as_ref(), reorder];
    let correlated =
        chances.into_iter().flatten().any(|chance| chance.correlation.is_some()) || jitter.is_some_and(|jitter| jitter.correlation.is_some());
    let drawn = netem.slot.as_ref().is_some_and(|slot| matches!(slot.gap, SlotGap::Drawn { .. }));
    let distributed = drawn || jitter.is_some_and(|jitter| jitter.distribution.is_some());
    (bounds.correlation || !correlated)
        && (bounds.distributions || !distributed)
        && jitter.zip(netem.delay.as_ref()).is_none_or(|(jitter, delay)| jitter.time <= delay.time)
}

/// Returns the chain whose long-run loss is `share`. `chain` makes a chain from the probability of entering bursts, which is varied up to `most`, in
/// ten-thousandths of a percent; the loss must grow with this probability. `None` if no chain comes within half of the tolerance.
pub(super) fn fitting(share: u64, most: u64, chain: impl Fn(u64) -> LossSpec) -> Option<LossSpec> {
    let lost = |p: u64| {
        let netem = Netem { loss: Some(chain(p)), ..Netem::default() };
        ImpairedLink::new(netem).ok().as_ref().and_then(long_run)
    };
    let (mut low, mut high) = (1, most);
    // The long-run loss grows with `p`, so bisection finds the first probability that reaches the share.
    while low < high {
        let middle = low.midpoint(high);
        if lost(middle)? < share {
            low = middle + 1;
        } else {
            high = middle;
        }
    }
    lost(low).filter(|lost| lost.abs_diff(share) <= SLACK / 2).map(|_| chain(low))
}
