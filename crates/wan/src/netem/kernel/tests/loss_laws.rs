//! The chains lose as many packets as their stationary laws say, in bursts as long as these laws say.

use cohaptic_tests_common::quarter_by_day;

use crate::netem::Netem;
use crate::netem::kernel::Prng;
use crate::netem::kernel::loss::LossModel;
use crate::netem::kernel::prng::Unseeded;
use crate::netem::kernel::tests::{autocorrelation, mean};

fn model(words: &str) -> LossModel {
    LossModel::new(Netem::parse(words).unwrap().loss.as_ref(), &mut Unseeded::new(1))
}

/// Returns 1 for every packet lost, and 0 for every other packet.
fn losses(words: &str, count: u64) -> Vec<f64> {
    let mut model = model(words);
    let mut prng = Prng::new(1);
    (0..count).map(|_| f64::from(u8::from(model.loses(&mut prng)))).collect()
}

/// Returns the stationary loss π₃ + π₄ with π₁ = 1/(1 + p14 + a(1 + p32/p23)), π₄ = p14·π₁, π₃ = a·π₁, a = p13/p31.
fn stationary_loss([p13, p31, p32, p23, p14]: [f64; 5]) -> f64 {
    let a = p13 / p31;
    (a + p14) / (1.0 + p14 + a * (1.0 + p32 / p23))
}

fn state(probabilities: [f64; 5]) -> String {
    let percentages: Vec<String> = probabilities.iter().map(|p| format!("{}%", p * 100.0)).collect();
    format!("loss state {}", percentages.join(" "))
}

/// Published: three sets of parameters agree to 0.0003. The tolerance is more than three standard errors of 6·10⁷ packets: in the first set, which is the
/// worst, bursts leave twelve packets the weight of one independent packet. A quarter of the packets, by day, has twice the error.
#[test]
fn the_four_state_chain_has_its_stationary_loss() {
    let packets = quarter_by_day(60_000_000);
    let tolerance = 0.0003 * (6e7 / packets as f64).sqrt();
    for parameters in [[0.01, 0.3, 0.1, 0.4, 0.005], [0.05, 0.5, 0.2, 0.3, 0.02], [0.002, 0.1, 0.3, 0.6, 0.0]] {
        let mut model = model(&state(parameters));
        let mut prng = Prng::new(1);
        let lost: u64 = (0..packets).map(|_| u64::from(model.loses(&mut prng))).sum();
        let (expected, actual) = (stationary_loss(parameters), lost as f64 / packets as f64);
        assert!((actual - expected).abs() < tolerance, "{parameters:?}: {actual}, law {expected}");
    }
}

/// Published: (loss 5 %, burst 10, density 0.8, isolated 0.5 %, good run 3) gives a simulated loss of 0.0495 for a requested loss of 0.05.
#[test]
fn general_and_intuitive_parameters_give_the_loss_they_name() {
    let [loss, burst, density, isolated, good_run] = [0.05, 10.0, 0.8, 0.005, 3.0];
    let p31 = 1.0 / (density * burst);
    let p23 = 1.0 / good_run;
    let p32 = (1.0 - density) / (density * good_run);
    let p14 = isolated / (1.0 - isolated);
    let p13 = (loss - isolated) / (burst * (1.0 - isolated) * (density - loss));
    let actual = mean(&losses(&state([p13, p31, p32, p23, p14]), 5_000_000));
    // Bursts of 10 leave 5·10⁶ packets the weight of some 4·10⁵ independent packets: a standard error of 0.0003.
    assert!((actual - loss).abs() < 0.0012 && (actual - 0.0495).abs() < 0.0015, "{actual}");
}

/// A chain `state p13` without further probabilities is the Bernoulli law, as the manual says.
#[test]
fn a_single_probability_is_independent_loss() {
    for words in ["loss state 20%", "loss gemodel 20%"] {
        let lost = losses(words, 1_000_000);
        assert!((mean(&lost) - 0.2).abs() < 0.002, "five standard errors of 0.0004");
        assert!(autocorrelation(&lost, 1).abs() < 0.005, "five standard errors of 0.001");
    }
}

/// The loss is (k₁·r + (1−h)·p)/(p + r), and the autocorrelation at lag n is ((1−h−k₁)²·πB·πG/(ℓ(1−ℓ)))·(1−p−r)ⁿ. Published for a chain with 0.529 and 0.331
/// at lags one and two. The parameters of that chain are not known; p = 4.1 %, r = 33.3 %, 1 − h = 86 % give the same, and 0.529 and 0.330 were counted.
/// Tolerances are those of 5·10⁶ packets. A quarter of the packets, by day, has twice the error.
#[test]
fn the_gilbert_elliott_chain_has_its_loss_and_its_bursts() {
    let chains = [(0.041, 0.333, 0.86, 0.0), (0.01, 0.1, 0.7, 0.001), (0.05, 0.5, 0.9, 0.02)];
    let packets = quarter_by_day(5_000_000);
    let wider = (5e6 / packets as f64).sqrt();
    for (p, r, in_bad, in_good) in chains {
        let words = format!("loss gemodel {}% {}% {}% {}%", p * 100.0, r * 100.0, in_bad * 100.0, in_good * 100.0);
        let lost = losses(&words, packets);
        let expected = (in_good * r + in_bad * p) / (p + r);
        let spread: f64 = in_bad - in_good;
        let amplitude = spread * spread * p * r / ((p + r) * (p + r)) / (expected * (1.0 - expected));
        assert!((mean(&lost) - expected).abs() < 0.0006 * wider, "{words}");
        for lag in [1, 2, 5] {
            let law = amplitude * (1.0 - p - r).powi(i32::try_from(lag).unwrap());
            let actual = autocorrelation(&lost, lag);
            assert!((actual - law).abs() < 0.006 * wider, "{words}, lag {lag}: {actual}, law {law}");
        }
    }
}

#[test]
fn all_and_nothing_are_what_they_say() {
    for (words, expected) in [("loss 100%", 1.0), ("loss 0%", 0.0), ("loss gemodel 0% 0% 100% 0%", 0.0)] {
        assert_eq!(mean(&losses(words, 10_000)), expected, "{words}");
    }
}
