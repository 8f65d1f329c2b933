//! Writes `docs/measured-live.md`: `cargo run --profile dist -p cohaptic-benches-realtime --bin live-table > docs/measured-live.md`. Takes about four minutes; a number of seconds as
//! argument replaces the ten of each run.
#![allow(clippy::print_stdout, reason = "printing the page is what this program is for")]

mod admission;
mod devices;
mod session;

use std::error::Error;
use std::time::Duration;

use cohaptic_benches_realtime::machine::{self, Processors};
use cohaptic_benches_realtime::waiting::Waiting;
use cohaptic_realtime::{Clock as _, Lateness, LatenessSummary, MonotonicClock, Pacing, Wishes, prepare_thread};
use session::Members;

/// Of every loop here.
const TICK: Duration = Duration::from_millis(1);

/// With how many peers, one of them in another program or none.
const SESSIONS: [(usize, Members); 5] =
    [(3, Members::OneOutside), (10, Members::OneOutside), (10, Members::Simulated), (100, Members::OneOutside), (100, Members::Simulated)];

/// More peers than this run in one way only: sleeping, with priority.
const IN_EVERY_WAY: usize = 10;

/// `SCHED_FIFO` with the priority that `cohaptic live` asks for. Memory is not locked: it would stay so for the rows after it.
fn with_priority() -> Wishes {
    Wishes { lock_memory: false, ..Wishes::default() }
}

/// What one run of a loop came to.
#[derive(Debug)]
struct Loop {
    ticks: LatenessSummary,
    /// Datagrams to another program; `None` where there are none.
    releases: Option<LatenessSummary>,
    /// Of the thread, over the whole run.
    processor: Duration,
    /// What the system refused it.
    refused: Vec<String>,
    /// How many ticks were later than a millisecond, where more than one in a thousand makes a session not valid.
    late: u64,
}

impl Loop {
    fn bare(ticks: &Lateness, processor: Duration, refused: Vec<String>) -> Self {
        Self { ticks: ticks.summary(), releases: None, processor, refused, late: ticks.count_later_than(Duration::from_millis(1)) }
    }
}

fn main() -> Result<(), Box<dyn Error>> {
    let seconds = std::env::args().nth(1).map_or(Ok(10), |text| text.parse())?;
    let span = Duration::from_secs(seconds);
    println!("# Live sessions: how late\n");
    println!("Lateness of the 1 kHz loop of [`cohaptic live`](live.md), and its cost. This page is written by\n");
    println!("    cargo run --profile dist -p cohaptic-benches-realtime --bin live-table > docs/measured-live.md\n");
    println!("and measured on: {}. Each row is a run of {seconds} s, all of them one after the other in one process.\n", machine::name());
    println!("Ten minutes with three devices, one of them at another computer, are on [a page of their own](measured-devices.md).\n");
    loops(span)?;
    calls_of_devices(span)?;
    at_the_door()
}

fn loops(span: Duration) -> Result<(), Box<dyn Error>> {
    println!("## The loop\n");
    println!(
        "Sessions of peers that all touch the object. Links: 24 ms ± 2 ms, 1 % loss. In those *with a program*, one of the peers is another program, played by a"
    );
    println!(
        "thread of this process: it sends 125 samples a second over loopback, with a key, and receives those of the others. *Late* is when the loop woke up, less when the tick was due; *beyond 1 ms*, how"
    );
    println!(
        "many of 1000 ticks: a session with more than one is not valid. *To the program* is when a datagram was handed to the kernel, less when it came out of its link. *Processor* is the time of the loop's thread, of all"
    );
    println!(
        "that it does, a tick. *Steal* is the share of the processors' time that the host gave to others during the row. The bare loops do nothing but wait.\n"
    );
    println!(
        "| loop | `SCHED_FIFO` | late: p50 \\[µs\\] | p99 \\[µs\\] | p99.9 \\[µs\\] | max \\[µs\\] | beyond 1 ms \\[‰\\] | processor \\[µs\\] | to the program: p50 \\[µs\\] | p99 \\[µs\\] | p99.9 \\[µs\\] | max \\[µs\\] | steal |"
    );
    println!("| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |");
    let mut refused = Vec::new();
    for (peers, members) in SESSIONS {
        for (pacing, how) in [(Pacing::Sleep, "sleeping"), (Pacing::SPIN, "spinning")] {
            for wishes in [Wishes::NONE, with_priority()] {
                if peers > IN_EVERY_WAY && (pacing != Pacing::Sleep || wishes == Wishes::NONE) {
                    continue;
                }
                let name = format!("{peers} {}, {how}", members.name());
                refused.extend(row(&name, wishes, || session::run(peers, members, pacing, wishes, span))?);
            }
        }
    }
    row("bare: `tokio::time::interval`", Wishes::NONE, || tokio_interval(span))?;
    for (how, waiting) in Waiting::all() {
        for wishes in [Wishes::NONE, with_priority()] {
            refused.extend(row(&format!("bare: {how}"), wishes, || bare_thread(waiting.clone(), wishes, span))?);
        }
    }
    refused.sort();
    refused.dedup();
    if !refused.is_empty() {
        println!("\nThe system refused, so that rows with `SCHED_FIFO` are rows without: {}.", refused.join("; "));
    }
    println!();
    Ok(())
}

fn calls_of_devices(span: Duration) -> Result<(), Box<dyn Error>> {
    println!("## Devices\n");
    println!(
        "A session with three simulated Falcons, each with a thread of its own. *Calls* is the time that the loop spends in `read` and `hold` of one device at"
    );
    println!("one tick. [The contract](extending.md#a-device-of-your-own-in-rust) allows 50 µs at p99.\n");
    println!(
        "| `SCHED_FIFO` | ticks | calls: p50 \\[µs\\] | p99 \\[µs\\] | p99.9 \\[µs\\] | max \\[µs\\] |\n| --- | ---: | ---: | ---: | ---: | ---: |"
    );
    for wishes in [Wishes::NONE, with_priority()] {
        let took = devices::run(wishes, span)?;
        let [p50, p99, p999, max] = quantiles(took);
        println!("| {} | {} | {p50} | {p99} | {p999} | {max} |", if wishes.priority.is_some() { "asked for" } else { "" }, took.count);
    }
    println!();
    Ok(())
}

/// Runs a loop, prints its row, and gives what the system refused it.
fn row(name: &str, wishes: Wishes, run: impl FnOnce() -> Result<Loop, Box<dyn Error>>) -> Result<Vec<String>, Box<dyn Error>> {
    let processors = Processors::read();
    let Loop { ticks, releases, processor, refused, late } = run()?;
    let steal = processors.stolen_since() * 100.0;
    let fifo = if wishes.priority.is_some() { "asked for" } else { "" };
    let [p50, p99, p999, max] = quantiles(ticks);
    let [out50, out99, out999, out_max] = releases.map(quantiles).unwrap_or_default();
    let count = u32::try_from(ticks.count.max(1)).unwrap_or(u32::MAX);
    let (processor, late) = (micros(processor / count), f64::from(u32::try_from(late).unwrap_or(u32::MAX)) * 1000.0 / f64::from(count));
    println!(
        "| {name} | {fifo} | {p50} | {p99} | {p999} | {max} | {late:.1} | {processor} | {out50} | {out99} | {out999} | {out_max} | {steal:.1} % |"
    );
    Ok(refused)
}

fn at_the_door() -> Result<(), Box<dyn Error>> {
    println!("## Admission\n");
    println!(
        "The cost to decide about one datagram, and to make one ready: the median of {} rounds of {} on one thread, in processor time.",
        admission::ROUNDS,
        admission::COUNT
    );
    println!("No sockets: the [admission of datagrams](live-protocol.md) alone. Samples of three axes, 96 bytes without a seal and 128 with one.\n");
    println!("| datagram | what becomes of it | ns |");
    println!("| --- | --- | ---: |");
    for cost in admission::costs()? {
        println!("| {} | {} | {} |", cost.datagram, cost.fate, cost.each.as_nanos());
    }
    Ok(())
}

fn quantiles(summary: LatenessSummary) -> [String; 4] {
    [summary.p50, summary.p99, summary.p999, summary.max].map(micros)
}

fn micros(span: Duration) -> String {
    let micros = span.as_secs_f64() * 1e6;
    if micros < 10.0 { format!("{micros:.2}") } else { format!("{micros:.0}") }
}

/// A thread that waits for each tick's time in one of the ways there are.
fn bare_thread(mut waiting: Waiting, wishes: Wishes, span: Duration) -> Result<Loop, Box<dyn Error>> {
    let thread = std::thread::spawn(move || -> std::io::Result<Loop> {
        let prepared = prepare_thread(&wishes);
        let (clock, mut ticks) = (MonotonicClock::start(), Lateness::new());
        let (mut due, before) = (clock.now(), machine::thread_time());
        let end = due + span;
        while due < end {
            due += TICK;
            waiting.wait(&clock, due)?;
            ticks.record(clock.now().saturating_duration_since(due));
        }
        let processor = machine::thread_time() - before;
        Ok(Loop::bare(&ticks, processor, prepared.refused.iter().map(ToString::to_string).collect()))
    });
    Ok(thread.join().map_err(|_| "the thread panicked")??)
}

/// An interval of tokio, on a runtime of one thread that has nothing else to do.
fn tokio_interval(span: Duration) -> Result<Loop, Box<dyn Error>> {
    let thread = std::thread::spawn(move || -> std::io::Result<Loop> {
        let runtime = tokio::runtime::Builder::new_current_thread().enable_time().build()?;
        let before = machine::thread_time();
        let mut ticks = Lateness::new();
        runtime.block_on(async {
            let mut interval = tokio::time::interval(TICK);
            // The first is due at once.
            let mut due = interval.tick().await;
            let end = due + span;
            while due < end {
                due = interval.tick().await;
                ticks.record(due.elapsed());
            }
        });
        Ok(Loop::bare(&ticks, machine::thread_time() - before, Vec::new()))
    });
    Ok(thread.join().map_err(|_| "the thread panicked")??)
}
