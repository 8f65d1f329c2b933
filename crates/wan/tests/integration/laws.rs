//! Laws that are known exactly, on long runs with fixed seeds.
//!
//! Every interval holds with probability 0.999 for a correct link. With fixed seeds the tests do not flicker; the probability says how surprising it
//! would be if a correct link failed. 3.2905 is the 0.9995 quantile of the normal law.

use std::time::Duration;

use cohaptic_units::{Bytes, Instant};
use cohaptic_wan::random::{Purpose, Stream};
use cohaptic_wan::{Bottleneck, DropCause, Fate, GilbertElliott, Link, LinkConfig, LinkName, Loss, QueueLimit};
use rand_distr::{Distribution as _, Exp1};

use crate::random_links::{BYTE_A_MICROSECOND, at, probability, rate};

pub(crate) const NORMAL_9995: f64 = 3.2905;

/// Returns the losses among `count` packets: `true` for a lost packet, indexed by packet.
pub(crate) fn losses(seed: u64, loss: Loss, count: usize) -> Vec<bool> {
    let mut link = Link::new(seed, &LinkName::between("a", "b"), LinkConfig { loss, ..LinkConfig::default() });
    (0..count as u64).for_each(|number| link.handle_packet(at(number), Bytes::new(64), 0_u64).unwrap());
    link.handle_timeout(Instant::MAX).unwrap();
    let mut lost = vec![false; count];
    while let Some(event) = link.poll_event() {
        lost[usize::try_from(event.sequence).unwrap()] = event.fate == Fate::Dropped(DropCause::Loss);
    }
    lost
}

fn count(lost: &[bool]) -> usize {
    lost.iter().filter(|lost| **lost).count()
}

/// The lengths of the runs of lost packets that begin and end within.
pub(crate) fn bursts(lost: &[bool]) -> Vec<usize> {
    let runs: Vec<&[bool]> = lost.chunk_by(|a, b| a == b).collect();
    runs[1..runs.len() - 1].iter().filter(|run| run[0]).map(|run| run.len()).collect()
}

fn chain(p: f64, r: f64, h: f64, k: f64) -> GilbertElliott {
    GilbertElliott { p: probability(p), r: probability(r), h: probability(h), k: probability(k) }
}

#[test]
fn independent_losses_are_as_many_as_the_binomial_law_allows() {
    // scipy.stats.binom.ppf([0.0005, 0.9995], 200_000, p)
    for (seed, p, least, most) in [(1, 0.001, 155, 248), (2, 0.01, 1_855, 2_148), (3, 0.2, 39_412, 40_590), (4, 0.9, 179_557, 180_440)] {
        let lost = count(&losses(seed, Loss::Independent(probability(p)), 200_000));
        assert!((least..=most).contains(&lost), "{lost} of 200,000 lost at {p}");
    }
}

#[test]
fn runs_of_independent_losses_are_geometric() {
    // P(length = n) = (1 − p)·pⁿ⁻¹. Lengths from 1 to 10 and all beyond: eleven classes, so 10 degrees of freedom, of which chi² has the quantiles
    // 1.265 and 31.42 at 0.0005 and 0.9995. At p = 0.5 and a quarter of 400,000 runs the rarest class expects 98.
    let p = 0.5;
    let bursts = bursts(&losses(5, Loss::Independent(probability(p)), 400_000));
    let runs = bursts.len() as f64;
    let mut chi_squared = 0.0;
    for class in 1..=11usize {
        let seen = bursts.iter().filter(|length| (**length).min(11) == class).count() as f64;
        let tail = p.powi(i32::try_from(class).unwrap() - 1);
        let expected = runs * if class == 11 { tail } else { tail * (1.0 - p) };
        chi_squared += (seen - expected).powi(2) / expected;
    }
    assert!((1.265..31.42).contains(&chi_squared), "chi² = {chi_squared}");
}

#[test]
fn bursts_of_a_gilbert_elliott_chain_last_one_over_r() {
    // With h = 0 and k = 1 a burst is a stay in the bad state: geometric with mean 1/r and variance (1 − r)/r². Over B bursts the mean has the
    // standard error √(1 − r)/(r·√B).
    for (seed, p, r) in [(6, 0.01, 0.25), (7, 0.05, 0.1), (8, 0.3, 0.9)] {
        let bursts = bursts(&losses(seed, Loss::GilbertElliott(chain(p, r, 0.0, 1.0)), 400_000));
        let number = bursts.len() as f64;
        let mean = bursts.iter().sum::<usize>() as f64 / number;
        let error = (1.0 - r).sqrt() / (r * number.sqrt());
        assert!((mean - 1.0 / r).abs() < NORMAL_9995 * error, "mean burst {mean}, expected {} ± {error}", 1.0 / r);
    }
}

#[test]
fn a_gilbert_elliott_chain_has_its_mean_and_autocorrelation() {
    // The losses are cut into 100 batches of 10,000, far longer than the chain remembers (at most 1/(p+r) = 10 packets), so that the batches' means are
    // independent and normal. With the mean loss ℓ known, the mean over packets of (Xₙ − ℓ)(Xₙ₊ₖ − ℓ)/(ℓ(1 − ℓ)) is an unbiased estimate of the
    // autocorrelation at lag k, and the standard error is that of 100 independent numbers: Student's t with 99 degrees of freedom has the 0.9995 quantile
    // 3.3915.
    const BATCHES: usize = 100;
    const BATCH: usize = 10_000;
    const STUDENT: f64 = 3.3915;
    for (seed, chain) in
        [(9, chain(0.02, 0.3, 0.0, 1.0)), (10, chain(0.05, 0.2, 0.1, 0.97)), (11, chain(0.08, 0.02, 0.5, 0.9)), (12, chain(0.9, 0.8, 0.0, 1.0))]
    {
        let mean = chain.mean_loss().unwrap();
        let variance = mean * (1.0 - mean);
        let deviations: Vec<f64> =
            losses(seed, Loss::GilbertElliott(chain), BATCHES * BATCH).into_iter().map(|lost| f64::from(u8::from(lost)) - mean).collect();
        let within = |name: &str, expected: f64, of_packet: &dyn Fn(&[f64]) -> f64| {
            let estimates: Vec<f64> = deviations.chunks(BATCH).map(of_packet).collect();
            let estimate = estimates.iter().sum::<f64>() / BATCHES as f64;
            let scatter = estimates.iter().map(|each| (each - estimate).powi(2)).sum::<f64>() / (BATCHES - 1) as f64;
            let error = (scatter / BATCHES as f64).sqrt();
            assert!((estimate - expected).abs() < STUDENT * error, "{name} of {chain:?}: {estimate} ± {error}, expected {expected}");
            // Otherwise the test would not see anything.
            assert!(error < 0.01, "{name} of {chain:?}: known to {error} only");
        };
        within("deviation from the mean loss", 0.0, &|batch| batch.iter().sum::<f64>() / batch.len() as f64);
        for lag in [1u32, 2, 5] {
            let product = move |batch: &[f64]| {
                let pairs = batch.windows(lag as usize + 1);
                let number = pairs.len() as f64;
                pairs.map(|pair| pair[0] * pair[lag as usize]).sum::<f64>() / number / variance
            };
            within(&format!("autocorrelation at lag {lag}"), chain.autocorrelation(lag).unwrap(), &product);
        }
    }
}

#[test]
fn chains_begin_in_their_stationary_law() {
    // πB = p/(p + r) = 0.2. The first packet of 200,000 links that only differ in the seed is lost with that probability if h = 0, k = 1, however slow
    // the chain is: scipy.stats.binom.ppf([0.0005, 0.9995], 200_000, 0.2).
    let slow = Loss::GilbertElliott(chain(0.000_1, 0.000_4, 0.0, 1.0));
    // A link is 100 kB of ring, so 200,000 of them are asked only where the first draw sends them, and 300 of them where they really begin.
    let begins_bad = |seed: &u64| Stream::new(*seed, b"a->b").packet(0).draws(Purpose::InitialState).next_unit() < 0.2;
    let bad = (0..200_000).filter(begins_bad).count();
    assert!((39_412..=40_590).contains(&bad), "{bad} of 200,000 chains begin in the bad state");
    for seed in 0..300 {
        assert_eq!(losses(seed, slow.clone(), 1), [begins_bad(&seed)]);
    }
}

#[test]
fn a_queue_of_regular_arrivals_drops_exactly_what_does_not_fit() {
    // D/D/1/K: a packet of 3 bytes every 2 µs, served in 3 µs, K ≥ 1 may wait. At least one comes while another is served, so the line never idles: so ⌊2n/3⌋ packets are gone when packet n (from 0) comes at
    // 2n µs, a departure at that instant included. Arrivals are quicker than departures, so from the first full queue on it is filled whenever there is
    // room: after packet n, A(n) = min(n + 1, ⌊2n/3⌋ + K + 1) have been taken in. A packet is taken in where A grows; the j-th (from 0) of them leaves at
    // 3(j + 1) µs, so it has waited for 3j − 2n µs.
    const COUNT: u64 = 1_000;
    for limit in [1, 2, 7, 100, 1_000] {
        for bytes in [false, true] {
            let bound = if bytes { QueueLimit::Bytes(Bytes::new(3 * limit + 2)) } else { QueueLimit::Packets(limit) };
            let bottleneck = Bottleneck { limit: Some(bound), ..Bottleneck::at_rate(rate(BYTE_A_MICROSECOND)) };
            let mut link = Link::new(1, &LinkName::between("a", "b"), LinkConfig { bottleneck: Some(bottleneck), ..LinkConfig::default() });
            (0..COUNT).for_each(|number| link.handle_packet(at(number * 2_000), Bytes::new(3), 0_u64).unwrap());
            link.handle_timeout(Instant::MAX).unwrap();
            let mut fates: Vec<(u64, Fate)> = std::iter::from_fn(|| link.poll_event()).map(|event| (event.sequence, event.fate)).collect();
            fates.sort_by_key(|(sequence, _)| *sequence);

            let taken = |number: u64| (number + 1).min(2 * number / 3 + limit + 1);
            let fate = |number: u64| {
                let before = if number == 0 { 0 } else { taken(number - 1) };
                if taken(number) == before { Fate::Dropped(DropCause::QueueFull) } else { Fate::Delivered(at((before + 1) * 3_000)) }
            };
            assert_eq!(fates.len() as u64, COUNT);
            for (number, seen) in fates {
                assert_eq!(seen, fate(number), "packet {number}, {bound:?}");
            }
            assert_eq!(link.stats().dropped(DropCause::QueueFull), COUNT - taken(COUNT - 1));
        }
    }
}

#[test]
fn packets_at_random_wait_as_long_as_pollaczek_and_khinchine_say() {
    // M/D/1: arrivals at rate λ, service s, ρ = λs. The mean wait is λs²/(2(1 − ρ)).
    // The run is cut where a packet finds the line idle: such cycles are independent (the process regenerates). With Wᵢ the sum of the waits and Nᵢ the
    // number of packets of cycle i, the mean wait is ΣW/ΣN, and its standard error √(Σ(Wᵢ − m·Nᵢ)²)/ΣN (the central limit theorem for ratios). Rounding
    // instants to a nanosecond moves a wait by less than 10⁻⁶ of its mean.
    const COUNT: u64 = 300_000;
    const SERVICE: f64 = 64_000.0;
    for (seed, load) in [(1u64, 0.3), (2, 0.6), (3, 0.85)] {
        let bottleneck = Bottleneck::at_rate(rate(BYTE_A_MICROSECOND));
        let mut link = Link::new(seed, &LinkName::between("a", "b"), LinkConfig { bottleneck: Some(bottleneck), ..LinkConfig::default() });
        let gaps = Stream::new(seed, b"arrivals");
        let mut now = Instant::ZERO;
        for number in 0..COUNT {
            let gap: f64 = Exp1.sample(&mut gaps.packet(number).draws(Purpose::Jitter));
            now += Duration::from_secs_f64(gap * SERVICE / load / 1e9);
            link.handle_packet(now, Bytes::new(64), 0_u64).unwrap();
        }
        link.handle_timeout(Instant::MAX).unwrap();

        let mut cycles: Vec<(f64, f64)> = Vec::new();
        while let Some(event) = link.poll_event() {
            let wait = (event.at - event.offered).as_nanos() as f64 - SERVICE;
            if wait == 0.0 {
                cycles.push((0.0, 0.0));
            }
            let cycle = cycles.last_mut().unwrap();
            *cycle = (cycle.0 + wait, cycle.1 + 1.0);
        }
        let packets = COUNT as f64;
        let mean = cycles.iter().map(|cycle| cycle.0).sum::<f64>() / packets;
        let error = cycles.iter().map(|(wait, number)| (wait - mean * number).powi(2)).sum::<f64>().sqrt() / packets;
        let expected = load * SERVICE / (2.0 * (1.0 - load));
        assert!((mean - expected).abs() < NORMAL_9995 * error, "load {load}: mean wait {mean} ± {error} ns, expected {expected}");
        assert!(error < 0.03 * expected, "load {load}: the mean wait is known to {error} ns only");
        assert_eq!(link.stats().mean_delay().map(|delay| delay.as_nanos() as f64), Some((mean + SERVICE).floor()));
    }
}
