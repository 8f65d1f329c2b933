//! Over an ideal network with a sample a tick, N copies that nobody touches are a linear system with known modes: the sum, which nothing moves, and
//! N − 1 differences, each an oscillator of one and the same stiffness (Rakhsha & Constantinescu 2015, equations 3 and 6).

use cohaptic_harness::Model;
use cohaptic_peer::Coordination;
use cohaptic_tests::{Draft, Log, drafts, run};
use cohaptic_tests_common::{cases, properties};
use proptest::collection::vec;
use proptest::prelude::*;
use proptest::sample::select;

properties! {
    #![proptest_config(cases(100))]

    /// At every tick the coordination forces sum to zero: Σᵢ (xᵢ − x̄ᵢ) = 0, where x̄ᵢ is the mean of the others.
    #[test]
    fn nobody_moves_the_centre_of_mass(draft in untouched()) {
        let log = run(&draft.scene(), Model::Least);
        let (n, mass) = (super::count(draft.peers.len()), copy_mass(&draft));
        let (x, v) = sizes(&log);
        let (stiffness, damping) = effective_gains(&draft);
        // One force: the differences, the mean and the products round, at most 12 times in terms of the size of 2·K·x and 2·B·v.
        let force = 24.0 * super::ROUNDING * (stiffness * x + damping * v);
        // One tick: N such forces over 1 ms, and N velocities rounded twice.
        let tick = n * (force * 1e-3 + mass * 2.0 * super::ROUNDING * v);
        let momentum = |rows: &[cohaptic_tests::Tick]| rows.iter().map(|row| mass * row.object.velocity[0]).sum::<f64>();
        let rows: Vec<_> = log.ticks.chunks_exact(draft.peers.len()).collect();
        let initial = momentum(rows[0]);
        for (ticks, row) in rows.iter().enumerate() {
            // The sum in this test rounds too.
            let tolerance = super::count(ticks) * tick + 2.0 * n * n * super::ROUNDING * mass * v;
            let error = (momentum(row) - initial).abs();
            prop_assert!(error <= tolerance, "{error:e} > {tolerance:e} kg·m/s at {}", row[0].at);
        }
    }

    /// The difference d of two copies obeys m·a = −K·d − B·w with the force held over each tick h, so that exactly
    ///
    /// ```text
    /// d⁺ = d + h·w + h²/2·a        w⁺ = w + h·a        a = −(K·d + B·w)/m
    /// ```
    ///
    /// with K = N/(N−1)·KT for AP (6) and N·KT for PD (3), and B likewise.
    #[test]
    fn difference_modes_have_the_stiffness_of_equations_3_and_6(draft in untouched()) {
        let log = run(&draft.scene(), Model::Least);
        let n = super::count(draft.peers.len());
        let factor = if draft.strategy == Coordination::AveragePosition { n / (n - 1.0) } else { n };
        let (stiffness, damping, mass) = (factor * draft.gains.stiffness, factor * draft.gains.damping, copy_mass(&draft));
        let (x, v) = sizes(&log);
        let (first, last) = (log.of(0), log.of(draft.peers.len() - 1));
        let difference = |tick: usize| {
            let (a, b) = (first[tick].object, last[tick].object);
            (a.position[0] - b.position[0], a.velocity[0] - b.velocity[0])
        };
        let (mut d, mut w) = difference(0);
        let h = 1e-3;
        for tick in 0..first.len() {
            let (actual, _) = difference(tick);
            // Each tick rounds positions (a few 1e-16·x) and velocities (which travel on for the time that a damped mode remembers, below 0.1 s): after
            // at most 300 ticks 300·4·1.1e-16 = 1.3e-13 of either, and the mode swings over by less than a factor of 4.
            let tolerance = 1e-12 * (x + 0.1 * v);
            prop_assert!((actual - d).abs() <= tolerance, "tick {tick}: {actual:e}, expected {d:e} ± {tolerance:e}");
            let a = -(stiffness * d + damping * w) / mass;
            (d, w) = (d + h * w + h * h / 2.0 * a, w + h * a);
        }
    }
}

/// Copies that begin anywhere, with any speed, among 2, 3, 5 or 8 peers.
fn untouched() -> BoxedStrategy<Draft> {
    let starts = |size: f64| vec(-size..size, 8);
    let gains = (50.0..1000.0, 6.0..20.0);
    (select(&[2_usize, 3, 5, 8][..]), select(drafts::PAPER), starts(0.05), starts(0.2), gains, any::<bool>())
        .prop_map(|(count, strategy, positions, velocities, (stiffness, damping), split_mass)| {
            let mut draft = Draft { strategy, split_mass, mass: 1.5, ..Draft::calm(count) };
            (draft.gains.stiffness, draft.gains.damping) = (stiffness, damping);
            for (peer, (position, velocity)) in draft.peers.iter_mut().zip(positions.into_iter().zip(velocities)) {
                (peer.position, peer.velocity) = (Some([position, 0.0, 0.0]), Some([velocity, 0.0, 0.0]));
            }
            draft
        })
        .boxed()
}

fn copy_mass(draft: &Draft) -> f64 {
    if draft.split_mass { draft.mass / super::count(draft.peers.len()) } else { draft.mass }
}

/// KT and BT towards the mean.
fn effective_gains(draft: &Draft) -> (f64, f64) {
    let factor = if draft.strategy == Coordination::AveragePosition { 1.0 } else { super::count(draft.peers.len() - 1) };
    (factor * draft.gains.stiffness, factor * draft.gains.damping)
}

/// The largest position and the largest velocity.
fn sizes(log: &Log) -> (f64, f64) {
    let largest = |value: &dyn Fn(&cohaptic_tests::Tick) -> f64| log.ticks.iter().map(|tick| value(tick).abs()).fold(0.0, f64::max);
    (largest(&|tick| tick.object.position[0]), largest(&|tick| tick.object.velocity[0]))
}
