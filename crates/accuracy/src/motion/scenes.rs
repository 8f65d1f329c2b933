//! The four scenes: two peers each, on one axis, with ticks of 1 ms in lockstep.

use std::path::Path;

use cohaptic_scene::Scene;
use cohaptic_stability::{Family, FamilyError, KeyRange};

use crate::AccuracyError;

/// The tick of all scenes \[ns\].
pub(crate) const TICK_NANOS: f64 = 1e6;
/// The tick of all scenes \[s\], as the program has it.
pub(crate) const TICK: f64 = 1e-3;

/// Which gain is raised until the loop is unstable.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Along {
    /// KC.
    Coupling,
    /// KT.
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

/// Two peers, one on the right and one on the left, that hold one object; each scene says what differs from this one.
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

/// One of the scenes, and facts of it that the loop need not read from the text.
#[derive(Clone, Copy, Debug)]
pub(crate) struct MotionScene {
    pub(crate) name: &'static str,
    /// The difference from [`PAIR`], as texts `KEY=VALUE`.
    overrides: &'static [&'static str],
    /// How many ticks there are between two samples.
    pub(crate) update: usize,
    /// How many ticks a sample takes.
    pub(crate) delay: usize,
    /// Along which gain the boundary of stability is looked for, and within which range \[N/m\]: stable at its beginning. `None` where there is no loop,
    /// or none that is linear.
    pub(crate) boundary: Option<(Along, f64, f64)>,
}

impl MotionScene {
    pub(crate) fn scene(&self) -> Result<Scene, AccuracyError> {
        Ok(Scene::parse(PAIR, Path::new(FILE), &self.overrides())?)
    }

    /// The scene with a key left open.
    pub(crate) fn family(&self, range: KeyRange) -> Result<Family, FamilyError> {
        Family::new(PAIR, Path::new(FILE), &self.overrides(), vec![range])
    }

    fn overrides(&self) -> Vec<String> {
        self.overrides.iter().map(|&text| text.to_owned()).collect()
    }
}

const FILE: &str = "motion.toml";

/// A device that touches nothing, pushed by a constant force: it nears its last velocity in some time constants of 20 ms.
pub(crate) const FREE: MotionScene = MotionScene {
    name: "free device",
    overrides: &["coordination.stiffness=1000.0", "peer.contact=none", "peers.left.hand.force=1.0", "link.delay=8ms"],
    update: 8,
    delay: 8,
    boundary: None,
};

/// Two peers hold the object, one of them with an arm that stays where it is, the other pushing with 1 N.
pub(crate) const COUPLED: MotionScene = MotionScene {
    name: "coupled peers",
    overrides: &["object.damping=1.0", "peers.left.hand.arm={ mass = 0.3, damping = 10.0, stiffness = 100.0 }", "peers.right.hand.force=1.0"],
    update: 8,
    delay: 4,
    boundary: Some((Along::Coordination, 100.0, 20_000.0)),
};

/// These two, a sample every tick and light copies, with a coupling so stiff that a little more is unstable.
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

/// Each can push the object towards the other and cannot pull it, and both swing to and fro: contact is made and lost again and again.
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
