use cohaptic_tests_common::properties;
use cohaptic_units::{Bytes, Instant};
use cohaptic_wan::{DropCause, Fate};
use proptest::prelude::*;
use rand_distr::{Distribution, Gamma};

use super::*;
use crate::tests::TestRng;

const MS: u64 = 1_000_000;

fn row(sequence: u64, copy: u8, offered_ms: u64, at_ms: u64, fate: Fate) -> PacketRecord {
    let [offered, at] = [offered_ms, at_ms].map(|ms| Instant::from_nanos(ms * MS));
    PacketRecord { path: (), sequence, copy, offered, at, size: Bytes::new(125), fate, marked: false, damaged: false }
}

fn arrives(sequence: u64, copy: u8, offered_ms: u64, at_ms: u64) -> PacketRecord {
    row(sequence, copy, offered_ms, at_ms, Fate::Delivered(Instant::from_nanos(at_ms * MS)))
}

fn lost(sequence: u64, offered_ms: u64) -> PacketRecord {
    row(sequence, 0, offered_ms, offered_ms, Fate::Dropped(DropCause::Loss))
}

/// Packets every 10 ms: delay 20 ms, lost, lost, 40 ms (with a copy after 30 ms), 10 ms, and on the way.
fn example() -> Vec<PacketRecord> {
    vec![
        arrives(0, 0, 0, 20),
        lost(1, 10),
        lost(2, 20),
        row(3, 0, 30, 30, Fate::Duplicated),
        arrives(4, 0, 40, 50),
        arrives(3, 1, 30, 60),
        PacketRecord { marked: true, ..arrives(3, 0, 30, 70) },
        row(5, 0, 70, 70, Fate::Duplicated),
        row(5, 1, 70, 71, Fate::Dropped(DropCause::QueueFull)),
    ]
}

#[test]
fn an_example_worked_by_hand() {
    let achieved = Achieved::of(&example());
    let fates = &achieved.fates;
    assert_eq!((fates.offered, fates.duplicated, fates.delivered, fates.in_flight, fates.marked), (6, 2, 4, 1, 1));
    assert_eq!((fates.dropped["loss"], fates.dropped["queue-full"], fates.dropped["outage"]), (2, 1, 0));

    let delay = achieved.delay.as_ref().unwrap();
    assert_eq!([delay.mean_s, delay.sd_s.unwrap(), delay.least_s, delay.greatest_s], [0.02, 0.01, 0.01, 0.03]);
    assert_eq!((delay.quantiles_s["0.5"], delay.quantiles_s["0.25"]), (0.02, 0.015));
    // Pairs of received packets: lag 1: (30, 10); lag 3: (20, 30); lag 4: (20, 10); none at lag 2, where the list ends. The only
    // product, −100, is −1.5 times the variance of 200/3, but −1 times the variance of the pair.
    assert_eq!(delay.autocorrelation.len(), 1);
    assert!((delay.autocorrelation[0] + 1.0).abs() < 1e-12);

    assert_eq!((achieved.loss.value, achieved.loss.received, achieved.loss.lost), (Some(0.4), 3, 2));
    assert_eq!((achieved.loss.run_mean, achieved.loss.gap_mean), (Some(2.0), Some(1.5)));
    assert_eq!((&achieved.loss.runs, &achieved.loss.gaps), (&[(2, 1)].into(), &[(1, 1), (2, 1)].into()));

    // Arrivals 0, 4, 3: packet 3 is one arrival late.
    assert_eq!(achieved.order.reordered, Some(1.0 / 3.0));
    assert_eq!((achieved.order.reordering_extent_mean, achieved.order.reordering_extent_max), (Some(1.0), Some(1)));
    assert_eq!(achieved.duplicated, Some(1.0 / 3.0));
    // Three arrivals of 1000 bit after the first, in 50 ms.
    assert_eq!(achieved.throughput_bit_s, Some(60_000.0));
    // D = 10 − 20 = −10 ms, then 30 − 10 = 20 ms: J = 10/16, then 0.625 + (20 − 0.625)/16 ms.
    assert!((achieved.jitter_rfc3550_s.unwrap() - 1.835_937_5e-3).abs() < 1e-12);
}

#[test]
fn json_is_flat_in_si_units_and_has_no_undefined_figure() {
    let json = serde_json::to_value(Achieved::of(&example())).unwrap();
    assert_eq!(json["mean_s"], 0.02);
    assert_eq!(json["quantiles_s"]["0.5"], 0.02);
    assert_eq!(json["loss"], 0.4);
    assert_eq!(json["loss_run_mean"], 2.0);
    assert_eq!(json["loss_runs"]["2"], 1);
    assert_eq!(json["reordered"], 1.0 / 3.0);
    assert!(json["autocorrelation"].is_array() && json["loss_autocorrelation"].is_array());
    assert!(json.get("mean_se_s").is_none() && json.get("fates").is_none());
    assert_eq!(json["throughput_bit_s"], 60_000.0);

    let nothing = serde_json::to_value(Achieved::of([])).unwrap();
    assert!(nothing.get("mean_s").is_none() && nothing.get("loss").is_none());
    assert_eq!(nothing["received"], 0);
    let counts = serde_json::to_value(Achieved::of([]).fates).unwrap();
    assert_eq!(counts["dropped"]["loss"], 0);
}

#[test]
fn a_packet_is_lost_only_when_its_last_copy_is() {
    let figures = |records: &[PacketRecord]| {
        let loss = Achieved::of(records).loss;
        (loss.received, loss.lost)
    };
    let copied = row(0, 0, 0, 0, Fate::Duplicated);
    assert_eq!(figures(&[copied, lost(0, 0)]), (0, 0));
    assert_eq!(figures(&[copied, lost(0, 0), arrives(0, 1, 0, 5)]), (1, 0));
    assert_eq!(figures(&[copied, lost(0, 0), PacketRecord { copy: 1, ..lost(0, 0) }]), (0, 1));
    // A packet without a record counts as on the way.
    assert_eq!(figures(&[lost(1, 0)]), (0, 1));
}

/// Figures cover the first two packets only, and fates cover all packets.
#[test]
fn figures_of_the_first_packets_are_those_of_a_shorter_stream() {
    let mut accumulator = Accumulator::of_first(2);
    let mut records = example();
    records.sort_by_key(|record| record.at);
    records.iter().for_each(|record| accumulator.record(record).unwrap());
    // Packet 1 was lost before packet 0 arrived.
    let (all, first) = (Achieved::of(&records), Achieved::of(&records[..2]));
    assert_eq!(accumulator.finish(), Achieved { fates: all.fates, ..first });
}

#[test]
fn records_that_go_back_in_time_are_refused() {
    let mut accumulator = Accumulator::new();
    accumulator.record(&arrives(0, 0, 0, 20)).unwrap();
    let refused = accumulator.record(&lost(1, 10)).unwrap_err();
    assert_eq!(refused.to_string(), "a record of 0.01s came after one of 0.02s: expected records in the order in which things happened");
    assert_eq!(accumulator.finish().fates.offered, 1);
}

/// Returns figures of 100 000 packets, a fifth lost independently, with gamma delays of mean 24 ms and deviation 2 ms above a floor of 20 ms.
fn gamma_link(seed: u64) -> Achieved {
    let mut rng = TestRng::new(seed);
    // Mean 4 ms, deviation 2 ms: shape 4, scale 1 ms.
    let law = Gamma::new(4.0, 1.0).unwrap();
    let mut records: Vec<PacketRecord> = (0..100_000)
        .map(|sequence| {
            let offered = Instant::from_nanos(sequence * MS);
            let delay: f64 = 20.0 + law.sample(&mut rng);
            #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a delay of some milliseconds")]
            let at = Instant::from_nanos(sequence * MS + (delay * 1e6) as u64);
            let is_lost = rng.unit() < 0.2;
            let (at, fate) = if is_lost { (offered, Fate::Dropped(DropCause::Loss)) } else { (at, Fate::Delivered(at)) };
            PacketRecord { path: (), sequence, copy: 0, offered, at, size: Bytes::new(64), fate, marked: false, damaged: false }
        })
        .collect();
    records.reverse();
    Achieved::of(&records)
}

#[test]
fn figures_of_a_known_law_lie_within_their_own_standard_errors() {
    let achieved = gamma_link(11);
    let delay = achieved.delay.unwrap();
    // Four standard errors: exceeded once in 16 000 seeds with a normal law, and once in 2500 with 29 degrees of freedom.
    assert!((delay.mean_s - 0.024).abs() < 4.0 * delay.mean_se_s.unwrap());
    assert!((delay.sd_s.unwrap() - 0.002).abs() < 4.0 * delay.sd_se_s.unwrap());
    // The errors agree with theory within 40 % (χ² with 29 degrees of freedom, 0.999): sd/√n, and sd·√((κ − 1)/4n) with kurtosis κ = 3 + 6/4.
    let n = 80_000.0_f64;
    assert!((0.6..1.45).contains(&(delay.mean_se_s.unwrap() / (0.002 / n.sqrt()))));
    assert!((0.6..1.45).contains(&(delay.sd_se_s.unwrap() / (0.002 * (3.5_f64 / 4.0 / n).sqrt()))));
    // The median of a gamma law of shape 4 and scale 1 is 3.672 061 (R: qgamma(0.5, 4)), the 0.99 quantile 10.045 118.
    for (name, quantile) in [("0.5", 0.023_672_061), ("0.99", 0.030_045_118)] {
        let [low, high] = delay.quantile_intervals_95_s[name];
        let middle = delay.quantiles_s[name];
        assert!((middle - quantile).abs() < 2.0 * (high - low), "{name}: {low} {high}");
        assert!(low <= middle && middle <= high);
    }
    assert!(delay.autocorrelation.iter().all(|r| r.abs() < 2.5 * delay.autocorrelation_bound_95));

    let loss = achieved.loss;
    assert!((loss.value.unwrap() - 0.2).abs() < 4.0 * loss.standard_error.unwrap());
    // Runs of independent losses are geometric, with mean 1/0.8.
    assert!((loss.run_mean.unwrap() - 1.25).abs() < 4.0 * loss.run_mean_se.unwrap());
    assert!((loss.gap_mean.unwrap() - 5.0).abs() < 4.0 * loss.gap_mean_se.unwrap());
}

properties! {
    #[test]
    fn fates_are_conserved_and_runs_add_up(fates in prop::collection::vec((0..4_u8, 0..50_u64), 0..200)) {
        let mut records = Vec::new();
        for (sequence, (what, delay)) in (0..).zip(fates) {
            let offered = sequence * 10;
            match what {
                0 => records.push(lost(sequence, offered)),
                1 => records.push(row(sequence, 0, offered, offered, Fate::Duplicated)),
                2 => records.extend([row(sequence, 0, offered, offered, Fate::Duplicated), arrives(sequence, 1, offered, offered + delay), lost(sequence, offered)]),
                _ => records.push(arrives(sequence, 0, offered, offered + delay)),
            }
        }
        let achieved = Achieved::of(&records);
        let fates = &achieved.fates;
        prop_assert_eq!(fates.offered + fates.duplicated, fates.delivered + fates.dropped.values().sum::<u64>() + fates.in_flight);
        let packets = |runs: &BTreeMap<u64, u64>| runs.iter().map(|(length, times)| length * times).sum::<u64>();
        prop_assert_eq!((packets(&achieved.loss.gaps), packets(&achieved.loss.runs)), (achieved.loss.received, achieved.loss.lost));
        if let Some(delay) = &achieved.delay {
            let quantiles: Vec<f64> = delay.quantiles_s.values().copied().collect();
            prop_assert!(quantiles.is_sorted());
            prop_assert!(delay.least_s <= quantiles[0] && quantiles[8] <= delay.greatest_s);
        }
        prop_assert!(serde_json::to_string(&achieved).is_ok());
    }
}
