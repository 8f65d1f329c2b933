//! Effects of correlation in the kernel: loss nearly vanishes, and delays stay independent.

use cohaptic_tests_common::quarter_by_day;

use crate::netem::kernel::tests::{SIZE, at, autocorrelation, qdisc};
use crate::netem::kernel::{Output, Qdisc};

/// Returns the number of packets lost out of `draws`.
fn losses(words: &str, seed: u64, draws: u64) -> u64 {
    let mut qdisc = qdisc(words, seed);
    let mut lost = 0;
    for number in 0..draws {
        qdisc.enqueue(at(number), SIZE, false, number, &mut |output| lost += u64::from(matches!(output, Output::Dropped { .. })));
        while qdisc.dequeue(at(number)).is_some() {}
    }
    lost
}

/// Returns P(X < p) for the stationary X = (1 − ρ)·U + ρ·X′ with U uniform and X′ distributed like X. The distribution function F is found as the fixed point
/// of F(x) = 1/(1 − ρ) · ∫ ρ·F(y) dy over y from (x − (1 − ρ))/ρ to x/ρ on a grid. The reference needs no random numbers.
fn below(p: f64, rho: f64) -> f64 {
    const CELLS: usize = 1 << 16;
    // Cell of the grid that contains x, and the position of x in the cell.
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "x is in 0..1")]
    let locate = |x: f64| ((x * CELLS as f64) as usize, (x * CELLS as f64).fract());
    let mut function: Vec<f64> = (0..=CELLS).map(|i| i as f64 / CELLS as f64).collect();
    for _ in 0..60 {
        // Integral of F from 0 up to each grid point.
        let mut integral = vec![0.0; CELLS + 1];
        for i in 0..CELLS {
            integral[i + 1] = integral[i] + f64::midpoint(function[i], function[i + 1]) / CELLS as f64;
        }
        let integral_to = |x: f64| {
            if x <= 0.0 {
                0.0
            } else if x >= 1.0 {
                integral[CELLS] + (x - 1.0)
            } else {
                let (cell, part) = locate(x);
                // F is linear within a cell.
                let end = function[cell] + (function[cell + 1] - function[cell]) * part;
                integral[cell] + f64::midpoint(function[cell], end) * part / CELLS as f64
            }
        };
        function = (0..=CELLS)
            .map(|i| i as f64 / CELLS as f64)
            .map(|x| rho / (1.0 - rho) * (integral_to(x / rho) - integral_to((x - (1.0 - rho)) / rho)))
            .collect();
    }
    let (cell, part) = locate(p);
    function[cell] + (function[cell + 1] - function[cell]) * part
}

/// Published from 2·10⁶ draws each: words, requested loss and measured loss. The reference `below` stands beside the measurement, and needs no seed.
#[test]
fn correlated_loss_loses_next_to_nothing() {
    let published = [
        ("loss 0.3% 25%", 0.003, 0.25, 0.0, 5e-7),
        ("loss 1% 25%", 0.01, 0.25, 0.000_001_5, 5e-8),
        ("loss 5% 25%", 0.05, 0.25, 0.001_87, 5e-6),
        ("loss 5% 50%", 0.05, 0.5, 0.000_014, 5e-7),
        ("loss 10% 50%", 0.1, 0.5, 0.001_04, 5e-6),
        ("loss 30% 50%", 0.3, 0.5, 0.129, 5e-4),
    ];
    let draws = quarter_by_day(2_000_000);
    for (words, p, rho, figure, digit) in published {
        let expected = below(p, rho);
        // A binomial count has its variance inflated by at most (1 + ρ)/(1 − ρ) for the correlation of neighbours. The tolerance is five standard errors and
        // one packet, a significance below 10⁻⁶.
        let error = |draws: f64| 5.0 * (expected * (1.0 - expected) * (1.0 + rho) / (1.0 - rho) / draws).sqrt() + 1.0 / draws;
        assert!((expected - figure).abs() < error(2e6) + digit, "{words}: published {figure}, law {expected}");
        let lost = losses(words, 1, draws) as f64 / draws as f64;
        assert!((lost - expected).abs() < error(draws as f64), "{words}: lost {lost}, law {expected}");
    }
    let uncorrelated = losses("loss 5%", 1, draws) as f64 / draws as f64;
    assert!((uncorrelated - 0.05).abs() < 5.0 * (0.05 * 0.95 / draws as f64).sqrt());
}

/// Returns the delays that a qdisc gives to packets so far apart that each packet is alone \[ms\].
fn delays(words: &str, count: u64) -> Vec<f64> {
    let mut qdisc: Qdisc<u64> = qdisc(words, 3);
    (1..=count)
        .map(|number| {
            let now = at(number * 1_000_000_000);
            qdisc.enqueue(now, SIZE, false, number, &mut |_| {});
            let leaves = qdisc.next_at().unwrap();
            assert!(qdisc.dequeue(leaves).is_some());
            (leaves.as_nanos() - now.as_nanos()) as f64 / 1e6
        })
        .collect()
}

/// Published: the autocorrelation of neighbours for each requested correlation. The standard error of n draws is 1/√n, and the tolerance is four of these, or
/// five for the normal law. The published figures have an error of 0.001 of their own.
#[test]
fn correlated_delay_is_not_correlated() {
    let uniform = [(25.0, 0.000), (50.0, 0.000), (90.0, 0.005), (99.0, 0.051)];
    let draws = quarter_by_day(1_000_000);
    let error = 1.0 / (draws as f64).sqrt();
    for (asked, published) in uniform {
        let actual = autocorrelation(&delays(&format!("delay 100ms 10ms {asked}%"), draws), 1);
        assert!((actual - published).abs() < 4.0 * error, "{asked} %: {actual}");
    }
    for asked in [25.0, 50.0, 90.0, 99.0, 99.9] {
        let actual = autocorrelation(&delays(&format!("delay 100ms 10ms {asked}% distribution normal"), draws), 1);
        assert!(actual.abs() < 5.0 * error, "{asked} %: {actual}");
    }
}
