//! Masses, dampings and stiffnesses twelve orders of magnitude apart, in one body and in one scene.
//!
//! **The step map** of a body m·a = f − b·v − k·x over h is compared with the same matrix exponential in 31 digits. Its error can be bounded in units of energy: with
//! ω = √(k/m), velocities divided by ω and forces by k, a body with m, b, k ≥ 0 never gains energy, so every power of I + E has norm at most 1 there, and
//! E ← 2E + E², which makes two steps of one, doubles what is wrong and adds what it rounds: 4 products and 6 sums of terms of size at most 3, below 30u. Before
//! the body turns or fades noticeably 2E is exact and E² small, and such a doubling adds below 5u. The series of 16 terms, 8 roundings a power at ‖X‖ ≤ ½, begins with
//! 8u·‖X‖·e^‖X‖ < 7u. With s doublings in all, of which t are those past ‖X‖ = ½,
//!
//! ```text
//! ‖error‖ ≤ 2ᵗ·(7 + 5·s + 30)·u·e²        2ᵗ ≤ max(1, 4·‖X‖),  ‖X‖ = h·max(ω, b/m)
//! ```
//!
//! where e² bounds Π(1 + 2⁻ʲ)², by which early errors grow beyond their doubling. So a body that turns or fades n times in a tick loses log₂(n) bits, and no more: how
//! far k, b and m themselves are apart costs the s alone.

use std::time::Duration;

use cohaptic_harness::{Model, NoObserver, Simulation};
use cohaptic_peer::{Contact, Gains, Integrator, Plant};
use cohaptic_stability::{Method, Verdict, analyse};
use cohaptic_tests::Draft;
use qd::Quad;

use crate::hard::ROUNDING;

const TICK: Duration = Duration::from_millis(1);

/// exp(X) − I of a body in 31 digits: rows of Δx and Δv by x, v and f.
fn reference(plant: Plant, span: f64) -> [[Quad; 3]; 2] {
    let [m, b, k, h] = [plant.mass, plant.damping, plant.stiffness, span].map(Quad::from);
    let x = [[Quad::ZERO, h, Quad::ZERO], [-k / m * h, -b / m * h, h / m], [Quad::ZERO; 3]];
    let product = |a: &[[Quad; 3]; 3], c: &[[Quad; 3]; 3]| -> [[Quad; 3]; 3] {
        std::array::from_fn(|i| std::array::from_fn(|j| a[i][0] * c[0][j] + a[i][1] * c[1][j] + a[i][2] * c[2][j]))
    };
    let sum = |a: &[[Quad; 3]; 3], c: &[[Quad; 3]; 3]| -> [[Quad; 3]; 3] { std::array::from_fn(|i| std::array::from_fn(|j| a[i][j] + c[i][j])) };
    // Sixteen halvings more than the norm asks for: then 12 terms leave out less than 2⁻²⁰⁰.
    let largest = x.iter().flatten().map(|entry| entry.0.abs()).fold(1.0, f64::max);
    let halvings = libm::ceil(libm::log2(largest)) as u32 + 16;
    let part = x.map(|row| row.map(|entry| entry * Quad::from(libm::ldexp(1.0, -(halvings as i32)))));
    let mut increment = [[Quad::ZERO; 3]; 3];
    for n in (1..=12_u32).rev() {
        increment = sum(&product(&part, &increment), &part).map(|row| row.map(|entry| entry / Quad::from(f64::from(n))));
    }
    for _ in 0..halvings {
        increment = sum(&sum(&increment, &increment), &product(&increment, &increment));
    }
    [increment[0], increment[1]]
}

/// The largest error of a step map in units of the energy norm, and its bound.
fn error_and_bound(plant: Plant) -> (f64, f64) {
    let h = TICK.as_secs_f64();
    let (state, force) = plant.step(TICK, Integrator::Exact).coefficients();
    let expected = reference(plant, h);
    let Plant { mass: m, damping: b, stiffness: k } = plant;
    let omega = (k / m).sqrt();
    let apart = |actual: f64, expected: Quad| (Quad::from(actual) - expected).0.abs();
    // A force f holds the body at f/k: the columns of the force are those of a displacement, in units of 1/k.
    let errors = [
        apart(state[0][0], expected[0][0]),
        apart(state[0][1], expected[0][1]) * omega,
        apart(state[1][0], expected[1][0]) / omega,
        apart(state[1][1], expected[1][1]),
        apart(force[0], expected[0][2]) * k,
        apart(force[1], expected[1][2]) * k / omega,
    ];
    let norm = h * omega.max(b / m);
    let unscaled = h * [1.0, k / m + b / m + 1.0 / m].into_iter().fold(0.0, f64::max);
    let doublings = libm::log2(2.0 * unscaled.max(0.5)).ceil();
    let bound = (4.0 * norm).max(1.0) * (37.0 + 5.0 * doublings) * ROUNDING * libm::exp(2.0);
    (errors.into_iter().fold(0.0, f64::max), bound)
}

#[test]
fn a_step_is_exact_within_what_its_turns_cost_over_twelve_orders_of_magnitude() {
    let sizes = [1e-6, 1e-3, 1.0, 1e3, 1e6];
    let mut used = 0.0_f64;
    for (mass, stiffness) in sizes.into_iter().flat_map(|mass| sizes.map(|stiffness| (mass, stiffness))) {
        // With 498 N·s/m and 1 kg ‖X‖ is just below ½, where the series leaves out most.
        for damping in [0.0, 1e-6, 1e-3, 1.0, 498.0, 1e3, 1e6] {
            let plant = Plant { mass, damping, stiffness };
            let (error, bound) = error_and_bound(plant);
            assert!(error <= bound, "{plant:?}: {error:e}, more than {bound:e}");
            used = used.max(error / bound);
        }
    }
    assert!(used > 1e-4, "the bound is {used:e} of what happens: it says nothing");
}

/// How much of the velocity of a copy its damping takes in a tick is 1 − e^(−δ): δ = bO·h/m.
const DELTA: f64 = 0.01;

/// The radius of m·a = −K·d − B·w − b·w with the first two sampled and held: with κ = K·h²/m, β = B·h/m, φ₁ = (1 − e^(−δ))/δ and φ₂ = (1 − φ₁)/δ,
///
/// ```text
/// d⁺   = (1 − κ·φ₂)·d + (φ₁ − β·φ₂)·h·w
/// h·w⁺ = −κ·φ₁·d + (e^(−δ) − β·φ₁)·h·w
/// ```
fn held(kappa: f64, beta: f64, delta: f64) -> f64 {
    let (left, phi_1, phi_2) = if delta > 0.0 {
        let phi_1 = -libm::expm1(-delta) / delta;
        (libm::exp(-delta), phi_1, (1.0 - phi_1) / delta)
    } else {
        (1.0, 1.0, 0.5)
    };
    let ([a, b], [c, d]) = ([1.0 - kappa * phi_2, phi_1 - beta * phi_2], [-kappa * phi_1, left - beta * phi_1]);
    let (half_trace, determinant) = (0.5 * (a + d), a * d - b * c);
    let discriminant = half_trace * half_trace - determinant;
    if discriminant < 0.0 { determinant.sqrt() } else { half_trace.abs() + discriminant.sqrt() }
}

/// Two peers over an ideal network. The difference of two copies of mass m has the stiffness 2·KT: so that κ = 2·KT·h²/m and β = 2·BT·h/m; a device of mass mH on
/// a copy far heavier has κ = KC·h²/mH and β = BC·h/mH.
fn scene(copy: f64, (kappa, beta): (f64, f64), device: Option<(f64, (f64, f64))>) -> Draft {
    let h = TICK.as_secs_f64();
    let mut draft = Draft { mass: copy, split_mass: false, damping: DELTA * copy / h, ..Draft::calm(2) };
    draft.gains = Gains { stiffness: kappa * copy / (2.0 * h * h), damping: beta * copy / (2.0 * h) };
    for (peer, x) in draft.peers.iter_mut().zip([0.01, -0.01]) {
        peer.position = Some([x, 0.0, 0.0]);
        if let Some((mass, (kappa, beta))) = device {
            (peer.contact, peer.device.mass, peer.device.damping) = (Contact::Grasp, mass, 0.0);
            peer.coupling = Gains { stiffness: kappa * mass / (h * h), damping: beta * mass / h };
        }
    }
    draft
}

/// The same κ and β, a thousandth below and above the edge, for copies of a milligram to a thousand tons: gains from 10⁻² to 10¹⁰ N/m. κ, β and δ are rounded 4 times
/// each on their way through the gains, and φ₂ loses 1/δ = 100 of its roundings to a difference, here and not there: 2·100u·κ of the determinant, and 12u for the
/// rest; the radius, its root, is off by half of that and its own rounding. What all copies have in common fades by e^(−δ).
#[test]
fn the_verdict_does_not_depend_on_the_mass() {
    let beta = 0.05;
    let (mut stable, mut unstable) = (0.01, 0.9);
    for _ in 0..60 {
        let middle = 0.5 * (stable + unstable);
        *(if held(middle, beta, DELTA) < 1.0 { &mut stable } else { &mut unstable }) = middle;
    }
    for mass in [1e-6, 1e-3, 1.0, 1e3, 1e6] {
        for (kappa, verdict) in
            [(0.01, Verdict::Stable), (stable * 0.999, Verdict::Stable), (unstable * 1.001, Verdict::Unstable), (0.9, Verdict::Unstable)]
        {
            let scene = scene(mass, (kappa, beta), None).scene();
            for method in [Method::Reduced, Method::Full] {
                let analysis = analyse(&scene, method).unwrap();
                let expected = held(kappa, beta, DELTA).max(libm::exp(-DELTA));
                assert_eq!(analysis.verdict(), verdict, "{mass} kg, {kappa}: {:?}", analysis.radius);
                let bound = analysis.radius.error + (100.0 * kappa + 8.0) * ROUNDING;
                assert!((analysis.radius.value - expected).abs() <= bound, "{:?} for {expected}", analysis.radius);
            }
        }
    }
}

/// A device of a milligram on a copy of a thousand tons. The copy is a wall to the device and the device nothing to the copy, but for 10⁻¹² of either: the two modes
/// are those of each by itself. What couples them back is E, of norm 2·10⁻¹²·(κ + β) < 4·10⁻¹²; an eigenvalue moves by at most its condition number times that,
/// and with blocks whose eigenvectors have a condition below 10 each and lie 0.1 apart that number is below 10·10/0.1 = 10³: 4·10⁻⁹.
#[test]
fn a_device_a_million_million_times_lighter_than_its_copy_has_a_mode_of_its_own() {
    let copies = (0.01, 0.05);
    for (device, verdict) in [((0.5, 0.6), Verdict::Stable), ((1.3, 0.6), Verdict::Unstable)] {
        let draft = scene(1e6, copies, Some((1e-6, device)));
        let expected = held(device.0, device.1, 0.0).max(held(copies.0, copies.1, DELTA)).max(libm::exp(-DELTA));
        for method in [Method::Reduced, Method::Full] {
            let analysis = analyse(&draft.scene(), method).unwrap();
            assert_eq!(analysis.verdict(), verdict, "{:?}", analysis.radius);
            assert!((analysis.radius.value - expected).abs() <= analysis.radius.error + 4e-9, "{:?} for {expected}", analysis.radius);
        }
        // The copies, apart by 2 cm, come together whatever the devices do: those move them by 10⁻¹² of what they move themselves, 1.03³⁰⁰ = 7000 times as far.
        let Ok(summary) = Simulation::new(&draft.scene(), Model::Least).run(&mut NoObserver);
        assert!(summary.peers.iter().all(|peer| peer.position[0].abs() < 0.01));
    }
}

/// The other way round: devices of a thousand tons hold copies of a milligram. The copies settle at once; what is left is two masses of a thousand tons on springs
/// and dampers for a milligram, whose modes, and their motion in common, differ from 1 in modulus by less than 10⁻¹²·2·(κ + β + δ). A verdict must not say more than that the radius is 1 within its
/// error and this.
#[test]
fn a_device_a_million_million_times_heavier_than_its_copy_leaves_hardly_anything_to_decide() {
    let (light, heavy, h) = (1e-6, 1e6, TICK.as_secs_f64());
    let mut draft = scene(light, (0.01, 0.05), None);
    for peer in &mut draft.peers {
        (peer.contact, peer.device.mass, peer.device.damping) = (Contact::Grasp, heavy, 0.0);
        peer.coupling = Gains { stiffness: 0.05 * light / (h * h), damping: 0.1 * light / h };
    }
    for method in [Method::Reduced, Method::Full] {
        let analysis = analyse(&draft.scene(), method).unwrap();
        let radius = analysis.radius;
        assert!((radius.value - 1.0).abs() <= radius.error + 1e-12, "{radius:?}");
        assert!(analysis.verdict() != Verdict::Unstable || radius.value - radius.error > 1.0, "{radius:?}");
    }
}
