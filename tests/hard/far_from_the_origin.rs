//! Everything 10⁶ m from the origin: it moves as at the origin, but for the last digits of positions, which are 10⁻¹⁰ m there.
//!
//! ulp(10⁶) = 2⁻³³ m = 1.2·10⁻¹⁰ m. Where everything begins at multiples of that, moving the scene changes no number at its beginning.

use std::time::Duration;

use cohaptic_harness::{Model, Simulation, TickRow};
use cohaptic_peer::{ArmConfig, Contact, Gains, Integrator, Plant};
use cohaptic_tests::{Draft, DraftHand, Log, run};

use crate::hard::ROUNDING;
use crate::hard::gain::{Gain, PerTick};
use crate::hard::watch::OnTick;

/// How far away \[m\].
const FAR: f64 = 1e6;
const TICK: Duration = Duration::from_millis(1);

/// Three peers that grasp, over 3 ms: one by an arm, which ties the scene to the ground, one with a constant force and one with a sine.
fn tied(origin: f64) -> Draft {
    let mut draft = Draft { duration: 20_000, link: "delay = \"3ms\"".to_owned(), damping: 0.5, ..Draft::calm(3) };
    draft.gains = Gains { stiffness: 100.0, damping: 2.0 };
    let arm = ArmConfig { mass: 0.2, damping: 6.0, stiffness: 100.0 };
    let hands = [
        DraftHand::Arm { arm, wanted: [origin, 0.0, 0.0] },
        DraftHand::Force([0.5, 0.0, 0.0]),
        DraftHand::Sine { amplitude: [0.8, 0.0, 0.0], frequency: 1.5, phase: 0.3 },
    ];
    for ((peer, hand), start) in draft.peers.iter_mut().zip(hands).zip([0.0, 0.0078125, -0.015625]) {
        (peer.contact, peer.hand, peer.position) = (Contact::Grasp, hand, Some([origin + start, 0.0, 0.0]));
        peer.coupling = Gains { stiffness: 800.0, damping: 2.0 };
    }
    draft
}

/// The difference between the two runs is made by roundings and answered by the same linear scene: at most Σ|Aʲ|·d ([`Gain`]), with d, for |x| ≤ X = 10⁶ + 1:
///
/// - a position is rounded once a tick to u·X, and what is added to it, below 10⁻² m, to less than a thousandth of that;
/// - differences of two positions are exact (they are within a factor of two of each other, Sterbenz), but for a mean of two, whose sum is rounded to u·2X and
///   halved: KT·u·X, which the copy's g1 makes a velocity;
/// - in the arm's plant e00·x and g0·ka·xw (and e10·x, g1·ka·xw) are large and cancel. Coefficients by Horner's rule round 8 times a power: below 30u of the
///   second-order e00 and g0 and 15u of e10 and g1 each; ka·xw, the subtraction of FC and the products and sums round 6 times more: 66u·|e00|·X, 36u·|e10|·X;
/// - everything else is relative to forces and velocities, which are below 10 N and 1 m/s: 20u of those, in the scene at the origin too.
#[test]
fn the_scene_moves_as_at_the_origin_within_the_gain_of_its_roundings() {
    let (near, far) = (tied(0.0), tied(FAR));
    let gain = Gain::of(&near.scene(), TICK);
    let arm = Plant { mass: 0.1 + 0.2, damping: 5.0 + 6.0, stiffness: 100.0 }.step(TICK, Integrator::Exact).coefficients().0;
    let (size, copy, device) = (FAR + 1.0, 1e-3 / (near.mass / 3.0), 1e-3 / 0.1);
    let of_all = PerTick {
        device_position: 1.001 * ROUNDING * size,
        device_velocity: 20.0 * ROUNDING * (device * 10.0 + 1.0),
        copy_position: 1.001 * ROUNDING * size,
        copy_velocity: copy * near.gains.stiffness * ROUNDING * size + 20.0 * ROUNDING * (copy * 10.0 + 1.0),
    };
    let of_the_arm = PerTick {
        device_position: of_all.device_position + 66.0 * ROUNDING * arm[0][0].abs() * size,
        device_velocity: of_all.device_velocity + 36.0 * ROUNDING * arm[1][0].abs() * size,
        ..of_all
    };
    let bounds = gain.of_errors(&[of_the_arm, of_all, of_all]);
    let (near, far) = (run(&near.scene(), Model::Least), run(&far.scene(), Model::Least));
    let mut most = 0.0_f64;
    for (near, far) in near.ticks.iter().zip(&far.ticks) {
        let apart = (far.object.position[0] - FAR) - near.object.position[0];
        assert!(apart.abs() <= bounds[far.peer], "{} at {}: {apart:e} m, more than {:e}", far.peer, far.at, bounds[far.peer]);
        assert!(far.coupling_force[0].abs() < 10.0 && far.object.velocity[0].abs() < 1.0, "{far:?}");
        most = most.max(near.object.position[0].abs());
    }
    // The bound says something: the scene moves a hundred thousand times as far.
    assert!(bounds.iter().all(|bound| 1e5 * bound < most), "{bounds:?} of {most}");
}

/// Rounding to nearest knows no sign: a scene and its mirror image stay mirror images to the bit, 10⁶ m to either side.
#[test]
fn a_mirror_image_far_to_the_other_side_is_the_same_to_the_bit() {
    let mirrored = |draft: Draft| {
        let mut draft = draft;
        for peer in &mut draft.peers {
            peer.position = peer.position.map(|place| place.map(|x| -x));
            peer.hand = match peer.hand {
                DraftHand::Arm { arm, wanted } => DraftHand::Arm { arm, wanted: wanted.map(|x| -x) },
                DraftHand::Force(force) => DraftHand::Force(force.map(|x| -x)),
                DraftHand::Sine { amplitude, frequency, phase } => DraftHand::Sine { amplitude: amplitude.map(|x| -x), frequency, phase },
                DraftHand::None => DraftHand::None,
            };
        }
        draft
    };
    let one: Log = run(&tied(FAR).scene(), Model::Least);
    let other: Log = run(&mirrored(tied(FAR)).scene(), Model::Least);
    assert_eq!(one.ticks.len(), 60_000);
    for (one, other) in one.ticks.iter().zip(&other.ticks) {
        let numbers =
            |tick: &cohaptic_tests::Tick| [tick.object.position[0], tick.object.velocity[0], tick.device.position[0], tick.coupling_force[0]];
        assert_eq!(numbers(one), numbers(other).map(|number| -number), "at {}", one.at);
    }
}

/// Four free copies without damping, 10⁶ m away: the mean of three others is not symmetric, since their sum is rounded at 3·10⁶ m. So the forces do not quite
/// sum to zero and the scene drifts off, by no more than this.
///
/// A mean of three takes two additions and a division: 3u·X; so a force is off by 3u·K·X, and the roundings of itself, 8u of K·d + B·V with d the largest
/// distance between copies (their difference is exact). Times g1 that is added to a velocity each tick with u·V; times h that to a position, with u·X.
#[test]
fn an_asymmetric_mean_far_away_moves_the_centre_no_more_than_its_rounding() {
    let mut draft = Draft { duration: 20_000, ..Draft::calm(4) };
    let starts = [0.0078125, -0.015625, 0.00390625, 0.00390625];
    for (peer, start) in draft.peers.iter_mut().zip(starts) {
        peer.position = Some([FAR + start, 0.0, 0.0]);
    }
    let (h, g1, size) = (1e-3, 1e-3 / (draft.mass / 4.0), FAR + 1.0);
    let (mut wrong_x, mut wrong_v) = (0.0, 0.0);
    // From the first place: those differences are exact, and so small that their sum hardly rounds.
    let (mut x, mut v, mut largest) = (0.0, 0.0, (0.0_f64, 0.0_f64));
    let Ok(_) = Simulation::new(&draft.scene(), Model::Least).run(&mut OnTick(|row: &TickRow<'_>| {
        let (from_far, speed) = (row.object.position[0] - FAR, row.object.velocity[0]);
        (x, v) = (x + from_far / 4.0, v + speed / 4.0);
        largest = (largest.0.max(from_far.abs()), largest.1.max(speed.abs()));
        if row.peer < 3 {
            return;
        }
        assert!(x.abs() <= wrong_x + 1e-17, "{}: {x:e} m, more than {wrong_x:e}", row.at);
        assert!(v.abs() <= wrong_v + 1e-17, "{}: {v:e} m/s, more than {wrong_v:e}", row.at);
        let force = ROUNDING * (3.0 * 1000.0 * size + 8.0 * (2000.0 * largest.0 + 10.0 * largest.1));
        let next = largest.1 + g1 * (2000.0 * largest.0 + 10.0 * largest.1);
        wrong_x += h * wrong_v + ROUNDING * size * 1.001 + h * g1 * force;
        wrong_v += g1 * force + ROUNDING * 2.0 * next;
        (x, v, largest) = (0.0, 0.0, (0.0, 0.0));
    }));
}
