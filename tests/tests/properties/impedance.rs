//! The impedance that a probe meets in a run against the admittance that the analysis computes, where the scene is linear.
//!
//! In steady state a periodic loop answers a sine at its frequency and at that plus multiples of the frame's. Over a window that is a whole number of periods of the sine
//! and of frames, these are orthogonal to the sine, so least squares give the fundamental harmonic itself. What is left is the transient: it has died out by the
//! second half of the scene.

use cohaptic_harness::Model;
use cohaptic_harness::measures::Measures;
use cohaptic_peer::{Contact, Coordination, Gains};
use cohaptic_scene::{Measure, MeasureName, MeasureSettings, MeasureSpec, Scene};
use cohaptic_stability::admittance;
use cohaptic_tests::{Draft, DraftHand, cases, drafts};
use proptest::prelude::*;
use proptest::sample::select;

/// Half of the scene \[ms\]: a multiple of every frame, which is of 1 to 8 ms.
const WINDOW: u64 = 6720;

fn probed(draft: &Draft) -> Scene {
    let mut scene = draft.scene();
    let names = [Measure::Viscosity, Measure::EffectiveMass].map(|measure| MeasureName { measure, peer: None }).to_vec();
    scene.measure = Some(MeasureSpec { names, settings: MeasureSettings { probe: Some(0), ..MeasureSettings::default() } });
    scene
}

proptest! {
    #![proptest_config(cases(60))]

    #[test]
    fn it_is_the_inverse_of_the_admittance(
        mut draft in drafts::well_behaved(2..=4_usize, drafts::fixed_link()),
        strategy in select(vec![Coordination::AveragePosition, Coordination::ProportionalDerivative, Coordination::Extrapolated]),
        axes in 1..=2_usize,
        amplitude in (0.2..3.0, -3.0..3.0),
        periods in 1..60_u32,
        phase in -3.0..3.0,
    ) {
        draft.strategy = strategy;
        draft.axes = axes;
        draft.duration = 2 * WINDOW;
        for peer in &mut draft.peers {
            peer.hand = DraftHand::None;
        }
        // 0.15 to 9 Hz.
        let frequency = f64::from(periods) / (1e-3 * WINDOW as f64);
        draft.peers[0].hand = DraftHand::Sine { amplitude: [amplitude.0, amplitude.1, 0.0], frequency, phase };
        let scene = probed(&draft);
        let measured = Measures::run(&scene, Model::Least).1;
        let point = admittance(&scene, 0, &[frequency]).unwrap().points[0];
        let impedance = point.value.inv();
        let omega = std::f64::consts::TAU * frequency;
        let (viscosity, mass) = (measured[0].value.unwrap(), measured[1].value.unwrap());
        // Relative motion dies out in less than a second there, and the common one with a time constant of mass by damping, below 1.5 s.
        let error = 1e-3 * impedance.norm();
        prop_assert!((viscosity - impedance.re).abs() <= error, "{viscosity} for {}", impedance.re);
        prop_assert!((mass * omega - impedance.im).abs() <= error, "{} for {}", mass * omega, impedance.im);
    }
}

/// A device that touches nothing is its own mass and damping, by the exact step of 1 ms: 1/Z = (z-transform of the held force), close to 1/(bH + j·ω·mH).
#[test]
fn a_free_device_has_its_own_mass_and_damping() {
    let mut draft = Draft::calm(2);
    draft.duration = 4000;
    for peer in &mut draft.peers {
        peer.contact = Contact::None;
        peer.coupling = Gains { stiffness: 0.0, damping: 0.0 };
    }
    draft.peers[0].device.mass = 0.1;
    draft.peers[0].device.damping = 5.0;
    let amplitude = [1.0, 0.0, 0.0];
    draft.peers[0].hand = DraftHand::Sine { amplitude, frequency: 2.0, phase: 0.3 };
    let measured = Measures::run(&probed(&draft), Model::Least).1;
    // Force and velocity at the same tick: the force held after it comes half a tick later than a continuous one, e^{-jωh/2}, so Z gains j·ω·bH·h/2.
    let (viscosity, mass) = (measured[0].value.unwrap(), measured[1].value.unwrap());
    assert!((viscosity - 5.0).abs() < 1e-3, "{viscosity}");
    assert!((mass - (0.1 + 5.0 * 0.5e-3)).abs() < 1e-4, "{mass}");
}
