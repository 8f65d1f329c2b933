//! Random drawing of a link.

use core::num::NonZeroU32;
use core::time::Duration;

use cohaptic_wan::netem::{
    ChanceSpec, DelaySpec, Distribution, GemodelSpec, JitterSpec, LossSpec, Netem, RateSpec, ReorderSpec, SlotGap, SlotSpec, StateSpec,
};

use super::admits::fitting;
use super::bounds::{LinkBounds, LossModel, Presence};
use super::grid::{Dice, Span};
use super::link::ImpairedLink;
use super::stage::Stage;
use super::units::{ALL, percent};

/// Draws a link within bounds. Each permitted stage is present in a third of all cases, and absent if `is_ideal`. `None` if the drawn link is not within the
/// bounds.
pub(super) fn link(bounds: &LinkBounds, is_ideal: bool, dice: &mut Dice<'_>) -> Option<ImpairedLink> {
    let netem = words(bounds, is_ideal, dice);
    ImpairedLink::new(netem).ok().filter(|link| bounds.admits(link))
}

fn words(bounds: &LinkBounds, is_ideal: bool, dice: &mut Dice<'_>) -> Netem {
    let mut is_there = [false; Stage::ALL.len()];
    for stage in Stage::ALL {
        // Drawn for every stage, whatever the bounds say, so that bounds of a stage change no other stage.
        let drawn = dice.one_in(3);
        is_there[stage.place()] = match bounds.presence(stage) {
            Presence::Never => false,
            Presence::Maybe => drawn && !is_ideal,
            Presence::Always => true,
        };
    }
    let is = |stage: Stage| is_there[stage.place()];
    let mut netem = Netem::default();
    if is(Stage::Limit) {
        netem.limit = u32::try_from(dice.number(bounds.span(Stage::Limit))).ok();
    }
    if is(Stage::Delay) || is(Stage::Jitter) || is(Stage::Reorder) {
        netem.delay = Some(delay(bounds, is(Stage::Jitter), dice));
    }
    if is(Stage::Loss) {
        netem.loss = Some(loss(bounds, dice));
    }
    if is(Stage::Corrupt) {
        netem.corrupt = Some(chance(bounds, Stage::Corrupt, dice));
    }
    if is(Stage::Duplicate) {
        netem.duplicate = Some(chance(bounds, Stage::Duplicate, dice));
    }
    if is(Stage::Reorder) {
        let gap = if dice.one_in(4) { NonZeroU32::new(2 + dice.pick(0, &[1, 2, 3, 8])) } else { None };
        netem.reorder = Some(ReorderSpec { chance: chance(bounds, Stage::Reorder, dice), gap });
    }
    if is(Stage::Rate) {
        netem.rate = (dice.number(bounds.span(Stage::Rate)) / 8).try_into().ok().map(|bytes_per_sec| RateSpec { bytes_per_sec, framing: None });
    }
    if is(Stage::Slot) {
        netem.slot = Some(slot(bounds, dice));
    }
    netem
}

fn nanos(count: u64) -> Duration {
    Duration::from_nanos(count)
}

fn correlation(bounds: &LinkBounds, dice: &mut Dice<'_>) -> Option<cohaptic_wan::netem::Percent> {
    // From 5 % to 90 %.
    (dice.one_in(4) && bounds.correlation).then(|| percent(50_000 * (1 + dice.below(18))))
}

fn chance(bounds: &LinkBounds, stage: Stage, dice: &mut Dice<'_>) -> ChanceSpec {
    ChanceSpec { percent: percent(dice.number(bounds.span(stage))), correlation: correlation(bounds, dice) }
}

/// Draws a delay. A uniform law may reach from zero to twice the mean. The other laws stay above zero if their deviation is at most half the mean.
fn delay(bounds: &LinkBounds, jitters: bool, dice: &mut Dice<'_>) -> DelaySpec {
    let longest = bounds.span(Stage::Delay).high;
    let mut mean = dice.number(bounds.span(Stage::Delay));
    if !jitters {
        return DelaySpec { time: nanos(mean), jitter: None };
    }
    let sd = dice.number(bounds.span(Stage::Jitter)).min(longest);
    mean = mean.max(sd);
    let law = if bounds.distributions && dice.one_in(2) {
        // The bounds may forbid a mean of twice the deviation. Such a jitter stays uniform.
        mean = mean.max((2 * sd).min(longest));
        Some(dice.pick(Distribution::Normal.name(), &["pareto", "paretonormal"])).filter(|_| 2 * sd <= mean).and_then(Distribution::named)
    } else {
        None
    };
    // A heavy-tailed law with correlation needs a search for its chain, which would take most of the time of a test.
    let is_quick = matches!(law, None | Some(Distribution::Normal));
    let correlation = correlation(bounds, dice).filter(|_| is_quick);
    DelaySpec { time: nanos(mean), jitter: Some(JitterSpec { time: nanos(sd), correlation, distribution: law }) }
}

fn slot(bounds: &LinkBounds, dice: &mut Dice<'_>) -> SlotSpec {
    let span = bounds.span(Stage::Slot);
    let min = dice.number(span);
    let gap = match dice.below(4) {
        0 => SlotGap::Range { min: nanos(min), max: Some(nanos(dice.number(Span { low: min, high: 2 * min, step: 1 }))) },
        // A slot of 1 ns has no room for a jitter of at least 1 ns.
        1 if bounds.distributions && min > 1 => {
            let distribution = Distribution::named(dice.pick("normal", &["pareto", "paretonormal"])).unwrap_or(Distribution::Normal);
            SlotGap::Drawn { distribution, delay: nanos(min), jitter: nanos(dice.number(Span { low: 1, high: min / 2, step: 1 })) }
        }
        _ => SlotGap::Range { min: nanos(min), max: None },
    };
    let packets = if dice.one_in(3) { NonZeroU32::new(dice.pick(1, &[2, 3, 5, 10, 20])) } else { None };
    SlotSpec { gap, packets, bytes: None }
}

fn loss(bounds: &LinkBounds, dice: &mut Dice<'_>) -> LossSpec {
    let models = &bounds.models;
    let model = models.first().map_or(LossModel::Random, |first| dice.pick(*first, models.get(1..).unwrap_or_default()));
    let share = dice.number(bounds.span(Stage::Loss));
    let correlation = correlation(bounds, dice);
    let in_bursts = match model {
        LossModel::Random => return LossSpec::Random(ChanceSpec { percent: percent(share), correlation }),
        LossModel::Gemodel => gemodel(share, dice),
        LossModel::State => state(share, dice),
    };
    // A chain can lose any share if the probability of leaving the bad state and the probability of entering the state add up to 1.
    in_bursts.unwrap_or_else(|| two_states(model, share, ALL - share))
}

fn two_states(model: LossModel, p: u64, r: u64) -> LossSpec {
    let (p, r) = (percent(p), Some(percent(r)));
    match model {
        LossModel::State => LossSpec::State(StateSpec { p13: p, p31: r, p32: None, p23: None, p14: None }),
        LossModel::Gemodel | LossModel::Random => LossSpec::Gemodel(GemodelSpec { p, r, loss_in_bad: None, loss_in_good: None }),
    }
}

fn gemodel(share: u64, dice: &mut Dice<'_>) -> Option<LossSpec> {
    let r = Some(percent(50_000 + 50_000 * dice.below(15)));
    let loss_in_bad = dice.one_in(2).then(|| percent(500_000 + 50_000 * dice.below(10)));
    // The words of netem are positional: the loss in the good state needs the loss in the bad state before it. A quarter of the share leaves the rest to
    // bursts.
    let loss_in_good = (dice.one_in(3) && loss_in_bad.is_some()).then(|| percent(share / 4));
    fitting(share, ALL, |p| LossSpec::Gemodel(GemodelSpec { p: percent(p), r, loss_in_bad, loss_in_good }))
}

fn state(share: u64, dice: &mut Dice<'_>) -> Option<LossSpec> {
    let p31 = Some(percent(50_000 + 50_000 * dice.below(10)));
    let in_burst = dice.one_in(2).then(|| (percent(50_000 + 50_000 * dice.below(8)), percent(500_000 + 50_000 * dice.below(10))));
    // The words of netem are positional, so the isolated losses need the probabilities of bursts before them.
    let p14 = (dice.one_in(3) && in_burst.is_some()).then_some(share / 4);
    let (p32, p23) = in_burst.unzip();
    let most = ALL - p14.unwrap_or(0);
    fitting(share, most, |p13| LossSpec::State(StateSpec { p13: percent(p13), p31, p32, p23, p14: p14.map(percent) }))
}
