//! Energy that the coordination injects into rotation, against kinetic energies and closed forms.

use std::convert::Infallible;

use cohaptic_harness::measures::Measures;
use cohaptic_harness::{Model, Observer, Simulation, Summary, TickRow};
use cohaptic_scene::Scene;

use crate::turning_laws::{INERTIA, LAWS, MASS, read, run, untouched};

/// Returns the kinetic energy of a copy at the end of a run \[J\].
fn kinetic(summary: &Summary, peer: usize) -> f64 {
    let rate = summary.peers[peer].attitude.unwrap().rate;
    let square = |velocity: &[f64]| velocity.iter().map(|velocity| velocity * velocity).sum::<f64>();
    0.5 * MASS * square(&summary.peers[peer].velocity) + (0..3).map(|axis| 0.5 * INERTIA[axis] * rate[axis] * rate[axis]).sum::<f64>()
}

fn value(scene: &Scene, name: &str) -> f64 {
    let mut scene = scene.clone();
    let text = format!("[measure]\nnames = [\"{name}\"]\n");
    let measured = read(&format!("{}{text}", untouched(3, "average-position", "mass = 1", "stiffness = 1", &vec![String::new(); scene.peers.len()])));
    scene.measure = measured.measure;
    Measures::run(&scene, Model::Least).values[0].value.unwrap()
}

/// A copy that nobody touches and that ground does not damp gets energy from the coordination alone.
#[test]
fn the_energy_injected_is_what_the_kinetic_energy_changes_by() {
    for law in LAWS {
        let peers = [
            "orientation = [1, 0.3, -0.2, 0.5]\nangular-velocity = [1, -2, 0.5]\nposition = [0.01, 0, 0]",
            "orientation = [1, -0.5, 0.4, 0]\nangular-velocity = [0, 3, 1]",
            "position = [0, 0.02, 0]",
        ];
        let law = law.replace("BETA", "0.3");
        let object = format!("mass = {MASS}\ninertia = {INERTIA:?}\nsplit-mass = false");
        let gains = "stiffness = 200\ndamping = 0.5\nrotational-stiffness = [0.02, 0.03, 0.04]\nrotational-damping = 1e-5";
        let scene = read(&untouched(3, &law, &object, gains, &peers.map(str::to_owned)));
        let after = run(&scene);
        for peer in 0..3 {
            let rate = scene.rotation.as_ref().unwrap().peers[peer].attitude.rate;
            let start: f64 = (0..3).map(|axis| 0.5 * INERTIA[axis] * rate[axis] * rate[axis]).sum();
            let (changed, injected) = (kinetic(&after, peer) - start, value(&scene, &format!("peers.p{peer}.energy_j")));
            // A step of angular velocities of at most 50 rad/s misses less than (hω)⁵ of the energy, and there are 200.
            let most = 200.0 * 0.05_f64.powi(5) / 100.0 * kinetic(&after, peer).max(start);
            assert!((changed - injected).abs() < most, "{law}, peer {peer}: {changed} {injected}");
            assert!(changed.abs() > 100.0 * most, "{law}, peer {peer}: {changed}");
        }
    }
}

/// Angular velocity [rad/s] and coordination torque \[N·m\] of the first peer, indexed by tick.
#[derive(Default)]
struct Spins {
    rates: Vec<[f64; 3]>,
    torques: Vec<[f64; 3]>,
}

impl Observer for Spins {
    type Error = Infallible;

    fn wants_ticks(&self) -> bool {
        true
    }

    fn on_tick(&mut self, row: &TickRow<'_>) -> Result<(), Infallible> {
        if let (0, Some(turn)) = (row.peer, &row.turn) {
            self.rates.push(turn.object.rate);
            self.torques.push(*turn.coordination_torque);
        }
        Ok(())
    }
}

/// β takes from a free top, about each axis, its share of the energy that all damping takes. The gyroscopic term, which moves energy between the axes, changes
/// nothing in that.
#[test]
fn the_damping_of_a_law_takes_its_share_of_the_energy() {
    let ground = [1e-5, 4e-5, 2e-5];
    let object = format!("mass = {MASS}\ninertia = {INERTIA:?}\nrotational-damping = {ground:?}");
    let law = "local-damping\"\nlocal-damping.damping = 0.8\nscaling = \"none";
    let scene = read(&untouched(3, law, &object, "stiffness = 0", &vec!["angular-velocity = [3, 5, -4]".to_owned(); 2]));
    let beta = INERTIA.map(|inertia| 0.8 * inertia / MASS);
    let mut seen = Spins::default();
    let Ok(_) = Simulation::new(&scene, Model::Least).run(&mut seen);
    for (torque, rate) in seen.torques.iter().zip(&seen.rates) {
        assert!((0..3).all(|axis| (torque[axis] - beta[axis] * rate[axis]).abs() < 1e-18), "{torque:?}");
    }
    let end = run(&scene).peers[0].attitude.unwrap().rate;
    seen.rates.push(end);
    let loss = |rate: &[f64; 3]| (0..3).map(|axis| beta[axis] * rate[axis] * rate[axis]).sum::<f64>();
    // Simpson's rule over 200 ticks of 1 ms: rates change by at most 8 a second and more often by less.
    let taken: f64 = seen.rates.windows(3).step_by(2).map(|of| (loss(&of[0]) + 4.0 * loss(&of[1]) + loss(&of[2])) * 1e-3 / 3.0).sum();
    let injected = value(&scene, "peers.p0.energy_j");
    assert!((injected / -taken - 1.0).abs() < 200.0 * 8e-3_f64.powi(5), "{injected} {taken}");
}

/// The counterexample of a damping of half the bound, which gains energy, and the bound, which an automatic damping is.
#[test]
fn an_automatic_damping_lets_turns_inject_no_more_than_is_in_their_springs() {
    let peak = |age: &str| {
        let text = format!(
            "scene = {{ duration = \"3s\", axes = 3 }}\nobject = {{ mass = 1, inertia = 5e-5 }}\n\
             coordination = {{ strategy = \"local-damping\", stiffness = 0, rotational-stiffness = 0.02, update = \"1ms\", local-damping = {{ {age} }} }}\n\
             link = {{ delay = \"8ms\" }}\npeer = {{ contact = \"none\", device = {{ mass = 0.1 }} }}\n\
             peers = [{{ name = \"a\", angular-velocity = [0.1, 0, 0] }}, {{ name = \"b\", orientation = [{:?}, 0, 0, 0.5] }}]\n\
             measure = {{ names = [\"energy_peak_j\"] }}\n",
            3.0_f64.sqrt() / 2.0
        );
        let scene = read(&text);
        Measures::run(&scene, Model::Least).values[0].value.unwrap()
    };
    // KR·(1 − cos 60°).
    let spring = 0.02 * 0.5;
    assert!(peak("") <= spring * (1.0 + 1e-12), "{}", peak(""));
    assert!(peak("age = \"3.5ms\"") > 2.0 * spring, "{}", peak("age = \"3.5ms\""));
}
