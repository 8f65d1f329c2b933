//! Writes `docs/measured-relay.md`: `cargo run --profile dist -p cohaptic-benches-realtime --bin relay-table > docs/measured-relay.md`. Takes about three minutes; a
//! number of seconds as argument replaces the ten of each run, and `tcp` after it prints the section on connections of TCP alone.
#![allow(clippy::print_stdout, reason = "printing the page is what this program is for")]
#![allow(clippy::cast_precision_loss, reason = "counts of packets")]

mod connections;
mod subjects;
mod traffic;

use std::error::Error;
use std::time::Duration;

use cohaptic_benches_realtime::machine::{self, Processors};
use cohaptic_benches_realtime::waiting::Waiting;
use cohaptic_realtime::{LatenessSummary, Pacing};
use connections::Between;
use subjects::{Outcome, bare_thread, relay, tokio_forwarder};

/// Packets a second of the first table.
const RATE: u64 = 5000;

/// Packets a second of the second.
const RATES: [u64; 6] = [50_000, 100_000, 150_000, 250_000, 300_000, 400_000];

fn main() -> Result<(), Box<dyn Error>> {
    let seconds = std::env::args().nth(1).and_then(|text| text.parse().ok()).unwrap_or(10);
    let span = Duration::from_secs(seconds);
    if std::env::args().nth(2).is_some_and(|part| part == "tcp") {
        return connections_of_tcp(span);
    }
    println!("# The relay: how late and how fast\n");
    println!("Lateness and speed of [`cohaptic relay`](relay.md) on loopback. This page is written by\n");
    println!("    cargo run --profile dist -p cohaptic-benches-realtime --bin relay-table > docs/measured-relay.md\n");
    println!("and measured on: {}. Each row is a run of {seconds} s, all of them one after the other in one process, with the", machine::name());
    println!("generator and the sink in it, on the same cores. Datagrams carry {} bytes.\n", traffic::SIZE);
    release_error(span)?;
    rates(span)?;
    println!();
    connections_of_tcp(span)
}

fn connections_of_tcp(span: Duration) -> Result<(), Box<dyn Error>> {
    println!("## Connections of TCP\n");
    println!(
        "One connection over loopback, with [`cohaptic relay --tcp`](relay.md#connections-of-tcp) or another program between client and server, in runs of"
    );
    println!(
        "{} s, on {}. *Added* is the time of a round trip of 64 bytes, less the delay that the keys ask for: 10 ms",
        span.as_secs(),
        machine::name()
    );
    println!("with `delay = \"5ms\"` both ways. *Carried* is what the server reads of a client that writes as much as it can.\n");
    println!("| between | added p50 \\[µs\\] | p99 \\[µs\\] | max \\[µs\\] | carried \\[MB/s\\] |");
    println!("| --- | ---: | ---: | ---: | ---: |");
    for between in Between::ALL {
        let times = connections::round_trips(&between, span)?.summary();
        let [p50, p99, max] = [times.p50, times.p99, times.max].map(|time| micros(time.saturating_sub(between.asked())));
        let carried = connections::throughput(&between, span)? / 1e6;
        println!("| {} | {p50} | {p99} | {max} | {carried:.1} |", between.name());
    }
    println!("\n100 Mbit/s are 12.5 MB/s. Without a rate a connection carries at most its `buffer`, 6 MiB, per delay: 1258 MB/s with 5 ms.");
    Ok(())
}

fn release_error(span: Duration) -> Result<(), Box<dyn Error>> {
    println!("## Release error\n");
    println!(
        "{RATE} packets a second through a link of {} ms. The *release error* is the time just before a datagram is handed to",
        subjects::DELAY.as_millis()
    );
    println!(
        "the kernel, less the instant at which it should leave: for the relay {} ms after the kernel's time stamp, for the others after they read it.\n",
        subjects::DELAY.as_millis()
    );
    println!(
        "*Core* is the processor time of all but generator and sink, as a share of one core; *steal*, the share of the processors' time that the host gave to"
    );
    println!("others meanwhile. Asked for: p50 at most 1 µs and p99 at most 60 µs, for less than 30 % of a core.\n");
    println!("| what | p50 \\[µs\\] | p99 \\[µs\\] | p99.9 \\[µs\\] | max \\[µs\\] | reordered | core | steal |");
    println!("| --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |");
    let row = |name: &str, (error, processor): (LatenessSummary, Duration), reordered: Option<f64>, before: Processors| {
        let reordered = reordered.map_or_else(String::new, |share| format!("{:.1} %", share * 100.0));
        let [p50, p99, p999, max] = [error.p50, error.p99, error.p999, error.max].map(micros);
        let (core, steal) = (processor.as_secs_f64() * RATE as f64 * 100.0, before.stolen_since() * 100.0);
        println!("| {name} | {p50} | {p99} | {p999} | {max} | {reordered} | {core:.0} % | {steal:.1} % |");
    };
    let share = |outcome: &Outcome| Some(outcome.received.reordered as f64 / outcome.received.count.max(1) as f64);
    let forwarder = |name: &str, run: &dyn Fn() -> Result<Outcome, Box<dyn Error>>| -> Result<Outcome, Box<dyn Error>> {
        let before = Processors::read();
        let outcome = run()?;
        row(name, (outcome.error, outcome.processor), share(&outcome), before);
        Ok(outcome)
    };
    let sleeping = forwarder("relay, sleeping", &|| relay(Pacing::Sleep, RATE, span))?;
    let spinning = forwarder("relay, spinning", &|| relay(Pacing::SPIN, RATE, span))?;
    forwarder("`tokio::time::sleep_until`, a task a packet", &|| tokio_forwarder(RATE, span))?;
    for (name, waiting) in Waiting::all() {
        let before = Processors::read();
        row(&format!("a bare thread, {name}"), bare_thread(waiting, RATE, span)?, None, before);
    }
    println!();
    for (name, Outcome { clamped: (count, longest), sent, .. }) in [("sleeping", &sleeping), ("spinning", &spinning)] {
        println!(
            "Offered to the link later than they came, which the release error includes, {name}: {count} of {}, by at most {} µs.",
            sent.count,
            micros(*longest)
        );
    }
    println!("The bare threads receive nothing: they wait for an instant every {} µs, and send.", 1_000_000 / RATE);
    match sleeping.refused.as_slice() {
        [] => println!("The relay and the bare threads had `SCHED_FIFO`, as they ask for; the others did not.\n"),
        refused => println!("The relay had to do without: {}.\n", refused.join("; ")),
    }
    Ok(())
}

fn rates(span: Duration) -> Result<(), Box<dyn Error>> {
    println!("## Rates\n");
    println!(
        "The same link, the relay sleeping. *At the socket*: dropped by the kernel because the forwarder did not read in time. *Overload*: dropped by"
    );
    println!(
        "the relay because too much was on its way. *At the sink*: passed on, and dropped by the kernel because the sink of this program did not read"
    );
    println!("in time, which is no fault of the forwarder's. Asked for: 250,000 a second with p99 below 2 ms.\n");
    println!(
        "| packets/s | what | sent/s | at the socket | overload | at the sink | p50 \\[µs\\] | p99 \\[µs\\] | reordered | processor/packet | memory \\[MB\\] |"
    );
    println!("| ---: | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: | --- |");
    let mut highest = [("relay", 0), ("tokio", 0)];
    for rate in RATES {
        for (name, highest) in &mut highest {
            let outcome = if *name == "relay" { relay(Pacing::Sleep, rate, span)? } else { tokio_forwarder(rate, span)? };
            row(rate, name, &outcome);
            if is_sustained(rate, &outcome) {
                *highest = rate;
            }
        }
    }
    let [relay, tokio] = highest.map(|(_, rate)| rate);
    println!(
        "\nSustained means: the generator reached 99 % of the rate, 99.99 % were passed on, and p99 was below 2 ms. The highest of these rates that was"
    );
    println!("sustained: relay {relay} packets/s, tokio {tokio} packets/s. Memory is what the process holds before and after the run.");
    Ok(())
}

fn row(rate: u64, name: &str, outcome: &Outcome) {
    let Outcome { sent, received, error, at_socket, overload, at_sink, memory: (before, after), .. } = outcome;
    let per_second = sent.count as f64 / sent.elapsed.as_secs_f64();
    let reordered = received.reordered as f64 / received.count.max(1) as f64 * 100.0;
    let (p50, p99) = (micros(error.p50), micros(error.p99));
    let [before, after] = [before, after].map(|kilobytes| *kilobytes as f64 / 1000.0);
    println!(
        "| {rate} | {name} | {per_second:.0} | {at_socket} | {overload} | {at_sink} | {p50} | {p99} | {reordered:.1} % | {} | {before:.1} → {after:.1} |",
        of(outcome)
    );
}

fn is_sustained(rate: u64, outcome: &Outcome) -> bool {
    let Outcome { sent, received, error, at_sink, .. } = outcome;
    let reached = sent.count as f64 / sent.elapsed.as_secs_f64() >= 0.99 * rate as f64;
    reached && (received.count + at_sink) as f64 >= 0.9999 * sent.count as f64 && error.p99 < Duration::from_millis(2)
}

fn of(outcome: &Outcome) -> String {
    format!("{:.2} µs", outcome.processor.as_secs_f64() * 1e6)
}

fn micros(span: Duration) -> String {
    let micros = span.as_secs_f64() * 1e6;
    if micros < 10.0 { format!("{micros:.2}") } else { format!("{micros:.0}") }
}
