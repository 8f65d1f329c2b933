//! Bounds of random links: drawn links obey them, and contradictory bounds are refused.

use std::ops::RangeInclusive;
use std::time::Duration;

use cohaptic_testkit::proptest::prelude::*;
use cohaptic_testkit::strategies::{BoundsError, ImpairedLink, LinkBounds, LossModel, Stage, links_like, networks_like};
use cohaptic_wan::netem::{LossSpec, SlotGap};

use super::{sample, shrink};

const fn us(count: u64) -> Duration {
    Duration::from_micros(count)
}

fn times(most: u64) -> impl Strategy<Value = RangeInclusive<Duration>> {
    (1..most, 0..most).prop_map(|(low, more)| us(low)..=us(low + more))
}

fn percents() -> impl Strategy<Value = RangeInclusive<f64>> {
    (1..500_u32, 0..500_u32).prop_map(|(low, more)| f64::from(low) / 10.0..=f64::from(low + more) / 10.0)
}

/// Returns random ranges in which some delay allows some jitter: the longest delay is at least twice the least jitter.
fn ranges() -> impl Strategy<Value = Ranges> {
    let times = (times(50_000), times(1_000), times(10_000));
    let percents = (percents(), percents(), percents(), percents());
    let counts = ((8..1_000_000_u64, 8..1_000_000_u64), (1..100_u32, 0..100_u32));
    (times, percents, counts, any::<(bool, bool)>()).prop_map(
        |((delay, jitter, slot), (loss, corrupt, duplicate, reorder), counts, (may, always))| {
            let ((rate, more), (limit, further)) = counts;
            let delay = *delay.start()..=*delay.end() + 2 * *jitter.start();
            Ranges { delay, jitter, slot, loss, corrupt, duplicate, reorder, rate: rate..=rate + more, limit: limit..=limit + further, may, always }
        },
    )
}

#[derive(Clone, Debug)]
struct Ranges {
    delay: RangeInclusive<Duration>,
    jitter: RangeInclusive<Duration>,
    slot: RangeInclusive<Duration>,
    loss: RangeInclusive<f64>,
    corrupt: RangeInclusive<f64>,
    duplicate: RangeInclusive<f64>,
    reorder: RangeInclusive<f64>,
    rate: RangeInclusive<u64>,
    limit: RangeInclusive<u32>,
    may: bool,
    always: bool,
}

impl Ranges {
    fn bounds(&self) -> LinkBounds {
        let Self { delay, jitter, slot, loss, corrupt, duplicate, reorder, rate, limit, may, always } = self.clone();
        let mut bounds = LinkBounds::ideal().delay(delay).jitter(jitter).slot(slot).loss(loss).corrupt(corrupt).duplicate(duplicate).reorder(reorder);
        bounds = bounds.rate(rate).limit(limit).distributions(may).correlation(may);
        if always { Stage::ALL.into_iter().fold(bounds, LinkBounds::always) } else { bounds }
    }

    /// Looks at the words only.
    fn hold(&self, link: &ImpairedLink) -> bool {
        let netem = link.netem();
        let share =
            |chance: &Option<cohaptic_wan::netem::ChanceSpec>, range: &RangeInclusive<f64>| chance.is_none_or(|c| range.contains(&c.percent.get()));
        let jitter = netem.delay.as_ref().and_then(|delay| delay.jitter.as_ref());
        let loss = link.config().loss.mean().unwrap() * 100.0;
        // Models with bursts lose as much to a hundredth of a percent.
        let slack = if matches!(netem.loss, Some(LossSpec::Random(_))) { 1e-9 } else { 0.010_1 };
        let plain = !link.to_string().contains("distribution") && jitter.is_none_or(|jitter| jitter.correlation.is_none());
        netem.delay.as_ref().is_none_or(|delay| self.delay.contains(&delay.time))
            && jitter.is_none_or(|jitter| self.jitter.contains(&jitter.time))
            && (netem.loss.is_none() || (self.loss.start() - slack..=self.loss.end() + slack).contains(&loss))
            && share(&netem.corrupt, &self.corrupt)
            && share(&netem.duplicate, &self.duplicate)
            && share(&netem.reorder.map(|reorder| reorder.chance), &self.reorder)
            && netem.rate.is_none_or(|rate| self.rate.contains(&(rate.bytes_per_sec.get() * 8)))
            && netem.limit.is_none_or(|limit| self.limit.contains(&limit))
            && netem.slot.as_ref().is_none_or(|slot| match &slot.gap {
                SlotGap::Range { min, .. } => self.slot.contains(min),
                SlotGap::Drawn { delay, .. } => self.slot.contains(delay),
            })
            && (self.may || plain)
            && (!self.always || (link.stages().len() == 8 && netem.delay.is_some()))
    }
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(100))]

    #[test]
    fn every_link_is_within_bounds(ranges in ranges(), seed in any::<u64>()) {
        let bounds = ranges.bounds();
        // Rates of whole bytes may leave nothing.
        prop_assume!(bounds.check().is_ok());
        for link in sample(&links_like(bounds.clone()), seed, 20) {
            prop_assert!(ranges.hold(&link), "{}", link);
            prop_assert!(bounds.admits(&link));
        }
    }

    #[test]
    fn every_link_on_the_way_to_the_least_is_within_bounds(ranges in ranges(), seed in any::<u64>(), threshold in 0.0..50.0) {
        let bounds = ranges.bounds();
        prop_assume!(bounds.check().is_ok());
        let outside = std::cell::Cell::new(None);
        let _ = shrink(&links_like(bounds), seed, |link| {
            if !ranges.hold(link) {
                outside.set(Some(link.to_string()));
            }
            link.netem().loss.is_some() && link.netem().duplicate.is_some_and(|chance| chance.percent.get() >= threshold)
        });
        prop_assert_eq!(outside.take(), None);
    }
}

#[test]
fn stages_that_are_off_are_never_drawn_and_required_ones_always() {
    for stage in Stage::ALL {
        let without = LinkBounds::any().never(stage);
        assert!(sample(&links_like(without), 3, 200).iter().all(|link| !link.has(stage)), "{stage}");
        let with = sample(&links_like(LinkBounds::any().always(stage)), 3, 200);
        let delayed = |link: &ImpairedLink| stage == Stage::Delay && link.netem().delay.is_some();
        assert!(with.iter().all(|link| link.has(stage) || delayed(link)), "{stage}");
        let alone = sample(&links_like(LinkBounds::ideal().always(stage)), 3, 50);
        assert!(alone.iter().all(|link| link.stages() == [stage]), "{stage}");
    }
    assert!(sample(&links_like(LinkBounds::ideal()), 3, 10).iter().all(ImpairedLink::is_ideal));
}

#[test]
fn only_the_models_of_loss_that_may_be_are_drawn() {
    for (model, word) in [(LossModel::Gemodel, "loss gemodel"), (LossModel::State, "loss state")] {
        for range in [0.1..=30.0, 5.0..=5.0, 60.0..=100.0, 0.0..=0.01] {
            let bounds = LinkBounds::ideal().loss(range).always(Stage::Loss).loss_models(&[model]);
            assert!(sample(&links_like(bounds), 5, 50).iter().all(|link| link.to_string().starts_with(word)));
        }
    }
}

#[test]
fn a_range_that_begins_at_zero_begins_at_the_least_that_is_something() {
    let bounds = LinkBounds::ideal().delay(Duration::ZERO..=us(100)).loss(0.0..=1.0).always(Stage::Delay).always(Stage::Loss);
    assert_eq!(shrink(&links_like(bounds), 1, |_| true).unwrap().least.to_string(), "delay 1us loss 0.01%");
}

#[test]
fn bounds_that_make_no_sense_are_refused() {
    let refused = [
        (LinkBounds::any().delay(us(5)..=us(2)), "delay: the range from 5µs to 2µs is empty: expected its end at or above its beginning"),
        (LinkBounds::any().loss(3.0..=1.0), "loss: the range from 3% to 1% is empty: expected its end at or above its beginning"),
        (LinkBounds::any().loss(0.0..=101.0), "loss: 101 is not a percentage: expected 0 to 100"),
        (LinkBounds::any().reorder(f64::NAN..=1.0), "reorder: NaN is not a percentage: expected 0 to 100"),
        (LinkBounds::any().limit(0..=0), "limit: the range holds only zero: expected LinkBounds::never(Stage::Limit), or an end above zero"),
        (LinkBounds::any().rate(0..=100), "rate: 0 bit/s: expected 8 bit/s to 1 Tbit/s"),
        (LinkBounds::any().rate(9..=15), "rate: the range from 9bit to 15bit is empty: expected its end at or above its beginning"),
        (LinkBounds::any().slot(us(1)..=Duration::MAX), "slot: 18446744073709551615.999999999s is too long: expected at most 1 hour"),
        (
            LinkBounds::any().delay(us(1)..=us(5)),
            "the jitter is at least 1ms and the delay at most 5µs: expected a longest delay of at least the least jitter",
        ),
        (LinkBounds::any().loss_models(&[]), "loss has no model: expected one of random, gemodel and state, or LinkBounds::never(Stage::Loss)"),
    ];
    for (bounds, message) in refused {
        assert_eq!(bounds.check().unwrap_err().to_string(), message);
    }
    // The first is told, and a later call does not undo it.
    let bounds = LinkBounds::any().limit(0..=0).loss(1.0..=101.0).limit(1..=2);
    assert_eq!(bounds.check(), Err(BoundsError::OnlyZero { stage: Stage::Limit }));
}

#[test]
#[should_panic(expected = "the bounds of links are not valid: loss: 101 is not a percentage")]
fn a_strategy_within_no_bounds_is_not_made() {
    let _ = networks_like(3, LinkBounds::any().loss(0.0..=101.0));
}

#[test]
#[should_panic(expected = "a network cannot have 0 hosts: expected 1 to 1000 hosts")]
fn a_network_without_hosts_is_not_made() {
    let _ = networks_like(0, LinkBounds::any());
}
