//! The numbers of a scene that its motion depends on, each with a way to read and to write it.

use cohaptic_peer::Hand;
use cohaptic_scene::{PeerSpec, Scene};

/// One number of a scene.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Leaf {
    ObjectMass,
    ObjectDamping,
    WallStiffness,
    WallDamping,
    CoordinationStiffness,
    CoordinationDamping,
    /// Of the peer at that place.
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
            Some(Hand::Arm { arm, .. }) => Some(arm),
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
    /// The number; `None` if the scene has none there.
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

/// Scenes that were read with values for some keys, one value for each key.
pub(super) struct Probe {
    pub(super) values: Vec<f64>,
    pub(super) scene: Scene,
}

/// For each key, the numbers that take its value; `None` unless that is all that the keys do.
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
            let holds = |probe: &mut Probe| {
                let value = probe.values[key] + 0.0;
                leaf.of(&mut probe.scene).is_some_and(|number| number.to_bits() == value.to_bits())
            };
            if probes.iter_mut().all(holds) {
                leaves.push(leaf);
            }
        }
    }
    // Whatever else the keys do shows as a difference that writing the numbers does not make up for.
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
