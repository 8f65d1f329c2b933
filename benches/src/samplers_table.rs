//! Writes `docs/samplers.md`: `cargo run --release -p cohaptic-benches --bin samplers-table > docs/samplers.md`. Takes about a minute.
#![allow(clippy::print_stdout, reason = "printing the page is what this program is for")]
#![allow(
    clippy::cast_precision_loss,
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::float_cmp,
    reason = "counts are small, and equal entries of a table are equal numbers"
)]

use std::hint::black_box;
use std::time::Instant;

use cohaptic_benches::machine::processor;
use cohaptic_benches::samplers::{Fine, MEAN, Netem, SD, draw, laws, next_word, unit};
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
        let inverse = exact(&law, 8.29, |z| law.quantile(probability(&normal, z)), &normal);
        let of_draw = exact(&law, if name == "Pareto" { 9.16 } else { 13.0 }, |z| law.at_normal(z), &normal);
        let map = if name == "gamma" { "13 kB" } else { "" };
        let errors = [steps(&law, &netem.delays()), steps(&law, fine.delays()), lines(&law, fine.delays()), inverse, of_draw];
        let ways = [("4096 steps", "8 kB"), ("65536 steps", "512 kB"), ("65536 interpolated", "512 kB"), ("exact inverse", ""), ("**draw**", map)];
        for (((way, table), nanos), [distance, tail, mean, sd]) in ways.into_iter().zip(nanos).zip(errors) {
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

/// Distance, error of the 99.99 % quantile, of the mean, of the deviation.
type Errors = [f64; 4];

fn tail_error(law: &Law, found: f64) -> f64 {
    let exact = law.quantile(0.9999);
    (found - exact) / (exact - MEAN)
}

/// Of equally probable delays.
fn steps(law: &Law, delays: &[f64]) -> Errors {
    let n = delays.len() as f64;
    let mut distance = 0.0_f64;
    let mut begin = 0;
    for group in delays.chunk_by(|a, b| a == b) {
        let end = begin + group.len();
        let true_share = law.cdf(group[0]);
        distance = distance.max((true_share - begin as f64 / n).abs()).max((true_share - end as f64 / n).abs());
        begin = end;
    }
    let mean = delays.iter().sum::<f64>() / n;
    let sd = (delays.iter().map(|x| (x - mean) * (x - mean)).sum::<f64>() / n).sqrt();
    [distance, tail_error(law, delays[delays.len() * 9_999 / 10_000]), (mean - MEAN) / SD, sd / SD - 1.0]
}

/// Of straight lines between equally spaced quantiles.
fn lines(law: &Law, delays: &[f64]) -> Errors {
    let cells = (delays.len() - 1) as f64;
    let at = |p: f64| {
        let cell = (p * cells).floor();
        let [left, right] = [cell, cell + 1.0].map(|i| delays[delays.len().min(i as usize + 1) - 1]);
        left + (p * cells - cell) * (right - left)
    };
    // Beyond the last quantiles there is nothing.
    let ends = law.cdf(delays[0]).max(law.survival(delays[delays.len() - 1]));
    let points = (0..(delays.len() - 1) * 16).map(|i| i as f64 / (16.0 * cells));
    let distance = points.map(|p| (law.cdf(at(p)) - p).abs()).fold(ends, f64::max);
    let average = |f: &dyn Fn(f64, f64) -> f64| delays.windows(2).map(|pair| f(pair[0], pair[1])).sum::<f64>() / cells;
    let mean = average(&|a, b| 0.5 * (a + b));
    let sd = average(&|a, b| ((a - mean) * (a - mean) + (a - mean) * (b - mean) + (b - mean) * (b - mean)) / 3.0).sqrt();
    [distance, tail_error(law, at(0.9999)), (mean - MEAN) / SD, sd / SD - 1.0]
}

/// Of a delay that is a function of a standard normal number up to `end`: the trapezoidal rule, which for smooth functions on the whole line has no
/// error but that of the end.
fn exact(law: &Law, end: f64, delay: impl Fn(f64) -> f64, normal: &Law) -> Errors {
    const STEPS: f64 = 64.0;
    let moment = |k: i32| {
        let term = |i: i32| {
            let z = f64::from(i) / STEPS;
            ((law.at_normal(z) - MEAN) / SD).powi(k) * (-0.5 * z * z).exp()
        };
        (-13 * 64..=(end * STEPS) as i32).map(term).sum::<f64>() / STEPS / (2.0 * std::f64::consts::PI).sqrt()
    };
    let (mean, square) = (moment(1), moment(2));
    let places = (-40_000..40_000).map(|i| f64::from(i) * 2e-4);
    let distance = places.map(|z| (law.cdf(delay(z)) - probability(normal, z)).abs()).fold(0.0, f64::max);
    [distance, tail_error(law, delay(Z_9999)), mean, (square - mean * mean).sqrt() - 1.0]
}

/// Φ⁻¹(0.9999).
const Z_9999: f64 = 3.719_016_485_455_709;

/// Φ(z), from a normal law.
fn probability(normal: &Law, z: f64) -> f64 {
    normal.cdf(MEAN + SD * z)
}
