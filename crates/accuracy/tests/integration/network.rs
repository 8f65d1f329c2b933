use std::collections::BTreeSet;
use std::sync::LazyLock;

use cohaptic_accuracy::network::errors::Look;
use cohaptic_accuracy::network::{Effort, rows};
use cohaptic_accuracy::{Row, Unwatched};

use crate::rows::assert_sound;

/// Less work than in any command, by the same code.
const EFFORT: Effort = Effort {
    look: Look { quantile: 0.999, places_a_cell: 1, places_a_side: 800 },
    draws: 50_000,
    rounds: 1,
    correlated_packets: 100_000,
    loss_runs: &[(1000, 100), (10_000, 40)],
};

static ROWS: LazyLock<Vec<Row>> = LazyLock::new(|| rows(EFFORT, &Unwatched).unwrap());

fn of<'a>(case: &'a str, method: &'a str) -> impl Iterator<Item = &'a Row> {
    ROWS.iter().filter(move |row| row.case.starts_with(case) && row.method == method)
}

/// Returns the error of the only row of that kind.
fn error(case: &str, method: &str, unit: &str) -> f64 {
    let found: Vec<&Row> = of(case, method).filter(|row| row.error_unit.starts_with(unit)).collect();
    assert_eq!(found.len(), 1, "{case}, {method}, {unit}");
    found[0].error.unwrap()
}

#[test]
fn every_row_is_sound() {
    assert_sound(&ROWS);
    let laws: BTreeSet<&str> = ROWS.iter().filter_map(|row| row.case.strip_prefix("delay, ")).collect();
    let wanted = ["Laplace", "Pareto", "Pareto-normal", "Weibull", "gamma", "lognormal", "normal", "table", "uniform"];
    assert_eq!(laws.into_iter().collect::<Vec<_>>(), wanted);
}

/// Both distribution functions are numbers of 53 bits, each off by some units in the last place with a relative condition of at most 3 (a Pareto law of index
/// 3). Delays are rounded to 4·10⁻¹⁵ of 24, where the density is at most 0.87 per millisecond. The bound 10⁻¹⁴ is generous, and a hundred million times below
/// the resolution of 10⁶ draws.
#[test]
fn exact_ways_are_exact_to_rounding() {
    for method in ["draw", "exact inverse"] {
        for row in of("delay, ", method) {
            assert!(row.error.unwrap() < 1e-14, "{row:?}");
        }
    }
}

/// Steps of n equally probable values are at least ½/n away from a continuous law. netem's steps begin at the lower end of each step, so their distance is up
/// to 1/n, plus the effect of 16 bits and four deviations.
#[test]
fn tables_are_as_far_off_as_their_steps() {
    for law in ["normal", "Pareto", "gamma", "lognormal", "uniform", "Pareto-normal", "Weibull", "Laplace"] {
        let case = format!("delay, {law}");
        let ways = |method| {
            of(&case, method).filter(|row| row.case == case && row.error_unit.starts_with("Kolm")).map(|row| row.error.unwrap()).next().unwrap()
        };
        let fine = ways("65536 steps");
        assert!((fine * 131_072.0 - 1.0).abs() < 1e-6, "{law}: {fine}");
        assert!(ways("4096 steps") >= 1.0 / 8192.0, "{law}");
    }
}

/// The kernel's Pareto table has a factor of 4/3 in place of 2/√3, and ends at four deviations. Its least value is −0.5·4/3 deviations, where the law has F =
/// 0 up to −0.577 deviations. The table already has 1 − (1 + (−0.577 + 0.667)·3/4)^−3 = 0.176 at that place.
#[test]
fn the_kernels_pareto_table_is_off_by_a_sixth_of_all_delays() {
    let found = ROWS.iter().find(|row| row.case == "delay, Pareto" && row.method == "kernel-6.6").unwrap().error.unwrap();
    let share = 1.0 - (1.5 - 0.75 / 3.0_f64.sqrt()).powi(-3);
    // Of 4096 entries, the entry at the begin of the law may lie on either side, and so may the place of the comparison.
    assert!((found - share).abs() < 2.0 / 4096.0, "{found} is not {share}");
}

/// D·√n of perfect draws exceeds 2.2 with probability 2·e^(−2·2.2²) = 1.3·10⁻⁴ (Kolmogorov). The words of the test are fixed.
#[test]
fn what_others_draw_agrees_with_the_law_as_closely_as_so_many_draws_can_tell() {
    let sampled = ROWS.iter().filter(|row| row.note.starts_with("measured with 50000 draws") && row.error_unit.starts_with("Kolm"));
    let mut count = 0;
    for row in sampled {
        count += 1;
        assert!(row.error.unwrap() * 50_000.0_f64.sqrt() < 2.2, "{row:?}");
    }
    assert_eq!(count, 7, "Box-Muller, five laws of rand_distr, one multiplication");
}

/// The ratio r is the root mean square of k runs, divided by the expectation of theory. k·r² has nearly a χ² law with k degrees of freedom, of mean k and
/// deviation √(2k). For k ≥ 40 the ratio stays between a half and one and a half, six deviations for the mean. Runs of losses in 1000 packets are few and
/// skew, so they have twice the deviation.
#[test]
fn loss_models_are_off_by_what_theory_expects() {
    for row in ROWS.iter().filter(|row| row.case.starts_with("loss") && row.method == "chain") {
        let behind = if row.error_unit.starts_with("mean loss") { " of the mean" } else { " of the run" };
        let expected: f64 = row.note.split_once(behind).unwrap().0.rsplit(' ').next().unwrap().parse().unwrap();
        let ratio = row.error.unwrap() / expected;
        assert!((0.6..1.5).contains(&ratio), "{ratio}: {row:?}");
    }
}

/// netem compares a running mean of words with the probability. A loss of 5 % with correlation 0.5 needs a mean of words in the lowest twentieth, and such
/// means are far rarer than such words, for any number of packets.
#[test]
fn the_kernels_correlated_loss_is_not_what_was_asked() {
    let errors: Vec<f64> =
        of("loss, correlated", "kernel-6.6").filter(|row| row.error_unit.starts_with("mean loss")).map(|row| row.error.unwrap()).collect();
    assert_eq!(errors.len(), 2);
    assert!(errors.iter().all(|error| *error > 0.5), "{errors:?}");
    let ours = of("loss, correlated", "chain").filter(|row| row.error_unit.starts_with("mean loss")).map(|row| row.error.unwrap());
    assert!(ours.last().unwrap() < 0.1);
}

/// By Bartlett's formulas 10⁵ packets leave 2·10⁻³ of the correlation and 4·10⁻³ of the deviation open; the bounds are five times as large.
#[test]
fn jitter_has_the_correlation_that_was_asked_and_the_kernels_has_none() {
    for law in ["normal", "uniform", "gamma"] {
        let case = format!("jitter, {law}");
        assert!(error(&case, "copula", "autocorrelation") < 0.011, "{law}");
        assert!(error(&case, "copula", "standard deviation") < 0.021, "{law}");
    }
    // The remainder of a running mean does not depend on the earlier mean: the whole correlation of 0.75 is missing.
    for law in ["normal", "uniform"] {
        assert!((error(&format!("jitter, {law}"), "kernel-6.6", "autocorrelation") - 0.75).abs() < 0.02, "{law}");
    }
}
