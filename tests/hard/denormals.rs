//! States and forces so small that doubles lose digits: below 2⁻¹⁰²² they are multiples of η = 2⁻¹⁰⁷⁴, down to which a number fades and is gone.

use std::time::Duration;

use cohaptic_harness::Model;
use cohaptic_peer::{Contact, Gains};
use cohaptic_tests::{Body, Draft, Log, Tick, run};

use crate::hard::gain::{Gain, PerTick};

const TICK: Duration = Duration::from_millis(1);
/// η, the smallest double above zero.
const SMALLEST: f64 = f64::from_bits(1);

/// Three peers that grasp over 2 ms, without hands: linear. Everything is damped, and space has an origin nowhere. Scaled by 2 to a power.
fn scaled(power: i32) -> Draft {
    let mut draft = Draft { duration: 4000, link: "delay = \"2ms\"".to_owned(), damping: 0.5, ..Draft::calm(3) };
    draft.gains = Gains { stiffness: 100.0, damping: 2.0 };
    // Numbers with few digits, so that they are doubles at every scale, and sum to zero.
    for (peer, (x, v)) in draft.peers.iter_mut().zip([(0.75, -0.5), (-0.5, 0.25), (-0.25, 0.25)]) {
        peer.contact = Contact::Grasp;
        peer.coupling = Gains { stiffness: 800.0, damping: 2.0 };
        (peer.position, peer.velocity) = (Some([libm::ldexp(x, power), 0.0, 0.0]), Some([libm::ldexp(v, power), 0.0, 0.0]));
    }
    draft
}

/// The numbers of a tick.
fn numbers(tick: &Tick) -> [f64; 8] {
    let Tick { object, device, target, coupling_force, coordination_force, .. } = tick;
    let body = |body: &Body| (body.position[0], body.velocity[0]);
    let ((x, v), (x_h, v_h), (x_d, v_d)) = (body(object), body(device), body(target));
    [x, v, x_h, v_h, x_d, v_d, coupling_force[0], coordination_force[0]]
}

/// Doubles of every size have the same digits, so a linear scene scaled by a power of two is that scene scaled, to the bit, as long as nothing underflows. At
/// 2⁻⁸⁰⁰ nothing does: positions and velocities above 2⁻²⁸ of that are multiples of 2⁻⁸⁸⁰, so are their differences where they are not zero; the products of these
/// with gains are multiples of 2⁻⁹³², so are the forces; and the products of those with coefficients, which are above 2⁻²⁰, are above 2⁻⁹⁵².
#[test]
fn a_scene_scaled_by_two_to_the_minus_800_is_the_same_to_the_bit() {
    let (one, small) = (run(&scaled(0).scene(), Model::Least), run(&scaled(-800).scene(), Model::Least));
    assert_eq!(one.ticks.len(), 12_000);
    for (one, small) in one.ticks.iter().zip(&small.ticks) {
        assert_eq!(numbers(one).map(|number| libm::ldexp(number, -800).to_bits()), numbers(small).map(f64::to_bits), "at {}", one.at);
    }
}

/// How far a run below the smallest normal numbers may be from one that is scaled up: Σ|Aʲ|·d ([`Gain`]) with d in η. A product rounds to ½η and a sum of
/// multiples of η not at all, so
///
/// - a position: two products of a free body's step, 1 η; the relative roundings of the run that is scaled up, u·2⁻¹⁰³⁰ = 2⁻⁹ η each, are below 1 η in all: 2 η;
/// - a force FC: two products with KC and BC, 1 η; FT: two products, 1 η, and KT and BT times the mean, which a halving rounds to ½η: (KT + BT)/2 η;
/// - a velocity: two products, 1 η, and g1 times the forces on it: g1 below 10⁻² for both bodies; and 1 η as above.
fn bound(gain: &Gain, draft: &Draft) -> Vec<f64> {
    let (copy, device): (f64, f64) = (1e-3 / (draft.mass / 3.0), 1e-3 / 0.1);
    let forces = 2.0 + (draft.gains.stiffness + draft.gains.damping) / 2.0;
    let per_tick = PerTick {
        device_position: 2.0 * SMALLEST,
        device_velocity: (2.0 + device).ceil() * SMALLEST,
        copy_position: 2.0 * SMALLEST,
        copy_velocity: (2.0 + copy * forces).ceil() * SMALLEST,
    };
    gain.of_errors(&[per_tick; 3])
}

/// Positions relative to the first copy's, at each tick.
fn relative(log: &Log) -> Vec<[f64; 3]> {
    log.ticks.chunks_exact(3).map(|ticks| [0, 1, 2].map(|peer| ticks[peer].object.position[0] - ticks[0].object.position[0])).collect()
}

#[test]
fn below_the_smallest_normal_numbers_a_scene_is_itself_within_the_gain_of_the_last_digit() {
    // 2⁻¹⁰³⁰·¾ = 6.5e-311: subnormal from the first tick on, with forces as large as 1e-308.
    let (small, large) = (scaled(-1030), scaled(-30));
    let gain = Gain::of(&small.scene(), TICK);
    let bounds = bound(&gain, &small);
    let (small, large) = (run(&small.scene(), Model::Least), run(&large.scene(), Model::Least));
    let mut seen = false;
    for (tick, (small, large)) in relative(&small).into_iter().zip(relative(&large)).enumerate() {
        for ((small, large), bound) in small.into_iter().zip(large).zip(&bounds) {
            let expected = libm::ldexp(large, -1000);
            // The expected number is a multiple of η too, to ½ of it.
            assert!((small - expected).abs() <= bound + SMALLEST, "tick {tick}: {small:e} for {expected:e}, more than {bound:e} away");
            seen |= small.abs() > 1000.0 * bound;
        }
    }
    assert!(seen, "the bound, {bounds:?}, is below what moves");
}

/// What fades ends at the last digits and neither stalls above them nor turns back: after 120 s ‖Aⁿ‖ times the beginning is below η, so what is left is what the
/// last digits make, Σ|Aʲ|·d. (It need not be zero: a velocity of 9 η loses 5 % of itself a tick, which rounds to nothing.)
#[test]
fn what_fades_ends_at_the_last_digits() {
    let mut draft = scaled(-1030);
    draft.duration = 120_000;
    let gain = Gain::of(&draft.scene(), TICK);
    let bounds = bound(&gain, &draft);
    assert!(gain.left_after(60_000) * libm::ldexp(1.0, -1000) * gain.time().max(1.0) < libm::ldexp(1.0, -1072), "{:e}", gain.left_after(60_000));
    let log = run(&draft.scene(), Model::Least);
    let positions = relative(&log);
    for (tick, positions) in positions.iter().enumerate().skip(60_000) {
        for (position, bound) in positions.iter().zip(&bounds) {
            assert!(position.abs() <= bound + SMALLEST, "tick {tick}: {position:e}, more than {bound:e}");
        }
    }
    assert!(log.ticks.iter().all(|tick| numbers(tick).iter().all(|number| number.is_finite())));
}
