//! Disciplines of a queue on one stream of packets, here and on ns-3: the last part of `docs/measured-link.md`. No figure depends on the machine.

use std::fmt::Write as _;
use std::path::Path;
use std::process::Command;

use cohaptic_units::{Bytes, Instant, Rate};
use cohaptic_wan::random::{Purpose, Stream};
use cohaptic_wan::{Bottleneck, CoDel, Discipline, Fate, FqCoDel, Link, LinkConfig, LinkName, Pie, QueueLimit};

/// Rate of the line \[bit/s\]. A packet of 1500 bytes takes a millisecond.
const RATE: u64 = 12_000_000;
/// Seconds of traffic.
const SECONDS: u64 = 20;
/// Nanoseconds of a second.
const SECOND: u64 = 1_000_000_000;
/// Number of flows of large packets. The flow of small packets has the next number.
const LARGE: u32 = 3;
/// Status of a script that does not find what it needs.
const SKIPPED: i32 = 77;

/// A packet before the queue.
struct Offered {
    /// Instant \[ns\].
    at: u64,
    flow: u32,
    /// Size \[byte\].
    size: u64,
}

/// Discipline of the queue, as this project and as ns-3 know it.
struct Subject {
    name: &'static str,
    /// Word for the program of ns-3.
    word: &'static str,
    discipline: Discipline,
    /// Number of packets that may wait.
    limit: u64,
}

/// Disciplines with their default parameters. ECN does not matter, because no packet of the traffic supports it.
fn subjects() -> [Subject; 4] {
    [
        Subject { name: "tail drop", word: "tail-drop", discipline: Discipline::TailDrop, limit: 100 },
        Subject { name: "CoDel", word: "codel", discipline: Discipline::CoDel(CoDel::default()), limit: 1_000 },
        Subject { name: "FQ-CoDel", word: "fq-codel", discipline: Discipline::FqCoDel(FqCoDel::default()), limit: 10_240 },
        Subject { name: "PIE", word: "pie", discipline: Discipline::Pie(Pie::default()), limit: 1_000 },
    ]
}

/// Returns the traffic in the order of time: large packets with exponential gaps, which take the flows in turn, and a small packet every 20 ms.
#[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "gaps of milliseconds in nanoseconds")]
fn traffic() -> Vec<Offered> {
    let stream = Stream::new(1, b"traffic");
    // Small packets are not offered at whole milliseconds, so that no small packet comes at the instant at which a large one leaves.
    let mut all: Vec<Offered> = (0..SECONDS * 50).map(|number| Offered { at: number * SECOND / 50 + 7_777, flow: LARGE, size: 100 }).collect();
    let (mut at, mut number) = (0, 0);
    while at < SECONDS * SECOND {
        let load = if (at / SECOND).is_multiple_of(2) { 1.2 } else { 0.5 };
        let unit = stream.packet(number).draws(Purpose::CrossTraffic).next_unit();
        at += (-(1.0 - unit).ln() * 1e6 / load) as u64;
        all.push(Offered { at, flow: (number % u64::from(LARGE)) as u32, size: 1500 });
        number += 1;
    }
    all.sort_by_key(|packet| (packet.at, packet.flow));
    all
}

/// Returns the instant at which each packet has left the line \[ns\], `None` for a dropped packet.
fn here(subject: &Subject, traffic: &[Offered]) -> Vec<Option<u64>> {
    let rate = Rate::bits_per_sec(RATE).expect("a rate above zero");
    let limit = Some(QueueLimit::Packets(subject.limit));
    let line = Bottleneck { limit, discipline: subject.discipline, ..Bottleneck::at_rate(rate) };
    let config = LinkConfig { bottleneck: Some(line), ..LinkConfig::default() };
    let mut link = Link::new(1, &LinkName::between("a", "b"), config).with_flows(|flow: &u32| *flow);
    for packet in traffic {
        link.handle_packet(Instant::from_nanos(packet.at), Bytes::new(packet.size), packet.flow).expect("time goes on");
    }
    // Every packet has left by then: no queue has room for more than 10 s.
    link.handle_timeout(Instant::from_nanos(2 * SECONDS * SECOND)).expect("time goes on");
    let mut departures = vec![None; traffic.len()];
    while let Some(event) = link.poll_event() {
        if let Fate::Delivered(at) = event.fate {
            departures[usize::try_from(event.sequence).expect("some thousand packets")] = Some(at.as_nanos());
        }
    }
    departures
}

/// Result of the program of ns-3.
enum There {
    /// Reason for which the program cannot run here.
    Skipped(String),
    /// Name of the program, and the instants as [`here`] returns them.
    Ran(String, Vec<Option<u64>>),
}

/// Runs the program of ns-3 on the traffic in a file.
fn there(subject: &Subject, file: &Path) -> There {
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/peers/others/ns3.sh");
    let mut command = Command::new(script);
    let output = match command.args(["queues", subject.word, &subject.limit.to_string()]).arg(file).output() {
        Ok(output) => output,
        Err(error) => return There::Skipped(format!("{script}: {error}")),
    };
    let errors = String::from_utf8_lossy(&output.stderr);
    if output.status.code() == Some(SKIPPED) {
        return There::Skipped(errors.trim().to_owned());
    }
    assert!(output.status.success(), "{command:?}: {}: {errors}", output.status);
    let text = String::from_utf8(output.stdout).expect("text");
    let (name, departures) = text.split_once('\n').expect("the name of the program");
    let departures = departures.lines().map(|line| u64::try_from(line.parse::<i64>().expect("an instant")).ok());
    There::Ran(name.to_owned(), departures.collect())
}

/// Returns a row of the table. `same` is the number of packets with the fate and the instant of the row above, `None` in the row of this project.
#[expect(clippy::cast_precision_loss, clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "some thousand packets")]
fn row(name: &str, program: &str, traffic: &[Offered], departures: &[Option<u64>], same: Option<usize>) -> String {
    let delays = |is_small: bool| -> [f64; 2] {
        let of_kind = traffic.iter().zip(departures).filter(|(packet, _)| (packet.flow == LARGE) == is_small);
        let mut delays: Vec<f64> = of_kind.filter_map(|(packet, at)| Some((at.as_ref()? - packet.at) as f64 / 1e6)).collect();
        delays.sort_by(f64::total_cmp);
        [0.5, 0.99].map(|share| delays[(share * (delays.len() - 1) as f64).round() as usize])
    };
    let ([large_half, large_most], [small_half, small_most]) = (delays(false), delays(true));
    let by_the_end = |at: &Option<u64>| at.is_some_and(|at| at <= SECONDS * SECOND);
    let carried: u64 = traffic.iter().zip(departures).filter(|(_, at)| by_the_end(at)).map(|(packet, _)| packet.size).sum();
    let rate = carried as f64 * 8e-6 / SECONDS as f64;
    let percent = |count: usize| count as f64 / traffic.len() as f64 * 100.0;
    let dropped = percent(departures.iter().filter(|at| at.is_none()).count());
    let same = same.map_or_else(String::new, |count| format!("{:.2}", percent(count)));
    format!("| {name} | {program} | {large_half:.2} | {large_most:.2} | {small_half:.2} | {small_most:.2} | {rate:.3} | {dropped:.2} | {same} |\n")
}

/// Returns the section of the page.
pub(crate) fn section() -> String {
    let traffic = traffic();
    let mut text = String::from(HEAD);
    let mut lines = String::new();
    for Offered { at, flow, size } in &traffic {
        let _ = writeln!(lines, "{at} {flow} {size}");
    }
    let file = std::env::temp_dir().join(format!("cohaptic-queues-{}", std::process::id()));
    std::fs::write(&file, lines).expect("a temporary file");
    let mut missing = None;
    for subject in subjects() {
        let own = here(&subject, &traffic);
        text += &row(subject.name, "cohaptic", &traffic, &own, None);
        match there(&subject, &file) {
            There::Skipped(why) => missing = Some(why),
            There::Ran(program, departures) => {
                assert_eq!(departures.len(), own.len(), "{program} tells of each packet");
                let same = own.iter().zip(&departures).filter(|(own, other)| own == other).count();
                text += &row(subject.name, &program, &traffic, &departures, Some(same));
            }
        }
    }
    std::fs::remove_file(&file).expect("a file of this program");
    if let Some(why) = missing {
        let _ = writeln!(text, "\nns-3: skipped. {why}");
    }
    text + TAIL
}

/// Text before the rows.
const HEAD: &str = "\
## Queues beside ns-3

The table compares the [disciplines of a queue](emulator-stages.md#bottleneck) with those of ns-3 on one stream of packets, where ns-3 is installed
([ns3_queues.cc](../benches/peers/others/ns3_queues.cc), compiled against Debian's `libns3-dev`). No figure depends on the machine.

The traffic lasts twenty seconds, on a line of 12 Mbit/s. Three flows of packets of 1500 bytes with exponential gaps offer 1.2 times the rate of the line together
in every other second, and half of the rate in the seconds between. A fourth flow has 100 bytes every 20 ms. No sender reacts to a drop, so that the
differences are those of the disciplines alone. Parameters are the defaults of this project on both sides; 100 packets may wait with tail drop, 1000 with
CoDel and PIE, 10,240 with FQ-CoDel. A delay lasts from the offer to the end of transmission, which takes 1 ms for a large packet and 0.07 ms for a small
one. *Same* is the share of packets that both drop, or that leave both lines at the same nanosecond.

| discipline | program | large, 50 % \\[ms\\] | large, 99 % | small, 50 % \\[ms\\] | small, 99 % | carried \\[Mbit/s\\] | dropped \\[%\\] | same \\[%\\] |
| --- | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: |
";

/// Text after the rows.
const TAIL: &str = "
Why the two differ:

- **Tail drop** leaves no choice to a program, so there is no difference.
- **CoDel**, and so **FQ-CoDel**: for each drop ns-3 takes one step of Newton's method in place of a square root, as Linux does. So the third drop of a
  series comes 50 ms after the second, and not 100/√2 = 71 ms, as in RFC 8289 and here. ns-3 also counts time in units of 1.024 µs. Every packet after the
  first drop that differs meets another queue.
- **FQ-CoDel**: ns-3 drops no packet of a flow that has at most an MTU waiting. Here and in Linux, all flows together count.
- **PIE**: ns-3 draws other random numbers, and keeps the probability at zero during the burst allowance. Here and in Linux the controller works from the
  beginning. ns-3 drops no packet behind at most two packets, whatever their size; here and in RFC 8033, behind at most two of 1500 bytes.
";
