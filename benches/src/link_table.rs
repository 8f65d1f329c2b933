//! Writes `docs/measured-link.md`: `cargo run --profile dist -p cohaptic-benches --bin link-table > docs/measured-link.md`. Takes about a minute; `--quick` less.
#![allow(clippy::print_stdout, reason = "printing the page is what this program is for")]
#![allow(clippy::cast_precision_loss, reason = "counts of packets")]

mod queues;

use std::time::Duration;

use cohaptic_benches::effort::Effort;
use cohaptic_benches::machine::medians_in_turn;
use cohaptic_benches::one_link::{constant, drive, heap, hold, jitter_and_loss, ring, stages, str0m, str0m_configs};

/// How much is measured.
#[derive(Clone, Copy)]
struct Work {
    rounds: usize,
    packets: u64,
}

/// Something that is measured, and what it is called.
type Subject = (&'static str, Box<dyn Fn() -> u64>);

fn main() -> Result<(), String> {
    let effort = Effort::parse(std::env::args().skip(1))?;
    let work = Work { rounds: effort.of(9, 3, 1), packets: effort.of(1_000_000, 1_000_000, 20_000) };
    let Work { rounds, packets } = work;
    let what = "Packets per second of processor time through one link, on one core.";
    println!("{}", effort.head("One link: speed", what, "link-table", "docs/measured-link.md"));
    println!(
        "A steady stream of 64-byte packets 1 µs apart over 10 ms, so that 10⁴ are in flight; each is offered, and polled when it comes out. The median of"
    );
    println!("{rounds} rounds of {packets} packets, in each of which all rows of a table are run one after the other.\n");
    beside_others(work);
    stage_by_stage(work);
    println!("\n{}", queues::section().trim_end());
    Ok(())
}

fn beside_others(work: Work) {
    let packets = work.packets;
    let [plain, jittery, full] = str0m_configs();
    let (_, all) = stages().pop().expect("there are stages");
    let subjects: Vec<Subject> = vec![
        ("cohaptic", Box::new(move || drive(&constant(), packets, |_| ()))),
        ("str0m-netem 0.4", Box::new(move || str0m(plain, packets))),
        ("a bare ring", Box::new(move || ring(packets, |_| ()))),
        ("cohaptic", Box::new(move || drive(&jitter_and_loss(), packets, |_| ()))),
        ("str0m-netem 0.4 (uniform jitter)", Box::new(move || str0m(jittery, packets))),
        ("a bare binary heap, same draws", Box::new(move || heap(packets, |_| ()))),
        ("cohaptic", Box::new(move || drive(&all, packets, |_| ()))),
        ("str0m-netem 0.4 (jitter, loss, duplication, reordering, rate)", Box::new(move || str0m(full, packets))),
        ("a bare binary heap: taking one of 10⁴ events, pushing it again", Box::new(move || hold(packets))),
    ];
    let (names, works): (Vec<_>, Vec<_>) = subjects.into_iter().unzip();
    let times = medians_in_turn(&works, work.rounds);
    let links = ["constant delay", "normal jitter, 1 % loss", "all stages but slots (below)"];
    let asked = [50, 10, 3];
    println!("| link | what | million packets/s | asked for |\n| --- | --- | ---: | ---: |");
    for (place, (name, time)) in names.iter().zip(times).enumerate() {
        let asked = if place % 3 == 0 { asked[place / 3].to_string() } else { String::new() };
        println!("| {} | {name} | {:.1} | {asked} |", links[place / 3], millions(time, packets));
    }
}

fn stage_by_stage(work: Work) {
    let packets = work.packets;
    println!("\n## What each stage costs\n");
    println!(
        "A constant delay and one stage beside it. A stage that is not configured is not there: the first row is a link with none, next to a ring that is"
    );
    println!("written by hand.\n");
    let mut subjects: Vec<Subject> = vec![("a bare ring", Box::new(move || ring(packets, |_| ())))];
    for (name, config) in stages() {
        subjects.push((name, Box::new(move || drive(&config, packets, |_| ()))));
    }
    let (names, works): (Vec<_>, Vec<_>) = subjects.into_iter().unzip();
    let times = medians_in_turn(&works, work.rounds);
    println!("| stage | ns a packet | million packets/s |\n| --- | ---: | ---: |");
    for (name, time) in names.iter().zip(times) {
        println!("| {name} | {:.1} | {:.1} |", time.as_secs_f64() * 1e9 / packets as f64, millions(time, packets));
    }
    println!("\nThe same as criterion benches: `cargo bench -p cohaptic-benches --bench link`.");
}

fn millions(time: Duration, packets: u64) -> f64 {
    packets as f64 / time.as_secs_f64() / 1e6
}
