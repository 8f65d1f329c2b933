//! The base scene, and what scenes have beyond it.

use cohaptic_harness::Model;
use cohaptic_scene::Scene;

use crate::AccuracyError;

/// Something that a scene can need.
#[derive(Clone, Copy, Debug)]
pub(super) struct Variant {
    /// What it is called.
    pub(super) name: &'static str,
    /// Axes of the scene: the hand moves along all.
    pub(super) axes: usize,
    /// The keys that it takes, over those of the base.
    pub(super) overrides: &'static [&'static str],
    /// The part of a run that is watched.
    pub(super) recorded: Recorded,
    /// What simulates it.
    pub(super) model: Model,
}

/// The part of a run that is watched.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Recorded {
    /// Nothing.
    Nothing,
    /// Every tick of every peer, as a row of text.
    Trajectory,
    /// Every packet, as a row of text.
    Packets,
    /// Every packet, of which nothing is kept.
    CountedPackets,
}

impl Variant {
    /// What a reader should know of it besides its cost.
    pub(super) fn words(&self) -> String {
        match self.overrides {
            [] => String::new(),
            keys => format!("; {}", keys.join(", ")),
        }
    }
}

const fn scene(name: &'static str, overrides: &'static [&'static str]) -> Variant {
    Variant { name, axes: 1, overrides, recorded: Recorded::Nothing, model: Model::Least }
}

const fn with_axes(name: &'static str, axes: usize) -> Variant {
    Variant { axes, ..scene(name, &[]) }
}

const fn recorded(name: &'static str, recorded: Recorded) -> Variant {
    Variant { recorded, ..scene(name, &[]) }
}

const fn general(name: &'static str, overrides: &'static [&'static str]) -> Variant {
    Variant { model: Model::General, ..scene(name, overrides) }
}

/// Each has one thing more than the base.
pub(super) const VARIANTS: [Variant; 27] = [
    scene("nothing else", &[]),
    with_axes("a second axis", 2),
    with_axes("a second and a third axis", 3),
    scene("jitter", &["link.jitter=2ms"]),
    scene("jitter, gamma", &["link.jitter={ sd = \"2ms\", distribution = \"gamma\", floor = \"20ms\" }"]),
    scene("jitter with correlation", &["link.jitter={ sd = \"2ms\", correlation = 0.75 }"]),
    scene("loss", &["link.loss=1%"]),
    scene("loss in bursts", &["link.loss={ gilbert-elliott = { p = 0.01, r = 0.2 } }"]),
    scene("jitter and loss", &["link.jitter=2ms", "link.loss=1%"]),
    scene("in-order arrival", &["link.order=in-order"]),
    scene("duplication", &["link.duplicate=1%"]),
    scene("corruption", &["link.corrupt=1%"]),
    scene("reordering", &["link.reorder=1%"]),
    scene("a rate and its queue", &["link.rate=1Mbit", "link.queue={ limit = \"100 packets\" }"]),
    scene("a token bucket", &["link.token-bucket={ rate = \"1Mbit\", burst = \"10kB\" }"]),
    scene("netem of Linux 6.6", &["link={ netem = \"delay 24ms\", netem-profile = \"kernel-6.6\" }"]),
    scene("one-sided contact", &["peer.contact={ push = \"+x\" }"]),
    scene("a compute delay", &["peer.compute-delay=1"]),
    scene("a clock that drifts", &["peer.clock={ drift = \"20ppm\" }"]),
    scene("a walled enclosure", &["object.enclosure={ min = -0.5, max = 0.5, stiffness = 2000.0, damping = 5.0 }"]),
    scene("a tick of half a millisecond", &["peer.tick=500us"]),
    scene("steps of Euler's", &["simulation.integrator=semi-implicit-euler"]),
    recorded("a trajectory as text", Recorded::Trajectory),
    recorded("packets looked at", Recorded::CountedPackets),
    recorded("packets as text", Recorded::Packets),
    general("the general model", &[]),
    general("the general model, with jitter and loss", &["link.jitter=2ms", "link.loss=1%"]),
];

/// Three peers hold one object over links of 24 ms; the first one moves it.
const BASE: &str = r#"
    scene        = { duration = "1s", count = 3, seed = 7 }
    object       = { mass = 0.45, damping = 0.5 }
    coordination = { strategy = "average-position", stiffness = 200.0, damping = 5.0, update = "8ms" }
    peer         = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
    link         = { delay = "24ms" }

    [[peers]]
    name = "peer1"
    hand = { sine = { amplitude = AMPLITUDE, frequency = 1.3, phase = 0.2 } }
"#;

pub(super) fn base(millis: u64) -> Result<Scene, AccuracyError> {
    with(&scene("nothing else", &[]), millis)
}

/// The base with that.
pub(super) fn with(variant: &Variant, millis: u64) -> Result<Scene, AccuracyError> {
    let amplitude = ["1.5", "[1.5, 1.0]", "[1.5, 1.0, 0.5]"][variant.axes - 1];
    let mut overrides: Vec<String> = variant.overrides.iter().map(|key| (*key).to_owned()).collect();
    overrides.extend([format!("scene.duration={millis}ms"), format!("scene.axes={}", variant.axes)]);
    Ok(Scene::parse(&BASE.replace("AMPLITUDE", amplitude), format!("{}.toml", variant.name).as_ref(), &overrides)?)
}
