//! Writes `docs/samplers.md`: `cargo run --release -p cohaptic-benches --bin samplers-table > docs/samplers.md`. Takes about a minute.
#![allow(clippy::print_stdout, reason = "printing the page is what this program is for")]

use std::hint::black_box;
use std::time::Instant;

use cohaptic_accuracy::network::errors::{Errors, Look, probability};
use cohaptic_accuracy::network::ways::{Fine, Netem, draw, laws, next_word, unit};
use cohaptic_benches::machine::processor;
use cohaptic_wan::law::Law;

fn main() {
    println!("# Samplers\n");
    println!("What a random delay costs, and how far from its law it is. This page is written by\n");
    println!("    cargo run --release -p cohaptic-benches --bin samplers-table > docs/samplers.md\n");
    println!("and measured on: {}.\n", processor());
    println!(
        "All laws have mean 24 and standard deviation 2; gamma and lognormal begin at 20. A draw includes its uniform word (SplitMix64); times are medians"
    );
    println!("of 31 rounds in which all ways alternate, {DRAWS} draws each. Errors are computed, not sampled:\n");
    println!(
        "- *distance*: the largest difference between the distribution function delivered and the true one (Kolmogorov). Of steps at every jump; of"
    );
    println!(
        "  interpolated tables at 16 points of every cell; of the exact ways as |F(delay(p)) − p| at 80 000 places (the quantiles are tested against 40 digits)."
    );
    println!("- *99.99 %*: the error of the delay exceeded once in 10 000, relative to its distance from the mean.");
    println!(
        "- *mean*, *sd*: what is delivered less what is asked for, in standard deviations asked for. Of tables by summing them up; of the exact ways by"
    );
    println!("  integrating over a standard normal number, up to the largest that the way can give (for the inverse one of 53 bits).\n");
    println!(
        "The ways: *4096 steps* is netem's, 16-bit entries 8192·F⁻¹(i/4096) that end at four deviations, drawn without interpolation (here of laws"
    );
    println!(
        "standardised exactly; the tables that come with netem have errors of their own). *65536 steps* are quantiles in the middle of equal parts,"
    );
    println!(
        "*interpolated* the same with straight lines between. *Exact inverse* is `Law::quantile` of a uniform number. *Draw* is `Law::draw`: for the"
    );
    println!(
        "normal law the ziggurat; for the lognormal law its exponential; for the gamma law piecewise Taylor series of F⁻¹(Φ(z)) at the ziggurat's number"
    );
    println!("z; for the Pareto law the inverse.\n");
    println!("| law | way | table | ns a draw | distance | 99.99 % | mean | sd |");
    println!("| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: |");
    let [(_, normal), ..] = laws();
    for (name, law) in laws() {
        let (netem, fine) = (Netem::new(&law), Fine::new(&law));
        let nanos = times(&law, &netem, &fine);
        // The largest numbers: 53 bits for the inverse; 64 for the Pareto law's draw, and what the ziggurat reaches for the others.
        let look = Look::CLOSE;
        let inverse = look.exact(&law, 8.29, |z| law.quantile(probability(&normal, z)), &normal);
        let of_draw = look.exact(&law, if name == "Pareto" { 9.16 } else { 13.0 }, |z| law.at_normal(z), &normal);
        let map = if name == "gamma" { "13 kB" } else { "" };
        let errors = [look.steps(&law, &netem.delays()), look.steps(&law, fine.delays()), look.lines(&law, fine.delays()), inverse, of_draw];
        let ways = [("4096 steps", "8 kB"), ("65536 steps", "512 kB"), ("65536 interpolated", "512 kB"), ("exact inverse", ""), ("**draw**", map)];
        for (((way, table), nanos), Errors { distance, tail, mean, sd }) in ways.into_iter().zip(nanos).zip(errors) {
            println!("| {name} | {way} | {table} | {nanos:.1} | {distance:.1e} | {tail:.1e} | {mean:.1e} | {sd:.1e} |");
        }
    }
    println!(
        "\nThe speed of tables is that of a table alone in the cache: 512 kB compete with all else that a simulation touches. The same ways as criterion"
    );
    println!("benches: `cargo bench -p cohaptic-benches --bench samplers`.");
}

const DRAWS: u32 = 400_000;

/// Nanoseconds a draw of each way.
fn times(law: &Law, netem: &Netem, fine: &Fine) -> [f64; 5] {
    const ROUNDS: usize = 31;
    let mut rounds: [Vec<f64>; 5] = Default::default();
    let mut state = 1;
    for _ in 0..ROUNDS {
        rounds[0].push(time(|| netem.draw(next_word(&mut state))));
        rounds[1].push(time(|| fine.step(next_word(&mut state))));
        rounds[2].push(time(|| fine.interpolated(next_word(&mut state))));
        rounds[3].push(time(|| law.quantile(unit(next_word(&mut state)))));
        rounds[4].push(time(|| draw(law, &mut state)));
    }
    rounds.map(|mut times| {
        times.sort_by(f64::total_cmp);
        times[ROUNDS / 2]
    })
}

fn time(mut work: impl FnMut() -> f64) -> f64 {
    let start = Instant::now();
    for _ in 0..DRAWS {
        black_box(work());
    }
    start.elapsed().as_secs_f64() * 1e9 / f64::from(DRAWS)
}
