//! Printing and reading are inverse, and reading never panics. Strategies are boxed, so that their parts are compiled once and not in each property.

use core::num::{NonZeroU32, NonZeroU64};
use core::time::Duration;

use cohaptic_tests_common::properties;
use proptest::option::of;
use proptest::prelude::*;

use crate::netem::{
    CellSpec, ChanceSpec, CrossSource, CrossSpec, DelaySpec, Distribution, FramingSpec, GemodelSpec, JitterSpec, LossSpec, Netem, Percent, RateSpec,
    ReorderSpec, SlotGap, SlotSpec, StateSpec,
};

fn percent() -> BoxedStrategy<Percent> {
    let round = (0..=1000_u32).prop_map(|tenths| f64::from(tenths) / 10.0);
    prop_oneof![round, 0.0..=100.0, 0.0..=1e-12].prop_map(|value| Percent::new(value).unwrap()).boxed()
}

fn chance() -> BoxedStrategy<ChanceSpec> {
    (percent(), of(percent())).prop_map(|(percent, correlation)| ChanceSpec { percent, correlation }).boxed()
}

/// Times above zero, in which every number of binary digits is equally likely.
fn time() -> BoxedStrategy<Duration> {
    (1..=63_u32, any::<u64>()).prop_map(|(bits, word)| Duration::from_nanos((word >> (64 - bits)).max(1))).boxed()
}

fn distribution() -> BoxedStrategy<Distribution> {
    let name = prop_oneof![Just("uniform"), Just("normal"), Just("pareto"), Just("paretonormal")].prop_map(str::to_owned);
    prop_oneof![name, "[!-~]{1,12}"].prop_map(|name| Distribution::named(&name).unwrap()).boxed()
}

fn delay() -> BoxedStrategy<DelaySpec> {
    let jitter = (time(), of(percent()), of(distribution()));
    let jitter = jitter.prop_map(|(time, correlation, distribution)| JitterSpec { time, correlation, distribution });
    (time(), of(jitter)).prop_map(|(time, jitter)| DelaySpec { time, jitter }).boxed()
}

/// Percentages of which only the first ones are given, as the grammar demands.
fn said<const N: usize>() -> BoxedStrategy<[Option<Percent>; N]> {
    (prop::collection::vec(percent(), N), 0..=N).prop_map(|(all, count)| core::array::from_fn(|index| (index < count).then_some(all[index]))).boxed()
}

fn loss() -> BoxedStrategy<LossSpec> {
    let half = |percent: Percent| Percent::new(percent.get() / 2.0).unwrap();
    let state = (percent(), said::<4>()).prop_map(move |(p13, [p31, p32, p23, p14])| {
        LossSpec::State(StateSpec { p13: half(p13), p31: p31.map(half), p32: p32.map(half), p23, p14: p14.map(half) })
    });
    let gemodel =
        (percent(), said::<3>()).prop_map(|(p, [r, loss_in_bad, loss_in_good])| LossSpec::Gemodel(GemodelSpec { p, r, loss_in_bad, loss_in_good }));
    prop_oneof![chance().prop_map(LossSpec::Random), state, gemodel].boxed()
}

fn rate() -> BoxedStrategy<RateSpec> {
    let bytes = (1..=64_u32, any::<u64>()).prop_map(|(bits, word)| NonZeroU64::new((word >> (64 - bits)).max(1)).unwrap());
    let cell = (1..=u32::MAX, of(any::<i32>())).prop_map(|(size, overhead)| CellSpec { size: NonZeroU32::new(size).unwrap(), overhead });
    let framing = (any::<i32>(), of(cell)).prop_map(|(overhead, cell)| FramingSpec { overhead, cell });
    (bytes, of(framing)).prop_map(|(bytes_per_sec, framing)| RateSpec { bytes_per_sec, framing }).boxed()
}

fn cross() -> BoxedStrategy<CrossSpec> {
    let rate = || (1..=40_u32, any::<u64>()).prop_map(|(bits, word)| NonZeroU64::new((word >> (64 - bits)).max(1)).unwrap());
    let sources = (1..=65_536_u32).prop_map(|sources| NonZeroU32::new(sources).unwrap());
    let on_off = (sources, rate(), time(), time(), of(1.000_1..1.999_9)).prop_map(|(sources, peak, on, off, shape)| CrossSource::OnOff {
        sources,
        peak,
        on,
        off,
        shape,
    });
    let source = prop_oneof![rate().prop_map(|bytes_per_sec| CrossSource::Poisson { bytes_per_sec }), on_off];
    (source, of((1..=u32::MAX).prop_map(|size| NonZeroU32::new(size).unwrap()))).prop_map(|(source, size)| CrossSpec { source, size }).boxed()
}

fn slot() -> BoxedStrategy<SlotSpec> {
    let range = (time(), of(time())).prop_map(|(a, b)| match b {
        None => SlotGap::Range { min: a, max: None },
        Some(b) => SlotGap::Range { min: a.min(b), max: Some(a.max(b)) },
    });
    let drawn = (distribution(), time(), time()).prop_map(|(distribution, delay, jitter)| SlotGap::Drawn { distribution, delay, jitter });
    let count = || of((1..=i32::MAX).prop_map(|count| NonZeroU32::new(count.unsigned_abs()).unwrap()));
    (prop_oneof![range, drawn], count(), count()).prop_map(|(gap, packets, bytes)| SlotSpec { gap, packets, bytes }).boxed()
}

pub(in crate::netem) fn netem() -> BoxedStrategy<Netem> {
    let reorder = (chance(), of((1..=u32::MAX).prop_map(|gap| NonZeroU32::new(gap).unwrap()))).prop_map(|(chance, gap)| ReorderSpec { chance, gap });
    let head = (of(any::<u32>()), of(delay()), of(loss()), any::<bool>());
    let tail = (of(chance()), of(chance()), of(reorder), of(rate()), of(cross()), of(slot()), of(any::<u64>()));
    (head, tail)
        .prop_map(|((limit, delay, loss, ecn), (corrupt, duplicate, reorder, rate, cross, slot, seed))| Netem {
            limit,
            delay,
            loss,
            ecn,
            corrupt,
            duplicate,
            reorder,
            rate,
            cross,
            slot,
            seed,
        })
        .prop_map(|mut netem| {
            // Options that would contradict others are removed.
            if (Netem { rate: netem.rate, cross: netem.cross, ..Netem::default() }).check().is_err() {
                netem.cross = None;
            }
            netem.ecn = netem.ecn && Netem { reorder: None, ..netem.clone() }.check().is_ok();
            if netem.check().is_err() {
                netem.reorder = None;
            }
            netem
        })
        .boxed()
}

/// Words of the grammar, in a random order that is mostly wrong.
fn salad() -> BoxedStrategy<String> {
    let word = prop_oneof![
        prop::sample::select(vec![
            "limit",
            "delay",
            "latency",
            "loss",
            "drop",
            "random",
            "state",
            "gemodel",
            "ecn",
            "corrupt",
            "duplicate",
            "reorder",
            "gap",
            "distribution",
            "normal",
            "rate",
            "slot",
            "cross",
            "poisson",
            "on-off",
            "size",
            "packets",
            "bytes",
            "seed",
            "0",
            "1",
            "5%",
            "10ms",
            "1mbit",
            "-14",
            "0x10",
            "1e3",
            "1e",
            "1e+",
            ".",
            "-",
            "+",
            "0x",
        ])
        .prop_map(str::to_owned),
        "\\PC{0,8}",
        "[0-9.eE+-]{1,8}[a-zA-Z%]{0,3}",
    ];
    prop::collection::vec(word, 0..12).prop_map(|words| words.join(" ")).boxed()
}

properties! {
    #[test]
    fn what_is_printed_reads_back_to_the_same(netem in netem()) {
        prop_assert_eq!(netem.check(), Ok(()));
        let words = netem.to_string();
        let read = Netem::parse(&words).map_err(|error| TestCaseError::fail(error.excerpt(&words)))?;
        prop_assert_eq!(&read, &netem);
        prop_assert_eq!(read.to_string(), words);
    }

    #[test]
    fn no_text_makes_it_panic(text in prop_oneof![salad(), "\\PC{0,40}", any::<String>()]) {
        match Netem::parse(&text) {
            Ok(netem) => prop_assert_eq!(Netem::parse(&netem.to_string()), Ok(netem)),
            Err(error) => {
                prop_assert!(text.get(error.span.clone()).is_some_and(|word| !word.is_empty()), "{:?} in {:?}", error.span, text);
                prop_assert!(error.excerpt(&text).contains('^'));
            }
        }
    }
}
