//! The tables of connections.

mod on_testkit;
mod on_turmoil;
mod on_turmoil_net;
mod program;

use std::process::Command;
use std::time::Duration;

use cohaptic_benches_peers::{median, seconds_of, version};
use cohaptic_testkit::tcp::{CongestionControl, TcpConfig};

use super::{Effort, rounds};
use crate::program::DELAY;
use program::SIZE;

/// The octets of a full segment.
const MSS: f64 = 1448.0;
/// The link of the gigabyte.
const GIGABIT: &str = "delay 1ms rate 1gbit limit 1000";

/// What an idle connection may keep \[byte an end\].
const ASKED_IDLE: f64 = 4096.0;

/// The subjects.
const OWN: &str = "testkit";
const TOKIO: &str = "testkit on tokio";
const TURMOIL: &str = "turmoil, ticks of 1 ms";
const TURMOIL_NET: &str = "turmoil-net, ticks of 1 ms";

/// A subject, the figure that is asked for, and its work.
type Row<'a, T> = (&'a str, &'a str, &'a dyn Fn() -> T);

/// The median time of each row \[s\].
fn times<T>(effort: Effort, rows: &[Row<'_, T>]) -> Vec<f64> {
    let results = rounds(effort, rows, |(_, _, work)| work());
    results.iter().map(|times| median(times.iter().map(|(time, _)| *time).collect())).collect()
}

/// What an idle connection keeps \[byte an end\]. To be measured before anything else: freed memory stays with the process, and would be taken again.
pub fn idle(effort: Effort) -> Option<f64> {
    on_testkit::idle(effort.part_of(10_000))
}

/// Prints all tables.
pub fn print(effort: Effort, idle: Option<f64>) {
    println!("## TCP: a gigabyte\n");
    gigabyte(effort);
    println!("\n## TCP: thirty hosts write to one\n");
    fan_in(effort);
    println!("\n## TCP: a question after each answer\n");
    questions(effort);
    println!("\n## TCP: ten thousand connections\n");
    connections(effort, idle);
    println!("\n## TCP: closed forms\n");
    closed_forms(effort);
}

fn gigabyte(effort: Effort) {
    println!("A server writes 10⁹ octets on one connection over `{GIGABIT}`. turmoil's links have no rates.\n");
    println!("| | \\[s\\] | asked for | µs a full segment |");
    println!("| --- | ---: | ---: | ---: |");
    let octets = 1_000_000 * effort.part_of(1000);
    let work = |on_tokio| on_testkit::bulk(on_tokio, GIGABIT, octets as usize);
    let rows: [Row<'_, _>; 2] = [(OWN, "≤ 2", &|| work(false)), (TOKIO, "≤ 3", &|| work(true))];
    for ((subject, asked, _), time) in rows.iter().zip(times(effort, &rows)) {
        println!("| {subject} | {time:.2} | {asked} | {:.2} |", time * 1e6 * MSS / f64::from(octets));
    }
}

/// Hosts that write to one, and the delay of their links.
const WRITERS: (u32, Duration) = (30, Duration::from_millis(1));

/// Subjects of the hosts that write to one, with the figures that are asked for.
const FAN_IN: [(&str, &str); 3] = [(OWN, "≤ 2×"), (TOKIO, "≤ 2.5×"), (TURMOIL, "")];

/// Returns the number of octets that each host writes.
fn octets_of_writer(effort: Effort) -> usize {
    1000 * effort.part_of(500) as usize
}

/// Lets the hosts write to one, on the subject at a place of [`FAN_IN`].
fn fan_in_on(place: usize, octets: usize) {
    let (clients, delay) = WRITERS;
    match place {
        0 => on_testkit::fan_in(false, clients, delay, octets),
        1 => on_testkit::fan_in(true, clients, delay, octets),
        _ => on_turmoil::fan_in(clients, delay, octets),
    }
}

/// Variables by which the allocator of the GNU C library gives no memory back to the system.
const KEEPING: [(&str, &str); 2] = [("MALLOC_TRIM_THRESHOLD_", "1000000000"), ("MALLOC_MMAP_THRESHOLD_", "1000000000")];

/// Word for runs with kept memory.
const KEPT: &str = "kept";

/// Prints the processor time \[s\] of a run of the hosts that write to one: of the first run of the process, or the mean of 20 runs after three others, if
/// `memory` is the word [`KEPT`]. For a process that does nothing else.
pub fn fan_in_once(effort: Effort, place: usize, memory: &str) {
    let octets = octets_of_writer(effort);
    let (before, measured) = if memory == KEPT { (3, 20) } else { (0, 1) };
    (0..before).for_each(|_| fan_in_on(place, octets));
    println!("{}", seconds_of(|| (0..measured).for_each(|_| fan_in_on(place, octets))) / f64::from(measured));
}

/// Returns what [`fan_in_once`] prints in a process of its own \[s\].
fn time_alone(effort: Effort, place: usize, memory: &str) -> f64 {
    let mut command = Command::new(std::env::current_exe().expect("the program has a file"));
    command.args(["fan-in-once", &place.to_string(), memory]).args((effort.divisor > 1).then_some("--smoke"));
    if memory == KEPT {
        command.envs(KEEPING);
    }
    let output = command.output().expect("the program starts again");
    String::from_utf8_lossy(&output.stdout).trim().parse().expect("the program prints a number")
}

/// Prints the table of the hosts that write to one.
pub fn fan_in(effort: Effort) {
    let octets = octets_of_writer(effort);
    println!("{} hosts each write {octets} octets, 65,536 a call, on a connection of their own to one server, over links of 1 ms.", WRITERS.0);
    println!("turmoil carries each call as one message, without segments, acknowledgements and windows. Each run has a process of its own.");
    println!("With *fresh* memory the run is the first of its process, as a test is: the system maps and clears the memory that the run takes.");
    println!("With *kept* memory three runs came before and the allocator gave nothing back, so that the work alone counts; of 20 runs, the mean.");
    println!("A ratio above the figure that is asked for misses it: a real TCP costs more than messages, and kept memory hides none of it.\n");
    println!("| | fresh \\[ms\\] | against turmoil | kept \\[ms\\] | against turmoil | asked for |");
    println!("| --- | ---: | ---: | ---: | ---: | ---: |");
    let runs: Vec<(usize, &str)> = (0..FAN_IN.len()).flat_map(|place| [(place, "fresh"), (place, KEPT)]).collect();
    let times: Vec<f64> = rounds(effort, &runs, |(place, memory)| time_alone(effort, place, memory))
        .into_iter()
        .map(|times| median(times.into_iter().map(|(_, time)| time).collect()))
        .collect();
    for ((subject, asked), times_of) in FAN_IN.iter().zip(times.chunks(2)) {
        let [fresh, kept] = [0, 1].map(|memory| times_of[memory] / times[times.len() - 2 + memory]);
        println!("| {subject} | {:.1} | {fresh:.2}× | {:.1} | {kept:.2}× | {asked} |", times_of[0] * 1e3, times_of[1] * 1e3);
    }
}

fn questions(effort: Effort) {
    println!(
        "A client asks {SIZE} octets over links of {} ms, a server answers with as many, and the client asks again on the same connection.",
        DELAY.as_millis()
    );
    println!(
        "[turmoil-net](https://docs.rs/turmoil-net) {} (MIT) repeats a segment after a number of ticks without an answer, here 1000.\n",
        version("turmoil-net")
    );
    println!("| | simulated s per s | asked for | against turmoil |");
    println!("| --- | ---: | ---: | ---: |");
    let count = effort.part_of(2000);
    // The handshake is a round trip more.
    let simulated = (DELAY * 2 * (count + 1)).as_secs_f64();
    let rows: [Row<'_, _>; 4] = [
        (OWN, "≥ 20000", &|| on_testkit::questions(false, count)),
        (TOKIO, "≥ 5000", &|| on_testkit::questions(true, count)),
        (TURMOIL, "", &|| on_turmoil::questions(count)),
        (TURMOIL_NET, "", &|| on_turmoil_net::questions(count)),
    ];
    let speeds: Vec<f64> = times(effort, &rows).into_iter().map(|time| simulated / time).collect();
    for ((subject, asked, _), speed) in rows.iter().zip(&speeds) {
        println!("| {subject} | {speed:.0} | {asked} | {:.1}× |", speed / speeds[2]);
    }
}

fn connections(effort: Effort, idle: Option<f64>) {
    println!(
        "10,000 clients on one host each open a connection over links of {} ms, 10 µs after the one before, and ask five times.\n",
        DELAY.as_millis()
    );
    println!("| | \\[s\\] | asked for |");
    println!("| --- | ---: | ---: |");
    let count = effort.part_of(10_000);
    let rows: [Row<'_, _>; 3] = [
        (OWN, "≤ 1", &|| on_testkit::connections(false, count, 5)),
        (TOKIO, "≤ 1", &|| on_testkit::connections(true, count, 5)),
        (TURMOIL, "", &|| on_turmoil::connections(count, 5)),
    ];
    for ((subject, asked, _), time) in rows.iter().zip(times(effort, &rows)) {
        println!("| {subject} | {time:.2} | {asked} |");
    }
    if let Some(idle) = idle {
        println!("\nFor each end of a connection that is open and idle the resident memory of the process grows by {idle:.0} bytes; asked for");
        println!("are {ASKED_IDLE} at most.");
    }
}

fn closed_forms(effort: Effort) {
    println!(
        "The test kit compared with closed forms. With R the round trip, MSS = {MSS} octets and *n* how many packets there are for one that is lost:\n"
    );
    println!("- slow start: the last of N octets comes at R·(1 + ⌈log₂(N/(10·MSS) + 1)⌉);");
    println!("- Reno, where every *n*-th packet is lost: MSS/R·√(3·*n*/2) (Mathis, Semke, Mahdavi & Ott, 1997);");
    println!("- CUBIC there: MSS/R·(0.4·3.7/1.2)^¼·(R·*n*)^¾ (RFC 9438, section 5.2).\n");
    println!("Both of the latter are means of a sawtooth, measured over the last 60 % of the octets.");
    println!("The form of slow start knows no window of the receiver, so its rows have one of 6 MiB from the beginning.\n");
    println!("| | closed form | seen | seen / closed form |");
    println!("| --- | ---: | ---: | ---: |");
    let wide = TcpConfig { receive_buffer: Some(6 << 20), ..TcpConfig::default() };
    for (octets, config, buffers) in
        [(100_000, &wide, ""), (1_000_000, &wide, ""), (1_000_000, &TcpConfig::default(), ", with a window that grows as Linux's does")]
    {
        let expected = 0.2 * (1.0 + (f64::from(octets) / (10.0 * MSS) + 1.0).log2().ceil());
        let seen = on_testkit::transfer(config.clone(), "delay 100ms", octets as usize)[1].as_secs_f64();
        println!("| slow start, {} kB, R = 200 ms{buffers} | {expected:.3} s | {seen:.9} s | {:.4} |", octets / 1000, seen / expected);
    }
    let reno = |every: f64, round_trip: f64| MSS * 8.0 / round_trip * (1.5 * every).sqrt();
    let cubic = |every: f64, round_trip: f64| MSS * 8.0 / round_trip * (0.4f64 * 3.7 / 1.2).powf(0.25) * (round_trip * every).powf(0.75);
    let laws = [
        ("Reno", CongestionControl::Reno, 400, 50, reno(400.0, 0.1)),
        ("Reno", CongestionControl::Reno, 1600, 10, reno(1600.0, 0.02)),
        ("CUBIC", CongestionControl::Cubic, 1000, 100, cubic(1000.0, 0.2)),
        ("CUBIC", CongestionControl::Cubic, 4000, 100, cubic(4000.0, 0.2)),
        ("CUBIC", CongestionControl::Cubic, 16_000, 100, cubic(16_000.0, 0.2)),
    ];
    for (name, congestion, every, delay, expected) in laws {
        let config = TcpConfig { congestion, ..TcpConfig::default() };
        let octets = effort.part_of(every * 60_000);
        let [middle, end] = on_testkit::sawtooth(config, &format!("delay {delay}ms"), u64::from(every), octets as usize);
        let seen = f64::from(octets) * 0.6 * 8.0 / (end - middle).as_secs_f64();
        println!("| {name}, n = {every}, R = {} ms | {:.2} Mbit/s | {:.2} Mbit/s | {:.2} |", 2 * delay, expected / 1e6, seen / 1e6, seen / expected);
    }
    println!(
        "\nLinux 6.18 takes 1.64 s for the 1000 kB, over two TUN devices that delay each packet by 100 ms. With the window that grows, the test kit needs a round"
    );
    println!(
        "trip more, because a flight arrives at one instant, and the program reads only afterwards: the segments that it has not read take memory of the"
    );
    println!(
        "receive buffer, and the acknowledgements offer what is left. In Linux the flight is spread over milliseconds, and the program reads meanwhile.\n"
    );
    println!(
        "CUBIC is above its form where windows are small, and so is Linux: 1.22 to 1.25 for *n* = 1000 over the same TUN devices with the same losses. The form is"
    );
    println!(
        "the limit of large windows. Windows are whole segments, the law of Linux rounds the distance of the curve from its plateau down, and it aims a round trip"
    );
    println!("ahead. A model of that law by round trips gives 1.18, 1.07 and 1.03 for the three *n*.");
}
