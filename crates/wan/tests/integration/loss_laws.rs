//! The laws of the loss models with memory, through a link: mean, autocorrelation and lengths of runs, as in `laws`, each with probability 0.999.

use std::time::Duration;

use cohaptic_units::{Bytes, Instant, Probability};
use cohaptic_wan::{Chance, DropCause, Fate, FourState, GilbertElliottInTime, Link, LinkConfig, LinkName, Loss};

use crate::laws::{bursts, losses};
use crate::random_links::probability;

/// Student's t with 99 degrees of freedom: the 0.9995 quantile.
const STUDENT: f64 = 3.3915;
const BATCHES: usize = 100;
const BATCH: usize = 5_000;

/// Mean and autocorrelations against those expected, by the scatter of 100 batches, each of many times the memory of the chain.
fn check(name: &str, lost: &[bool], mean: f64, autocorrelation: impl Fn(usize) -> f64) {
    let deviations: Vec<f64> = lost.iter().map(|lost| f64::from(u8::from(*lost)) - mean).collect();
    let within = |what: &str, expected: f64, of_batch: &dyn Fn(&[f64]) -> f64| {
        let estimates: Vec<f64> = deviations.chunks(BATCH).map(of_batch).collect();
        let estimate = estimates.iter().sum::<f64>() / BATCHES as f64;
        let scatter = estimates.iter().map(|each| (each - estimate).powi(2)).sum::<f64>() / (BATCHES - 1) as f64;
        let error = (scatter / BATCHES as f64).sqrt();
        assert!((estimate - expected).abs() < STUDENT * error, "{what} of {name}: {estimate} ± {error}, expected {expected}");
        assert!(error < 0.015, "{what} of {name}: known to {error} only");
    };
    within("deviation from the mean loss", 0.0, &|batch| batch.iter().sum::<f64>() / batch.len() as f64);
    for lag in [1, 2, 5] {
        within(&format!("autocorrelation at lag {lag}"), autocorrelation(lag), &|batch| {
            let products = batch.windows(lag + 1).map(|pair| pair[0] * pair[lag]);
            products.sum::<f64>() / (batch.len() - lag) as f64 / (mean * (1.0 - mean))
        });
    }
}

/// χ² of lengths that should be geometric with this probability of going on, in ten classes and all beyond: 10 degrees of freedom, of which the quantiles at
/// 0.0005 and 0.9995 are 1.265 and 31.42.
fn is_geometric(name: &str, lengths: &[usize], goes_on: f64) {
    let count = lengths.len() as f64;
    let mut chi_squared = 0.0;
    for class in 1..=11_usize {
        let seen = lengths.iter().filter(|length| if class < 11 { **length == class } else { **length >= 11 }).count() as f64;
        let share = goes_on.powi(i32::try_from(class).unwrap() - 1) * if class < 11 { 1.0 - goes_on } else { 1.0 };
        assert!(share * count > 5.0, "a class of {name} expects {} only", share * count);
        chi_squared += (seen - share * count).powi(2) / (share * count);
    }
    assert!((1.265..31.42).contains(&chi_squared), "χ² of {name}: {chi_squared}");
}

#[test]
fn correlated_losses_have_their_mean_their_memory_and_geometric_runs() {
    for (seed, p, rho) in [(21, 0.1, 0.5), (22, 0.3, 0.25), (23, 0.5, -0.5)] {
        let lost = losses(seed, Loss::Correlated(Chance::correlated(probability(p), rho).unwrap()), BATCHES * BATCH);
        check(&format!("p = {p}, ρ = {rho}"), &lost, p, |lag| rho.powi(i32::try_from(lag).unwrap()));
    }
    let (p, rho) = (0.3, 0.4);
    let lost = losses(24, Loss::Correlated(Chance::correlated(probability(p), rho).unwrap()), 400_000);
    is_geometric("lost runs", &bursts(&lost), p + rho * (1.0 - p));
    let received: Vec<bool> = lost.iter().map(|lost| !lost).collect();
    is_geometric("received runs", &bursts(&received), 1.0 - p * (1.0 - rho));
}

#[test]
fn the_four_states_have_the_mean_and_the_memory_of_their_matrix() {
    let p = probability;
    for (seed, [p13, p31, p32, p23, p14]) in [(31, [0.05, 0.3, 0.2, 0.4, 0.02]), (32, [0.1, 0.2, 0.3, 0.5, 0.1])] {
        let chain = FourState::new(p(p13), p(p31), p(p32), p(p23), p(p14)).unwrap();
        // Gap, received in a burst, lost in a burst, lost alone.
        let matrix = [[1.0 - p13 - p14, 0.0, p13, p14], [0.0, 1.0 - p23, p23, 0.0], [p31, p32, 1.0 - p31 - p32, 0.0], [1.0, 0.0, 0.0, 0.0]];
        let step = |law: [f64; 4]| -> [f64; 4] { std::array::from_fn(|to| (0..4).map(|from| law[from] * matrix[from][to]).sum()) };
        let mut stationary = [1.0, 0.0, 0.0, 0.0];
        (0..10_000).for_each(|_| stationary = step(stationary));
        let [_, _, lost, isolated] = stationary;
        let mean = lost + isolated;
        assert!((mean - chain.mean_loss()).abs() < 1e-9);
        // P(lost, and lost again `lag` later), by moving the lost part of the law.
        let again = |lag| {
            let mut law = [0.0, 0.0, lost, isolated];
            (0..lag).for_each(|_| law = step(law));
            law[2] + law[3]
        };
        let lost = losses(seed, Loss::FourState(chain), BATCHES * BATCH);
        check("the four states", &lost, mean, |lag| (again(lag) - mean * mean) / (mean * (1.0 - mean)));
    }
}

#[test]
fn losses_in_time_have_the_memory_of_the_time_between_packets() {
    // Bad for 5 ms of 25: the autocorrelation over t is (h̄ − k̄)²·πB·πG/(ℓ(1−ℓ))·e^(−t/4 ms).
    let millis = Duration::from_millis;
    for (seed, spacing, through_bad, through_good) in [(41, 1, 0.0, 1.0), (42, 3, 0.3, 0.95)] {
        let chain = GilbertElliottInTime::new(millis(20), millis(5), probability(through_bad), probability(through_good)).unwrap();
        let config = LinkConfig { loss: Loss::GilbertElliottInTime(chain), ..LinkConfig::default() };
        let mut link = Link::new(seed, &LinkName::between("a", "b"), config);
        let lost: Vec<bool> = (0..(BATCHES * BATCH) as u64)
            .map(|number| {
                let now = Instant::from_nanos(number * spacing * 1_000_000);
                link.handle_packet(now, Bytes::new(64), 0_u64).unwrap();
                link.handle_timeout(now).unwrap();
                link.poll_event().unwrap().fate == Fate::Dropped(DropCause::Loss)
            })
            .collect();
        let mean = 0.2 * (1.0 - through_bad) + 0.8 * (1.0 - through_good);
        let visible = (through_good - through_bad).powi(2) * 0.2 * 0.8 / (mean * (1.0 - mean));
        check("losses in time", &lost, mean, |lag| visible * (-((lag as u64 * spacing) as f64) / 4.0).exp());
    }
}

#[test]
fn copies_and_damage_are_as_many_as_the_binomial_law_allows() {
    // scipy.stats.binom.ppf([0.0005, 0.9995], 100_000, 0.1) = (9688, 10313); 1 − (1 − 10⁻³)⁵¹² = 0.40083 of 64 bytes: 40 083 ± 3.2905·√(n·p·q) = 510.
    use cohaptic_wan::{Checksum, Corruption, Flips};
    let p: fn(f64) -> Probability = probability;
    let copies = Chance::independent(p(0.1));
    for (bits, least, most) in [(Flips::Bits { packets: copies, count: 1 }, 9_688, 10_313), (Flips::Rate(p(0.001)), 39_573, 40_593)] {
        let corruption = Some(Corruption { bits, within: None, checksum: Checksum::Discards });
        let config = LinkConfig { corruption, ..LinkConfig::default() };
        let mut link = Link::new(51, &LinkName::between("a", "b"), config);
        (0..100_000).for_each(|number| link.handle_packet(Instant::from_nanos(number), Bytes::new(64), 0_u64).unwrap());
        link.handle_timeout(Instant::MAX).unwrap();
        let damaged = link.stats().damaged();
        assert!((least..=most).contains(&damaged), "{damaged} of 100,000 damaged by {bits:?}");
        assert_eq!(link.stats().dropped(DropCause::Checksum), damaged);
    }
    let mut link = Link::new(52, &LinkName::between("a", "b"), LinkConfig { duplication: copies, ..LinkConfig::default() });
    (0..100_000).for_each(|number| link.handle_packet(Instant::from_nanos(number), Bytes::new(64), 0_u64).unwrap());
    assert!((9_688..=10_313).contains(&link.stats().duplicated()), "{}", link.stats().duplicated());
}
