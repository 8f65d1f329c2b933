//! Verdicts on the stability of scenes, by every way: `cargo bench -p cohaptic-benches --bench stability`.
#![allow(missing_docs, reason = "criterion's macros make undocumented functions")]

use cohaptic_accuracy::analysis::growth::growth;
use cohaptic_accuracy::analysis::references::references;
use cohaptic_benches::bare_pair::BarePair;
use cohaptic_benches::verdicts::{eight_different, equal, family};
use cohaptic_stability::{FamilyScratch, Grid, Map, Method, analyse};
use criterion::{BenchmarkId, Criterion, Throughput, criterion_group, criterion_main};

fn verdicts(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("stability/equal-peers");
    group.throughput(Throughput::Elements(1)).sample_size(20);
    let values = |number: &mut u32| {
        *number += 1;
        [f64::from(*number * 7 % 6000), f64::from(*number * 11 % 5900) + 100.0]
    };
    for peers in [3, 8, 1000] {
        let family = family(peers, &[]);
        let (mut number, mut scratch) = (0, FamilyScratch::default());
        group.bench_function(BenchmarkId::new("radius", peers), |bencher| bencher.iter(|| family.radius(&values(&mut number), &mut scratch).ok()));
        group.bench_function(BenchmarkId::new("bounded-radius", peers), |bencher| {
            bencher.iter(|| family.bounded_radius(&values(&mut number), &mut scratch).ok());
        });
    }
    let scene = equal(3, &[]);
    let (pair, gains, coupling) = (BarePair::new(&scene), scene.coordination.gains, scene.peers[0].coupling);
    group.bench_function("bare-pair", |bencher| bencher.iter(|| pair.radius(gains, coupling)));
    group.finish();
}

fn mean_square(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("stability/mean-square");
    group.throughput(Throughput::Elements(1)).sample_size(20);
    for peers in [2, 8, 1000] {
        let family = family(peers, &["link.loss=5%".into()]);
        let (mut number, mut scratch) = (0_u32, FamilyScratch::default());
        group.bench_function(BenchmarkId::new("radius", peers), |bencher| {
            bencher.iter(|| {
                number += 1;
                family.radius(&[f64::from(number * 7 % 6000), f64::from(number * 11 % 5900) + 100.0], &mut scratch).ok()
            });
        });
    }
    group.finish();
}

fn maps(criterion: &mut Criterion) {
    let family = family(3, &[]);
    let mut group = criterion.benchmark_group("stability/map");
    group.throughput(Throughput::Elements(10_000)).sample_size(10);
    let grid = Grid::new(100, 100).expect("a grid");
    group.bench_function("100x100", |bencher| bencher.iter(|| Map::fill(&family, grid, |_| {}, || false).expect("a map")));
    group.finish();
}

fn different_peers(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("stability/eight-different");
    group.sample_size(10);
    for (method, name) in [(Method::Full, "full"), (Method::Reduced, "reduced")] {
        for delay in [8, 48] {
            let scene = eight_different(delay);
            group.bench_function(BenchmarkId::new(name, format!("{delay}ms")), |bencher| {
                bencher.iter(|| analyse(&scene, method).expect("an analysis"))
            });
        }
    }
    group.finish();
}

fn ways(criterion: &mut Criterion) {
    let mut group = criterion.benchmark_group("stability/long-delays");
    group.sample_size(10);
    for frames in [10, 100, 1000] {
        let scene = equal(3, &[format!("link.delay={}ms", 8 * frames), "coordination.stiffness=20".into()]);
        let [apart, together] = BarePair::new(&scene).loops(frames, scene.coordination.gains, scene.peers[0].coupling);
        group.bench_function(BenchmarkId::new("determinant", frames), |bencher| {
            bencher.iter(|| apart.bounded_radius(0.0).or(together.bounded_radius(0.0)));
        });
        if frames <= 100 {
            group.bench_function(BenchmarkId::new("matrix", frames), |bencher| {
                bencher.iter(|| analyse(&scene, Method::Reduced).expect("an analysis"))
            });
        }
    }
    let anchor = &references()[0];
    group.bench_function("growth", |bencher| bencher.iter(|| growth(&anchor.scene)));
    group.finish();
}

criterion_group!(benches, verdicts, mean_square, maps, different_peers, ways);
criterion_main!(benches);
