//! The four scenes, each with two peers on one axis and ticks of 1 ms in lockstep.

use std::path::Path;

use cohaptic_scene::Scene;
use cohaptic_stability::{Family, FamilyError, KeyRange};

use crate::AccuracyError;

/// The tick of all scenes \[ns\].
pub(crate) const TICK_NANOS: f64 = 1e6;
/// The tick of all scenes \[s\], as a double of the program.
pub(crate) const TICK: f64 = 1e-3;

/// Gain that is raised until the loop is unstable.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Along {
    /// KC, the stiffness of the coupling.
    Coupling,
    /// KT, the stiffness of the coordination.
    Coordination,
}

impl Along {
    pub(crate) const fn key(self) -> &'static str {
        match self {
            Self::Coupling => "peer.coupling.stiffness",
            Self::Coordination => "coordination.stiffness",
        }
    }
}

/// Two peers with a shared object. Each scene is a difference from this text.
const PAIR: &str = r#"
[scene]
duration = "4s"
[object]
mass = 0.3
[coordination]
strategy = "average-position"
stiffness = 500.0
damping = 5.0
update = "8ms"
[peer]
device = { mass = 0.1, damping = 5.0 }
coupling = { stiffness = 2000.0, damping = 5.0 }
[[peers]]
name = "left"
[[peers]]
name = "right"
[link]
delay = "4ms"
"#;

/// A scene, with facts that the loop does not read from the text.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MotionScene {
    pub(crate) name: &'static str,
    /// Differences from [`PAIR`], as texts `KEY=VALUE`.
    overrides: &'static [&'static str],
    /// Number of ticks between two samples.
    pub(crate) update: usize,
    /// Delay of a sample \[ticks\].
    pub(crate) delay: usize,
    /// Gain and range \[N/m\] of the search for the boundary of stability, stable at the begin. `None` for a scene without a loop, or with a nonlinear loop.
    pub(crate) boundary: Option<(Along, f64, f64)>,
}

impl MotionScene {
    /// Returns the parsed scene.
    pub(crate) fn scene(&self) -> Result<Scene, AccuracyError> {
        Ok(Scene::parse(PAIR, Path::new(FILE), &self.overrides())?)
    }

    /// Returns the scene with one key left open.
    pub(crate) fn family(&self, range: KeyRange) -> Result<Family, FamilyError> {
        Family::new(PAIR, Path::new(FILE), &self.overrides(), vec![range])
    }

    fn overrides(&self) -> Vec<String> {
        self.overrides.iter().map(|&text| text.to_owned()).collect()
    }
}

const FILE: &str = "motion.toml";

/// A device without contact under a constant force, which approaches its final velocity in some time constants of 20 ms.
pub(crate) const FREE: MotionScene = MotionScene {
    name: "free device",
    overrides: &["coordination.stiffness=1000.0", "peer.contact=none", "peers.left.hand.force=1.0", "link.delay=8ms"],
    update: 8,
    delay: 8,
    boundary: None,
};

/// Two peers that hold the object: the left peer with an arm at rest, the right peer with a push of 1 N.
pub(crate) const COUPLED: MotionScene = MotionScene {
    name: "coupled peers",
    overrides: &["object.damping=1.0", "peers.left.hand.arm={ mass = 0.3, damping = 10.0, stiffness = 100.0 }", "peers.right.hand.force=1.0"],
    update: 8,
    delay: 4,
    boundary: Some((Along::Coordination, 100.0, 20_000.0)),
};

/// Like [`COUPLED`], with a sample every tick, light copies, and a coupling so stiff that slightly more is unstable.
pub(crate) const STIFF: MotionScene = MotionScene {
    name: "stiff coupling",
    overrides: &[
        "object.damping=1.0",
        "coordination.update=1ms",
        "peer.coupling.stiffness=15400.0",
        "peers.left.hand.arm={ mass = 0.3, damping = 10.0, stiffness = 100.0 }",
        "peers.right.hand.force=1.0",
        "link.delay=2ms",
    ],
    update: 1,
    delay: 2,
    boundary: Some((Along::Coupling, 100.0, 1_000_000.0)),
};

/// Two peers with one-sided contacts, which push the object towards the partner, and with oscillating hands. Contact is made and lost repeatedly.
pub(crate) const PUSH: MotionScene = MotionScene {
    name: "one-sided contact",
    overrides: &[
        "object.damping=2.0",
        "peers.left.contact={ push = \"+x\" }",
        "peers.right.contact={ push = \"-x\" }",
        "peer.hand.sine={ amplitude = 1.5, frequency = 2.0 }",
    ],
    update: 8,
    delay: 4,
    boundary: None,
};

pub(crate) const SCENES: [MotionScene; 4] = [FREE, COUPLED, STIFF, PUSH];
