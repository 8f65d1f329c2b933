//! Compilation of a scene to the least that its run needs: the model of each part. Every choice gives the same results to the bit.

use cohaptic_peer::Drift;
use cohaptic_scene::{Axes, ChangeKind, PeerSpec, Scene};

/// Extent of the machinery in a run.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
#[non_exhaustive]
pub enum Model {
    /// The least that the scene needs.
    #[default]
    Least,
    /// Everything in the program: three axes, an event for each tick of each peer, every device, and the complete chain of stages for every link, even for
    /// links with few stages. Slower, with the same results. Serves to test the choices of [`Model::Least`].
    General,
}

/// Models of the parts of a scene.
#[derive(Clone, PartialEq, Eq, Debug)]
pub(crate) struct Plan {
    pub(crate) axes: Axes,
    pub(crate) ticking: Ticking,
    /// Choice for the device of each peer, indexed by peer.
    pub(crate) devices: Vec<DeviceChoice>,
    /// `true` if links with nothing but a constant delay use the complete chain of stages too.
    pub(crate) general_links: bool,
}

/// Scheduling of ticks.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Ticking {
    /// All peers tick at the same instants, in a loop.
    Lockstep,
    /// Each peer has its own instants, in an event queue.
    EventDriven,
}

/// Choice for a peer's device.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum DeviceChoice {
    /// The device is simulated.
    Simulated,
    /// The device touches nothing and never moves, so a point replaces the device.
    Resting,
    /// The device moves but touches nothing, and no observer sees the device.
    Unobserved,
}

impl Plan {
    pub(crate) fn new(scene: &Scene, model: Model, ticks_are_observed: bool) -> Self {
        match model {
            Model::General => Self {
                axes: Axes::Three,
                ticking: Ticking::EventDriven,
                devices: vec![DeviceChoice::Simulated; scene.peers.len()],
                general_links: true,
            },
            Model::Least => Self {
                axes: scene.axes,
                ticking: ticking(scene.peers.iter()),
                // A judge that ends the run observes the ticks too.
                devices: (0..scene.peers.len()).map(|peer| device(scene, peer, ticks_are_observed || scene.ends_with_task())).collect(),
                general_links: false,
            },
        }
    }
}

/// Returns the scheduling for some peers of a scene, which need not be all.
pub(crate) fn ticking<'a>(peers: impl Iterator<Item = &'a PeerSpec> + Clone) -> Ticking {
    let first = peers.clone().next().map(|peer| peer.clock.tick);
    // Equal ticks without offset and drift: all peers tick at the same instants for ever.
    let together = |peer: &PeerSpec| peer.clock.offset.is_zero() && peer.clock.drift == Drift::default() && Some(peer.clock.tick) == first;
    if first.is_some() && peers.clone().all(together) { Ticking::Lockstep } else { Ticking::EventDriven }
}

fn device(scene: &Scene, peer: usize, ticks_are_observed: bool) -> DeviceChoice {
    let spec = &scene.peers[peer];
    // A device that turns, or that starts with the motion of a point of a turning copy, is not at rest.
    let turns = scene.rotation.as_ref().map(|rotation| &rotation.peers[peer]);
    let moves = spec.velocity.iter().any(|v| *v != 0.0)
        || turns.is_some_and(|turns| turns.device.is_some() || turns.attitude.rate.iter().any(|rate| *rate != 0.0));
    let moved_later =
        scene.timeline.iter().any(|change| matches!(&change.what, ChangeKind::Hand { peer: changed, hand: Some(_) } if *changed == peer));
    // The order matters: a device that touches its copy is needed even if no hand moves the device and no observer sees the device.
    if scene.touches(peer) {
        DeviceChoice::Simulated
    } else if spec.hand.is_none() && !moved_later && !moves {
        DeviceChoice::Resting
    } else if ticks_are_observed {
        DeviceChoice::Simulated
    } else {
        DeviceChoice::Unobserved
    }
}
