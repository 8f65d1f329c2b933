//! Writes `docs/measured-samplers.md`: `cargo run --profile dist -p cohaptic-benches --bin samplers-table > docs/measured-samplers.md`. Takes about a minute; `--quick`
//! less.
#![allow(clippy::print_stdout, reason = "printing the page is what this program is for")]

use std::hint::black_box;
use std::time::Instant;

use cohaptic_accuracy::network::errors::{Errors, Look, probability};
use cohaptic_accuracy::network::ways::{Fine, Netem, draw, laws, next_word, unit};
use cohaptic_benches::effort::Effort;
use cohaptic_wan::law::Law;

/// How much is measured.
#[derive(Clone, Copy)]
struct Work {
    rounds: usize,
    draws: u32,
}

fn main() -> Result<(), String> {
    let effort = Effort::parse(std::env::args().skip(1))?;
    let work = Work { rounds: effort.of(31, 9, 1), draws: effort.of(400_000, 400_000, 1000) };
    let Work { rounds, draws } = work;
    let look = effort.of(Look::CLOSE, Look::CLOSE, Look { places_a_cell: 1, places_a_side: 400, ..Look::CLOSE });
    let what = "The cost of a random delay, and its distance from its law.";
    println!("{}", effort.head("Samplers", what, "samplers-table", "docs/measured-samplers.md"));
    println!(
        "All laws have mean 24 and standard deviation 2; gamma and lognormal begin at 20. A draw includes its uniform word (SplitMix64); times are medians"
    );
    println!("of {rounds} rounds in which all ways alternate, {draws} draws each. Errors are computed, not sampled:\n");
    println!(
        "- *distance*: the largest difference between the distribution function delivered and the true one (Kolmogorov). Of steps at every jump; of"
    );
    println!(
        "  interpolated tables at {} points of every cell; of the exact ways as |F(delay(p)) − p| at {} places (the quantiles are tested against 40 digits).",
        look.places_a_cell,
        2 * look.places_a_side
    );
    println!("- *99.99 %*: the error of the delay exceeded once in 10 000, relative to its distance from the mean.");
    println!(
        "- *mean*, *sd*: the value delivered less the value asked for, in standard deviations asked for. Of tables by summing them up; of the exact ways by"
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
        let nanos = times(&law, &netem, &fine, work);
        // The largest numbers: 53 bits for the inverse; 64 for the Pareto law's draw, and what the ziggurat reaches for the others.
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
    Ok(())
}

/// Nanoseconds a draw of each way.
fn times(law: &Law, netem: &Netem, fine: &Fine, Work { rounds: count, draws }: Work) -> [f64; 5] {
    let mut rounds: [Vec<f64>; 5] = Default::default();
    let mut state = 1;
    for _ in 0..count {
        rounds[0].push(time(draws, || netem.draw(next_word(&mut state))));
        rounds[1].push(time(draws, || fine.step(next_word(&mut state))));
        rounds[2].push(time(draws, || fine.interpolated(next_word(&mut state))));
        rounds[3].push(time(draws, || law.quantile(unit(next_word(&mut state)))));
        rounds[4].push(time(draws, || draw(law, &mut state)));
    }
    rounds.map(|mut times| {
        times.sort_by(f64::total_cmp);
        times[count / 2]
    })
}

fn time(draws: u32, mut work: impl FnMut() -> f64) -> f64 {
    let start = Instant::now();
    for _ in 0..draws {
        black_box(work());
    }
    start.elapsed().as_secs_f64() * 1e9 / f64::from(draws)
}
