//! Methods to draw a delay: nanoseconds per draw against the distance of distributions and the error of a tail quantile.

use std::hint::black_box;
use std::time::Duration;

use cohaptic_wan::Distribution;
use cohaptic_wan::law::{DistTable, Law};
use cohaptic_wan::netem::kernel::{Prng, Table};
use cohaptic_wan::random::unit;

use super::errors::{Look, probability};
use super::other_ways::{KernelTable, samplers};
use super::ways::{Fine, MEAN, Netem, SD, draw, further_laws, laws, next_word};
use super::{Effort, RowSink, real, row};
use crate::cost::{Work, nanos};
use crate::{AccuracyError, Row};

const DISTANCE: &str = "Kolmogorov distance [1]";
const TAIL: &str = "99.9 % quantile [of its distance from the mean]";
const EXACT_LAW: &str = "the exact law";

/// Number of draws that are timed together.
const BATCH: u32 = 1000;

/// Errors of a method, and a note on their origin.
struct Wrong {
    distance: f64,
    tail: f64,
    note: String,
}

/// Measures the rows of all laws and of the table.
pub(super) fn measure(effort: Effort, done: &mut RowSink<'_>) -> Result<(), AccuracyError> {
    let laws: Vec<(&'static str, Law)> = laws().into_iter().chain(further_laws()).collect();
    // The normal law serves as Φ for all laws, because all have the same mean and deviation.
    let normal = laws[0].1.clone();
    for (name, law) in &laws {
        of_law(name, law, &normal, effort, done)?;
    }
    of_table(effort, done)
}

/// Measures the rows of one law. The distribution function of `normal`, a normal law with the same mean and deviation, maps a standard normal number to a
/// probability.
fn of_law(name: &'static str, law: &Law, normal: &Law, effort: Effort, done: &mut RowSink<'_>) -> Result<(), AccuracyError> {
    let look = effort.look;
    let (netem, fine) = (Netem::new(law), Fine::new(law));
    done.check()?;
    let mut ways: Vec<(&'static str, Work<'_>, Wrong)> = Vec::new();
    if let Some(mut table) = KernelTable::of(name) {
        let errors = look.steps(law, &table.delays());
        let note = format!(
            "computed; deviation {:+.1} % of the one asked, mean {:+.4} deviations: the table of iproute2 as Linux 6.6 draws from it",
            100.0 * errors.sd,
            errors.mean
        );
        ways.push(("kernel-6.6", many(move || table.draw()), Wrong { distance: errors.distance, tail: errors.tail.abs(), note }));
    } else if name == "uniform" {
        ways.push(("kernel-6.6", kernel_uniform(), kernel_uniform_error(law, look)));
    }
    let computed = |errors: super::errors::Errors, what: &str| {
        let note = format!("computed; deviation {:+.1e} of the one asked; {what}", errors.sd);
        Wrong { distance: errors.distance, tail: errors.tail.abs(), note }
    };
    let coarse = computed(look.steps(law, &netem.delays()), "8 kB, netem's format with exact entries: ends at four deviations");
    ways.push(("4096 steps", with_words(|words| netem.draw(next_word(words))), coarse));
    ways.push(("65536 steps", with_words(|words| fine.step(next_word(words))), computed(look.steps(law, fine.delays()), "512 kB")));
    let lines = computed(look.lines(law, fine.delays()), "512 kB, straight lines between");
    ways.push(("65536 interpolated", with_words(|words| fine.interpolated(next_word(words))), lines));
    // A side of the middle has `places_a_side` places.
    let places = 2 * look.places_a_side;
    // Monotone functions of a normal number need no sampling: their distribution function is known at every place.
    let of_function = |delay: &dyn Fn(f64) -> f64, what: &str| {
        let tail = tail_error(law, look, delay((normal.quantile(look.quantile) - MEAN) / SD));
        let note = format!("computed at {places} places of ±8 normal deviations, so to rounding; {what}");
        Wrong { distance: look.distance(law, delay, normal), tail, note }
    };
    let inverse = of_function(&|z| law.quantile(probability(normal, z)), "`Law::quantile` of a uniform number");
    ways.push(("exact inverse", with_words(|words| law.quantile(unit(next_word(words)))), inverse));
    // `Law::draw` has two implementations, and the note names the one in use.
    let what = if matches!(name, "normal" | "gamma" | "lognormal") {
        "`Law::draw`, what the program draws: a function of the ziggurat's normal number"
    } else {
        "`Law::draw`, what the program draws: the inverse of a uniform word"
    };
    let drawn = of_function(&|z| law.at_normal(z), what);
    ways.push(("draw", with_words(|words| draw(law, words)), drawn));
    done.check()?;
    for (method, mut sampler) in samplers(name) {
        let wrong = sampled(law, look, effort.draws, &mut sampler);
        ways.push((method, many(sampler), wrong));
        done.check()?;
    }
    push(name, ways, EXACT_LAW, effort, done)
}

/// Measures the rows of the law given by a table. The entries are the exact distribution.
fn of_table(effort: Effort, done: &mut RowSink<'_>) -> Result<(), AccuracyError> {
    let table = Table::normal();
    let text: Vec<String> = table.entries().iter().map(ToString::to_string).collect();
    let table = DistTable::parse(&text.join(" ")).expect("the kernel's table is one");
    let law = Law::new(&Distribution::Table(table.clone().into()), MEAN, SD, None).expect("a law");
    // There are 2¹⁶ evenly spaced words and 2¹² entries, so every entry must be drawn exactly 16 times.
    let mut delivered: Vec<f64> = (0..1_u64 << 16).map(|i| law.draw(i << 48 | 1 << 47, || 0)).collect();
    delivered.sort_by(f64::total_cmp);
    let mut distance = 0.0_f64;
    let mut end = 0_u32;
    for group in delivered.chunk_by(|a, b| a.total_cmp(b).is_eq()) {
        end += u32::try_from(group.len()).unwrap_or(u32::MAX);
        // Share of entries at or below this delay, computed without the arithmetic of the law.
        let share = table.entries().partition_point(|entry| MEAN + SD / 8192.0 * f64::from(*entry) <= group[0] + 1e-12);
        let share = f64::from(u32::try_from(share).unwrap_or(u32::MAX)) / 4096.0;
        distance = distance.max((f64::from(end) / 65_536.0 - share).abs());
    }
    let exact = MEAN + SD / 8192.0 * f64::from(table.entries()[4096 * 999 / 1000]);
    let tail = ((law.quantile(effort.look.quantile) - exact) / (exact - MEAN)).abs();
    let note = "computed from 65536 evenly spaced words; the entries of iproute2's normal table".to_owned();
    let work = with_words(|words| draw(&law, words));
    push("table", vec![("draw", work, Wrong { distance, tail, note })], "the entries of the table, each as probable", effort, done)
}

/// Measures the costs of the methods in turns, and adds two rows per method.
fn push(
    name: &str,
    ways: Vec<(&'static str, Work<'_>, Wrong)>,
    reference: &'static str,
    effort: Effort,
    done: &mut RowSink<'_>,
) -> Result<(), AccuracyError> {
    let case = format!("delay, {name}");
    let (mut works, mut names) = (Vec::new(), Vec::new());
    for (method, work, wrong) in ways {
        works.push(work);
        names.push((method, wrong));
    }
    let times: Vec<Duration> = effort.rounds().medians(&mut works);
    for ((method, wrong), time) in names.into_iter().zip(times) {
        let cost = (nanos(time) / f64::from(BATCH), "ns a draw");
        let row = Row { reference, note: wrong.note, ..row(&case, method, String::new(), cost) };
        done.push(Row { error: Some(wrong.distance), error_unit: DISTANCE, ..row.clone() })?;
        done.push(Row { error: Some(wrong.tail), error_unit: TAIL, ..row })?;
    }
    Ok(())
}

/// Returns a batch of draws as work.
fn many<'a>(mut draw: impl FnMut() -> f64 + 'a) -> Work<'a> {
    Box::new(move || {
        for _ in 0..BATCH {
            black_box(draw());
        }
    })
}

/// Like [`many`], for draws from uniform words.
fn with_words<'a>(mut draw: impl FnMut(&mut u64) -> f64 + 'a) -> Work<'a> {
    let mut state = 1;
    many(move || draw(&mut state))
}

/// Returns the relative error of the quantile `found`.
fn tail_error(law: &Law, look: Look, found: f64) -> f64 {
    let exact = law.quantile(look.quantile);
    ((found - exact) / (exact - MEAN)).abs()
}

/// Returns the errors of n draws. Even perfect draws have a mean distance of about 0.87/√n: √(π/2)·ln 2 (Kolmogorov).
fn sampled(law: &Law, look: Look, count: usize, sampler: &mut impl FnMut() -> f64) -> Wrong {
    let mut delays: Vec<f64> = (0..count).map(|_| sampler()).collect();
    delays.sort_by(f64::total_cmp);
    let n = real(count);
    // The empirical distribution function jumps at each draw, so both sides of each jump are compared.
    let apart = |(place, delay): (usize, &f64)| {
        let share = law.cdf(*delay);
        (share - real(place) / n).abs().max((real(place + 1) / n - share).abs())
    };
    let distance = delays.iter().enumerate().map(apart).fold(0.0, f64::max);
    // The standard deviation of a quantile of n draws is the deviation of its share, divided by the density. The density is a difference quotient here.
    let (p, exact) = (look.quantile, law.quantile(look.quantile));
    let step = 0.01 * (1.0 - p);
    let slope = (law.quantile(p + step) - law.quantile(p - step)) / (2.0 * step);
    // Standard error of the quantile: deviation of the share, times the slope of the quantile function.
    let noise = slope * (p * (1.0 - p) / n).sqrt() / (exact - MEAN);
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a place among the draws")]
    let found = delays[(n * p) as usize];
    let note = format!(
        "measured with {count} draws, since it can only be drawn: perfect ones are {:.1e} away too, and their quantile is off by {noise:.1e}",
        0.8687 / n.sqrt()
    );
    Wrong { distance, tail: tail_error(law, look, found), note }
}

/// Width 2·√3·2 ms of netem's uniform law \[ns\]. Its jitter is half of the width, √3 deviations of 2 ms.
const WIDTH: u32 = 6_928_203;

/// Returns draws of a uniform delay as the kernel makes them: the remainder of a uniform word of 32 bits.
fn kernel_uniform() -> Work<'static> {
    let mut prng = Prng::new(1);
    many(move || MEAN + (f64::from(prng.next_u32() % WIDTH) - 0.5 * f64::from(WIDTH)) * 1e-6)
}

/// Returns the errors of the kernel's uniform delay. Of 2³² = q·w + r words, the first r of the w remainders have q + 1 words, and all later remainders have
/// q words. The distribution function of the first k remainders is k·(q + 1)/2³² up to r, and its distance from k/w is largest at r: r/w·(w − r)/2³². A delay
/// in whole nanoseconds adds a step of at most 1/w.
fn kernel_uniform_error(law: &Law, look: Look) -> Wrong {
    let (words, width) = (4_294_967_296.0, f64::from(WIDTH));
    let rest = words - (words / width).floor() * width;
    let bias = rest / width * (width - rest) / words;
    // The quantile lies among the remainders with q words each, where the share from k to the end is (w − k)·q/2³².
    let place = width - (1.0 - look.quantile) * words / (words / width).floor();
    let tail = tail_error(law, look, MEAN + (place - 0.5 * width) * 1e-6);
    let note = "computed; the remainder of 32 bits, so that shorter delays are more probable, and whole nanoseconds".to_owned();
    Wrong { distance: bias + 1.0 / width, tail, note }
}
