//! An hour at 1 kHz and a day at coarse ticks: bodies are where their closed forms say, within what rounding can add up to.
//!
//! The bounds are *running*: each tick adds what its own roundings can do at the present position x, velocity v and held force f, and carries on what was wrong
//! before. Nothing is assumed about signs, so they are what the worst case adds up to. With h the tick, m the mass, b the damping and the step map
//!
//! ```text
//! x⁺ = x + (e01·v + g0·f)        v⁺ = v + (e11·v + g1·f)
//! ```
//!
//! the last addition rounds to u·|x⁺| and u·|v⁺|, and the products and their sum to at most 2u·(|e01·v| + |g0·f|) and 2u·(|e11·v| + |g1·f|). The references are
//! computed with 31 digits, at whole numbers of ticks. By day an hour is a quarter of one.

use cohaptic_harness::{Model, Simulation, TickRow};
use cohaptic_tests::{Draft, DraftHand};
use cohaptic_tests_common::quarter_by_day;
use qd::Quad;

use crate::hard::ROUNDING;
use crate::hard::watch::OnTick;

/// Ticks of an hour at 1 kHz, and by day of a quarter of an hour.
fn hour() -> u64 {
    quarter_by_day(3_600_000)
}

/// The time of tick `k` of `tick` µs, exactly \[s\].
fn seconds(k: u64, tick: u64) -> Quad {
    Quad::from((k * tick) as f64) / Quad::from(1e6)
}

/// How far a number is from what it should be.
fn distance(actual: f64, expected: Quad) -> f64 {
    (Quad::from(actual) - expected).0.abs()
}

/// Two peers for a number of ticks, each of a number of µs, with a sample every 1000 of them.
fn alone(tick: u64, ticks: u64) -> Draft {
    let mut draft = Draft { duration: tick * ticks / 1000, update: 1000 * tick, ..Draft::calm(2) };
    for peer in &mut draft.peers {
        peer.tick = tick;
    }
    draft
}

/// Copies that move as one: x = x₀ + v·t.
///
/// The copies are the same to the bit, and with one other peer the mean is that peer: no force ever acts, and the velocity is never touched. h is rounded once,
/// its product with v and the sum once each: a tick adds u·(|x⁺| + 2·h·|v|).
fn copies_move_on(tick: u64, ticks: u64) {
    let mut draft = alone(tick, ticks);
    let (start, speed, h) = (0.125, -0.1, tick as f64 * 1e-6);
    (draft.position[0], draft.velocity[0], draft.update) = (start, speed, tick);
    let (mut k, mut bound) = (0, 0.0);
    let Ok(_) = Simulation::new(&draft.scene(), Model::Least).run(&mut OnTick(|row: &TickRow<'_>| {
        let (x, v) = (row.object.position[0], row.object.velocity[0]);
        assert_eq!((v, row.coordination_force[0]), (speed, 0.0));
        bound += if k > 0 && row.peer == 0 { ROUNDING * (x.abs() + 2.0 * h * speed.abs()) } else { 0.0 };
        let expected = Quad::from(start) + Quad::from(speed) * seconds(k, tick);
        assert!(distance(x, expected) <= bound, "tick {k}: {x} is not within {bound:e} of {:e}", expected.0);
        k += row.peer as u64;
    }));
    assert_eq!(k, ticks);
    // After 360 m or 8.6 km the worst case is below a micrometre.
    assert!(bound < 1e-6, "{bound:e}");
}

#[test]
fn copies_that_move_as_one_move_uniformly_for_an_hour_at_a_kilohertz() {
    copies_move_on(1000, hour());
}

#[test]
fn copies_that_move_as_one_move_uniformly_for_a_day_at_coarse_ticks() {
    copies_move_on(100_000, 864_000);
    copies_move_on(1_000_000, 86_400);
}

/// A device that touches nothing, without damping, under a constant force: x = x₀ + v₀·t + f·t²/2m, v = v₀ + f·t/m.
///
/// g1 = h/m has 2 roundings, e01 = h one; g0 = h·(h/m)/2 has 4, and 2 more for each of the 5 halvings that a norm h/m of 10 takes at a tick of 1 s. Their
/// products with v and f have one each, and their sum one. So a tick adds u·(|v⁺| + 3·g1·|f|) to the error of the velocity, and h times that error and
/// u·(|x⁺| + 3·h·|v| + 16·g0·|f|) to that of the position.
fn a_device_is_pushed(tick: u64, ticks: u64) {
    let mut draft = alone(tick, ticks);
    let (x0, v0, f, m, h) = (-3.0, 0.3, -2e-4, 0.1, tick as f64 * 1e-6);
    let peer = &mut draft.peers[0];
    (peer.device.damping, peer.device.mass, peer.hand) = (0.0, m, DraftHand::Force([f, 0.0, 0.0]));
    (peer.position, peer.velocity) = (Some([x0, 0.0, 0.0]), Some([v0, 0.0, 0.0]));
    (draft.gains.stiffness, draft.gains.damping) = (0.0, 0.0);
    let (mut k, mut wrong_x, mut wrong_v, mut before) = (0, 0.0, 0.0, v0);
    let acceleration = Quad::from(f) / Quad::from(m);
    let Ok(_) = Simulation::new(&draft.scene(), Model::Least).run(&mut OnTick(|row: &TickRow<'_>| {
        if row.peer != 0 {
            return;
        }
        let (x, v) = (row.device.position[0], row.device.velocity[0]);
        if k > 0 {
            wrong_x += h * wrong_v + ROUNDING * (x.abs() + 3.0 * h * before.abs() + 8.0 * h * h / m * f.abs());
            wrong_v += ROUNDING * (v.abs() + 3.0 * h / m * f.abs());
        }
        before = v;
        let t = seconds(k, tick);
        let expected = Quad::from(x0) + Quad::from(v0) * t + acceleration * t * t / Quad::from(2.0);
        assert!(distance(x, expected) <= wrong_x, "tick {k}: {x} is not within {wrong_x:e} of {:e}", expected.0);
        let expected = Quad::from(v0) + acceleration * t;
        assert!(distance(v, expected) <= wrong_v, "tick {k}: {v} is not within {wrong_v:e} of {:e}", expected.0);
        k += 1;
    }));
    assert_eq!(k, ticks);
    // f·t²/2m is 13 km after an hour, 7500 km after a day: 3·10⁻⁹ of that is the worst case.
    let travelled = 0.5 * (f / m).abs() * (ticks as f64 * h).powi(2);
    assert!(wrong_x < 3e-9 * travelled, "{wrong_x:e} m of {travelled:e} m");
}

#[test]
fn a_device_under_a_constant_force_follows_the_parabola_for_an_hour_at_a_kilohertz() {
    a_device_is_pushed(1000, hour());
}

#[test]
fn a_device_under_a_constant_force_follows_the_parabola_for_a_day_at_coarse_ticks() {
    a_device_is_pushed(100_000, 864_000);
    a_device_is_pushed(1_000_000, 86_400);
}

/// The same with damping b: with τ = m/b and w = f/b, x = x₀ + w·t + (v₀ − w)·τ·(1 − e^(−t/τ)) and v = w + (v₀ − w)·e^(−t/τ).
///
/// An hour of a terminal velocity shows whether the *coefficients* are right: their errors always act in the same direction. Horner's rule on a matrix of norm
/// below ½ rounds 8 times a power (3 in the entries of X, 5 in a product of matrices, a sum and a division), so a coefficient e is off by at most
/// 8u·|X|·e^|X|, which for the sizes here, |X| ≤ 0.06, is below 10u·|e|. With the 2u of the products a tick adds 12u·(|e11·v| + |g1·f|) + u·|v⁺| to the error
/// of the velocity, of which e^(−h/τ) stays to the next; and e01 times that error and 12u·(|e01·v| + |g0·f|) + u·|x⁺| to that of the position.
#[test]
fn a_damped_device_keeps_its_terminal_velocity_for_an_hour() {
    let (tick, ticks) = (1000, hour());
    let mut draft = alone(tick, ticks);
    let (x0, v0, f, m, b, h) = (0.0, -0.5, 0.25, 0.1, 5.0, 1e-3);
    let peer = &mut draft.peers[0];
    (peer.device.damping, peer.device.mass, peer.hand) = (b, m, DraftHand::Force([f, 0.0, 0.0]));
    peer.velocity = Some([v0, 0.0, 0.0]);
    (draft.gains.stiffness, draft.gains.damping) = (0.0, 0.0);
    let decay = -libm::expm1(-b / m * h);
    let (e01, e11, g0, g1) = (decay * m / b, decay, (h - decay * m / b) / b, decay / b);
    let (mut k, mut wrong_x, mut wrong_v, mut before) = (0, 0.0, 0.0, v0);
    let Ok(_) = Simulation::new(&draft.scene(), Model::Least).run(&mut OnTick(|row: &TickRow<'_>| {
        if row.peer != 0 {
            return;
        }
        let (x, v) = (row.device.position[0], row.device.velocity[0]);
        if k > 0 {
            wrong_x += e01 * wrong_v + ROUNDING * (x.abs() + 12.0 * (e01 * before.abs() + g0 * f));
            wrong_v = (1.0 - decay) * wrong_v + ROUNDING * (v.abs() + 12.0 * (e11 * before.abs() + g1 * f));
        }
        before = v;
        if k < 1000 || k % 1000 == 999 {
            let (t, tau, w) = (seconds(k, tick), Quad::from(m) / Quad::from(b), Quad::from(f) / Quad::from(b));
            // Beyond 600 time constants nothing is left that a double could hold against the rest.
            let left = if (t / tau).0 < 600.0 { (-t / tau).exp() } else { Quad::ZERO };
            let expected = Quad::from(x0) + w * t + (Quad::from(v0) - w) * tau * (Quad::ONE - left);
            assert!(distance(x, expected) <= wrong_x, "tick {k}: {x} is not within {wrong_x:e} of {:e}", expected.0);
            let expected = w + (Quad::from(v0) - w) * left;
            assert!(distance(v, expected) <= wrong_v, "tick {k}: {v} is not within {wrong_v:e} of {:e}", expected.0);
        }
        k += 1;
    }));
    assert_eq!(k, ticks);
    assert!(wrong_x < 1e-6, "{wrong_x:e}");
}

/// A closed system without damping, three copies held together by average-position forces over an ideal network: the forces sum to zero, so the sum of the
/// velocities stays and the sum of the positions moves uniformly.
///
/// With X and V the largest |x| and |v|, a force rounds by at most 8u·(K·X + B·V): each of the mean (a sum and a division), the difference and the product by
/// 2u·X, likewise for B, and their sum by 2u of both. Times g1 = h/m, whose own error is common to all and sums to zero, and rounded again (2u), three copies
/// add 3·u·(10·g1·(K·X + B·V) + V) a tick to the sum of the velocities; to that of the positions h times its error, 3·u·(X + 3·h·V) and what half a tick of
/// those forces does. The sums in this test are taken with 31 digits.
#[test]
fn an_hour_of_average_position_forces_moves_no_centre_of_mass() {
    let mut draft = Draft { duration: hour(), mass: 0.45, ..Draft::calm(3) };
    let starts = [([0.02, 0.3]), ([-0.01, -0.1]), ([0.015, -0.17])];
    for (peer, [x, v]) in draft.peers.iter_mut().zip(starts) {
        (peer.position, peer.velocity) = (Some([x, 0.0, 0.0]), Some([v, 0.0, 0.0]));
    }
    let (k_t, b_t, h, mass) = (draft.gains.stiffness, draft.gains.damping, 1e-3, draft.mass / 3.0);
    let sum = |column: usize| starts.iter().fold(Quad::ZERO, |sum, start| sum + Quad::from(start[column]));
    let (x0, v0) = (sum(0), sum(1));
    let (mut k, mut wrong_x, mut wrong_v) = (0, 0.0, 0.0);
    let (mut position, mut velocity, mut largest) = (Quad::ZERO, Quad::ZERO, (0.0_f64, 0.0_f64));
    let Ok(_) = Simulation::new(&draft.scene(), Model::Least).run(&mut OnTick(|row: &TickRow<'_>| {
        let (x, v) = (row.object.position[0], row.object.velocity[0]);
        (position, velocity) = (position + Quad::from(x), velocity + Quad::from(v));
        largest = (largest.0.max(x.abs()), largest.1.max(v.abs()));
        if row.peer < 2 {
            return;
        }
        let expected = x0 + v0 * seconds(k, 1000);
        assert!((position - expected).0.abs() <= wrong_x, "tick {k}: {:e} is not within {wrong_x:e} of {:e}", position.0, expected.0);
        assert!((velocity - v0).0.abs() <= wrong_v, "tick {k}: {:e} is not within {wrong_v:e} of {:e}", velocity.0, v0.0);
        let forces = 3.0 * ROUNDING * 10.0 * h / mass * (k_t * largest.0 + b_t * largest.1);
        // What is added to reach the next tick, where bodies are at most h·V and what the forces do in a tick further on.
        let reached = (largest.0 + h * largest.1, largest.1 + 2.0 * h / mass * (k_t * largest.0 + b_t * largest.1));
        wrong_x += h * wrong_v + 3.0 * ROUNDING * (reached.0 + 3.0 * h * reached.1) + h * forces;
        wrong_v += forces + 3.0 * ROUNDING * reached.1;
        (position, velocity, largest, k) = (Quad::ZERO, Quad::ZERO, (0.0, 0.0), k + 1);
    }));
    assert_eq!(k, hour());
}
