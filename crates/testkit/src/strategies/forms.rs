//! Plainer forms of stages.

use cohaptic_wan::netem::{ChanceSpec, GemodelSpec, JitterSpec, LossSpec, Netem, SlotGap, StateSpec};

use super::admits::{fitting, long_run};
use super::bounds::LinkBounds;
use super::link::ImpairedLink;
use super::numbers::{jitter_mut, random_mut, reorder_mut};
use super::stage::{self, Stage};
use super::units::{ALL, percent, whole};

/// Change of a link to a plainer form. The variants are in the order of trial.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Form {
    /// Reordering becomes its delay.
    Reordering,
    /// Jitter becomes its mean delay.
    Jitter,
    JitterCorrelation,
    /// Any law of jitter becomes the uniform law.
    JitterDistribution,
    /// Bursts become random loss with the same long-run loss.
    LossInBursts,
    LossCorrelation,
    /// The last probability of a chain becomes its default. The probability of entering bursts is changed to keep the long-run loss.
    LastProbability,
    /// Four states become two.
    FourStates,
    CorruptCorrelation,
    DuplicateCorrelation,
    ReorderCorrelation,
    ReorderGap,
    SlotDistribution,
    SlotRange,
    SlotPackets,
    SlotBytes,
}

impl Form {
    /// Changes, in the order of trial. `LastProbability` is listed four times, because a chain has up to four removable probabilities.
    pub(super) const ALL: [Self; 19] = [
        Self::Reordering,
        Self::Jitter,
        Self::JitterCorrelation,
        Self::JitterDistribution,
        Self::LossInBursts,
        Self::LossCorrelation,
        Self::LastProbability,
        Self::LastProbability,
        Self::LastProbability,
        Self::LastProbability,
        Self::FourStates,
        Self::CorruptCorrelation,
        Self::DuplicateCorrelation,
        Self::ReorderCorrelation,
        Self::ReorderGap,
        Self::SlotDistribution,
        Self::SlotRange,
        Self::SlotPackets,
        Self::SlotBytes,
    ];

    /// Returns the words after the change; unchanged if the change does not apply.
    pub(super) fn plainer(self, link: &ImpairedLink, bounds: &LinkBounds) -> Netem {
        let old = link.netem();
        let mut netem = old.clone();
        match self {
            // The delay is kept: a delay alone is the plainer form. The removal of the delay is the matter of the stages.
            Self::Reordering => return stage::without(old, &[Stage::Reorder], true),
            Self::Jitter => return stage::without(old, &[Stage::Jitter], true),
            Self::JitterCorrelation => change(jitter_mut(&mut netem), |jitter: &mut JitterSpec| jitter.correlation = None),
            Self::JitterDistribution => change(jitter_mut(&mut netem), |jitter| jitter.distribution = None),
            Self::LossInBursts => {
                if let Some(LossSpec::Gemodel(_) | LossSpec::State(_)) = old.loss {
                    // A chain keeps the bounds within a tolerance only. Random loss must keep the bounds exactly.
                    let span = bounds.span(Stage::Loss);
                    let loss = long_run(link).unwrap_or(span.low).clamp(span.low, span.high);
                    netem.loss = Some(LossSpec::Random(ChanceSpec { percent: percent(loss), correlation: None }));
                }
            }
            Self::LossCorrelation => uncorrelate(random_mut(&mut netem)),
            Self::LastProbability => netem.loss = old.loss.map(|loss| without_last_probability(loss, long_run(link).unwrap_or(0))),
            Self::FourStates => {
                if let Some(LossSpec::State(state)) = old.loss
                    // Without p32 the chain has p13 and p31 alone, which are the probabilities p and r of two states.
                    && state.p32.is_none()
                {
                    netem.loss = Some(LossSpec::Gemodel(GemodelSpec { p: state.p13, r: state.p31, loss_in_bad: None, loss_in_good: None }));
                }
            }
            Self::CorruptCorrelation => uncorrelate(netem.corrupt.as_mut()),
            Self::DuplicateCorrelation => uncorrelate(netem.duplicate.as_mut()),
            Self::ReorderCorrelation => uncorrelate(reorder_mut(&mut netem)),
            Self::ReorderGap => change(netem.reorder.as_mut(), |reorder| reorder.gap = None),
            Self::SlotDistribution => change(netem.slot.as_mut(), |slot| {
                if let SlotGap::Drawn { delay, .. } = slot.gap {
                    slot.gap = SlotGap::Range { min: delay, max: None };
                }
            }),
            Self::SlotRange => change(netem.slot.as_mut(), |slot| {
                if let SlotGap::Range { max, .. } = &mut slot.gap {
                    *max = None;
                }
            }),
            Self::SlotPackets => change(netem.slot.as_mut(), |slot| slot.packets = None),
            Self::SlotBytes => change(netem.slot.as_mut(), |slot| slot.bytes = None),
        }
        netem
    }
}

fn change<T>(place: Option<&mut T>, change: impl FnOnce(&mut T)) {
    if let Some(place) = place {
        change(place);
    }
}

fn uncorrelate(chance: Option<&mut ChanceSpec>) {
    change(chance, |chance| chance.correlation = None);
}

/// Removes the last probability of a chain other than p and r. The latter stay, because r determines the length of bursts.
fn without_last_probability(loss: LossSpec, share: u64) -> LossSpec {
    match loss {
        LossSpec::Random(_) => None,
        LossSpec::Gemodel(mut model) => {
            // The words of netem are positional, so probabilities go from the last to the first.
            if model.loss_in_good.is_some() {
                model.loss_in_good = None;
            } else {
                model.loss_in_bad = None;
            }
            fitting(share, ALL, |p| LossSpec::Gemodel(GemodelSpec { p: percent(p), ..model }))
        }
        LossSpec::State(mut state) => {
            if state.p14.is_some() {
                state.p14 = None;
            } else if state.p23.is_some() {
                state.p23 = None;
            } else {
                state.p32 = None;
            }
            let most = ALL - state.p14.map_or(0, whole);
            fitting(share, most, |p13| LossSpec::State(StateSpec { p13: percent(p13), ..state }))
        }
    }
    // Without a fitting chain the loss stays unchanged, and the form counts as impossible.
    .unwrap_or(loss)
}
