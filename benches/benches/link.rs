//! Packets through one link, beside str0m-netem, a ring and a heap: `cargo bench -p cohaptic-benches --bench link`.
#![allow(missing_docs, reason = "criterion's macros make undocumented functions")]

use cohaptic_benches::one_link::{drive, heap, hold, ring, stages, str0m, str0m_configs};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};

const PACKETS: u64 = 100_000;

fn links(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("link");
    group.throughput(Throughput::Elements(PACKETS)).sample_size(20);
    for (name, config) in stages() {
        group.bench_function(name, |bencher| bencher.iter(|| drive(&config, PACKETS, |_| ())));
    }
    for (name, config) in ["str0m-netem: delay", "str0m-netem: jitter and loss", "str0m-netem: full"].into_iter().zip(str0m_configs()) {
        group.bench_function(name, |bencher| bencher.iter(|| str0m(config, PACKETS)));
    }
    group.bench_function("a bare ring", |bencher| bencher.iter(|| ring(PACKETS, |_| ())));
    group.bench_function("a bare heap", |bencher| bencher.iter(|| heap(PACKETS, |_| ())));
    group.bench_function("a bare heap, hold model", |bencher| bencher.iter(|| hold(PACKETS)));
    group.finish();
}

criterion_group!(benches, links);
criterion_main!(benches);
