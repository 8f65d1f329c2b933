//! The tick of a peer, as runs and analyses compute it, beside the tick written by hand for each kind of numbers.
#![allow(missing_docs, reason = "criterion's macros make public functions")]
#![allow(clippy::cast_precision_loss, reason = "places and lanes are small")]

use std::hint::black_box;
use std::time::Duration;

use cohaptic_benches::by_hand::{self, Eight, Numbers, Tick};
use cohaptic_benches::kernel;
use cohaptic_peer::coordination::{AveragePosition, BuiltIn, LawParameters, LawValues};
use cohaptic_peer::{Coordination, Gains, Integrator, Plant};
use criterion::{BatchSize, Criterion, Throughput, criterion_group, criterion_main};

/// The ticks of one measurement.
const TICKS: u32 = 1000;

/// The paper's peer.
fn tick() -> Tick<f64> {
    let step = |mass, damping| Plant { mass, damping, stiffness: 0.0 }.step(Duration::from_millis(1), Integrator::Exact);
    Tick {
        coupling: Gains { stiffness: 2000.0, damping: 20.0 },
        coordination: Gains { stiffness: 1000.0, damping: 10.0 },
        device: step(0.1, 5.0),
        object: step(0.1, 0.0),
        hand: 0.5,
    }
}

/// A coefficient in eight lanes, a little apart.
fn spread(number: f64) -> Eight {
    Eight(std::array::from_fn(|lane| number * (1.0 + lane as f64 / 64.0)))
}

/// A number to begin with.
fn start(place: usize, column: usize) -> f64 {
    1e-3 * (1.0 + place as f64 + column as f64 / 8.0)
}

/// A way of computing ticks, with its name.
type Way<'a, N> = (&'a str, &'a dyn Fn(&mut Numbers<N>));

fn group<N: Clone>(criterion: &mut Criterion, name: &str, numbers: &Numbers<N>, ways: &[Way<'_, N>]) {
    let mut group = criterion.benchmark_group(format!("kernel/{name}"));
    group.throughput(Throughput::Elements(u64::from(TICKS)));
    for (name, way) in ways {
        group.bench_function(*name, |bencher| bencher.iter_batched_ref(|| numbers.clone(), |numbers| way(numbers), BatchSize::SmallInput));
    }
    group.finish();
}

fn kernels(criterion: &mut Criterion) {
    let tick = tick();
    let law = AveragePosition { gains: tick.coordination };
    let registered = Coordination::AveragePosition.law(&LawParameters {
        gains: tick.coordination,
        peers: 3,
        tick: Duration::from_millis(1),
        oldest: None,
        middle: None,
        own: LawValues::default(),
    });
    let registered = registered.expect("average-position is a law");
    group(
        criterion,
        "one peer",
        &std::array::from_fn(|place| start(place, 0)),
        &[
            ("by hand", &|numbers| by_hand::one(black_box(&tick), numbers, TICKS)),
            ("law", &|numbers| kernel::one(black_box(&tick), black_box(&law), numbers, TICKS)),
            ("law of the registry", &|numbers| kernel::one(black_box(&tick), black_box(&registered), numbers, TICKS)),
        ],
    );
    let eight = Tick {
        coupling: tick.coupling.map(|gain| spread(*gain)),
        coordination: tick.coordination.map(|gain| spread(*gain)),
        device: tick.device.map(|coefficient| spread(*coefficient)),
        object: tick.object.map(|coefficient| spread(*coefficient)),
        hand: spread(tick.hand),
    };
    let of_lanes: BuiltIn<Eight> = registered.map(|coefficient| spread(*coefficient));
    group(
        criterion,
        "eight lanes",
        &std::array::from_fn(|place| Eight(std::array::from_fn(|lane| start(place, lane)))),
        &[
            ("by hand", &|numbers| by_hand::eight(black_box(&eight), numbers, TICKS)),
            ("law of the registry", &|numbers| {
                let law = black_box(&of_lanes);
                kernel::eight(black_box(&eight), |lane| law.map(|coefficient| coefficient.0[lane]), numbers, TICKS);
            }),
        ],
    );
    columns::<4>(criterion, &tick);
    columns::<5>(criterion, &tick);
    columns::<6>(criterion, &tick);
    columns::<8>(criterion, &tick);
}

fn columns<const C: usize>(criterion: &mut Criterion, tick: &Tick<f64>) {
    let law = AveragePosition { gains: tick.coordination };
    group(
        criterion,
        &format!("{C} columns"),
        &std::array::from_fn(|place| std::array::from_fn::<f64, C, _>(|column| start(place, column))),
        &[
            ("by hand", &|numbers| by_hand::columns(black_box(tick), numbers, TICKS)),
            ("law", &|numbers| kernel::columns(black_box(tick), black_box(&law), numbers, TICKS)),
        ],
    );
}

criterion_group!(benches, kernels);
criterion_main!(benches);
