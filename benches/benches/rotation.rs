//! The tick of a copy that turns, as peers compute it, beside the same arithmetic by hand:
//! `cargo bench -p cohaptic-benches --bench rotation`.
#![allow(missing_docs, reason = "criterion's macros make public functions")]

use std::hint::black_box;

use cohaptic_benches::turning::{by_hand, example, program};
use criterion::{Criterion, Throughput, criterion_group, criterion_main};

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

criterion_group!(benches, rotation);
criterion_main!(benches);
