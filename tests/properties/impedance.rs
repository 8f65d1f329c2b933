//! The impedance that a probe meets in a run against the admittance that the analysis computes, where the scene is linear.
//!
//! In steady state a periodic loop answers a sine at its frequency and at that plus multiples of the frame's. Over a window that is a whole number of periods of the sine
//! and of frames, these are orthogonal to the sine, so least squares give the fundamental harmonic itself. The transient is left: it has died out by the
//! second half of the scene.

use cohaptic_harness::Model;
use cohaptic_harness::measures::Measures;
use cohaptic_peer::{Contact, Coordination, Gains};
use cohaptic_scene::{Measure, MeasureName, MeasureSettings, MeasureSpec, Scene};
use cohaptic_stability::{Method, admittance, analyse};
use cohaptic_tests::{Draft, DraftHand, drafts};
use cohaptic_tests_common::{cases, properties};
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

properties! {
    #![proptest_config(cases(60))]

    #[test]
    fn it_is_the_inverse_of_the_admittance(
        mut draft in drafts::well_behaved(2..=4_usize, drafts::fixed_link()),
        strategy in select(vec![Coordination::AveragePosition, Coordination::ProportionalDerivative, Coordination::Extrapolated]),
        axes in 1..=2_usize,
        amplitude in (0.2..3.0, -3.0..3.0),
        damping in 3.0..10.0,
        periods in 1..60_u32,
        phase in -3.0..3.0,
    ) {
        draft.strategy = strategy;
        draft.axes = axes;
        draft.damping = damping;
        draft.duration = 2 * WINDOW;
        for peer in &mut draft.peers {
            peer.hand = DraftHand::None;
        }
        // 0.15 to 9 Hz.
        let frequency = f64::from(periods) / (1e-3 * WINDOW as f64);
        draft.peers[0].hand = DraftHand::Sine { amplitude: [amplitude.0, amplitude.1, 0.0], frequency, phase };
        let scene = probed(&draft);
        // What is left of the motion of the beginning in the second half, mode by mode.
        let frames = i32::try_from(1000 * WINDOW / draft.update).unwrap();
        let left = analyse(&scene, Method::Reduced).unwrap().radius.value.powi(frames);
        prop_assume!(left < 1e-7);
        let measured = Measures::run(&scene, Model::Least).values;
        let point = admittance(&scene, 0, &[frequency]).unwrap().points[0];
        let impedance = point.value.inv();
        let omega = std::f64::consts::TAU * frequency;
        let (viscosity, mass) = (measured[0].value.unwrap(), measured[1].value.unwrap());
        // The transient begins no more than a thousand times as large as the steady motion; sums of 6720 ticks are exact to 1e-9 of themselves.
        let error = (1e3 * left + 1e-9) * impedance.norm();
        prop_assert!((viscosity - impedance.re).abs() <= error, "{viscosity} for {}", impedance.re);
        prop_assert!((mass * omega - impedance.im).abs() <= error, "{} for {}", mass * omega, impedance.im);
    }
}

/// A device that touches nothing moves by v⁺ = φ·v + (1 − φ)/bH·F with φ = e^{−bH·h/mH}, so Z = (e^{jωh} − φ)·bH/(1 − φ).
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
    let measured = Measures::run(&probed(&draft), Model::Least).values;
    let (viscosity, mass) = (measured[0].value.unwrap(), measured[1].value.unwrap());
    let (omega, kept) = (std::f64::consts::TAU * 2.0, libm::exp(-5.0 * 1e-3 / 0.1));
    let share = 5.0 / (1.0 - kept);
    // 1000 ticks of the second half, each with some roundings of numbers near 1.
    assert!((viscosity - share * (libm::cos(omega * 1e-3) - kept)).abs() < 1e-9, "{viscosity}");
    assert!((mass - share * libm::sin(omega * 1e-3) / omega).abs() < 1e-9, "{mass}");
}
