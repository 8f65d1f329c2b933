//! Writes `docs/measured-speed.md`: `cargo run --profile dist -p cohaptic-benches --bin speed-table > docs/measured-speed.md`. Takes some minutes; `--quick` less.
#![allow(clippy::print_stdout, reason = "printing the page is what this program is for")]
#![allow(clippy::cast_precision_loss, reason = "seconds and rounds are small")]

use std::hint::black_box;
use std::time::Duration;

use cohaptic_benches::bare::Queue;
use cohaptic_benches::effort::Effort;
use cohaptic_benches::large::{self, Large, heavy_mesh};
use cohaptic_benches::machine::{medians_in_turn, own_memory, peak_memory, time};
use cohaptic_benches::records;
use cohaptic_benches::scaling::{THREADS, Window};
use cohaptic_benches::watched::{Onlooker, Plotter, checked, with_all_measures, with_expectations};
use cohaptic_benches::{LINKS, Mesh, bare};
use cohaptic_harness::measures::Measures;
use cohaptic_harness::{Ending, Model, NoObserver, Simulation, run_side_by_side};
use cohaptic_peer::coordination::BuiltInStrategy;
use cohaptic_peer::{Coordination, Gains};
use cohaptic_scene::{FromScene, Scene, Strategies};

/// What the project asks of itself in each cell of [`Mesh::ALL`]: times real time, and the largest ratio of the bare loop's speed to the program's.
const ASKED: [(f64, f64); 6] = [(12_000.0, 2.5), (8_000.0, 2.5), (5_000.0, 1.25), (2_500.0, 1.25), (120.0, 2.5), (50.0, 2.5)];
/// How many runs go side by side.
const SIDE_BY_SIDE: u64 = 8;

/// How much is measured.
#[derive(Clone, Copy)]
struct Work {
    rounds: usize,
    /// A run of `most / N² + least` simulated seconds, which takes about as long for all N.
    most: u64,
    least: u64,
    /// What each of many runs simulates \[s\].
    seconds_a_run: u64,
    /// What the runs simulate after which memory is looked at \[s\].
    memory: &'static [(&'static str, u64)],
}

impl Work {
    const fn of(effort: Effort) -> Self {
        const HOUR: u64 = 3_600;
        match effort {
            Effort::Full => {
                Self { rounds: 9, most: 20_000, least: 20, seconds_a_run: 10, memory: &[("a minute", 60), ("an hour", HOUR), ("a day", 24 * HOUR)] }
            }
            Effort::Quick => Self { rounds: 3, most: 5_000, least: 5, seconds_a_run: 10, memory: &[("a minute", 60), ("an hour", HOUR)] },
            Effort::Smoke => Self { rounds: 1, most: 0, least: 1, seconds_a_run: 1, memory: &[("a second", 1), ("a minute", 60)] },
        }
    }

    /// About half a second of work, if it is the whole.
    const fn seconds(self, mesh: Mesh) -> u64 {
        self.most / (mesh.peers * mesh.peers) as u64 + self.least
    }
}

fn main() -> Result<(), String> {
    if let Some(run) = large::run_as_asked() {
        println!("{}", run?);
        return Ok(());
    }
    let effort = Effort::parse(std::env::args().skip(1))?;
    let work = Work::of(effort);
    let what = "Simulated seconds per second of processor time, on one core.";
    println!("{}", effort.head("Speed", what, "speed-table", "docs/measured-speed.md"));
    // The most memory is that of all before.
    let memory = memory(work);
    one_run(work);
    queues(work);
    many_runs(work);
    threads(work)?;
    many_peers(work)?;
    watched_runs(work);
    measured_runs(work);
    recorded_runs(work);
    strategies(work);
    print_memory(&memory);
    Ok(())
}

fn one_run(work: Work) {
    println!("## A full mesh\n");
    println!(
        "N peers at 1 kHz, each grasping the object through a device, one of them pushed by a constant hand; 125 samples of 64 bytes a second to each"
    );
    println!(
        "other peer; nothing recorded but counters. The *bare loop* (`benches/src/bare.rs`) does the same arithmetic on the same random numbers in"
    );
    println!(
        "arrays, written by hand for this one scene: no bytes on the wire, one axis, one strategy, no order of events but its own. Each figure is the"
    );
    println!("median of {} rounds in which all of them alternate.\n", work.rounds);
    println!("| peers | links | cohaptic | asked for | bare loop | ratio | asked for |");
    println!("| ---: | --- | ---: | ---: | ---: | ---: | ---: |");
    let scenes = Mesh::ALL.map(|mesh| mesh.scene(work.seconds(mesh) * 1000, 1));
    let mut works: Vec<Box<dyn Fn() + '_>> = Vec::new();
    for (mesh, scene) in Mesh::ALL.into_iter().zip(&scenes) {
        works.push(Box::new(|| drop(black_box(Mesh::run(scene)))));
        works.push(Box::new(move || drop(black_box(bare::run(mesh, work.seconds(mesh) * 1000)))));
    }
    let times = medians_in_turn(&works, work.rounds);
    for ((mesh, times), (asked, asked_ratio)) in Mesh::ALL.into_iter().zip(times.chunks(2)).zip(ASKED) {
        let speed = |time: Duration| work.seconds(mesh) as f64 / time.as_secs_f64();
        let (program, bare) = (speed(times[0]), speed(times[1]));
        let (peers, links) = (mesh.peers, mesh.links());
        println!("| {peers} | {links} | {program:.0}× | {asked:.0}× | {bare:.0}× | {:.2} | {asked_ratio} |", bare / program);
    }
    println!("\nThe loop is the straightforward one, and not the least there can be: where the ratio is below 1, the program keeps a sample once");
    println!(
        "for all peers that get it, and does for several peers at once what the loop does one by one. A leaner loop, without counters, and other simulators on"
    );
    println!("these scenes, all in one run: [measured-peers.md](measured-peers.md).");
    println!("The same cells as criterion benches: `cargo bench -p cohaptic-benches --bench mesh`.\n");
}

/// How many times as long a packet may take over such links as over those with jitter and loss.
const ASKED_OF_LINKS: [(&str, f64); 9] = [
    ("rate and queue", 1.6),
    ("full line", 1.6),
    ("chains", 1.2),
    ("CoDel", 4.0),
    ("full line, CoDel", 4.0),
    ("starlink", 1.3),
    ("lte-driving", 1.3),
    ("wifi-busy", 1.3),
    ("dsl", 1.3),
];

/// Links that have queues or memory, beside links without, in the program and, as far as they have one, in the bare loop.
fn queues(work: Work) {
    println!("## Queues and chains\n");
    println!(
        "The mesh above with jitter and loss, and over links that have a line besides, with a queue of packets that are dropped from its tail (*rate and queue*: 10 Mbit/s, 100 packets) or by CoDel, or"
    );
    println!(
        "gamma jitter with a correlation of 0.5 and Gilbert-Elliott loss (*chains*). No sample waits for 10 Mbit/s, which the program knows beforehand; a *full line* has 60 kbit/s for 64, and a queue of 8 packets, or of 100 with CoDel."
    );
    println!(
        "The last rows are [links of the library](how-to-named-link.md), down: a modulator of delays and losses in bursts (*starlink*), of the rate (*lte-driving*), correlated lognormal delays (*wifi-busy*), and a gamma law that is nearly always at its floor (*dsl*)."
    );
    println!(
        "Figures are processor time a packet offered, and its multiple of jitter and loss. The bare loop is the one above, with Lindley's recursion over departures for the queue. The median of {} rounds in which all alternate.\n",
        work.rounds
    );
    println!("| peers | links | a packet \\[ns\\] | of jitter and loss | asked for | bare loop \\[ns\\] | ratio |");
    println!("| ---: | --- | ---: | ---: | ---: | ---: | ---: |");
    for peers in [10, 50, 200] {
        let square = (peers * peers) as u64;
        let (mesh, ticks) = (Mesh { peers, impaired: true }, work.most * 20 / square / 8 * 8 + 400);
        let packets = (ticks / 8 * (square - peers as u64)) as f64;
        let keys = |name: &str| LINKS.iter().find(|(other, _)| *other == name).map_or("", |(_, keys)| keys);
        let rows = [("jitter and loss", 1.0)].into_iter().chain(ASKED_OF_LINKS);
        let scenes: Vec<Scene> = rows.clone().map(|(name, _)| mesh.scene_over(keys(name), ticks, 1)).collect();
        let mut works: Vec<Box<dyn Fn() + '_>> = Vec::new();
        works.extend(scenes.iter().map(|scene| Box::new(move || drop(black_box(Mesh::run(scene)))) as Box<dyn Fn()>));
        for queue in [None, Some(Queue::NEVER_FULL), Some(Queue::FULL)] {
            works.push(Box::new(move || drop(black_box(bare::run_through(queue, mesh, ticks)))));
        }
        let nanos: Vec<f64> = medians_in_turn(&works, work.rounds).iter().map(|time| 1e9 * time.as_secs_f64() / packets).collect();
        for (place, (name, asked)) in rows.enumerate() {
            let bare = nanos[scenes.len()..].get(place).map_or_else(|| "|".to_owned(), |bare| format!("{bare:.0} | {:.2}", nanos[place] / bare));
            println!("| {peers} | {name} | {:.0} | {:.2} | {asked} | {bare} |", nanos[place], nanos[place] / nanos[0]);
        }
    }
    println!();
}

/// Runs one after the other, and the same runs side by side.
fn many_runs(work: Work) {
    let seconds_a_run = work.seconds_a_run;
    println!("## Many runs of one scene\n");
    println!(
        "Runs of {seconds_a_run} simulated seconds of the mesh above that differ in their seed, as [a campaign](campaign.md) does them: {SIDE_BY_SIDE} side by side on one core, a number of"
    );
    println!(
        "each in one register, compared with the same runs one at a time. The results are compared first, and are the same to the bit. Runs a second of"
    );
    println!("processor time, the median of {} rounds in which all of them alternate.\n", work.rounds);
    println!("| peers | links | one at a time | {SIDE_BY_SIDE} side by side | gain |");
    println!("| ---: | --- | ---: | ---: | ---: |");
    let all = Mesh::ALL.map(|mesh| -> Vec<Scene> { (1..=SIDE_BY_SIDE).map(|seed| mesh.scene(seconds_a_run * 1000, seed)).collect() });
    let repetitions = |mesh: Mesh| (work.seconds(mesh) / (SIDE_BY_SIDE * seconds_a_run)).max(1);
    let mut works: Vec<Box<dyn Fn() + '_>> = Vec::new();
    for (mesh, scenes) in Mesh::ALL.into_iter().zip(&all) {
        let alone: Vec<_> = scenes.iter().map(Mesh::run).collect();
        assert!(run_side_by_side(scenes) == alone, "runs of {mesh:?} side by side are not what they are alone");
        works.push(Box::new(move || {
            for scene in (0..repetitions(mesh)).flat_map(|_| scenes) {
                black_box(Mesh::run(scene));
            }
        }));
        works.push(Box::new(move || (0..repetitions(mesh)).for_each(|_| drop(black_box(run_side_by_side(scenes))))));
    }
    let times = medians_in_turn(&works, work.rounds);
    for (mesh, times) in Mesh::ALL.into_iter().zip(times.chunks(2)) {
        let speed = |time: Duration| (repetitions(mesh) * SIDE_BY_SIDE) as f64 / time.as_secs_f64();
        let (alone, together) = (speed(times[0]), speed(times[1]));
        println!("| {} | {} | {alone:.1} | {together:.1} | {:.2}× |", mesh.peers, mesh.links(), together / alone);
    }
    println!();
}

/// How many times as long a run may take of which positions are plotted or checked as one that nobody watches.
const ASKED_OF_WATCHED: f64 = 1.3;

/// Runs of which only ticks are looked at.
fn watched_runs(work: Work) {
    println!("## Watched runs\n");
    println!(
        "The mesh above, of which nobody sees anything, positions are plotted as in a terminal, a discrepancy, a position and a time of travel are checked, or an observer sees each row of each tick and\nkeeps nothing. The median of {} rounds in which all of them alternate.\n",
        work.rounds
    );
    println!("| peers | links | unwatched | plotted | times as long | checked | times as long | asked for | each row | times as long |");
    println!("| ---: | --- | ---: | ---: | ---: | ---: | ---: | ---: | ---: | ---: |");
    let seconds = |mesh: Mesh| (work.seconds(mesh) / 4).max(1);
    let scenes = Mesh::ALL.map(|mesh| with_expectations(mesh.scene(seconds(mesh) * 1000, 1)));
    let mut works: Vec<Box<dyn Fn() + '_>> = Vec::new();
    for scene in &scenes {
        works.push(Box::new(|| drop(black_box(Mesh::run(scene)))));
        works.push(Box::new(|| drop(black_box(Simulation::new(scene, Model::Least).run(&mut Plotter::new(scene))))));
        works.push(Box::new(|| checked(scene)));
        works.push(Box::new(|| drop(black_box(Simulation::new(scene, Model::Least).run(&mut { Onlooker::OF_TICKS })))));
    }
    let times = medians_in_turn(&works, work.rounds);
    for (mesh, times) in Mesh::ALL.into_iter().zip(times.chunks(4)) {
        let [unwatched, plotted, checked, seen] = [0, 1, 2, 3].map(|run: usize| seconds(mesh) as f64 / times[run].as_secs_f64());
        let (peers, links) = (mesh.peers, mesh.links());
        println!(
            "| {peers} | {links} | {unwatched:.0}× | {plotted:.0}× | {:.2} | {checked:.0}× | {:.2} | {ASKED_OF_WATCHED} | {seen:.0}× | {:.2} |",
            unwatched / plotted,
            unwatched / checked,
            unwatched / seen
        );
    }
    println!();
}

/// How many times as long a run may take with all measures as one that is watched.
const ASKED_OF_MEASURES: f64 = 2.0;

/// One scene on two threads, and on as many as this machine has not.
fn threads(work: Work) -> Result<(), String> {
    println!("## One scene on many threads\n");
    println!(
        "The mesh with jitter and loss, and copies of 0.15 kg, on one thread and on two, by the wall clock, the least of {} rounds, or of five with 1000 peers. Beyond two by a model (`benches/src/scaling.rs`): work",
        work.rounds
    );
    println!(
        "of a window of 8 ms, without the first, shared out by registers of eight peers; a meeting, which grows with the threads; and samples that each thread takes of all."
    );
    println!(
        "A thread has eight peers at least, so that gains beyond N/8 threads are left out. Where no time of a meeting is left of that on two threads, gains beyond two are bounds. *Binds* is what most of the time goes to with most threads.\n"
    );
    let titles: Vec<String> = THREADS[1..].iter().map(|threads| if *threads == 2 { "2, measured".to_owned() } else { threads.to_string() }).collect();
    println!("| peers | window \\[µs\\] | traffic \\[kB\\] | meeting \\[µs\\] | {} | binds |", titles.join(" | "));
    println!("| ---: | ---: | ---: | ---: |{} --- |", " ---: |".repeat(titles.len()));
    for peers in [50, 200, 1000] {
        let mesh = Mesh { peers, impaired: true };
        // So long that threads that begin, and counters that are gathered, are no large part of it; 1000 peers take some 0.05 s a window.
        let windows = u32::try_from((work.most * 250 / (peers * peers) as u64).clamp(work.least.max(4), 2000)).unwrap_or(u32::MAX);
        let rounds = if peers < 1000 { work.rounds } else { work.rounds.min(5) };
        let window = Window::measure(|windows| heavy_mesh(mesh, u64::from(windows) * 8, []), windows, rounds)?;
        let pays = |threads: usize| threads == 2 || threads * 8 <= peers;
        let gain_of = |threads: usize| {
            let bound = if threads > 2 && window.meeting().is_zero() { "≤ " } else { "" };
            format!("{bound}{:.2}×", window.gain(threads).0)
        };
        let gains: Vec<String> = THREADS[1..].iter().map(|threads| if pays(*threads) { gain_of(*threads) } else { String::new() }).collect();
        let (work_of, meeting) = (1e6 * window.work().as_secs_f64(), 1e6 * window.meeting().as_secs_f64());
        let binds = THREADS.iter().rfind(|threads| pays(**threads)).map_or("", |most| window.gain(*most).1);
        println!("| {peers} | {work_of:.1} | {:.1} | {meeting:.2} | {} | {binds} |", window.traffic() as f64 / 1e3, gains.join(" | "));
    }
    println!();
    Ok(())
}

/// Scenes of many peers.
fn many_peers(work: Work) -> Result<(), String> {
    println!("## Many peers\n");
    println!(
        "The mesh above and a ring, of many peers with copies of 0.15 kg. Reading the scene, running it, and what came out of it: simulated time by the wall clock, and the most memory that the\nprocess held. The medians of {} runs, each in a process of its own.\n",
        work.rounds.min(3)
    );
    println!("| peers | hear | links | threads | simulated | times real time | asked for | memory \\[MB\\] | asked for |");
    println!("| ---: | --- | --- | ---: | ---: | ---: | ---: | ---: | ---: |");
    for (row, run) in large::rows(work.rounds.min(3), work.most == 0)? {
        let Large { peers, neighbours, impaired, threads, millis, asked, asked_memory } = row;
        let hear = neighbours.map_or_else(|| "all others".to_owned(), |neighbours| format!("{neighbours} on a ring"));
        let [asked, asked_memory] = [asked, asked_memory].map(|asked| asked.map_or_else(String::new, |asked| asked.to_string()));
        let (links, seconds, memory) = (Mesh { peers, impaired }.links(), millis as f64 / 1e3, run.memory as f64 / 1e6);
        println!("| {peers} | {hear} | {links} | {threads} | {seconds} s | {:.2}× | {asked} | {memory:.0} | {asked_memory} |", run.times_real_time);
    }
    println!();
    Ok(())
}

/// Runs with all measures beside runs that are watched.
fn measured_runs(work: Work) {
    println!("## Measures\n");
    println!(
        "The mesh above, watched by an observer that takes every tick and every sample held and keeps nothing, and with all [measures](scenes.md#measure), which take more rows than"
    );
    println!("ticks: steps, samples held, samples sent. The median of {} rounds in which all of them alternate.\n", work.rounds);
    println!("| peers | links | watched | all measures | ratio | asked for |");
    println!("| ---: | --- | ---: | ---: | ---: | ---: |");
    let seconds = |mesh: Mesh| (work.seconds(mesh) / 8).max(1);
    let scenes = Mesh::ALL.map(|mesh| with_all_measures(mesh.scene(seconds(mesh) * 1000, 1)));
    let mut works: Vec<Box<dyn Fn() + '_>> = Vec::new();
    for scene in &scenes {
        works.push(Box::new(|| drop(black_box(Simulation::new(scene, Model::Least).run(&mut { Onlooker::OF_EVENTS })))));
        works.push(Box::new(|| drop(black_box(Measures::run(scene, Model::Least)))));
    }
    let times = medians_in_turn(&works, work.rounds);
    for (mesh, times) in Mesh::ALL.into_iter().zip(times.chunks(2)) {
        let speed = |time: Duration| seconds(mesh) as f64 / time.as_secs_f64();
        let (watched, measured) = (speed(times[0]), speed(times[1]));
        println!("| {} | {} | {watched:.0}× | {measured:.0}× | {:.2} | {ASKED_OF_MEASURES} |", mesh.peers, mesh.links(), watched / measured);
    }
    println!();
}

/// How many bytes of records, and of rows of links, leave in a second \[MB\].
const ASKED_OF_RECORDS: (f64, f64) = (200.0, 300.0);

/// Runs that are recorded as CSV, beside runs of which the same rows are seen, and rows of links.
fn recorded_runs(work: Work) {
    println!("## Records\n");
    println!(
        "Bytes of CSV a second of processor time. *Records*: the mesh above with `--out`, files, synchronisation and pictures included, less a run whose ticks and packets are seen"
    );
    println!("and not kept. *Links*: rows of `--links`, handed on in memory. The median of {} rounds in which all alternate.\n", work.rounds);
    println!("| peers | links | what | MB | MB/s | asked for |");
    println!("| ---: | --- | --- | ---: | ---: | ---: |");
    let folder = std::env::temp_dir().join(format!("cohaptic-speed-table-{}", std::process::id()));
    let seconds = |mesh: Mesh| (work.seconds(mesh) / 20).max(1);
    let scenes = Mesh::ALL.map(|mesh| mesh.scene(seconds(mesh) * 1000, 1));
    let bytes: Vec<u64> = scenes.iter().map(|scene| records::csv_bytes(&records::record(scene, &folder))).collect();
    let of_links = [200, 1000].map(|peers| Mesh { peers, impaired: true });
    let summaries = of_links.map(|mesh| Mesh::run(&mesh.scene(work.seconds(mesh).min(2) * 100, 1)));
    let mut works: Vec<Box<dyn Fn() + '_>> = Vec::new();
    for scene in &scenes {
        works.push(Box::new(|| records::read(scene)));
        works.push(Box::new(|| drop(records::record(scene, &folder))));
    }
    works.extend(summaries.iter().map(|summary| Box::new(|| _ = black_box(records::stream(summary))) as Box<dyn Fn()>));
    let times = medians_in_turn(&works, work.rounds);
    let row = |mesh: Mesh, what: &str, bytes: u64, time: Duration, asked: f64| {
        let mega = bytes as f64 / 1e6;
        println!("| {} | {} | {what} | {mega:.1} | {:.0} | {asked} |", mesh.peers, mesh.links(), mega / time.as_secs_f64());
    };
    let (of_records, of_rows) = ASKED_OF_RECORDS;
    for ((mesh, bytes), times) in Mesh::ALL.into_iter().zip(bytes).zip(times.chunks(2)) {
        row(mesh, "records", bytes, times[1].saturating_sub(times[0]), of_records);
    }
    for ((mesh, summary), time) in of_links.into_iter().zip(&summaries).zip(&times[2 * scenes.len()..]) {
        row(mesh, "rows of links", records::stream(summary), *time, of_rows);
    }
    let _ = std::fs::remove_dir_all(&folder);
    println!();
}

/// How many times as long a tick of a strategy may take as one of average-position.
const ASKED_OF_STRATEGIES: f64 = 1.5;

/// Every strategy of the registry over events, beside average-position.
fn strategies(work: Work) {
    println!("## Strategies\n");
    println!(
        "The mesh above over constant delays, with events and nothing recorded but counters, and with gains so low that all [strategies](model.md#strategies)"
    );
    println!(
        "are stable (KT and KC 5 N/m, BT 0.1 N·s/m, BC 0.5 N·s/m): each with its usual parameters, as a multiple of the time that average-position takes;"
    );
    println!(
        "{ASKED_OF_STRATEGIES} is asked for, and a dash is a mesh that diverges. The median of {} rounds in which all of them alternate.\n",
        work.rounds
    );
    println!("| peers | {} |", Coordination::ALL.iter().map(|strategy| strategy.name()).collect::<Vec<_>>().join(" | "));
    println!("| ---: |{}", " ---: |".repeat(Coordination::ALL.len()));
    for mesh in Mesh::ALL.into_iter().filter(|mesh| !mesh.impaired) {
        let seconds = (work.seconds(mesh) / 8).max(1);
        let scene = calm(mesh.scene(seconds * 1000, 1));
        let scenes: Vec<Scene> = Coordination::ALL.iter().map(|strategy| with_strategy(&scene, *strategy)).collect();
        let run = |scene| drop(black_box(Simulation::with_strategies(scene, Model::Least, OverEvents).run(&mut NoObserver)));
        let works: Vec<Box<dyn Fn() + '_>> = scenes.iter().map(|scene| Box::new(move || run(scene)) as Box<dyn Fn()>).collect();
        let times = medians_in_turn(&works, work.rounds);
        let ratio = |(scene, time): (&Scene, &Duration)| {
            let Ok(summary) = Simulation::new(scene, Model::Least).run(&mut NoObserver);
            let ratio = time.as_secs_f64() / times[0].as_secs_f64();
            if summary.ending == Ending::Complete { format!("{ratio:.2}") } else { "–".to_owned() }
        };
        let ratios: Vec<String> = scenes.iter().zip(&times).map(ratio).collect();
        println!("| {} | {} |", mesh.peers, ratios.join(" | "));
    }
    println!();
}

/// The scene with low gains. Forces over the network to a server, and those that grow with the number of peers, make stiffer ones diverge.
fn calm(mut scene: Scene) -> Scene {
    scene.coordination.gains = Gains { stiffness: 5.0, damping: 0.1 };
    for peer in &mut scene.peers {
        peer.coupling = Gains { stiffness: 5.0, damping: 0.5 };
    }
    scene
}

/// The scene with another strategy.
fn with_strategy(scene: &Scene, strategy: Coordination) -> Scene {
    let mut scene = scene.clone();
    scene.coordination.strategy = strategy;
    scene
}

/// The strategies of the registry, as if they were somebody's own: never run in arrays.
#[derive(Clone, Copy, Debug)]
struct OverEvents;

impl Strategies for OverEvents {
    type Strategy<const A: usize> = BuiltInStrategy<A>;

    fn strategy<const A: usize>(&self, scene: &Scene, peer: usize) -> BuiltInStrategy<A> {
        FromScene.strategy(scene, peer)
    }
}

/// Name, processor time, and the memory of its own and the most so far.
type MemoryRow = (&'static str, Duration, String, String);

fn memory(work: Work) -> Vec<MemoryRow> {
    let row = |&(name, seconds)| {
        let scene = Mesh { peers: 3, impaired: true }.scene(seconds * 1000, 1);
        let took = time(|| drop(black_box(Mesh::run(&scene))));
        (name, took, own_memory(), peak_memory())
    };
    work.memory.iter().map(row).collect()
}

fn print_memory(rows: &[MemoryRow]) {
    println!("## Memory\n");
    println!(
        "After runs of 3 peers with jitter and loss, one after the other in one process, before all else on this page: the memory that the process holds of its own,\nand the most that it has held, in which the parts of the program are that were used.\n"
    );
    println!("| simulated | took | own memory | most memory |");
    println!("| --- | ---: | ---: | ---: |");
    for (name, took, own, most) in rows {
        println!("| {name} | {:.3} s | {own} | {most} |", took.as_secs_f64());
    }
}
