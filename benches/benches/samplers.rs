//! Nanoseconds a draw: tables, exact inverses and the program's own draws. `docs/measured-samplers.md` sets them beside their errors.
#![allow(missing_docs, reason = "criterion's macros make public functions")]

use std::time::Duration;

use cohaptic_accuracy::network::ways::{Fine, Netem, draw, laws, next_word, unit};
use criterion::{BenchmarkId, Criterion, criterion_group, criterion_main};

fn samplers(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("samplers");
    group.sample_size(20).warm_up_time(Duration::from_millis(200)).measurement_time(Duration::from_secs(1));
    for (name, law) in laws() {
        let (netem, fine) = (Netem::new(&law), Fine::new(&law));
        let mut state = 1;
        group.bench_function(BenchmarkId::new("4096-steps", name), |bencher| bencher.iter(|| netem.draw(next_word(&mut state))));
        group.bench_function(BenchmarkId::new("65536-steps", name), |bencher| bencher.iter(|| fine.step(next_word(&mut state))));
        group.bench_function(BenchmarkId::new("65536-interpolated", name), |bencher| bencher.iter(|| fine.interpolated(next_word(&mut state))));
        group.bench_function(BenchmarkId::new("exact-inverse", name), |bencher| bencher.iter(|| law.quantile(unit(next_word(&mut state)))));
        group.bench_function(BenchmarkId::new("draw", name), |bencher| bencher.iter(|| draw(&law, &mut state)));
    }
    group.finish();
}

criterion_group!(benches, samplers);
criterion_main!(benches);
