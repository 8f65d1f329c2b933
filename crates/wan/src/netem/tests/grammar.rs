//! Words that are read, and their values. Values marked as recorded are those that `tc` of iproute2 6.1 sent to a kernel for the same words.

use core::num::{NonZeroU32, NonZeroU64};
use core::time::Duration;

use crate::netem::{
    CellSpec, ChanceSpec, CrossSource, CrossSpec, DelaySpec, Distribution, FramingSpec, GemodelSpec, JitterSpec, LossSpec, Netem, Percent, RateSpec,
    ReorderSpec, SlotGap, SlotSpec, StateSpec,
};

fn percent(value: f64) -> Percent {
    Percent::new(value).unwrap()
}

fn netem(words: &str) -> Netem {
    match Netem::parse(words) {
        Ok(netem) => netem,
        Err(error) => panic!("{}", error.excerpt(words)),
    }
}

const MILLISECOND: Duration = Duration::from_millis(1);

#[test]
fn every_option_is_read() {
    let words = "limit 50 delay 24ms 2ms 25% distribution paretonormal loss gemodel 1% 10% 70% 0.1% ecn corrupt 0.1% 5% duplicate 1% \
                 reorder 25% 50% gap 5 rate 5kbit 20 100 -5 cross poisson 800bit size 1k slot 800us 10ms packets 42 bytes 64k seed 7";
    let expected = Netem {
        limit: Some(50),
        delay: Some(DelaySpec {
            time: 24 * MILLISECOND,
            jitter: Some(JitterSpec { time: 2 * MILLISECOND, correlation: Some(percent(25.0)), distribution: Some(Distribution::ParetoNormal) }),
        }),
        loss: Some(LossSpec::Gemodel(GemodelSpec {
            p: percent(1.0),
            r: Some(percent(10.0)),
            loss_in_bad: Some(percent(70.0)),
            loss_in_good: Some(percent(0.1)),
        })),
        ecn: true,
        corrupt: Some(ChanceSpec { percent: percent(0.1), correlation: Some(percent(5.0)) }),
        duplicate: Some(ChanceSpec { percent: percent(1.0), correlation: None }),
        reorder: Some(ReorderSpec { chance: ChanceSpec { percent: percent(25.0), correlation: Some(percent(50.0)) }, gap: NonZeroU32::new(5) }),
        rate: Some(RateSpec {
            bytes_per_sec: NonZeroU64::new(625).unwrap(),
            framing: Some(FramingSpec { overhead: 20, cell: Some(CellSpec { size: NonZeroU32::new(100).unwrap(), overhead: Some(-5) }) }),
        }),
        cross: Some(CrossSpec { source: CrossSource::Poisson { bytes_per_sec: NonZeroU64::new(100).unwrap() }, size: NonZeroU32::new(1024) }),
        slot: Some(SlotSpec {
            gap: SlotGap::Range { min: Duration::from_micros(800), max: Some(10 * MILLISECOND) },
            packets: NonZeroU32::new(42),
            bytes: NonZeroU32::new(65_536),
        }),
        seed: Some(7),
    };
    assert_eq!(netem(words), expected);
}

#[test]
fn the_sources_of_cross_packets_are_told_apart() {
    let on_off = |shape| {
        let (sources, peak) = (NonZeroU32::new(10).unwrap(), NonZeroU64::new(250_000).unwrap());
        CrossSource::OnOff { sources, peak, on: 200 * MILLISECOND, off: 800 * MILLISECOND, shape }
    };
    let cross = |words: &str| netem(words).cross;
    assert_eq!(cross("cross on-off 10 2mbit 200ms 0.8s rate 10mbit"), Some(CrossSpec { source: on_off(None), size: None }));
    let whole = Some(CrossSpec { source: on_off(Some(1.25)), size: NonZeroU32::new(64) });
    assert_eq!(cross("rate 10mbit cross on-off 10 2mbit 200ms 800ms 1.25 size 64 delay 5ms"), whole);
    assert_eq!(netem("rate 1mbit cr poisson 8kbit").cross, netem("cross poisson 8kbit rate 1mbit").cross);
    // A word of tc keeps its meaning.
    assert!(netem("c 5%").corrupt.is_some() && netem("rate 1mbit cross poisson 8kbit s 5").seed == Some(5));
}

#[test]
fn the_models_of_loss_are_told_apart() {
    let random = |percentage, correlation: Option<f64>| {
        Some(LossSpec::Random(ChanceSpec { percent: percent(percentage), correlation: correlation.map(percent) }))
    };
    assert_eq!(netem("loss 0.3% 25%").loss, random(0.3, Some(25.0)));
    assert_eq!(netem("drop random 5%").loss, random(5.0, None));
    let state = StateSpec { p13: percent(1.0), p31: Some(percent(2.0)), p32: Some(percent(3.0)), p23: None, p14: None };
    assert_eq!(netem("loss state 1% 2% 3%").loss, Some(LossSpec::State(state)));
    assert_eq!(state.probabilities(), [0.01, 0.02, 0.03, 1.0, 0.0]);
    let Some(LossSpec::Gemodel(model)) = netem("loss gemodel 5%").loss else { panic!("gemodel") };
    assert_eq!(model.probabilities(), [0.05, 0.95, 1.0, 0.0]);
}

#[test]
fn options_may_be_shortened_as_tc_lets_them() {
    let pairs = [
        ("l 5", "limit 5"),
        ("lo 5%", "loss 5%"),
        ("dr 5%", "loss 5%"),
        ("la 1ms", "delay 1ms"),
        ("d 1ms", "delay 1ms"),
        ("du 5%", "duplicate 5%"),
        ("di normal d 1ms 1ms", "delay 1ms 1ms distribution normal"),
        ("e lo 1%", "loss 1% ecn"),
        ("g 3 r 5% d 1ms", "delay 1ms reorder 5% gap 3"),
        ("ra 1mbit", "rate 1mbit"),
        ("c 1%", "corrupt 1%"),
        ("s 1", "seed 1"),
        ("sl 1ns p 5 b 10", "slot 1ns packets 5 bytes 10"),
    ];
    for (short, long) in pairs {
        assert_eq!(netem(short), netem(long), "{short}");
    }
}

#[test]
fn the_order_of_options_means_nothing() {
    assert_eq!(
        netem("distribution normal ecn gap 5 loss 1% reorder 5% delay 1ms 1ms"),
        netem("delay 1ms 1ms distribution normal loss 1% ecn reorder 5% gap 5")
    );
    assert_eq!(netem("slot 1us bytes 64k packets 5"), netem("slot 1us packets 5 bytes 64k"));
    assert_eq!(netem(" \t\n delay\n1ms "), netem("delay 1ms"));
    assert_eq!(netem(""), Netem::default());
}

#[test]
fn times_have_units() {
    let delays = [
        ("10ms", 10_000_000),
        ("10MS", 10_000_000),
        ("10msecs", 10_000_000),
        ("1.5s", 1_500_000_000),
        ("10Secs", 10_000_000_000),
        ("1e3us", 1_000_000),
        (".5ms", 500_000),
        ("+5ms", 5_000_000),
        ("5.ms", 5_000_000),
        ("1.001ms", 1_001_000),
        ("7nsec", 7),
        ("0", 0),
        ("9223372036854775807ns", 9_223_372_036_854_775_807),
    ];
    for (words, nanos) in delays {
        assert_eq!(netem(&format!("delay {words}")).delay.unwrap().time, Duration::from_nanos(nanos), "{words}");
    }
    let slot = SlotGap::Range { min: Duration::from_nanos(100), max: Some(Duration::from_micros(2)) };
    assert_eq!(netem("slot 100ns 2us").slot.unwrap().gap, slot);
}

/// Recorded rates.
#[test]
fn rates_are_bytes_per_second_cut_off() {
    let rates = [
        ("5kbit", 625),
        ("1mbit", 125_000),
        ("1Mbit", 125_000),
        ("1000", 125),
        ("8", 1),
        ("1MBPS", 1_000_000),
        ("1mibit", 131_072),
        ("1.5KiBps", 1536),
        ("1.1mbit", 137_500),
        ("1e3kbit", 125_000),
        ("1tbit", 125_000_000_000),
        ("40gbit", 5_000_000_000),
        ("+5kbit", 625),
    ];
    for (words, bytes) in rates {
        assert_eq!(netem(&format!("rate {words}")).rate.unwrap().bytes_per_sec.get(), bytes, "{words}");
    }
}

/// Recorded limits.
#[test]
fn limits_are_read_as_sizes() {
    let limits =
        [("1k", 1024), ("1.5", 1), ("0", 0), ("+5", 5), ("10b", 10), ("1kb", 1024), ("1M", 1_048_576), ("1kbit", 128), ("1gbit", 134_217_728)];
    for (words, limit) in limits {
        assert_eq!(netem(&format!("limit {words}")).limit, Some(limit), "{words}");
    }
}

/// Recorded integers.
#[test]
fn integers_may_be_octal_and_hexadecimal() {
    let overhead = |words: &str| netem(words).rate.unwrap().framing.unwrap().overhead;
    assert_eq!(overhead("rate 1mbit -14"), -14);
    assert_eq!(overhead("rate 1mbit 0x10"), 16);
    assert_eq!(overhead("rate 1mbit 010"), 8);
    assert_eq!(netem("slot 1us packets 0x10").slot.unwrap().packets, NonZeroU32::new(16));
    assert_eq!(netem("delay 1ms reorder 5% gap 0x5").reorder.unwrap().gap, NonZeroU32::new(5));
}

#[test]
fn a_distribution_may_be_a_table_of_any_name() {
    let distribution = |words: &str| netem(words).delay.unwrap().jitter.unwrap().distribution.unwrap();
    assert_eq!(distribution("delay 1ms 1ms distribution uniform"), Distribution::Uniform);
    assert_eq!(distribution("delay 1ms 1ms distribution experimental").name(), "experimental");
    let SlotGap::Drawn { distribution, .. } = netem("slot distribution pareto 1ms 100us").slot.unwrap().gap else { panic!("drawn") };
    assert_eq!(distribution, Distribution::Pareto);
}
