//! The other integrators come to the exact one's answer with their order, in a whole scene: forces are held over a tick in all of them, so what they
//! approximate is the damping of devices and copies and the spring of an arm.

use cohaptic_harness::{Model, NoObserver, Simulation};
use cohaptic_peer::{ArmConfig, Contact, DeviceConfig};
use cohaptic_tests::{Draft, DraftHand};

/// Three grasp the object and wait for one another over a network; long ticks and light, damped devices, so that the errors are far above rounding.
fn coupled() -> Draft {
    let mut draft = Draft { link: "delay = \"8ms\"".to_owned(), damping: 8.0, update: 8000, mass: 1.2, ..Draft::calm(3) };
    draft.gains.stiffness = 200.0;
    for peer in &mut draft.peers {
        (peer.tick, peer.contact) = (4000, Contact::Grasp);
        peer.device = DeviceConfig { mass: 0.05, damping: 5.0 };
        (peer.coupling.stiffness, peer.coupling.damping) = (200.0, 2.0);
    }
    draft.peers[0].hand = DraftHand::Force([1.0, 0.0, 0.0]);
    let arm = ArmConfig { mass: 0.05, damping: 4.0, stiffness: 300.0 };
    draft.peers[1].hand = DraftHand::Arm { arm, wanted: [0.02, 0.0, 0.0] };
    draft
}

fn end(draft: &Draft) -> Vec<f64> {
    let scene = draft.scene();
    let Ok(summary) = Simulation::new(&scene, Model::Least).run(&mut NoObserver);
    summary.peers.iter().map(|peer| peer.position[0]).collect()
}

/// By which power of the step the error at the end of the scene shrinks, from `substeps` to twice as many.
fn order(integrator: &'static str, substeps: u32) -> f64 {
    let exact = end(&coupled());
    let error = |substeps| {
        let approximate = end(&Draft { integrator: Some((integrator, substeps)), ..coupled() });
        approximate.iter().zip(&exact).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
    };
    libm::log2(error(substeps) / error(2 * substeps))
}

/// The next term of the error is a factor b·h/(m·substeps) = 0.4/8 smaller.
#[test]
fn semi_implicit_euler_is_of_first_order() {
    let order = order("semi-implicit-euler", 8);
    assert!((order - 1.0).abs() < 0.05, "{order}");
}

/// Errors of 1e-6 and 1e-7 of the motion; the next term is a factor 0.4/2 smaller, of which halving the step leaves half.
#[test]
fn runge_kutta_is_of_fourth_order() {
    let order = order("rk4", 2);
    assert!((order - 4.0).abs() < 0.2, "{order}");
}
