//! Numbers of a scene on which the motion depends: reading and writing of each number, and the search for the numbers that a key sets.

use cohaptic_peer::Hand;
use cohaptic_scene::{PeerSpec, Scene};

/// One number of a scene that a key may set.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Leaf {
    ObjectMass,
    ObjectDamping,
    WallStiffness,
    WallDamping,
    CoordinationStiffness,
    CoordinationDamping,
    /// A number of one peer, with the index of the peer in [`Scene::peers`].
    Peer(usize, PeerLeaf),
}

/// One number of a peer.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum PeerLeaf {
    DeviceMass,
    DeviceDamping,
    CouplingStiffness,
    CouplingDamping,
    ArmMass,
    ArmDamping,
    ArmStiffness,
}

impl PeerLeaf {
    const ALL: [Self; 7] =
        [Self::DeviceMass, Self::DeviceDamping, Self::CouplingStiffness, Self::CouplingDamping, Self::ArmMass, Self::ArmDamping, Self::ArmStiffness];

    fn of(self, spec: &mut PeerSpec) -> Option<&mut f64> {
        let arm = match &mut spec.hand {
            Some(Hand::Arm { arm, .. } | Hand::Operator { arm, .. }) => Some(arm),
            Some(Hand::Force(_)) | None => None,
        };
        match self {
            Self::DeviceMass => Some(&mut spec.device.mass),
            Self::DeviceDamping => Some(&mut spec.device.damping),
            Self::CouplingStiffness => Some(&mut spec.coupling.stiffness),
            Self::CouplingDamping => Some(&mut spec.coupling.damping),
            Self::ArmMass => arm.map(|arm| &mut arm.mass),
            Self::ArmDamping => arm.map(|arm| &mut arm.damping),
            Self::ArmStiffness => arm.map(|arm| &mut arm.stiffness),
        }
    }
}

impl Leaf {
    /// Returns the place of the number in a scene, or `None` if the scene has no such number: no enclosure, no arm, or no peer with that index.
    pub(super) fn of(self, scene: &mut Scene) -> Option<&mut f64> {
        match self {
            Self::ObjectMass => Some(&mut scene.object.mass),
            Self::ObjectDamping => Some(&mut scene.object.damping),
            Self::WallStiffness => scene.object.enclosure.as_mut().map(|wall| &mut wall.stiffness),
            Self::WallDamping => scene.object.enclosure.as_mut().map(|wall| &mut wall.damping),
            Self::CoordinationStiffness => Some(&mut scene.coordination.gains.stiffness),
            Self::CoordinationDamping => Some(&mut scene.coordination.gains.damping),
            Self::Peer(place, leaf) => scene.peers.get_mut(place).and_then(|spec| leaf.of(spec)),
        }
    }

    pub(super) fn set(self, scene: &mut Scene, value: f64) {
        if let Some(number) = self.of(scene) {
            *number = value;
        }
    }
}

/// A scene together with the values of the keys with which the scene was read, one value per key.
pub(super) struct Probe {
    pub(super) values: Vec<f64>,
    pub(super) scene: Scene,
}

/// Returns, for each key, the numbers of the scene that take the value of the key, or `None` if the keys change anything else of the scene.
///
/// The first probe's scene is written to during the check, and holds the first probe's values again on success.
pub(super) fn learn(probes: &mut [Probe]) -> Option<Vec<Vec<Leaf>>> {
    let keys = probes.first()?.values.len();
    let mut learned = vec![Vec::new(); keys];
    let peers = probes.first()?.scene.peers.len();
    if probes.iter().any(|probe| probe.scene.peers.len() != peers) {
        return None;
    }
    let whole =
        [Leaf::ObjectMass, Leaf::ObjectDamping, Leaf::WallStiffness, Leaf::WallDamping, Leaf::CoordinationStiffness, Leaf::CoordinationDamping];
    let of_peers = (0..peers).flat_map(|place| PeerLeaf::ALL.map(|leaf| Leaf::Peer(place, leaf)));
    for leaf in whole.into_iter().chain(of_peers) {
        for (key, leaves) in learned.iter_mut().enumerate() {
            // A number belongs to a key if the number equals the value of the key in every probe. Adding 0.0 turns −0.0 into 0.0, the form in which the
            // value was printed for the reader of the scene.
            let holds = |probe: &mut Probe| {
                let value = probe.values[key] + 0.0;
                leaf.of(&mut probe.scene).is_some_and(|number| number.to_bits() == value.to_bits())
            };
            if probes.iter_mut().all(holds) {
                leaves.push(leaf);
            }
        }
    }
    // If the keys do anything besides setting these numbers, the first scene with the numbers of another probe still differs from that probe's scene.
    let (first, others) = probes.split_first_mut()?;
    for probe in others {
        for (leaves, value) in learned.iter().zip(&probe.values) {
            for leaf in leaves {
                leaf.set(&mut first.scene, *value);
            }
        }
        if first.scene != probe.scene {
            return None;
        }
    }
    for (leaves, value) in learned.iter().zip(&first.values) {
        for leaf in leaves {
            leaf.set(&mut first.scene, *value);
        }
    }
    Some(learned)
}
