//! The energy that the network injects into the copies, from what was recorded.
//!
//! W = Σᵢ Σ (−F·d − what β took) with F the force that a strategy holds over a tick, and d what a copy moves in it. Of what all damping takes in a tick,
//! f·d − ½·m·Δv² with f the sum of the held forces, β takes β/(bO + β).

use cohaptic_harness::Model;
use cohaptic_harness::measures::Measures;
use cohaptic_scene::{Measure, MeasureName, MeasureSettings, MeasureSpec, Scene};
use cohaptic_tests::{Body, Draft, Log, Tick};
use proptest::prelude::*;

/// The energy that the network has injected \[J\], and how far it may be from exact numbers.
pub(crate) struct Injected {
    /// After each step of a copy, in the order of the ticks at which they end.
    pub(crate) energy: Vec<f64>,
    rounding: f64,
}

impl Injected {
    /// Of a run along one axis, without walls.
    pub(crate) fn of(scene: &Scene, log: &Log) -> Self {
        let mass = scene.copy_mass();
        let own: Vec<f64> = (0..scene.peers.len()).map(|place| scene.own_damping(place)).collect();
        let mut before: Vec<Option<Tick>> = vec![None; scene.peers.len()];
        let (mut injected, mut exchanged, mut energy) = (0.0, 0.0, Vec::new());
        // Where the last step of each leads to is no tick any more.
        let end = |last: &Tick| {
            let end = &log.summary.peers[last.peer];
            Tick { object: Body { position: [end.position[0], 0.0, 0.0], velocity: [end.velocity[0], 0.0, 0.0] }, ..*last }
        };
        let ends: Vec<Tick> = (0..before.len()).filter_map(|peer| log.ticks.iter().rfind(|tick| tick.peer == peer)).map(end).collect();
        for next in log.ticks.iter().chain(&ends) {
            if let Some(now) = before[next.peer].replace(*next) {
                let own = own[next.peer];
                let (before, after) = (now.object, next.object);
                let moved = after.position[0] - before.position[0];
                let force = now.coordination_force[0] - own * before.velocity[0];
                let held = now.coupling_force[0] - force;
                injected -= force * moved;
                if own > 0.0 {
                    let damped = held * moved - 0.5 * mass * (after.velocity[0].powi(2) - before.velocity[0].powi(2));
                    injected -= damped * own / (own + scene.object.damping);
                }
                exchanged += (force.abs() + held.abs()) * (moved.abs() + before.position[0].abs() * 1e-4)
                    + mass * (after.velocity[0].powi(2) + before.velocity[0].powi(2))
                    + own * before.velocity[0].abs() * moved.abs();
                energy.push(injected);
            }
        }
        // Step maps are exact to 1e-11 of what they exchange (crates/peer/src/plant.rs), positions to 2^-53 < 1e-4·1e-11 of themselves.
        Self { energy, rounding: 1e-11 * exchanged }
    }

    /// The largest of all \[J\].
    pub(crate) fn peak(&self) -> f64 {
        self.energy.iter().copied().fold(f64::MIN, f64::max)
    }

    /// How much more it is than `most` \[J\]; above zero, by more than rounding, where it is more.
    pub(crate) fn excess(&self, most: f64) -> f64 {
        self.peak() - most - self.rounding - 1e-11 * most
    }

    /// Fails where the measures of the scene say something else.
    pub(crate) fn is_measured(&self, scene: &Scene) -> Result<(), TestCaseError> {
        let names = [Measure::Energy, Measure::EnergyPeak].map(|measure| MeasureName { measure, peer: None }).to_vec();
        let scene = Scene { measure: Some(MeasureSpec { names, settings: MeasureSettings::default() }), ..scene.clone() };
        let values = Measures::run(&scene, Model::Least).values;
        let (energy, peak) = (values[0].value.unwrap(), values[1].value.unwrap());
        prop_assert!((energy - self.energy.last().unwrap()).abs() <= self.rounding, "{energy} J are measured");
        prop_assert!(peak >= energy && peak <= self.peak().max(0.0) + self.rounding, "{peak} J are measured of {} J", self.peak());
        Ok(())
    }

    /// Fails where it is more than `most` \[J\], or where the tolerance decides.
    pub(crate) fn is_at_most(&self, most: f64) -> Result<(), TestCaseError> {
        prop_assert!(self.excess(most) <= 0.0, "{:e} J more than {most:e} J", self.excess(most));
        prop_assert!(self.rounding <= 1e-6 * self.energy.iter().copied().fold(most, |most, energy| most.max(energy.abs())));
        Ok(())
    }
}

/// U: what the springs between the copies store at the beginning \[J\].
pub(crate) fn stored_at_first(scene: &Scene) -> f64 {
    let pair = scene.coordination.gains.stiffness / (scene.peers.len() - 1) as f64;
    let squares = |one: &f64| scene.peers.iter().map(|other| (one - other.position[0]).powi(2)).sum::<f64>();
    scene.peers.iter().map(|one| 0.25 * pair * squares(&one.position[0])).sum()
}

/// Returns whether a link takes longer for a larger packet: extra numbers make samples larger.
pub(crate) fn has_rates(draft: &Draft) -> bool {
    draft.link.contains("rate") || draft.links.iter().any(|link| link.keys.contains("rate"))
}
