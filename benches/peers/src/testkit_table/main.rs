//! Writes `docs/measured-testkit.md`: `cargo run --release > ../../docs/measured-testkit.md` in `benches/peers`. Takes some minutes.
//!
//! `--smoke` runs every row once with the least work: its figures say nothing. `udp` and `tcp` print the tables of one of them only, `fan-in` that
//! of the hosts that write to one. `fan-in-once PLACE fresh` and `fan-in-once PLACE kept` run one subject of that table, by its place from 0 on.

mod on_bare;
mod on_testkit;
mod on_turmoil;
mod program;
mod seldom;
mod tcp;

use std::hint::black_box;
use std::time::Duration;

use cohaptic_benches_peers::{machine, median, processor_time};
use on_testkit::Kind;
use program::{DELAY, Errors, SIZE, Stream};

/// Rounds of which the median is taken.
const ROUNDS: usize = 5;

/// How much work is done.
#[derive(Clone, Copy)]
struct Effort {
    rounds: usize,
    divisor: u32,
}

impl Effort {
    /// A number divided by that of the effort; 1 at least.
    fn part_of(self, count: u32) -> u32 {
        (count / self.divisor).max(1)
    }
}

/// What the issues of the test kit ask for: with datagrams all the time, on its own executor and on tokio; with a question now and then.
const ASKED_STEADY: [f64; 2] = [8.0, 3.0];
const ASKED_SELDOM: f64 = 10.0;
const ASKED_PAIR: f64 = 20.0;

/// The subjects of a table, in its order.
#[derive(Clone, Copy)]
enum Subject {
    Kit(Kind),
    /// With this tick.
    Turmoil(Duration),
    /// The program alone.
    Bare,
}

/// Where turmoil stands among them.
const TURMOIL: usize = 3;

const SUBJECTS: [Subject; 5] = [
    Subject::Kit(Kind::Own),
    Subject::Kit(Kind::Tokio),
    Subject::Kit(Kind::TokioTimers),
    Subject::Turmoil(Duration::from_millis(1)),
    Subject::Turmoil(Duration::from_micros(100)),
];

/// Those of the steady program.
const STEADY: [Subject; 6] = {
    let [own, tokio, timers, turmoil, finer] = SUBJECTS;
    [own, tokio, timers, turmoil, finer, Subject::Bare]
};

impl Subject {
    const fn name(self) -> &'static str {
        match self {
            Self::Kit(Kind::Own) => "testkit",
            Self::Kit(Kind::Tokio) => "testkit on tokio",
            Self::Kit(Kind::TokioTimers) => "testkit on tokio, tokio's timers",
            Self::Turmoil(tick) if tick.as_millis() == 1 => "turmoil, ticks of 1 ms",
            Self::Turmoil(_) => "turmoil, ticks of 100 µs",
            Self::Bare => "a bare loop",
        }
    }

    /// The steady program. What turmoil says how long the run was is beside the errors.
    fn steady(self, hosts: u32, stream: Stream) -> (Errors, Option<Duration>) {
        match self {
            Self::Kit(kind) => (on_testkit::run(kind, hosts, stream), None),
            Self::Turmoil(tick) => {
                let (errors, said) = on_turmoil::run(tick, hosts, stream);
                (errors, Some(said))
            }
            Self::Bare => (on_bare::run(hosts, stream), None),
        }
    }

    /// The program that waits, and asks so often.
    fn seldom(self, wait: Duration, count: u32) {
        match self {
            Self::Kit(kind) => on_testkit::seldom(kind, wait, count),
            Self::Turmoil(tick) => on_turmoil::seldom(tick, wait, count),
            Self::Bare => unreachable!("it has the steady program only"),
        }
    }
}

fn main() {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let is_given = |word: &str| arguments.iter().any(|argument| argument == word);
    let effort = if is_given("--smoke") { Effort { rounds: 1, divisor: 100 } } else { Effort { rounds: ROUNDS, divisor: 1 } };
    if is_given("fan-in") {
        return tcp::fan_in(effort);
    }
    if let [word, place, memory, ..] = &*arguments
        && word == "fan-in-once"
    {
        return tcp::fan_in_once(effort, place.parse().expect("the place of a subject"), memory);
    }
    let idle = tcp::idle(effort);
    head();
    if !is_given("tcp") {
        steady(effort);
        seldom(effort);
        pairs(effort);
    }
    if !is_given("udp") {
        tcp::print(effort, idle);
    }
}

fn head() {
    println!("# The test kit: how fast and how exact\n");
    println!("Compared with [turmoil](https://docs.rs/turmoil) 0.7.2 (MIT), on the same programs, in one run. This page is written by\n");
    println!("    cd benches/peers && cargo run --release > ../../docs/measured-testkit.md\n");
    println!("and measured on: {}. Each figure is the median of {ROUNDS} rounds in which all alternate, in seconds of processor time.", machine());
    println!("How a program is tested with it: [testing.md](testing.md).\n");
}

/// One round after the other, each with all subjects; gives the times of each.
fn rounds<S: Copy, T>(effort: Effort, subjects: &[S], mut measure: impl FnMut(S) -> T) -> Vec<Vec<(f64, T)>> {
    let mut results: Vec<Vec<(f64, T)>> = subjects.iter().map(|_| Vec::new()).collect();
    for _ in 0..effort.rounds {
        for (subject, times) in subjects.iter().zip(&mut results) {
            let begin = processor_time();
            let outcome = measure(*subject);
            times.push(((processor_time() - begin).as_secs_f64(), outcome));
        }
    }
    results
}

fn micros(time: Duration) -> String {
    if time.is_zero() { "0".into() } else { format!("{:.1}", time.as_secs_f64() * 1e6) }
}

fn steady(effort: Effort) {
    println!("## Datagrams all the time\n");
    println!(
        "Each host sends {SIZE} bytes to each other one, 97,531 ns after the host before it, over links of {} ms; the program",
        DELAY.as_millis()
    );
    println!(
        "(`benches/peers/src/testkit_table/program.rs`) is the same for all. *Error* is how far from the exact instant a datagram arrives: the instant at"
    );
    println!(
        "which it should be sent, and {} ms. With a datagram each millisecond something happens in each of turmoil's ticks: nothing suits it better.\n",
        DELAY.as_millis()
    );
    println!(
        "| hosts | every \\[ms\\] | | simulated s per s | against turmoil | datagrams/s | mean error \\[µs\\] | worst error \\[µs\\] | simulated, as it says \\[s\\] |"
    );
    println!("| ---: | ---: | --- | ---: | ---: | ---: | ---: | ---: | ---: |");
    for (hosts, period, count) in [(2, 1, 20_000), (10, 1, 2_000), (2, 8, 2_500), (3, 8, 2_500)] {
        let stream = Stream { period: Duration::from_millis(period), count: effort.part_of(count) };
        let results = rounds(effort, &STEADY, |subject| subject.steady(hosts, stream));
        let speeds: Vec<f64> =
            results.iter().map(|times| stream.length().as_secs_f64() / median(times.iter().map(|(time, _)| *time).collect())).collect();
        for ((subject, times), speed) in STEADY.iter().zip(&results).zip(&speeds) {
            let (errors, said) = times[0].1;
            let rate = speed * f64::from(hosts * (hosts - 1)) / stream.period.as_secs_f64();
            let mean = errors.sum / u32::try_from(errors.packets).unwrap_or(u32::MAX);
            let said = said.unwrap_or(stream.length() + DELAY).as_secs_f64();
            println!(
                "| {hosts} | {period} | {} | {speed:.0} | {:.1}× | {rate:.0} | {} | {} | {said:.3} |",
                subject.name(),
                speed / speeds[TURMOIL],
                micros(mean),
                micros(errors.worst)
            );
        }
    }
    let [own, tokio] = ASKED_STEADY;
    println!(
        "\nAsked for is {own}× turmoil, and {tokio}× on tokio, with a datagram each millisecond. The *bare loop* (`on_bare.rs`) runs the same program without links, addresses,"
    );
    println!(
        "sockets, records and wakers: what lies between it and the test kit is all that the test kit does. With traffic like the paper's (3 hosts, every 8 ms) and in most"
    );
    println!("programs (below) nothing happens in nearly all of turmoil's ticks. Where each tick has datagrams, it is they that cost.");
    println!(
        "\nWith ticks of 100 µs turmoil is not finer: its hosts run on tokio's paused clock, whose timers are rounded up to milliseconds, so that each tick takes one"
    );
    println!("and its own count of time is a tenth of what its hosts see.\n");
}

fn seldom(effort: Effort) {
    println!("## A question now and then\n");
    println!(
        "A client asks, a server answers over links of {} ms, and the client waits so long before it asks again. Asked for: {ASKED_SELDOM}× turmoil.\n",
        DELAY.as_millis()
    );
    println!("| wait | | simulated s per s | against turmoil |");
    println!("| ---: | --- | ---: | ---: |");
    for (wait, count) in [(0, 2000), (100, 1000), (1000, 200)] {
        let (wait, count) = (Duration::from_millis(wait), effort.part_of(count));
        let simulated = ((DELAY * 2 + wait) * count).as_secs_f64();
        let results = rounds(effort, &SUBJECTS, |subject| subject.seldom(wait, count));
        let speeds: Vec<f64> = results.iter().map(|times| simulated / median(times.iter().map(|(time, ())| *time).collect())).collect();
        for (subject, speed) in SUBJECTS.iter().zip(&speeds) {
            println!("| {} ms | {} | {speed:.0} | {:.1}× |", wait.as_millis(), subject.name(), speed / speeds[TURMOIL]);
        }
    }
    println!();
}

fn pairs(effort: Effort) {
    println!("## Ten thousand datagrams through a pair of sockets\n");
    println!("One every 10 µs, over a link of {} ms. Asked for: less than {ASKED_PAIR} ms.\n", DELAY.as_millis());
    println!("| | \\[ms\\] |");
    println!("| --- | ---: |");
    for kind in [Kind::Own, Kind::Tokio] {
        let measure = |_| {
            let begin = processor_time();
            black_box(on_testkit::pair(kind, effort.part_of(10_000)));
            (processor_time() - begin).as_secs_f64() * 1e3
        };
        println!("| {} | {:.1} |", Subject::Kit(kind).name(), median((0..effort.rounds).map(measure).collect()));
    }
    println!();
}
