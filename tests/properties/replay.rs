//! Steps 3 and 4 of a tick, against the recorded rows: the forces in a row follow from the states in it, and the next row follows from this one and
//! the forces that apply, those of this row or, with a computation delay, of the row before.
//!
//! The oracle moves a damped mass in closed form, with φ = 1 − e^{−z} and z = b·h/m:
//!
//! ```text
//! v⁺ = v + φ·(f/b − v)        x⁺ = x + (m/b)·φ·v + f/b·(h − (m/b)·φ)
//! ```

use core::f64::consts::TAU;

use cohaptic_harness::Model;
use cohaptic_peer::{Contact, Coordination};
use cohaptic_tests::{Draft, DraftHand, Tick, drafts, run};
use cohaptic_tests_common::{cases, properties};
use cohaptic_units::Instant;
use proptest::prelude::*;

properties! {
    #![proptest_config(cases(800))]

    #[test]
    fn every_row_follows_from_the_row_before_it(draft in drafts::anything_of_the_paper()) {
        let draft = replayable(draft);
        let log = run(&draft.scene(), Model::Least);
        for peer in 0..draft.peers.len() {
            let rows = log.of(peer);
            for row in &rows {
                forces_follow(&draft, row)?;
            }
            for (number, pair) in rows.windows(2).enumerate() {
                // With a computation delay nothing is applied before the first forces are a tick old.
                let before = number.checked_sub(1).map(|before| rows[before]);
                let forces = if draft.peers[peer].compute_delay { before } else { Some(pair[0]) };
                moves_follow(&draft, pair[0], pair[1], forces)?;
            }
        }
    }
}

/// Without what the oracle does not know: walls, other integrators, and changes of anything but links.
fn replayable(mut draft: Draft) -> Draft {
    (draft.enclosure, draft.integrator) = (None, None);
    draft.timeline.retain(|entry| entry.contains("link = "));
    draft
}

/// Equations (9) and (10), and the contacts. The program may add in another order: a few roundings of the terms.
fn forces_follow(draft: &Draft, row: &Tick) -> Result<(), TestCaseError> {
    let peer = &draft.peers[row.peer];
    let gain = if draft.strategy == Coordination::ProportionalDerivative { super::count(draft.peers.len() - 1) } else { 1.0 };
    for axis in 0..draft.axes {
        let (stretch, closing) = (row.device.position[axis] - row.object.position[axis], row.device.velocity[axis] - row.object.velocity[axis]);
        let (spring, damper) = (peer.coupling.stiffness * stretch, peer.coupling.damping * closing);
        let expected = match peer.contact {
            Contact::None => 0.0,
            Contact::Grasp => spring + damper,
            Contact::Push(direction) if direction.axis != axis => 0.0,
            // Only past the surface, and only outwards.
            Contact::Push(direction) if direction.positive => {
                if stretch > 0.0 {
                    (spring + damper).max(0.0)
                } else {
                    0.0
                }
            }
            Contact::Push(_) => {
                if stretch < 0.0 {
                    (spring + damper).min(0.0)
                } else {
                    0.0
                }
            }
        };
        let size = spring.abs() + damper.abs();
        close(row.coupling_force[axis], expected, 1e-15 * size, "FC", row)?;
        let spring = gain * draft.gains.stiffness * (row.object.position[axis] - row.target.position[axis]);
        let damper = gain * draft.gains.damping * (row.object.velocity[axis] - row.target.velocity[axis]);
        close(row.coordination_force[axis], spring + damper, 1e-15 * (spring.abs() + damper.abs()), "FT", row)?;
    }
    Ok(())
}

/// Equations (7) and (8) over one tick.
fn moves_follow(draft: &Draft, row: &Tick, next: &Tick, applied: Option<&Tick>) -> Result<(), TestCaseError> {
    let peer = &draft.peers[row.peer];
    let copies = if draft.split_mass { super::count(draft.peers.len()) } else { 1.0 };
    let h = (next.at - row.at).as_secs_f64();
    for axis in 0..draft.axes {
        let (fc, ft) = applied.map_or((0.0, 0.0), |forces| (forces.coupling_force[axis], forces.coordination_force[axis]));
        let hand = hand(&peer.hand, row.at)[axis];
        if let DraftHand::Arm { arm, .. } = peer.hand {
            // The arm's mass, damper and spring belong to the device.
            let plant = [peer.device.mass + arm.mass, peer.device.damping + arm.damping, arm.stiffness];
            let from = [row.device.position[axis], row.device.velocity[axis]];
            let ([x, v], [x_size, v_size]) = series(plant, h, from, hand, -fc);
            close(next.device.position[axis], x, 1e-12 * x_size + 1e-15 * x.abs(), "device in an arm", row)?;
            close(next.device.velocity[axis], v, 1e-12 * v_size + 1e-15 * v.abs(), "device in an arm", row)?;
        }
        let bodies = [
            (peer.device.mass, peer.device.damping, hand, -fc, row.device, next.device, "device"),
            (draft.mass / copies, draft.damping, fc, -ft, row.object, next.object, "copy"),
        ];
        let free = usize::from(matches!(peer.hand, DraftHand::Arm { .. }));
        for (m, b, push, pull, from, to, what) in bodies.into_iter().skip(free) {
            let (x, v, f) = (from.position[axis], from.velocity[axis], push + pull);
            let [along, reached, kick] = closed_form(m, b, h);
            // The increments have a relative error of at most 1e-13 in either computation; adding them rounds to the precision of x and v.
            let terms = (push.abs() + pull.abs()) * kick / m;
            let moved = along * v.abs() + reached * (push.abs() + pull.abs()) / m;
            close(to.position[axis], x + (along * v + reached * f / m), 1e-12 * moved + 1e-15 * x.abs(), what, row)?;
            let decay = b / m * along;
            close(to.velocity[axis], v + (kick * f / m - decay * v), 1e-12 * (terms + decay * v.abs()) + 1e-15 * v.abs(), what, row)?;
        }
    }
    Ok(())
}

/// The state after h of m·a = push + pull − b·v − k·x by its Taylor series in time, and the sum of the sizes of its terms but the first: each
/// derivative of x and v follows from the one before it. With b·h/m and k·h²/m below 5, 60 terms leave less than 1e-30.
fn series([m, b, k]: [f64; 3], h: f64, [x, v]: [f64; 2], push: f64, pull: f64) -> ([f64; 2], [f64; 2]) {
    let (mut term, mut sum) = ([x, v], [x, v]);
    let forces = (push + pull) / m;
    let mut size = [0.0, h * (push.abs() + pull.abs()) / m];
    for n in 1..60 {
        let scale = h / f64::from(n);
        let force = if n == 1 { forces } else { 0.0 };
        term = [scale * term[1], scale * (force - (b * term[1] + k * term[0]) / m)];
        for component in 0..2 {
            sum[component] += term[component];
            size[component] += term[component].abs();
        }
    }
    size[0] += h * size[1];
    size[1] += h * k / m * x.abs();
    (sum, size)
}

/// ∫φ: how far a unit velocity goes \[s\], how far a unit acceleration goes [s²], and what velocity it gives \[s\].
fn closed_form(m: f64, b: f64, h: f64) -> [f64; 3] {
    let z = b * h / m;
    // (1 − e^{−z})/z and (z − 1 + e^{−z})/z²; the second cancels for small z, where its series 1/2 − z/6 + z²/24 − … converges at once.
    let first = if z == 0.0 { 1.0 } else { -libm::expm1(-z) / z };
    let second = if z < 0.5 { (0..20).rev().fold(0.0, |rest, n| (1.0 - z * rest) / f64::from(n + 2)) } else { (z + libm::expm1(-z)) / (z * z) };
    [first * h, second * h * h, first * h]
}

fn hand(hand: &DraftHand, at: Instant) -> [f64; 3] {
    match hand {
        DraftHand::Force(force) => *force,
        DraftHand::Sine { amplitude, frequency, phase } => amplitude.map(|a| a * libm::sin(TAU * frequency * at.as_secs_f64() + phase)),
        // The far end of the arm's spring.
        DraftHand::Arm { arm, wanted } => wanted.map(|x| arm.stiffness * x),
        DraftHand::None => [0.0; 3],
    }
}

fn close(actual: f64, expected: f64, tolerance: f64, what: &str, row: &Tick) -> Result<(), TestCaseError> {
    // Beyond 1e140 products of the oracle overflow; the scene diverges.
    let ok = (actual - expected).abs() <= tolerance || expected.is_nan() || expected.abs() > 1e140;
    prop_assert!(ok, "{what}: {actual:e}, expected {expected:e} ± {tolerance:e}, from {row:?}");
    Ok(())
}
