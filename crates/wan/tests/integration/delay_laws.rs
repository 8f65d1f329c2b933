//! Laws of delays, and of the reordering that random delays cause, through a link.

use std::time::Duration;

use cohaptic_units::{Bytes, Instant};
use cohaptic_wan::{Correlation, Delay, Distribution, Fate, Jitter, Link, LinkConfig, LinkName};

use crate::any_link::JITTERS;

/// Returns the delays \[ns\] of packets sent a second apart, so far apart that no packet overtakes another.
fn delays(seed: u64, delay: &Delay, count: u64) -> Vec<f64> {
    let mut link = Link::new(seed, &LinkName::between("a", "b"), LinkConfig { delay: delay.clone(), ..LinkConfig::default() });
    (0..count).for_each(|number| link.handle_packet(Instant::from_nanos(number * 1_000_000_000), Bytes::new(64), 0_u64).unwrap());
    link.handle_timeout(Instant::MAX).unwrap();
    std::iter::from_fn(|| link.poll_event()).map(|event| (event.at - event.offered).as_nanos() as f64).collect()
}

/// Of 40,000 delays, those at most the p-quantile are a binomial number. 200 of them are compared at 4.75 standard deviations, which all hold with probability
/// 0.9996. What is counted is below a nanosecond beyond the quantile, since delays are rounded; the law is asked the same.
#[test]
fn the_quantiles_of_every_law_come_out_of_a_link() {
    const COUNT: u64 = 40_000;
    let independent = JITTERS.iter().filter(|delay| delay.jitter().is_some_and(|jitter| jitter.correlation == Correlation::None));
    let mut laws = 0;
    for (seed, delay) in (71..).zip(independent) {
        let law = delay.law().unwrap();
        let seen = delays(seed, delay, COUNT);
        laws += 1;
        for p in [0.001, 0.01, 0.05, 0.25, 0.5, 0.75, 0.9, 0.99, 0.999] {
            let beyond = law.quantile(p) + 1.0;
            // What is delivered at a rounded nanosecond lies within half of one.
            let (least, most) = (law.cdf(beyond - 0.5), law.cdf(beyond + 0.5));
            let below = seen.iter().filter(|delay| **delay <= beyond).count() as f64 / COUNT as f64;
            let error = |p: f64| 4.75 * (p * (1.0 - p) / COUNT as f64).sqrt();
            assert!(
                (least - error(least)..=most + error(most)).contains(&below),
                "{:?}: {below} of the delays below the {p}-quantile",
                law.distribution()
            );
        }
    }
    assert_eq!(laws, 20);
}

/// Returns the share of packets that arrive after a packet that was sent later (RFC 4737, section 3.4), and its standard error from 100 batches.
fn reordered(seed: u64, jitter: Duration, distribution: Distribution, spacing: Duration) -> (f64, f64) {
    const BATCH: usize = 2_000;
    let delay = Delay::with_jitter(Duration::from_millis(200), Jitter::new(jitter, distribution)).unwrap();
    let mut link = Link::new(seed, &LinkName::between("a", "b"), LinkConfig { delay, ..LinkConfig::default() });
    let mut now = Instant::ZERO;
    for _ in 0..100 * BATCH {
        link.handle_packet(now, Bytes::new(64), 0_u64).unwrap();
        now += spacing;
    }
    link.handle_timeout(Instant::MAX).unwrap();
    let mut next_expected = 0;
    let mut late = vec![0.0; 100 * BATCH];
    while let Some(event) = link.poll_event() {
        assert!(matches!(event.fate, Fate::Delivered(_)));
        late[usize::try_from(event.sequence).unwrap()] = f64::from(u8::from(event.sequence < next_expected));
        next_expected = next_expected.max(event.sequence + 1);
    }
    let shares: Vec<f64> = late.chunks(BATCH).map(|batch| batch.iter().sum::<f64>() / BATCH as f64).collect();
    let mean = shares.iter().sum::<f64>() / 100.0;
    let variance = shares.iter().map(|share| (share - mean).powi(2)).sum::<f64>() / 99.0;
    (mean, (variance / 100.0).sqrt())
}

/// Independent jitter disorders a stream. Where only the next packet can overtake, uniform jitter of ±w at a spacing s does it with (2w − s)²/(8w²): the
/// difference of two such delays has a triangular law. The other shares were computed by simulation elsewhere, and are known to half a unit of their last
/// digit.
#[test]
fn independent_jitter_disorders_a_stream_by_the_known_share() {
    let millis = |millis: f64| Duration::from_secs_f64(millis / 1e3);
    // Spacing and half width \[ms\], share, how well it is known.
    let uniform = [
        (1.0, 1.0, 0.125, 0.0),
        (8.0, 5.0, 0.02, 0.0),
        (8.0, 4.0, 0.0, 0.0),
        (1.0, 2.0, 0.34, 0.005),
        (1.0, 10.0, 0.71, 0.005),
        (8.0, 10.0, 0.19, 0.005),
    ];
    for (seed, (spacing, width, share, known)) in (81..).zip(uniform) {
        let (seen, error) = reordered(seed, millis(width / 3f64.sqrt()), Distribution::Uniform, millis(spacing));
        assert!((seen - share).abs() <= known + 4.0 * error, "±{width} ms every {spacing} ms: {seen} ± {error}, expected {share}");
    }
    let normal = [(1.0, 1.0, 0.275, 0.0005), (1.0, 5.0, 0.72, 0.005), (8.0, 5.0, 0.13, 0.005), (8.0, 20.0, 0.56, 0.005)];
    for (seed, (spacing, sd, share, known)) in (91..).zip(normal) {
        let (seen, error) = reordered(seed, millis(sd), Distribution::Normal, millis(spacing));
        assert!((seen - share).abs() <= known + 4.0 * error, "σ = {sd} ms every {spacing} ms: {seen} ± {error}, expected {share}");
    }
}
