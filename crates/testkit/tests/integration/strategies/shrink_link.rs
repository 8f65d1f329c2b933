//! Links shrink in few steps to the least impaired link that still fails.

use std::time::Duration;

use cohaptic_testkit::proptest::prelude::*;
use cohaptic_testkit::proptest::strategy::ValueTree;
use cohaptic_testkit::strategies::{ImpairedLink, LinkBounds, LossModel, Stage, any_link, links_like};
use cohaptic_wan::netem::{LossSpec, Netem};

use super::{runner, shrink};

const fn ms(count: u64) -> Duration {
    Duration::from_millis(count)
}

fn delay(netem: &Netem) -> Duration {
    netem.delay.as_ref().map_or(Duration::ZERO, |delay| delay.time)
}

fn jitter(netem: &Netem) -> Duration {
    netem.delay.as_ref().and_then(|delay| delay.jitter.as_ref()).map_or(Duration::ZERO, |jitter| jitter.time)
}

/// Returns the long-run loss of a link \[%\].
fn loss(link: &ImpairedLink) -> f64 {
    link.config().loss.mean().unwrap() * 100.0
}

fn percent(chance: Option<cohaptic_wan::netem::ChanceSpec>) -> f64 {
    chance.map_or(0.0, |chance| chance.percent.get())
}

/// Checks that every link for which `fails` is true, of a hundred seeds, shrinks to the link `words`, in at most `most` calls of `fails`.
fn comes_down_to(words: &str, most: u32, fails: impl Fn(&ImpairedLink) -> bool) {
    let mut found = 0;
    for seed in 0..100 {
        let Some(shrunk) = shrink(&any_link(), seed, &fails) else { continue };
        found += 1;
        assert_eq!(shrunk.least.to_string(), words, "from {}", shrunk.first);
        assert!(shrunk.asked <= most, "{} steps from {}", shrunk.asked, shrunk.first);
    }
    assert_eq!(found, 100);
}

#[test]
fn what_always_fails_fails_on_the_ideal_link() {
    comes_down_to("delay 0s", 2, |_| true);
}

#[test]
fn a_stage_alone() {
    // Each with what impairs least by it, in the ranges of any link.
    let plain = [
        (Stage::Limit, "limit 1000"),
        (Stage::Delay, "delay 1ms"),
        (Stage::Jitter, "delay 1ms 1ms"),
        (Stage::Loss, "loss 0.1%"),
        (Stage::Corrupt, "corrupt 0.1%"),
        (Stage::Duplicate, "duplicate 0.1%"),
        (Stage::Reorder, "delay 1ms reorder 1%"),
        (Stage::Rate, "rate 100mbit"),
        (Stage::Slot, "slot 1ms"),
    ];
    for (stage, words) in plain {
        comes_down_to(words, 20, |link| link.has(stage));
    }
}

#[test]
fn a_number_comes_down_to_its_threshold() {
    comes_down_to("loss 3%", 30, |link| loss(link) >= 2.999 && !matches!(link.netem().loss, Some(LossSpec::Random(c)) if c.percent.get() < 3.0));
    comes_down_to("delay 24ms", 30, |link| delay(link.netem()) >= ms(24));
    comes_down_to("delay 5ms 5ms", 30, |link| jitter(link.netem()) >= ms(5));
    comes_down_to("delay 250ms", 30, |link| delay(link.netem()) >= ms(250));
    comes_down_to("duplicate 1.5%", 30, |link| percent(link.netem().duplicate) >= 1.5);
    comes_down_to("delay 1ms reorder 25%", 30, |link| percent(link.netem().reorder.map(|reorder| reorder.chance)) >= 25.0);
    comes_down_to("limit 8", 30, |link| link.netem().limit.is_some_and(|limit| limit <= 8));
    comes_down_to("rate 1500kbit", 30, |link| link.netem().rate.is_some_and(|rate| rate.bytes_per_sec.get() * 8 <= 1_500_000));
}

#[test]
fn a_threshold_that_is_not_round_is_left_at_the_next_round_number() {
    // From what was drawn above 13 ms; between 12.34 and 13 ms the digits go on until the number is round.
    let fails = |link: &ImpairedLink| delay(link.netem()) > Duration::from_micros(12_340);
    for seed in 0..100 {
        let shrunk = shrink(&any_link(), seed, fails).unwrap();
        if delay(shrunk.first.netem()) >= ms(13) {
            assert_eq!(shrunk.least.to_string(), "delay 13ms", "from {}", shrunk.first);
        }
    }
    // Within bounds nothing rounder is left.
    let narrow = links_like(LinkBounds::ideal().delay(Duration::from_nanos(12_345_678)..=Duration::from_nanos(12_399_999)).always(Stage::Delay));
    assert_eq!(shrink(&narrow, 1, |_| true).unwrap().least.to_string(), "delay 12345678ns");
}

#[test]
fn two_stages_that_fail_together() {
    comes_down_to("delay 1ms 1ms loss 0.1%", 50, |link| link.has(Stage::Jitter) && link.has(Stage::Loss));
    comes_down_to("delay 10ms loss 3%", 50, |link| delay(link.netem()) >= ms(10) && loss(link) >= 3.0);
    comes_down_to("delay 1ms 1ms reorder 1%", 50, |link| link.has(Stage::Jitter) && link.has(Stage::Reorder));
}

#[test]
fn overtaking_comes_down_to_jitter_or_to_reordering_alone() {
    let overtakes = |link: &ImpairedLink| link.has(Stage::Jitter) || link.has(Stage::Reorder);
    let mut seen = std::collections::BTreeSet::new();
    for seed in 0..100 {
        let least = shrink(&any_link(), seed, overtakes).unwrap().least;
        assert_eq!(least.stages().len(), 1);
        seen.insert(least.to_string());
    }
    assert_eq!(seen.into_iter().collect::<Vec<_>>(), ["delay 1ms 1ms", "delay 1ms reorder 1%"]);
}

#[test]
fn bursts_come_down_to_random_loss_unless_they_are_what_fails() {
    comes_down_to("loss 0.1%", 30, |link| link.has(Stage::Loss));
    for seed in 0..50 {
        let shrunk = shrink(&any_link(), seed, |link| matches!(link.netem().loss, Some(LossSpec::Gemodel(_) | LossSpec::State(_)))).unwrap();
        let Some(LossSpec::Gemodel(model)) = shrunk.least.netem().loss else { panic!("{}", shrunk.least) };
        assert!(model.loss_in_bad.is_none(), "{}", shrunk.least);
        assert!(shrunk.least.stages() == [Stage::Loss] && loss(&shrunk.least) <= 0.12 && shrunk.asked <= 80, "{} {}", shrunk.least, shrunk.asked);
    }
}

#[test]
fn a_required_stage_stays() {
    let bounds = LinkBounds::any().jitter(ms(2)..=ms(20)).always(Stage::Jitter).always(Stage::Loss);
    for seed in 0..30 {
        assert_eq!(shrink(&links_like(bounds.clone()), seed, |_| true).unwrap().least.to_string(), "delay 2ms 2ms loss 0.1%");
    }
    let bounds = LinkBounds::any().always(Stage::Delay).always(Stage::Rate);
    for seed in 0..30 {
        assert_eq!(shrink(&links_like(bounds.clone()), seed, |_| true).unwrap().least.to_string(), "delay 1ms rate 100mbit");
    }
}

#[test]
fn without_random_loss_the_chain_stays() {
    let bounds = LinkBounds::ideal().loss(5.0..=20.0).always(Stage::Loss).loss_models(&[LossModel::Gemodel]);
    for seed in 0..30 {
        let shrunk = shrink(&links_like(bounds.clone()), seed, |_| true).unwrap();
        assert!(matches!(shrunk.least.netem().loss, Some(LossSpec::Gemodel(_))), "{}", shrunk.least);
        assert!(bounds.admits(&shrunk.least) && (4.98..5.6).contains(&loss(&shrunk.least)), "{}", shrunk.least);
    }
}

#[test]
fn a_test_that_fails_at_whim_ends_too_with_a_value_that_has_failed() {
    for seed in 0..200_u64 {
        let mut tree = any_link().new_tree(&mut runner(seed, 1)).unwrap();
        let mut whim = seed;
        let mut failed = tree.current();
        let mut steps = 0;
        let mut goes_on = tree.simplify();
        while goes_on {
            steps += 1;
            assert!(steps < 2_000, "no end from seed {seed}");
            whim = whim.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            goes_on = if whim >> 63 == 0 {
                failed = tree.current();
                tree.simplify()
            } else {
                tree.complicate()
            };
        }
        assert_eq!(tree.current(), failed);
        assert!(!tree.simplify() && !tree.complicate() && tree.current() == failed);
    }
}

#[test]
fn giving_up_half_way_leaves_what_failed_last() {
    let fails = |link: &ImpairedLink| loss(link) >= 3.0 && delay(link.netem()) >= ms(7);
    for seed in 0..200 {
        let mut tree = any_link().new_tree(&mut runner(seed, 1)).unwrap();
        if !fails(&tree.current()) {
            continue;
        }
        let mut failed = tree.current();
        let mut goes_on = tree.simplify();
        for _ in 0..seed % 30 {
            if !goes_on {
                break;
            }
            goes_on = if fails(&tree.current()) {
                failed = tree.current();
                tree.simplify()
            } else {
                tree.complicate()
            };
        }
        // As the runner does when it may not go on: whatever is being tried now is taken to pass, even if it would fail.
        while tree.complicate() {}
        assert_eq!(tree.current(), failed);
    }
}

#[test]
fn in_a_tuple_what_comes_after_the_link_is_shrunk_too() {
    let strategy = (0..1_000_u32, any_link(), 0..1_000_u32);
    for seed in 0..30 {
        let fails = |(a, link, b): &(u32, ImpairedLink, u32)| *a >= 10 && loss(link) >= 3.0 && *b >= 20;
        let Some(shrunk) = shrink(&strategy, seed, fails) else { continue };
        let (a, link, b) = shrunk.least;
        assert_eq!((a, link.to_string().as_str(), b), (10, "loss 3%", 20));
    }
}
