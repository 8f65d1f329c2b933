//! The contacts of a scene along one axis.

use cohaptic_peer::{Contact as ContactKind, Gains};
use cohaptic_scene::Scene;
use cohaptic_stability::frames::{Contacts, Piece, Structure};

use super::contact_frame::{Contact, Kind};
use super::error::SwitchingError;

/// The contacts of a scene along one axis.
pub(super) struct Along<'a> {
    pub(super) scene: &'a Scene,
    axis: usize,
    /// Grasps, held at all times, and the pushes along the axis; walls are left open.
    pub(super) contacts: Contacts,
}

impl<'a> Along<'a> {
    pub(super) fn new(piece: &'a Piece<'_>, axis: usize) -> Self {
        let scene: &Scene = &piece.scene;
        let touches = |spec: &cohaptic_scene::PeerSpec| match spec.contact {
            ContactKind::Grasp => true,
            ContactKind::None => false,
            ContactKind::Push(direction) => direction.axis == axis,
        };
        let touching = scene.peers.iter().map(touches).collect();
        Self { scene, axis, contacts: Contacts { touching, at_wall: false, absent: piece.absent.clone() } }
    }

    /// Returns the direction of a peer's push along the axis: to larger positions (`true`) or to smaller positions (`false`); `None` if the peer does not push
    /// along the axis.
    pub(super) fn pushes(&self, peer: usize) -> Option<bool> {
        match self.scene.peers[peer].contact {
            ContactKind::Push(direction) if direction.axis == self.axis => Some(direction.positive),
            ContactKind::Push(_) | ContactKind::Grasp | ContactKind::None => None,
        }
    }

    /// Sets whether the structure is tied to ground: if the structure is silent, or if a peer with a stiff arm grasps the object. The arm of a
    /// pushing peer does not tie the object, because the contact can open.
    pub(super) fn tied(&self, mut structure: Structure) -> Structure {
        let holds = |class: &Vec<usize>| {
            self.contacts.touching[class[0]] && self.pushes(class[0]).is_none() && self.scene.device_plant(class[0]).stiffness > 0.0
        };
        structure.tied = structure.silent || structure.classes.iter().any(holds);
        structure
    }

    /// Returns the contacts of one member of a class, at the node with the index `node`: the push, and the walls if `walls`.
    ///
    /// # Errors
    ///
    /// [`SwitchingError::NoSpring`] if the stiffness of a contact is not above zero.
    pub(super) fn of_class(&self, structure: &Structure, class: usize, node: usize, walls: bool) -> Result<Vec<Contact>, SwitchingError> {
        let peer = structure.classes[class][0];
        let mut all = Vec::new();
        if let Some(positive) = self.pushes(peer) {
            let armed = self.scene.device_plant(peer).stiffness > 0.0;
            all.push(Contact { node, kind: Kind::Push { positive }, gains: self.scene.coupling(peer), armed });
        }
        if let Some(wall) = self.scene.object.enclosure.filter(|_| walls) {
            all.push(Contact { node, kind: Kind::Wall, gains: Gains { stiffness: wall.stiffness, damping: wall.damping }, armed: false });
        }
        if all.iter().any(|contact| contact.gains.stiffness <= 0.0) {
            return Err(SwitchingError::NoSpring { what: self.scene.peers[peer].name.clone() });
        }
        Ok(all)
    }
}
