//! Writes `docs/measured-cluster.md` on request, with a release build: see the head of that page. Takes minutes on a machine that does nothing else.

use std::fmt::Write as _;
use std::fs;
use std::path::Path;
use std::process::{Child, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

use crate::dask::Dask;
use crate::parallel;
use crate::slurm::Cluster;
use crate::work::{SHARDS, Work, has};

const HEAD: &str = "# Shards: how fast

What do shards cost, and how fast are they merged? How they are done: [cluster.md](cluster.md). This page is written by

    cargo build --profile dist && COHAPTIC_PROGRAM=target/dist/cohaptic cargo test --workspace --test cluster -- --ignored

";

/// Number of measurements of each way. The ways are measured in turn.
const ROUNDS: usize = 3;

/// Number of runs in the campaign.
const RUNS: f64 = 4096.0;

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

fn seconds(work: impl FnOnce()) -> f64 {
    let begun = Instant::now();
    work();
    begun.elapsed().as_secs_f64()
}

fn succeeds(mut command: Command) {
    let output = command.output().unwrap();
    assert!(output.status.success(), "{command:?}: {}", String::from_utf8_lossy(&output.stderr));
}

fn begin(mut command: Command) -> Child {
    command.stdout(Stdio::null()).stderr(Stdio::null()).spawn().unwrap()
}

/// Measures the same runs in one process and in shards, in each way that this machine offers.
fn ways(page: &mut String) {
    let work = Work::new();
    let dask = Dask::start(&work);
    // Daemons of Slurm need a folder of their own as much as Dask does; the work is the same.
    let other = Work::new();
    let slurm = Cluster::start(&other);
    let by_processes = || {
        let shards = [1, 2].map(|index| begin(work.cohaptic(&format!("--out losses --shard {index}/2"))));
        shards.into_iter().for_each(|mut shard| assert!(shard.wait().unwrap().success()));
        succeeds(work.cohaptic("--merge losses"));
    };
    let by_parallel = || {
        succeeds(parallel::command(&work, "losses"));
        succeeds(work.cohaptic("--merge losses"));
    };
    let by_slurm = |cluster: &Cluster<'_>| {
        let shards = cluster.submit(&[&format!("--array=1-{SHARDS}"), "array.sh"]);
        let merge = cluster.submit(&[&format!("--dependency=afterok:{shards}"), "merge.sh"]);
        assert_eq!(cluster.end_of(&merge), ["COMPLETED"]);
    };
    type Way<'a> = (&'static str, &'static str, &'a Path, Box<dyn Fn() + 'a>);
    let (here, there) = (work.path(""), other.path(""));
    let mut all: Vec<Way<'_>> = vec![
        ("one process", "1 thread", &here, Box::new(|| succeeds(work.cohaptic("--out losses")))),
        ("one process", "2 threads", &here, Box::new(|| succeeds(work.on_two_threads("--out losses")))),
        ("2 shards as processes, and the merge", "2 processes of 1 thread", &here, Box::new(by_processes)),
    ];
    let mut skipped = Vec::new();
    match has("parallel") {
        true => all.push(("4 shards by GNU parallel, and the merge", "2 at a time", &here, Box::new(by_parallel))),
        false => skipped.push("GNU parallel"),
    }
    match &dask {
        Some(dask) => all.push(("4 shards by Dask, and the merge", "2 workers of 1 thread", &here, Box::new(|| succeeds(dask.command("losses"))))),
        None => skipped.push("Dask"),
    }
    match &slurm {
        Ok(cluster) => {
            all.push(("4 shards by a Slurm array, and a dependent merge", "2 nodes of 1 core", &there, Box::new(move || by_slurm(cluster))))
        }
        Err(_) => skipped.push("Slurm"),
    }
    let mut times = vec![Vec::new(); all.len()];
    let mut table = None;
    for _ in 0..ROUNDS {
        for ((_, _, folder, way), times) in all.iter().zip(&mut times) {
            times.push(seconds(way));
            let bytes = fs::read(folder.join("losses/runs.parquet")).unwrap();
            assert!(*table.get_or_insert_with(|| bytes.clone()) == bytes, "other bytes");
            fs::remove_dir_all(folder.join("losses")).unwrap();
        }
    }
    page.push_str(
        "## The same runs in each way\n\n4096 runs of two users, 2 s each, in 64 parts. Wall time from the command to the table, the median of ",
    );
    let _ = writeln!(
        page,
        "{ROUNDS} rounds in which all alternate. All tables are the same to the byte.\n\n| way | at the same time | \\[s\\] | runs a second |"
    );
    page.push_str("| --- | --- | ---: | ---: |\n");
    for ((name, at_once, ..), times) in all.iter().zip(times) {
        let time = median(times);
        let _ = writeln!(page, "| {name} | {at_once} | {time:.2} | {:.0} |", RUNS / time);
    }
    if !skipped.is_empty() {
        let _ = writeln!(page, "\nNot installed here, and skipped: {}.", skipped.join(", "));
    }
}

/// Measures the cost of a shard of one run, beyond the cost of the run.
fn one_run(page: &mut String) {
    const SHARDS: usize = 40;
    let work = Work::new();
    let words = "campaign scene.toml --runs 40 --part 1 --threads 1 --no-plot";
    let shard = |index: usize| {
        let mut command = work.command("cohaptic");
        command.args(words.split(' ')).args(["--out", "one", "--shard", &format!("{index}/{SHARDS}")]);
        seconds(|| succeeds(command))
    };
    let run = || {
        let mut command = work.command("cohaptic");
        let output = command.args(["run", "scene.toml", "--no-plot", "--json", "--threads", "1"]).output().unwrap();
        let document: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
        document["wall_s"].as_f64().unwrap()
    };
    let (shards, runs) = (1..=SHARDS).map(|index| (shard(index), run())).unzip::<_, _, Vec<f64>, Vec<f64>>();
    let (shard, run) = (1000.0 * median(shards), 1000.0 * median(runs));
    page.push_str("\n## A shard of one run\n\nWall time of a process that does a shard of one run, from its start to its end, and of the run in it; medians of 40. The first shard also checks\nthe campaign. Asked for: at most 30 ms beside the run.\n\n");
    let _ = writeln!(
        page,
        "| shard \\[ms\\] | run \\[ms\\] | beside it \\[ms\\] |\n| ---: | ---: | ---: |\n| {shard:.1} | {run:.2} | {:.1} |",
        shard - run
    );
}

/// Waits for the end of a process. Returns the most memory that it has held \[MB\].
fn peak_memory(mut child: Child) -> f64 {
    let mut peak = 0.0;
    while child.try_wait().unwrap().is_none() {
        let status = fs::read_to_string(format!("/proc/{}/status", child.id())).unwrap_or_default();
        let found = status.lines().find_map(|line| line.strip_prefix("VmHWM:")?.trim().strip_suffix(" kB")?.parse::<f64>().ok());
        peak = found.map_or(peak, |kilobytes| kilobytes * 1.024e-3);
        sleep(Duration::from_millis(1));
    }
    assert!(child.wait().unwrap().success());
    peak
}

/// Merges of many shards.
fn merges(page: &mut String) {
    let work = Work::new();
    page.push_str("\n## The merge\n\nShards of 10,000 runs with all measures, a combination each, put together from parts to the table on the disk, and summed up. Asked for: 100 MB/s, in memory that does not grow\nwith the number of shards.\n\n| shards | runs | table \\[MB\\] | \\[s\\] | \\[MB/s\\] | most memory \\[MB\\] |\n| ---: | ---: | ---: | ---: | ---: | ---: |\n");
    let most = std::env::var("COHAPTIC_SHARDS").ok().and_then(|most| most.parse().ok()).unwrap_or(1000_u64);
    for shards in [10, 100, 1000].into_iter().filter(|shards| *shards <= most) {
        let words = format!(
            "campaign scene.toml --set scene.duration=100ms --measure all --vary coordination.stiffness=1..2/{shards} --runs 10000 --part 10000 --no-plot"
        );
        let command = |options: &str| {
            let mut command = work.command("cohaptic");
            command.args(words.split(' ')).args(options.split(' '));
            command
        };
        let out = format!("{shards}");
        succeeds(command(&format!("--out {out} --shard 1/1")));
        let mut memory = 0.0;
        let time = seconds(|| memory = peak_memory(begin(command(&format!("--merge {out}")))));
        #[expect(clippy::cast_precision_loss, reason = "far below 2^52")]
        let table = fs::metadata(work.path(&out).join("runs.parquet")).unwrap().len() as f64 * 1e-6;
        fs::remove_dir_all(work.path(&out)).unwrap();
        let _ = writeln!(page, "| {shards} | {} | {table:.0} | {time:.2} | {:.0} | {memory:.0} |", 10_000 * shards, table / time);
    }
    page.push_str("\nA Parquet file ends with an index of its parts, 60 kB each in memory with 53 columns. It is put aside on the disk instead.\n");
}

/// The machine and the build.
fn where_and_when() -> String {
    let said = |program: &str, words: &[&str]| {
        let output = Command::new(program).args(words).output().ok().filter(|output| output.status.success());
        output.map(|output| String::from_utf8_lossy(&output.stdout).trim().to_owned()).unwrap_or_default()
    };
    let processor = fs::read_to_string("/proc/cpuinfo").unwrap_or_default();
    let processor = processor.lines().find_map(|line| line.strip_prefix("model name")).unwrap_or_default();
    let cores = std::thread::available_parallelism().map_or(1, std::num::NonZero::get);
    let is_debug = cfg!(debug_assertions) && std::env::var_os("COHAPTIC_PROGRAM").is_none();
    let build = if is_debug { ", a debug build" } else { "" };
    let note = std::env::var("COHAPTIC_BUILD").map(|note| format!(", {note}")).unwrap_or_default();
    format!("and measured on {}, {}, {cores} cores{build}{note}.\n\n", said("date", &["-u", "+%F"]), processor.trim_start_matches([' ', '\t', ':']))
}

#[test]
#[ignore = "minutes: writes docs/measured-cluster.md"]
fn the_page_of_measured_shards() {
    let mut page = HEAD.to_owned() + &where_and_when();
    ways(&mut page);
    one_run(&mut page);
    merges(&mut page);
    fs::write(Path::new(env!("CARGO_MANIFEST_DIR")).join("../../docs/measured-cluster.md"), page).unwrap();
}
