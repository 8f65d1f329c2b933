//! Packets a second over links with queues and with memory, beside the links that need neither: `cargo bench -p cohaptic-benches --bench queues`.
#![allow(missing_docs, reason = "criterion's macros make public functions")]

use std::sync::Arc;
use std::time::Duration;

use cohaptic_benches::bare::{self, Queue};
use cohaptic_benches::{LINKS, Mesh};
use cohaptic_harness::{Model, NoObserver, Simulation};
use cohaptic_scene::{Scene, Topology};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};

fn scene(peers: usize, keys: &str, ticks: u64) -> Scene {
    Mesh { peers, impaired: true }.scene_over(keys, ticks, 1)
}

/// One run on one thread and on two.
fn threads(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("threads");
    group.sample_size(10).warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(4));
    for (peers, ticks) in [(50, 1000), (200, 400), (1000, 48)] {
        let scene = scene(peers, LINKS[1].1, ticks);
        group.throughput(Throughput::Elements(ticks / 8 * (peers * (peers - 1)) as u64));
        for threads in [1, 2] {
            group.bench_function(BenchmarkId::new(threads.to_string(), peers), |bencher| {
                bencher.iter(|| Simulation::new(&scene, Model::Least).on_threads(threads).run(&mut NoObserver));
            });
        }
    }
    group.finish();
}

fn queues(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("queues");
    group.sample_size(10).warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(2));
    for peers in [10, 50, 200] {
        let (mesh, ticks) = (Mesh { peers, impaired: true }, 400_000 / (peers * peers) as u64 / 8 * 8 + 400);
        // Elements are packets offered.
        group.throughput(Throughput::Elements(ticks.div_ceil(8) * (peers * (peers - 1)) as u64));
        for (name, keys) in LINKS {
            let scene = scene(peers, keys, ticks);
            group.bench_function(BenchmarkId::new(name, peers), |bencher| bencher.iter(|| Mesh::run(&scene)));
        }
        for (name, queue) in [("bare jitter and loss", None), ("bare rate and queue", Some(Queue::NEVER_FULL)), ("bare full line", Some(Queue::FULL))]
        {
            group.bench_function(BenchmarkId::new(name, peers), |bencher| bencher.iter(|| bare::run_through(queue, mesh, ticks)));
        }
    }
    group.finish();
}

/// Ten thousand peers on a ring of eight neighbours: a run of 200 ticks is at real time if it takes 200 ms.
fn rings(criterion: &mut Criterion) {
    const PEERS: usize = 10_000;
    const NEIGHBOURS: usize = 8;
    const TICKS: u64 = 200;
    let mut group = criterion.benchmark_group("rings");
    group.sample_size(10).warm_up_time(Duration::from_millis(500)).measurement_time(Duration::from_secs(4));
    group.throughput(Throughput::Elements(TICKS / 8 * (PEERS * NEIGHBOURS) as u64));
    for (name, keys) in &LINKS[..3] {
        let scene = Scene { topology: Topology::ring(PEERS, NEIGHBOURS).map(Arc::new), ..scene(PEERS, keys, TICKS) };
        group.bench_function(BenchmarkId::new(*name, PEERS), |bencher| bencher.iter(|| Mesh::run(&scene)));
    }
    group.finish();
}

criterion_group!(benches, queues, threads, rings);
criterion_main!(benches);
