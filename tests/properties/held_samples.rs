//! Steps 1 and 2 of a tick, against the packets' own records: the target of a strategy at t is the mean of what the senders' copies were at the
//! ticks at which the highest-numbered packets that had arrived by t were sent; before the first, of where they began.

use std::collections::BTreeMap;

use cohaptic_harness::Model;
use cohaptic_tests::{Body, Draft, Log, drafts, run};
use cohaptic_tests_common::{cases, properties};
use cohaptic_units::Instant;
use cohaptic_wan::Fate;
use proptest::prelude::*;

properties! {
    #![proptest_config(cases(800))]

    #[test]
    fn every_target_is_the_mean_of_the_newest_samples_that_have_arrived(draft in drafts::anything_of_the_paper()) {
        let scene = draft.scene();
        let log = run(&scene, Model::Least);
        check(&draft, &log)?;
    }

    /// Most packets overtake others.
    #[test]
    fn a_late_packet_never_replaces_a_newer_sample(mut draft in drafts::anything_among(Just(2)), sd in 8..20_u32) {
        (draft.strategy, draft.send_when) = (drafts::PAPER[0], None);
        draft.link = format!("delay = \"20ms\", jitter = \"{sd}ms\", loss = 0.2");
        (draft.links, draft.update, draft.duration) = (Vec::new(), 2000, 200);
        draft.timeline.retain(|entry| !entry.contains("link = "));
        for peer in &mut draft.peers {
            peer.phase = 0;
            (peer.uplink, peer.downlink) = (None, None);
        }
        let log = run(&draft.scene(), Model::Least);
        check(&draft, &log)?;
        let stale: u64 = log.summary.peers.iter().map(|peer| peer.stale_samples).sum();
        // 100 samples each way, neighbours out of order with a probability of P(|Z| > 2 ms / (√2·8 ms)) / 2 > 0.4 before loss.
        prop_assert!(stale > 5 || log.end() < Instant::from_nanos(150_000_000), "{} stale samples", stale);
    }
}

fn check(draft: &Draft, log: &Log) -> Result<(), TestCaseError> {
    let places = 0..draft.peers.len();
    let rows: Vec<_> = places.clone().map(|peer| log.of(peer)).collect();
    // Step 1: sample q is taken at tick phase + q·M of the sender, and its packet is sent at that instant.
    let sampled = |peer: usize, sequence: u64| {
        let every = draft.update / draft.peers[peer].tick;
        rows[peer][usize::try_from(draft.peers[peer].phase + sequence * every).unwrap()]
    };
    let mut arrivals: BTreeMap<(usize, usize), Vec<(Instant, u64)>> = BTreeMap::new();
    for packet in &log.packets {
        prop_assert_eq!(packet.offered, sampled(packet.path.from.index(), packet.sequence).at, "{:?}", packet);
        if let Fate::Delivered(at) = packet.fate {
            prop_assert!(at >= packet.offered);
            arrivals.entry((packet.path.from.index(), packet.path.to.index())).or_default().push((at, packet.sequence));
        }
    }
    for receiver in places.clone() {
        let others: Vec<usize> = places.clone().filter(|other| *other != receiver).collect();
        let mut newest = vec![None; others.len()];
        let mut seen = vec![0; others.len()];
        for row in &rows[receiver] {
            // Step 2: what has arrived by now, the present instant included.
            for (place, sender) in others.iter().enumerate() {
                let due = arrivals.get(&(*sender, receiver)).map_or(&[][..], |arrivals| &arrivals[seen[place]..]);
                let due = &due[..due.iter().take_while(|(at, _)| *at <= row.at).count()];
                newest[place] = newest[place].max(due.iter().map(|(_, sequence)| *sequence).max());
                seen[place] += due.len();
            }
            let held =
                others.iter().zip(&newest).map(|(sender, newest)| newest.map_or_else(|| initial(draft, *sender), |q| sampled(*sender, q).object));
            let held: Vec<Body> = held.collect();
            for axis in 0..draft.axes {
                let context = format!("peer {receiver} at {} along axis {axis}: samples {newest:?} of {others:?}", row.at);
                mean_is(row.target.position[axis], held.iter().map(|body| body.position[axis]), &context)?;
                mean_is(row.target.velocity[axis], held.iter().map(|body| body.velocity[axis]), &context)?;
            }
        }
    }
    Ok(())
}

/// One sample is its own mean, to the bit. The mean of n in any order of summation has an error of at most n + 1 roundings of Σ|x|/n.
fn mean_is(actual: f64, samples: impl Iterator<Item = f64> + Clone, context: &str) -> Result<(), TestCaseError> {
    let n = super::count(samples.clone().count());
    let mean = samples.clone().sum::<f64>() / n;
    let size = samples.map(f64::abs).sum::<f64>() / n;
    let tolerance = if n == 1.0 { 0.0 } else { 2.0 * (n + 1.0) * super::ROUNDING * size };
    // Sums that overflow on the way to divergence are no number here or there.
    prop_assert!((actual - mean).abs() <= tolerance || !mean.is_finite() || !actual.is_finite(), "{context}: {actual:e}, expected {mean:e}");
    Ok(())
}

fn initial(draft: &Draft, peer: usize) -> Body {
    let peer = &draft.peers[peer];
    Body { position: peer.position.unwrap_or(draft.position), velocity: peer.velocity.unwrap_or(draft.velocity) }
}
