//! Simulated seconds per second: the program beside the bare loop, on the same work, in the same run.
#![allow(missing_docs, reason = "criterion's macros make public functions")]

use std::path::PathBuf;
use std::time::Duration;

use cohaptic_benches::watched::{Onlooker, Plotter, with_all_measures};
use cohaptic_benches::{Mesh, bare};
use cohaptic_harness::measures::Measures;
use cohaptic_harness::record::Recorder;
use cohaptic_harness::{Model, Simulation};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};

fn mesh(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("mesh");
    group.sample_size(10).warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(2));
    for mesh in Mesh::ALL {
        let seconds = 200 / (mesh.peers * mesh.peers) as u64 + 1;
        let size = format!("{}-{}", mesh.peers, if mesh.impaired { "jitter-and-loss" } else { "constant" });
        // Elements are simulated milliseconds: "1 Melem/s" is 1000 times real time.
        group.throughput(Throughput::Elements(seconds * 1000));
        let scene = mesh.scene(seconds * 1000, 1);
        group.bench_function(BenchmarkId::new("cohaptic", &size), |bencher| bencher.iter(|| Mesh::run(&scene)));
        let watched = || Simulation::new(&scene, Model::Least).run(&mut { Onlooker::OF_TICKS });
        group.bench_function(BenchmarkId::new("watched", &size), |bencher| bencher.iter(watched));
        let plotted = || Simulation::new(&scene, Model::Least).run(&mut Plotter::new(&scene));
        group.bench_function(BenchmarkId::new("plotted", &size), |bencher| bencher.iter(plotted));
        let measured = with_all_measures(scene.clone());
        group.bench_function(BenchmarkId::new("measures", &size), |bencher| bencher.iter(|| Measures::run(&measured, Model::Least)));
        group.bench_function(BenchmarkId::new("bare-loop", &size), |bencher| bencher.iter(|| bare::run(mesh, seconds * 1000)));
    }
    group.finish();
}

/// Bytes of `trajectory.csv` and `packets.csv` a second, the run among what takes time.
fn records(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("records");
    group.sample_size(10).warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(2));
    let scene = Mesh { peers: 10, impaired: true }.scene(2000, 1);
    let folder = tempfile::tempdir().expect("there is a folder for files of a while");
    let record = || {
        let mut recorder = Recorder::create(folder.path(), &scene).expect("the folder can be written");
        let summary = Simulation::new(&scene, Model::Least).run(&mut recorder).expect("rows can be written");
        recorder.finish(&summary).expect("files can be written")
    };
    let length = |file: &PathBuf| file.metadata().map_or(0, |about| about.len());
    let bytes = record().iter().filter(|file| file.ends_with("trajectory.csv") || file.ends_with("packets.csv")).map(length).sum();
    group.throughput(Throughput::Bytes(bytes));
    group.bench_function("csv", |bencher| bencher.iter(record));
    group.finish();
}

criterion_group!(benches, mesh, records);
criterion_main!(benches);
