//! The work that is measured: a full mesh of N peers at 1 kHz, 125 samples of 64 bytes a second, 24 ms one way.
#![allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    clippy::cast_precision_loss,
    clippy::float_cmp,
    reason = "a bare loop is written for speed; every number here is small"
)]

pub mod bare;
pub mod bare_pair;
pub mod by_hand;
pub mod effort;
pub mod kernel;
pub mod machine;
pub mod one_link;
pub mod pages;
pub mod verdicts;

use cohaptic_harness::{Model, NoObserver, Simulation, Summary};
use cohaptic_peer::{DeviceConfig, Gains};
use cohaptic_scene::Scene;

/// The control period.
pub const TICK_NANOS: u64 = 1_000_000;
/// Ticks between two samples.
pub const TICKS_A_FRAME: u64 = 8;
/// The delay one way.
pub const DELAY_NANOS: u64 = 24_000_000;
/// The deviation of the jitter, where there is jitter.
pub const SD_NANOS: f64 = 2e6;
/// The fraction of packets lost, where packets are lost.
pub const LOSS: f64 = 0.01;
/// The device of every peer.
pub const DEVICE: DeviceConfig = DeviceConfig { mass: 0.1, damping: 5.0 };
/// The coupling of every peer.
pub const COUPLING: Gains = Gains { stiffness: 3500.0, damping: 5.0 };
/// The mass of the whole object \[kg\]; every copy has its share.
pub const OBJECT_MASS: f64 = 0.45;
/// The damping of every copy [N·s/m].
pub const COPY_DAMPING: f64 = 0.0;
/// The force of the first peer's hand \[N\].
pub const HAND_FORCE: f64 = 1.5;

/// One cell of the table: a number of peers, with or without jitter and loss.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Mesh {
    /// The number of peers.
    pub peers: usize,
    /// 2 ms of normal jitter and 1 % of loss.
    pub impaired: bool,
}

impl Mesh {
    /// The cells of the table.
    pub const ALL: [Self; 6] = [
        Self { peers: 3, impaired: false },
        Self { peers: 3, impaired: true },
        Self { peers: 10, impaired: false },
        Self { peers: 10, impaired: true },
        Self { peers: 50, impaired: false },
        Self { peers: 50, impaired: true },
    ];

    /// The scene, of a duration \[s\].
    #[must_use]
    pub fn scene(self, seconds: u64) -> Scene {
        self.scene_with_seed(seconds, 1)
    }

    /// The links, in words.
    #[must_use]
    pub const fn links(self) -> &'static str {
        if self.impaired { "24 ms ± 2 ms normal, 1 % loss" } else { "24 ms" }
    }

    /// The scene with other random numbers.
    ///
    /// # Panics
    ///
    /// If the scene below is no scene, which a test would show.
    #[must_use]
    pub fn scene_with_seed(self, seconds: u64, seed: u64) -> Scene {
        let Self { peers, impaired } = self;
        let impairments = if impaired { "jitter = \"2ms\"\nloss = \"1%\"" } else { "" };
        let text = format!(
            r#"
            [scene]
            duration = "{seconds}s"
            seed = {seed}
            count = {peers}
            [object]
            mass = {OBJECT_MASS}
            [coordination]
            strategy = "average-position"
            scaling = "inverse-n"
            stiffness = {stiffness}
            damping = {damping}
            update = "8ms"
            [peer]
            device = {{ mass = {device_mass}, damping = {device_damping} }}
            coupling = {{ stiffness = {coupling_stiffness}, damping = {coupling_damping} }}
            [[peers]]
            name = "peer1"
            hand = {{ force = {HAND_FORCE} }}
            [link]
            delay = "24ms"
            {impairments}
            "#,
            stiffness = Self::GAINS.stiffness,
            damping = Self::GAINS.damping,
            device_mass = DEVICE.mass,
            device_damping = DEVICE.damping,
            coupling_stiffness = COUPLING.stiffness,
            coupling_damping = COUPLING.damping,
        );
        Scene::parse(&text, "mesh.toml".as_ref(), &[]).expect("the mesh is a scene")
    }

    /// Runs the program on the scene.
    #[must_use]
    pub fn run(scene: &Scene) -> Summary {
        let Ok(summary) = Simulation::new(scene, Model::Least).run(&mut NoObserver);
        summary
    }

    /// KT and BT before scaling.
    const GAINS: Gains = Gains { stiffness: 200.0, damping: 5.0 };

    /// KT and BT with the scaling by the number of peers.
    #[must_use]
    pub fn scaled_gains(self) -> Gains {
        let n = self.peers as f64;
        Self::GAINS.scaled(4.0 * (n - 1.0) / (n * n))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The loop and the program do the same work: same packets, same motion. The loop adds up increments in another order, so positions agree to
    /// rounding: 1000 ticks of motions below 1 m, each rounded to 2^-53, in a damped system that forgets them.
    #[test]
    fn the_bare_loop_and_the_program_agree() {
        for mesh in Mesh::ALL {
            let bare = bare::run(mesh, 1000);
            let summary = Mesh::run(&mesh.scene(1));
            for (peer, position) in summary.peers.iter().zip(&bare.positions) {
                assert!((peer.position[0] - position).abs() < 1e-11, "{mesh:?}: {} is not {position}", peer.position[0]);
            }
            assert!((summary.max_discrepancy - bare.max_discrepancy).abs() < 1e-11);
            let delivered: u64 = summary.links.iter().map(|link| link.stats.delivered()).sum();
            // The program also delivers what arrives after the last tick, up to the end of the scene.
            let last_millisecond = (mesh.peers * mesh.peers) as u64;
            assert!((bare.delivered..bare.delivered + last_millisecond).contains(&delivered), "{mesh:?}");
        }
    }
}
