//! The tick of a copy that turns, as peers compute it, beside the same arithmetic by hand, and runs of scenes that turn, with events and in arrays:
//! `cargo bench -p cohaptic-benches --bench rotation`.
#![allow(missing_docs, reason = "criterion's macros make public functions")]

use std::hint::black_box;
use std::time::Duration;

use cohaptic_benches::Mesh;
use cohaptic_benches::turning::{self, by_hand, example, program};
use cohaptic_benches::watched::WithEvents;
use cohaptic_harness::{Model, Simulation};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};

/// The ticks of one measurement.
const TICKS: u32 = 1000;

fn rotation(criterion: &mut Criterion) {
    let (copy, start) = example();
    let (step, tick) = (copy.step(), copy.by_hand());
    let mut group = criterion.benchmark_group("rotation");
    group.throughput(Throughput::Elements(u64::from(TICKS)));
    group.bench_function("cohaptic", |bencher| {
        bencher.iter(|| {
            let mut body = start;
            program(black_box(&step), black_box(&copy), &mut body, TICKS);
            body
        });
    });
    group.bench_function("by hand", |bencher| {
        bencher.iter(|| {
            let mut body = start;
            by_hand(black_box(&tick), black_box(&copy), &mut body, TICKS);
            body
        });
    });
    group.finish();
}

/// Runs of a mesh whose object turns.
fn runs(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("rotation");
    group.sample_size(10).warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(2));
    for mesh in Mesh::ALL {
        let seconds = 100 / (mesh.peers * mesh.peers) as u64 + 1;
        let size = format!("{}-{}", mesh.peers, if mesh.impaired { "jitter-and-loss" } else { "constant" });
        // Elements are simulated milliseconds, as in the bench of the mesh.
        group.throughput(Throughput::Elements(seconds * 1000));
        let scene = turning::mesh(mesh, seconds * 1000);
        group
            .bench_function(BenchmarkId::new("events", &size), |bencher| bencher.iter(|| Simulation::new(&scene, Model::Least).run(&mut WithEvents)));
        group.bench_function(BenchmarkId::new("arrays", &size), |bencher| bencher.iter(|| Mesh::run(&scene)));
    }
    group.finish();
}

criterion_group!(benches, rotation, runs);
criterion_main!(benches);
