//! Words of each option, and the link configuration that they must give.

use alloc::sync::Arc;
use core::time::Duration;

use cohaptic_units::{Bytes, Probability, Rate};

use crate::laws::chance::Chance;
use crate::laws::delay::{DistTable, Distribution};
use crate::netem::{ExactError, Netem, TableName};
use crate::stages::config::{Layout, LinkConfig};
use crate::stages::corruption::{Checksum, Corruption, Flips};
use crate::stages::delay::{Correlation, Delay, Jitter};
use crate::stages::loss::{FourState, GilbertElliott, Loss};
use crate::stages::queue::{Bottleneck, Cells, CrossTraffic, Framing, OnOff, Poisson};
use crate::stages::reorder::{Displacement, Reorder};
use crate::stages::slots::Slots;

const MILLISECOND: Duration = Duration::from_millis(1);

fn netem(config: LinkConfig) -> LinkConfig {
    LinkConfig { layout: Layout::Netem, ..config }
}

fn exact(words: &str) -> LinkConfig {
    Netem::parse(words).expect(words).to_link_config(&mut |_| None).expect(words)
}

fn refused(words: &str) -> ExactError {
    Netem::parse(words).expect(words).to_link_config(&mut |_| None).expect_err(words)
}

fn p(value: f64) -> Probability {
    Probability::new(value).unwrap()
}

fn independent(value: f64) -> Chance {
    Chance::independent(p(value))
}

fn delay(jitter: Jitter) -> LinkConfig {
    netem(LinkConfig { delay: Delay::with_jitter(100 * MILLISECOND, jitter).unwrap(), ..LinkConfig::default() })
}

fn loss(loss: Loss) -> LinkConfig {
    netem(LinkConfig { loss, ..LinkConfig::default() })
}

/// A line of 10 Mbit/s with the cross-traffic of the words, and with that of the configuration.
#[test]
fn cross_packets_share_the_line() {
    let rate = |bits| Rate::bits_per_sec(bits).unwrap();
    let with = |traffic: CrossTraffic| {
        let bottleneck = Some(Bottleneck::at_rate(rate(10_000_000)));
        netem(LinkConfig { bottleneck, cross_traffic: Some(traffic), ..LinkConfig::default() })
    };
    let poisson = |size| CrossTraffic::poisson(Poisson { rate: rate(8_000_000), size: Bytes::new(size) }).unwrap();
    assert_eq!(exact("rate 10mbit cross poisson 8mbit"), with(poisson(1500)));
    assert_eq!(exact("rate 10mbit cross poisson 8mbit size 200"), with(poisson(200)));
    let on_off = |shape| {
        let (on, off) = (200 * MILLISECOND, 800 * MILLISECOND);
        CrossTraffic::on_off(OnOff { sources: 10, peak: rate(2_000_000), size: Bytes::new(1500), on, off, shape }).unwrap()
    };
    assert_eq!(exact("rate 10mbit cross on-off 10 2mbit 200ms 800ms"), with(on_off(1.5)));
    assert_eq!(exact("rate 10mbit cross on-off 10 2mbit 200ms 800ms 1.8"), with(on_off(1.8)));
}

#[test]
fn delay_and_jitter() {
    let constant = netem(LinkConfig { delay: Delay::constant(100 * MILLISECOND), ..LinkConfig::default() });
    assert_eq!(exact("delay 100ms"), constant);
    assert_eq!(exact("delay 100ms 0 50%"), constant);
    // Half a width of 10 ms is a deviation of 10 ms / √3, to the nanosecond.
    let uniform = Jitter::new(Duration::from_nanos(5_773_502), Distribution::Uniform);
    assert_eq!(exact("delay 100ms 10ms"), delay(uniform.clone()));
    assert_eq!(exact("delay 100ms 10ms distribution uniform"), delay(uniform));
    let laws = [("normal", Distribution::Normal), ("pareto", Distribution::Pareto), ("paretonormal", Distribution::ParetoNormal)];
    for (name, law) in laws {
        let jitter = Jitter { correlation: Correlation::PerPacket(0.25), ..Jitter::new(10 * MILLISECOND, law) };
        assert_eq!(exact(&format!("delay 100ms 10ms 25% distribution {name}")), delay(jitter));
    }
}

#[test]
fn a_named_distribution_is_looked_up() {
    let table = Arc::new(DistTable::parse("-8192 0 8192").unwrap());
    let words = Netem::parse("delay 100ms 10ms distribution mine").unwrap();
    let mut asked = Vec::new();
    let config = words.to_link_config(&mut |name| {
        asked.push(name.clone());
        Some(Arc::clone(&table))
    });
    assert_eq!(config.unwrap(), delay(Jitter::new(10 * MILLISECOND, Distribution::Table(table))));
    assert_eq!(asked, [TableName::new("mine").unwrap()]);
    let error = refused("delay 100ms 10ms distribution mine");
    assert_eq!(error, ExactError::NoTable(TableName::new("mine").unwrap()));
    assert_eq!(error.option(), "distribution");
}

#[test]
fn losses() {
    assert_eq!(exact("loss 1%"), loss(Loss::Independent(p(0.01))));
    assert_eq!(exact("loss 0%"), loss(Loss::None));
    assert_eq!(exact("loss 1% 0%"), loss(Loss::Independent(p(0.01))));
    assert_eq!(exact("loss random 1% 25%"), loss(Loss::Correlated(Chance::correlated(p(0.01), 0.25).unwrap())));
    let chain = |p13, p31, p32, p23, p14| Loss::FourState(FourState::new(p(p13), p(p31), p(p32), p(p23), p(p14)).unwrap());
    assert_eq!(exact("loss state 10%"), loss(chain(0.1, 0.9, 0.0, 1.0, 0.0)));
    assert_eq!(exact("loss state 2% 60% 25% 50% 1%"), loss(chain(0.02, 0.6, 0.25, 0.5, 0.01)));
    // In the kernel the sum of these probabilities wraps around.
    assert_eq!(exact("loss state 50% 50% 0% 100% 50%"), loss(chain(0.5, 0.5, 0.0, 1.0, 0.5)));
    let model = |p_, r, h, k| Loss::GilbertElliott(GilbertElliott { p: p(p_), r: p(r), h: p(h), k: p(k) });
    assert_eq!(exact("loss gemodel 25%"), loss(model(0.25, 0.75, 0.0, 1.0)));
    // The words give the fractions lost, 1 − h and 1 − k, and the model takes the fractions that get through.
    assert_eq!(exact("loss gemodel 1% 10% 75% 25%"), loss(model(0.01, 0.1, 0.25, 0.75)));
    let marks = LinkConfig { marks_instead_of_loss: true, ..loss(Loss::Independent(p(0.01))) };
    assert_eq!(exact("loss 1% ecn"), marks);
}

/// Two shares in tenths of a percent, x and 100 % − x, may sum to slightly more than 1 in binary.
#[test]
fn ways_out_of_a_state_may_sum_to_all() {
    for tenth in 0..=1000 {
        let (some, rest) = (f64::from(tenth) / 10.0, f64::from(1000 - tenth) / 10.0);
        exact(&format!("loss state {some}% {some}% {rest}% 50% {rest}%"));
    }
}

#[test]
fn duplicates_and_damage() {
    let correlated = Chance::correlated(p(0.02), 0.5).unwrap();
    assert_eq!(exact("duplicate 2% 50%"), netem(LinkConfig { duplication: correlated, ..LinkConfig::default() }));
    let corruption = Corruption { bits: Flips::Bits { packets: correlated, count: 1 }, within: None, checksum: Checksum::Discards };
    assert_eq!(exact("corrupt 2% 50%"), netem(LinkConfig { corruption: Some(corruption), ..LinkConfig::default() }));
    assert_eq!(exact("corrupt 0% duplicate 0%"), netem(LinkConfig::default()));
}

#[test]
fn reordering() {
    let config = |percent: f64, gap: u32| {
        let reorder = Reorder { packets: independent(percent), how: Displacement::Jump { gap: gap.try_into().unwrap() } };
        netem(LinkConfig { delay: Delay::constant(10 * MILLISECOND), reorder: Some(reorder), ..LinkConfig::default() })
    };
    assert_eq!(exact("delay 10ms reorder 25%"), config(0.25, 1));
    assert_eq!(exact("delay 10ms reorder 25% gap 5"), config(0.25, 5));
}

#[test]
fn rate_and_limit() {
    let line = |rate: u64, overhead: i32, cells: Option<Cells>| {
        let bottleneck = Bottleneck { framing: Framing { overhead, cells }, ..Bottleneck::at_rate(Rate::bits_per_sec(rate).unwrap()) };
        netem(LinkConfig { bottleneck: Some(bottleneck), ..LinkConfig::default() })
    };
    assert_eq!(exact("rate 8mbit"), line(8_000_000, 0, None));
    assert_eq!(exact("rate 1mbps"), line(8_000_000, 0, None));
    assert_eq!(exact("rate 8mbit -14"), line(8_000_000, -14, None));
    let atm = Cells { payload: 48.try_into().unwrap(), overhead: 5 };
    assert_eq!(exact("rate 8mbit 10 48 5"), line(8_000_000, 10, Some(atm)));
    assert_eq!(exact("rate 8mbit 10 48"), line(8_000_000, 10, Some(Cells { overhead: 0, ..atm })));
    assert_eq!(exact("limit 20"), netem(LinkConfig { limit: Some(20), ..LinkConfig::default() }));
    assert_eq!(exact("seed 7").limit, None);
    assert_eq!(exact("seed 7"), exact(""));
}

#[test]
fn slots() {
    let with = |slots| netem(LinkConfig { slots: Some(slots), ..LinkConfig::default() });
    let uniform = |min, max| Slots::new(Duration::from_micros(min), Duration::from_micros(max)).unwrap();
    assert_eq!(exact("slot 800us 1ms"), with(uniform(800, 1000)));
    let mut shared = uniform(800, 800);
    shared.packets = 4_u64.try_into().ok();
    shared.bytes = 3000_u64.try_into().ok();
    assert_eq!(exact("slot 800us packets 4 bytes 3000"), with(shared));
    let gap = Delay::with_jitter(MILLISECOND, Jitter::new(MILLISECOND / 10, Distribution::Normal)).unwrap();
    let mut drawn = Slots::drawn(gap);
    drawn.packets = 4_u64.try_into().ok();
    assert_eq!(exact("slot distribution normal 1ms 100us packets 4"), with(drawn));
}

#[test]
fn what_no_link_can_do_is_refused_with_the_option_and_what_could_be() {
    let refusals = [
        ("delay 1ms 10ms", "delay: uniform jitter of 10ms around 1ms begins below zero: expected a jitter of at most 1ms"),
        ("delay 1ms 2ms distribution pareto", "delay: Pareto jitter of 2ms around 1ms begins below zero: expected a jitter of at most 1.73205ms"),
        ("slot distribution uniform 1ms 2ms", "slot: uniform jitter of 2ms around 1ms begins below zero: expected a jitter of at most 1ms"),
        (
            "delay 5ms 1ms 100%",
            "delay: delays with this law cannot have the correlation 1 from one packet to the next: expected -1.000000 or more, and less than 1",
        ),
        (
            "duplicate 1% 100%",
            "duplicate: events of probability 1% cannot have the correlation 1 from one packet to the next: expected -0.010101 or more, and less than 1",
        ),
        ("rate 8mbit 0 48 -5", "rate: a cell overhead of -5 bytes: expected zero or more"),
    ];
    for (words, message) in refusals {
        let error = refused(words);
        assert_eq!(error.to_string(), message, "{words}");
        assert_eq!(error.option(), message.split(':').next().unwrap());
    }
    // A jitter of exactly the largest size is accepted, and a law without a smallest value is cut at zero.
    exact("delay 1ms 1ms");
    assert_eq!(exact("delay 1ms 10ms distribution normal").delay.least(), Duration::ZERO);
    let by_hand = Netem { ecn: true, ..Netem::default() };
    assert_eq!(by_hand.to_link_config(&mut |_| None).unwrap_err().option(), "ecn");
}
