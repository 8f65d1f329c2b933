use cohaptic_tests_common::quarter_by_day;

use super::*;
use crate::random::{Purpose, Stream};

/// Kolmogorov–Smirnov: the 0.9999 quantile of √n·D is 2.2253, so that about 50 comparisons fail by chance once in 200 seeds. For laws with atoms the test
/// is conservative.
const KS: f64 = 2.2253;

/// Returns the largest distance between the empirical distribution and the law. At a jump of either, both are evaluated from the same side.
fn kolmogorov(mut sample: Vec<f64>, law: &Law) -> f64 {
    sample.sort_by(f64::total_cmp);
    let n = sample.len() as f64;
    let mut largest = 0.0_f64;
    let mut begin = 0;
    for group in sample.chunk_by(|a, b| a == b) {
        let end = begin + group.len();
        let below = law.cdf(group[0].next_down());
        largest = largest.max((below - begin as f64 / n).abs()).max((law.cdf(group[0]) - end as f64 / n).abs());
        begin = end;
    }
    largest
}

/// Returns the largest distance between the sample and the law. Rounding could move the steps of a table to either side, so a table is compared at places
/// spread over all delays instead of at its steps.
fn distance(sample: Vec<f64>, name: &str, law: &Law) -> f64 {
    if name != "table" {
        return kolmogorov(sample, law);
    }
    let n = sample.len() as f64;
    let edges = (0..800).map(|i| law.least() - 0.01 + f64::from(i) * 0.013);
    edges.map(|edge| (sample.iter().filter(|&&x| x <= edge).count() as f64 / n - law.cdf(edge)).abs()).fold(0.0, f64::max)
}

fn draws(law: &Law, seed: u64, count: u64) -> Vec<f64> {
    let stream = Stream::new(seed, b"law");
    let draw = |packet| {
        let mut draws = stream.packet(packet).draws(Purpose::Jitter);
        law.draw(draws.next_word(), || draws.next_word())
    };
    (0..count).map(draw).collect()
}

#[test]
fn draws_have_the_law() {
    let count = quarter_by_day(100_000);
    for (seed, (name, law)) in (1..).zip(every_law()) {
        let distance = distance(draws(&law, seed, count), name, &law);
        assert!(distance < KS / libm::sqrt(count as f64), "{name} {:?}: {distance}", law.fit.standard);
    }
}

/// The standard error of the mean is sd/√n and of the variance sd²·√((κ − 1)/n), κ from the law by quadrature; 4.5 of them. Laws whose fourth moment is
/// infinite (Pareto of index 3) or ruled by what 4·10⁵ draws seldom hold have their mean alone.
#[test]
fn draws_have_the_moments() {
    let count = 400_000;
    for (seed, (name, law)) in (101..).zip(every_law()) {
        let sample = draws(&law, seed, count);
        let n = count as f64;
        let mean = sample.iter().sum::<f64>() / n;
        assert!((mean - law.mean()).abs() < 4.5 * law.sd() / libm::sqrt(n), "{name}: {mean}");
        let kurtosis = moment(&law, 4);
        if kurtosis > 50.0 || name.starts_with("pareto") {
            continue;
        }
        let variance = sample.iter().map(|x| (x - law.mean()) * (x - law.mean())).sum::<f64>() / n / (law.sd() * law.sd());
        assert!((variance - 1.0).abs() < 4.5 * libm::sqrt((kurtosis - 1.0) / n), "{name}: {variance}");
    }
}

/// Returns E of ((delay − mean)/sd)^k.
fn moment(law: &Law, k: i32) -> f64 {
    let mut sum = 0.0;
    for i in -13 * 32..20 * 32 {
        let low = f64::from(i) / 32.0;
        special::quadrature::panel(low, low + 1.0 / 32.0, |z, weight| {
            sum += weight * special::normal::density(z) * ((law.at_normal(z) - law.mean()) / law.sd()).powi(k);
        });
    }
    sum
}

/// Every 20th delay of a Gaussian AR(1), correlated by 0.8²⁰ = 1 %, has the law, and neighbouring delays have the correlation.
///
/// The standard error of Σ x(n)·x(n + 1)/N with x standardised is √(Σ over lags of the covariance of the products/N); it is measured here from 64 blocks
/// of the same run, so the bound is 5 of them (Student's t with 63 degrees of freedom: 5·10⁻⁶) and the model's own error of 10⁻⁵.
#[test]
fn a_gaussian_copula_has_the_law_and_the_correlation() {
    let rho = 0.8;
    for (seed, (name, law)) in (201..).zip(every_law()) {
        // Sums of products need a fourth moment.
        if moment(&law, 4) > 200.0 || name.starts_with("pareto") {
            continue;
        }
        let phi = law.gaussian_correlation(rho).unwrap();
        let stream = Stream::new(seed, b"copula");
        let normal = |packet: u64| {
            let mut draws = stream.packet(packet).draws(Purpose::Jitter);
            crate::laws::normal::standard_normal(draws.next_word(), || draws.next_word())
        };
        let mut z = normal(u64::MAX);
        let delays: Vec<f64> = (0..400_000)
            .map(|packet| {
                z = phi * z + libm::sqrt(1.0 - phi * phi) * normal(packet);
                law.at_normal(z)
            })
            .collect();
        let thinned: Vec<f64> = delays.iter().copied().step_by(20).collect();
        let bound = KS / libm::sqrt(thinned.len() as f64);
        assert!(distance(thinned, name, &law) < bound, "{name}");
        let standardised: Vec<f64> = delays.iter().map(|x| (x - law.mean()) / law.sd()).collect();
        let blocks: Vec<f64> =
            standardised.chunks(6250).map(|block| block.windows(2).map(|pair| pair[0] * pair[1]).sum::<f64>() / (block.len() - 1) as f64).collect();
        let mean = blocks.iter().sum::<f64>() / 64.0;
        let error = libm::sqrt(blocks.iter().map(|b| (b - mean) * (b - mean)).sum::<f64>() / 63.0 / 64.0);
        assert_eq!(blocks.len(), 64);
        assert!((mean - rho).abs() < 5.0 * error + 1e-5, "{name}: {mean} ± {error}");
    }
}
