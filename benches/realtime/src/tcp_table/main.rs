//! Writes `docs/measured-tcp.md`: `cargo run --profile dist -p cohaptic-benches-realtime --bin tcp-table > docs/measured-tcp.md`. Takes about nine minutes, and makes network
//! namespaces: it needs root, or `unshare -Urn` before the program. A number as argument replaces the 101 connections of a row.
#![allow(clippy::print_stdout, reason = "printing the page is what this program is for")]
#![allow(clippy::cast_precision_loss, reason = "counts of octets and connections")]

mod kernel;
mod test_kit;

use std::error::Error;
use std::fs;
use std::time::Duration;

use cohaptic_benches_realtime::machine::{self, Processors};
use kernel::Tcp;

/// Connections of a row, unless fewer are said.
const CONNECTIONS: u32 = 101;
/// Connections of a row whose link has a rate: one after the other, since they would share it.
const ALONE: u32 = 5;

/// Connections of a row of long transfers over a link without a rate: each takes seconds, and few stand at once within [`LOAD`].
const FEW: u32 = 25;

/// What all connections that stand at once may carry together, in bit/s. More is a load for the machine, on which Linux waits and the test kit does not: a row of 1 MB with
/// jitter took Linux three times as long with 101 connections at once as with 5.
const LOAD: u64 = 200_000_000;

/// The octets of a question, and of its answer.
const QUESTION: usize = 100;

/// What the server does with a connection.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Work {
    /// It writes this number of octets at once.
    Gives(usize),
    /// It answers this number of questions, each with as many octets.
    Answers(u32),
}

/// What came of a connection: how long it took from `connect` to the last octet.
type Times = Vec<Duration>;

/// The links and sizes of the first table of the design of this TCP, in the order in which it has them.
const TRANSFERS: [(&str, usize); 6] = [
    ("delay 100ms", 100_000),
    ("delay 25ms rate 20mbit limit 100", 10_000_000),
    ("delay 20ms 5ms", 1_000_000),
    ("delay 20ms 5ms loss 1%", 1_000_000),
    ("delay 50ms loss 5%", 1_000_000),
    ("delay 10ms loss 10%", 100_000),
];

/// Long transfers, whose beginning counts little.
const LONG: [(&str, usize); 4] = [
    ("delay 10ms rate 100mbit limit 1000", 40_000_000),
    ("delay 10ms rate 50mbit limit 50", 20_000_000),
    ("delay 10ms loss 0.1%", 10_000_000),
    ("delay 50ms loss 0.1%", 10_000_000),
];

const QUESTIONS: [(&str, u32); 3] = [("delay 24ms", 50), ("delay 24ms 4ms", 50), ("delay 24ms loss 2%", 50)];

/// How many connections a row has.
fn count(words: &str, most: u32) -> u32 {
    if words.contains("rate") { most.min(ALONE) } else { most }
}

fn main() -> Result<(), Box<dyn Error>> {
    let most = std::env::args().nth(1).and_then(|text| text.parse().ok()).unwrap_or(CONNECTIONS);
    kernel::check()?;
    let before = Processors::read();
    let system = fs::read_to_string("/proc/sys/kernel/osrelease")?;
    println!("# TCP: the kernel's and the test kit's\n");
    println!("How far the TCP of [the test kit](testing.md#tcp) and that of Linux are apart. This page is written by\n");
    println!("    cargo run --profile dist -p cohaptic-benches-realtime --bin tcp-table > docs/measured-tcp.md\n");
    println!("and measured on: {}. Linux here is {}, as it comes: CUBIC, SACK, RACK.\n", machine::name(), system.trim());
    println!("Linux runs in two network namespaces with [`cohaptic router`](router.md) between them, whose two links have the words of the row. The");
    println!(
        "test kit runs the same program in [virtual time](glossary.md#virtual-time) over links of the same words. Figures are medians of {most} connections, or"
    );
    println!(
        "of {} where a link has a rate, one after the other; behind them are the quartiles. Connections of Linux that stand at once carry at most {} Mbit/s",
        most.min(ALONE),
        LOAD / 1_000_000
    );
    println!("together, by the test kit's median. *Ratio* is the test kit's median divided by Linux's.");
    println!(
        "In each table *kept* is Linux as it comes, which keeps a threshold and a round trip of earlier connections to the same host; *fresh* is Linux with"
    );
    println!("`tcp_no_metrics_save`, where each connection begins anew, as all connections of the test kit do.\n");
    transfers(most)?;
    long(most)?;
    questions(most)?;
    explain();
    let load = fs::read_to_string("/proc/loadavg")?;
    println!("\nThe host of the virtual machine gave {:.1} % of the processors' time to others meanwhile.", before.stolen_since() * 100.0);
    println!(
        "The load of the machine was {} (the average of the last minute): above its number of cores, the router is late.",
        load.split(' ').next().unwrap_or_default()
    );
    Ok(())
}

/// The times of a row: the test kit's, and those of fresh and of kept connections of the kernel.
fn measure(words: &str, work: Work, count: u32) -> Result<[Times; 3], Box<dyn Error>> {
    let kit = sorted(test_kit::times(words, work, count)?);
    let [_, median, _] = quartiles(&kit);
    let connections = (count, at_once(words, work, median).min(count));
    let fresh = kernel::times(words, work, connections, Tcp::Fresh)?;
    let kept = kernel::times(words, work, connections, Tcp::Kept)?;
    Ok([kit, sorted(fresh), sorted(kept)])
}

fn sorted(mut times: Times) -> Times {
    times.sort();
    times
}

/// How many connections the kernel has at once: one where they would share a rate, else within [`LOAD`], by the time `each` that one takes.
fn at_once(words: &str, work: Work, each: Duration) -> u32 {
    if words.contains("rate") {
        return 1;
    }
    let octets = match work {
        Work::Gives(octets) => octets,
        Work::Answers(questions) => 2 * QUESTION * questions as usize,
    };
    let bits = octets as u64 * 8;
    let possible = u64::try_from(each.as_nanos()).unwrap_or(u64::MAX).saturating_mul(LOAD) / (bits * 1_000_000_000);
    u32::try_from(possible).unwrap_or(u32::MAX).max(1)
}

/// The median and the quartiles, with a unit.
fn shown(times: &Times, figure: impl Fn(Duration) -> f64) -> String {
    let [low, median, high] = quartiles(times).map(figure);
    let (low, high) = (low.min(high), low.max(high));
    format!("{} ({}–{})", short(median), short(low), short(high))
}

fn quartiles(times: &Times) -> [Duration; 3] {
    [1, 2, 3].map(|part| times[(times.len() - 1) * part / 4])
}

fn short(figure: f64) -> String {
    if figure < 10.0 { format!("{figure:.3}") } else { format!("{figure:.1}") }
}

/// A row: what it is, the figures of all three, and the two ratios.
fn row(name: &str, all: &[Times; 3], figure: impl Fn(Duration) -> f64) {
    let [kit, fresh, kept] = all.each_ref().map(|times| shown(times, &figure));
    let [of_kit, of_fresh, of_kept] = all.each_ref().map(|times| figure(quartiles(times)[1]));
    println!("| {name} | {kit} | {fresh} | {:.2} | {kept} | {:.2} |", of_kit / of_fresh, of_kit / of_kept);
}

fn transfers(most: u32) -> Result<(), Box<dyn Error>> {
    println!("## How long a transfer takes\n");
    println!("Seconds from `connect` to the last octet of what the server writes as soon as it has accepted.\n");
    println!("| link, each way | octets | test kit \\[s\\] | Linux, fresh \\[s\\] | ratio | Linux, kept \\[s\\] | ratio |");
    println!("| --- | ---: | ---: | ---: | ---: | ---: | ---: |");
    for (words, octets) in TRANSFERS {
        let all = measure(words, Work::Gives(octets), count(words, most))?;
        row(&format!("`{words}` | {octets}"), &all, |time| time.as_secs_f64());
    }
    println!();
    Ok(())
}

fn long(most: u32) -> Result<(), Box<dyn Error>> {
    println!("## Throughput\n");
    println!("The same with more octets, divided by the time. A row without a rate has {} connections.\n", most.min(FEW));
    println!("| link, each way | octets | test kit \\[Mbit/s\\] | Linux, fresh \\[Mbit/s\\] | ratio | Linux, kept \\[Mbit/s\\] | ratio |");
    println!("| --- | ---: | ---: | ---: | ---: | ---: | ---: |");
    for (words, octets) in LONG {
        let all = measure(words, Work::Gives(octets), count(words, most.min(FEW)))?;
        row(&format!("`{words}` | {octets}"), &all, |time| octets as f64 * 8e-6 / time.as_secs_f64());
    }
    println!();
    Ok(())
}

fn questions(most: u32) -> Result<(), Box<dyn Error>> {
    println!("## A question after each answer\n");
    println!(
        "Milliseconds for a question of {QUESTION} octets and its answer: all of a connection, without the handshake, divided by their number.\n"
    );
    println!("| link, each way | questions | test kit \\[ms\\] | Linux, fresh \\[ms\\] | ratio | Linux, kept \\[ms\\] | ratio |");
    println!("| --- | ---: | ---: | ---: | ---: | ---: | ---: |");
    for (words, questions) in QUESTIONS {
        let all = measure(words, Work::Answers(questions), count(words, most))?;
        row(&format!("`{words}` | {questions}"), &all, |time| time.as_secs_f64() * 1e3 / f64::from(questions));
    }
    println!();
    Ok(())
}

fn explain() {
    println!("## What makes the difference\n");
    println!("Measured, by these tables or by switching one cause off:\n");
    println!("- **Lateness.** The router is never early; how late it is, [measured-router.md](measured-router.md) tells. The test kit is exact.");
    println!("- **Memory of a host.** *Kept* connections begin with the threshold of one before them, often one that lost packets at the beginning.");
    println!(
        "- **Load.** 101 connections at once over `delay 20ms 5ms` took Linux three times as long as five. That is why they are kept within a bound."
    );
    println!("- **Chance.** Links of both lose at random, not the same packets. With losses a row has the spread that its quartiles show.\n");
    println!("Known of Linux or of the router, and not switched off here, so that their parts in a row are a conjecture:\n");
    println!("- **Order.** Packets of a link with jitter that leave late together leave in another order and in bursts.");
    println!("- **Ticks.** The kernel rounds its timers up to its ticks, of up to 4 ms, and its round trips to 1 ms on timestamps.");
    println!(
        "- **Large segments.** Between the kernel and the device one segment may stand for many packets. The router cuts it before the link and joins"
    );
    println!(
        "  what leaves together, so that a receiver acknowledges less often than the test kit's, which sees every packet. The packets of one segment come in a"
    );
    println!("  burst, which a short queue may drop.");
    println!("- **Pacing.** The test kit paces nothing. Linux paces only under the queue `fq`.\n");
    println!("## Single segments\n");
    println!(
        "What single segments do, and not only their sums, is compared by [scripts](../crates/tcp/README.md#scripts-of-segments). The test kit and Linux 6.18"
    );
    println!("follow all of them alike, but for the initial sequence number of one connection. A script has one of three kinds of source.\n");
    include_str!("../../../../crates/tcp/README.md").lines().filter(|line| line.starts_with("| ")).for_each(|line| println!("{line}"));
}
