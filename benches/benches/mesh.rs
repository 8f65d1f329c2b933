//! Simulated seconds per second: the program beside the bare loop, on the same work, in the same run.
#![allow(missing_docs, reason = "criterion's macros make public functions")]

use std::time::Duration;

use cohaptic_benches::watched::{Onlooker, with_all_measures};
use cohaptic_benches::{Mesh, bare};
use cohaptic_harness::measures::Measures;
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
        group.bench_function(BenchmarkId::new("watched", &size), |bencher| bencher.iter(|| Simulation::new(&scene, Model::Least).run(&mut Onlooker)));
        let measured = with_all_measures(scene.clone());
        group.bench_function(BenchmarkId::new("measures", &size), |bencher| bencher.iter(|| Measures::run(&measured, Model::Least)));
        group.bench_function(BenchmarkId::new("bare-loop", &size), |bencher| bencher.iter(|| bare::run(mesh, seconds * 1000)));
    }
    group.finish();
}

criterion_group!(benches, mesh);
criterion_main!(benches);
