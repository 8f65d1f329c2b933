//! Writes `docs/measured-live.md`: `cargo run --release -p cohaptic-benches-realtime --bin live-table > docs/measured-live.md`. Takes about three minutes; a number of seconds as
//! argument replaces the ten of each run.
#![allow(clippy::print_stdout, reason = "printing the page is what this program is for")]

mod admission;
mod session;

use std::error::Error;
use std::time::Duration;

use cohaptic_benches_realtime::machine;
use cohaptic_realtime::{Clock as _, Lateness, LatenessSummary, MonotonicClock, Pacer, Pacing, Wishes, prepare_thread};

/// Of every loop here.
const TICK: Duration = Duration::from_millis(1);

/// With how many peers, one of them in another program.
const PEERS: [usize; 2] = [3, 10];

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
}

fn main() -> Result<(), Box<dyn Error>> {
    let seconds = std::env::args().nth(1).map_or(Ok(10), |text| text.parse())?;
    let span = Duration::from_secs(seconds);
    println!("# Live sessions: how late\n");
    println!("Lateness of the 1 kHz loop of [`cohaptic live`](live.md), and its cost. This page is written by\n");
    println!("    cargo run --release -p cohaptic-benches-realtime --bin live-table > docs/measured-live.md\n");
    println!("and measured on: {}. Each row is a run of {seconds} s, all of them one after the other in one process.\n", machine::name());
    loops(span)?;
    at_the_door()
}

fn loops(span: Duration) -> Result<(), Box<dyn Error>> {
    println!("## The loop\n");
    println!(
        "Sessions of 3 and of 10 peers that all touch the object. One of them is another program, played by a thread of this process: it sends 125 samples a"
    );
    println!(
        "second over loopback, with a key, and receives those of the others. Links: 24 ms ± 2 ms, 1 % loss. *Late* is when the loop woke up, less when the tick"
    );
    println!(
        "was due. *To the program* is when a datagram was handed to the kernel, less when it came out of its link. *Processor* is the time of the loop's thread, of all"
    );
    println!("that it does, a tick. The bare loops do nothing but wait.\n");
    println!(
        "| loop | `SCHED_FIFO` | late: p50 \\[µs\\] | p99 \\[µs\\] | p99.9 \\[µs\\] | max \\[µs\\] | processor \\[µs\\] | to the program: p50 \\[µs\\] | p99 \\[µs\\] | p99.9 \\[µs\\] | max \\[µs\\] |"
    );
    println!("| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |");
    let mut refused = Vec::new();
    for peers in PEERS {
        for (pacing, how) in [(Pacing::Sleep, "sleeping"), (Pacing::SPIN, "spinning")] {
            for wishes in [Wishes::NONE, with_priority()] {
                let run = session::run(peers, pacing, wishes, span)?;
                row(&format!("session of {peers}, {how}"), wishes, &run);
                refused.extend(run.refused);
            }
        }
    }
    row("bare: `tokio::time::interval`", Wishes::NONE, &tokio_interval(span)?);
    for (pacing, how) in [(Pacing::Sleep, "bare: `clock_nanosleep`"), (Pacing::SPIN, "bare: spinning")] {
        for wishes in [Wishes::NONE, with_priority()] {
            let run = bare_thread(pacing, wishes, span)?;
            row(how, wishes, &run);
            refused.extend(run.refused);
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

fn row(name: &str, wishes: Wishes, run: &Loop) {
    let fifo = if wishes.priority.is_some() { "asked for" } else { "" };
    let [p50, p99, p999, max] = quantiles(run.ticks);
    let [out50, out99, out999, out_max] = run.releases.map(quantiles).unwrap_or_default();
    let ticks = u32::try_from(run.ticks.count.max(1)).unwrap_or(u32::MAX);
    let processor = micros(run.processor / ticks);
    println!("| {name} | {fifo} | {p50} | {p99} | {p999} | {max} | {processor} | {out50} | {out99} | {out999} | {out_max} |");
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

/// A thread that waits for each tick's time: with `clock_nanosleep`, and spins the last of it if asked.
pub(crate) fn bare_thread(pacing: Pacing, wishes: Wishes, span: Duration) -> Result<Loop, Box<dyn Error>> {
    let thread = std::thread::spawn(move || -> std::io::Result<Loop> {
        let prepared = prepare_thread(&wishes);
        let (clock, mut pacer, mut ticks) = (MonotonicClock::start(), Pacer::new(pacing), Lateness::new());
        let (mut due, before) = (clock.now(), machine::thread_time());
        let end = due + span;
        while due < end {
            due += TICK;
            match pacing {
                // Without what a pacer does to be on time all the same.
                Pacing::Sleep => _ = clock.block(Some(due), &[])?,
                Pacing::Spin { .. } => _ = pacer.wait(&clock, Some(due), &[])?,
            }
            ticks.record(clock.now().saturating_duration_since(due));
        }
        let refused = prepared.refused.iter().map(ToString::to_string).collect();
        Ok(Loop { ticks: ticks.summary(), releases: None, processor: machine::thread_time() - before, refused })
    });
    Ok(thread.join().map_err(|_| "the thread panicked")??)
}

/// An interval of tokio, on a runtime of one thread that has nothing else to do.
pub(crate) fn tokio_interval(span: Duration) -> Result<Loop, Box<dyn Error>> {
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
        Ok(Loop { ticks: ticks.summary(), releases: None, processor: machine::thread_time() - before, refused: Vec::new() })
    });
    Ok(thread.join().map_err(|_| "the thread panicked")??)
}
