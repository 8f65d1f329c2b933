//! A full mesh of N peers at 1 kHz, 125 samples of 64 bytes a second, 24 ms one way.
#![allow(clippy::cast_precision_loss, reason = "every number here is small")]

use cohaptic_harness::{Model, NoObserver, Simulation, Summary};
use cohaptic_peer::{DeviceConfig, Gains};
use cohaptic_scene::Scene;

/// The control period.
pub const TICK_NANOS: u64 = 1_000_000;
/// Ticks between two samples.
pub const TICKS_A_FRAME: u64 = 8;
/// The delay one way, the mean of it if it varies.
pub const DELAY_NANOS: u64 = 24_000_000;
/// The deviation of the jitter, where there is jitter.
pub const SD_NANOS: f64 = 2e6;
/// The fraction of packets lost, where packets are lost.
pub const LOSS: f64 = 0.01;
/// The seed of all draws.
pub const SEED: u64 = 1;
/// The device of every peer.
pub const DEVICE: DeviceConfig = DeviceConfig { mass: 0.1, damping: 5.0 };
/// The coupling of every peer.
pub const COUPLING: Gains = Gains { stiffness: 3500.0, damping: 5.0 };
/// The mass of the whole object \[kg\]; every copy has its share.
pub const OBJECT_MASS: f64 = 0.45;
/// KT and BT before scaling.
pub const GAINS: Gains = Gains { stiffness: 200.0, damping: 5.0 };
/// The force of the first peer's hand \[N\].
pub const HAND_FORCE: f64 = 1.5;

/// One cell of a table: a number of peers, with or without jitter and loss.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Mesh {
    /// The number of peers, 2 at least.
    pub peers: usize,
    /// 2 ms of normal jitter and 1 % of loss.
    pub impaired: bool,
}

impl Mesh {
    /// The keys of impaired links beside the delay.
    pub const IMPAIRMENTS: &str = "jitter = \"2ms\"\nloss = \"1%\"";

    /// The cells of the tables.
    pub const ALL: [Self; 6] = [
        Self { peers: 3, impaired: false },
        Self { peers: 3, impaired: true },
        Self { peers: 10, impaired: false },
        Self { peers: 10, impaired: true },
        Self { peers: 50, impaired: false },
        Self { peers: 50, impaired: true },
    ];

    /// The links, in words.
    #[must_use]
    pub const fn links(self) -> &'static str {
        if self.impaired { "24 ms ± 2 ms normal, 1 % loss" } else { "24 ms" }
    }

    /// KT and BT with the scaling by the number of peers.
    #[must_use]
    pub fn scaled_gains(self) -> Gains {
        let n = self.peers as f64;
        GAINS.scaled(4.0 * (n - 1.0) / (n * n))
    }

    /// The scene, of a number of ticks.
    ///
    /// # Panics
    ///
    /// If it is no scene, which a test would show.
    #[must_use]
    pub fn scene(self, ticks: u64, seed: u64) -> Scene {
        self.scene_over(self.keys(), ticks, seed)
    }

    /// The scene, of a number of ticks, with these keys of links beside the delay.
    ///
    /// # Panics
    ///
    /// If they are no keys of links.
    #[must_use]
    pub fn scene_over(self, links: &str, ticks: u64, seed: u64) -> Scene {
        Scene::parse(&Self::text_over(self.peers, links, ticks, seed), "mesh.toml".as_ref(), &[]).expect("the mesh is a scene")
    }

    /// The scene as a file.
    #[must_use]
    pub fn text(self, ticks: u64, seed: u64) -> String {
        Self::text_over(self.peers, self.keys(), ticks, seed)
    }

    const fn keys(self) -> &'static str {
        if self.impaired { Self::IMPAIRMENTS } else { "" }
    }

    /// The scene of that number of peers as a file, with these keys of links beside the delay. A profile has a delay of its own.
    #[must_use]
    pub fn text_over(peers: usize, links: &str, ticks: u64, seed: u64) -> String {
        let delay = if links.starts_with("profile") { "" } else { "delay = \"24ms\"" };
        format!(
            r#"
            [scene]
            duration = "{ticks}ms"
            seed = {seed}
            count = {peers}
            [object]
            mass = {OBJECT_MASS}
            [coordination]
            strategy = "average-position"
            scaling = "inverse-n"
            stiffness = {}
            damping = {}
            update = "8ms"
            [peer]
            device = {{ mass = {}, damping = {} }}
            coupling = {{ stiffness = {}, damping = {} }}
            [[peers]]
            name = "peer1"
            hand = {{ force = {HAND_FORCE} }}
            [link]
            {delay}
            {links}
            "#,
            GAINS.stiffness, GAINS.damping, DEVICE.mass, DEVICE.damping, COUPLING.stiffness, COUPLING.damping,
        )
    }

    /// Runs the program on the scene.
    #[must_use]
    pub fn run(scene: &Scene) -> Summary {
        let Ok(summary) = Simulation::new(scene, Model::Least).run(&mut NoObserver);
        summary
    }
}
