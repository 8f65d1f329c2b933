//! Writes `docs/testkit-speed.md`: see there. Takes about a minute.

mod on_testkit;
mod on_turmoil;
mod program;

use std::hint::black_box;
use std::time::{Duration, Instant};

use cohaptic_benches_peers::{machine, median};
use on_testkit::Kind;
use program::{Errors, PERIOD};

fn main() {
    if let Some(what) = std::env::args().nth(1) {
        for _ in 0..20 { match &*what { "own" => {on_testkit::run(Kind::Own, 10, 2_000);} "own2" => {on_testkit::run(Kind::Own, 2, 20_000);} "tokio" => {on_testkit::run(Kind::Tokio, 2, 20_000);} _ => {let _ = on_turmoil::run(Duration::from_millis(1), 10, 2_000);} } }
        return;
    }
    for (hosts, count) in [(2, 20_000), (10, 2_000)] {
        for kind in [Kind::Own, Kind::Tokio, Kind::TokioTimers] {
            let t = Instant::now();
            let e = on_testkit::run(kind, hosts, count);
            println!("{hosts} {kind:?} {:.0} {e:?}", (PERIOD * count).as_secs_f64() / t.elapsed().as_secs_f64());
        }
        for tick in [1000, 100] {
            let t = Instant::now();
            let e = on_turmoil::run(Duration::from_micros(tick), hosts, count);
            println!("{hosts} turmoil {tick} {:.0} {e:?}", (PERIOD * count).as_secs_f64() / t.elapsed().as_secs_f64());
        }
    }
    for kind in [Kind::Own, Kind::Tokio] {
        let v = median((0..9).map(|_| { let t = Instant::now(); black_box(on_testkit::pair(kind, 10_000)); t.elapsed().as_secs_f64() * 1e3 }).collect());
        println!("{kind:?} {v:.2} ms");
    }
    let _ = (machine(), Errors::default());
}
