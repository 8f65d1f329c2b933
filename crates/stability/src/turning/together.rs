//! Classes of equal peers of a scene whose object turns, and the linear systems of these classes.

use cohaptic_peer::Contact;
use cohaptic_scene::Scene;

use super::frame::{SAMPLE, Turning};
use super::node::Node;
use super::rigid::{self, Displacement};
use crate::cost::PartCost;
use crate::network::NominalNetwork;
use crate::structure::{Contacts, Structure, common_time, linear_law};
use crate::timetable::Timetable;
use crate::{AnalysisError, Matrix, Watch};

/// Classes of equal peers of a scene whose object turns, with a node per class.
#[derive(Clone, Debug)]
pub(crate) struct Together {
    /// Classes, weights and timetables.
    pub(crate) structure: Structure,
    /// Node of each class.
    pub(super) nodes: Vec<Node>,
    /// Time by which velocities are multiplied \[s\].
    pub(super) time: f64,
    /// Displacements of everything that no force resists.
    pub(super) free: Vec<Displacement>,
}

impl Together {
    pub(crate) fn new(scene: &Scene, structure: Structure) -> Self {
        let nodes: Vec<Node> = structure.classes.iter().map(|class| Node::of(scene, class[0])).collect();
        let peers = structure.classes.iter().zip(&structure.touching).map(|(class, touching)| (class[0], *touching));
        let time = common_time(scene, structure.timetable.frame, structure.law(scene, 0).held_by(), peers, false);
        let free = if structure.silent { Vec::new() } else { rigid::displacements(&nodes) };
        Self { structure, nodes, time, free }
    }

    /// Returns the classes of a scene, with the peer `alone` in a class of its own even if other peers equal it.
    pub(crate) fn with_alone(scene: &Scene, network: &NominalNetwork, alone: usize, watch: &dyn Watch) -> Result<Self, AnalysisError> {
        let structure = Structure::with_alone(&[scene], network, &contacts(scene)?, Some(alone))?;
        allowed(&structure, watch)?;
        Ok(Self::new(scene, structure))
    }

    /// Returns the system of the classes' averages.
    pub(crate) fn turning(&self) -> Turning<'_> {
        let Self { structure, nodes, time, free } = self;
        Turning { nodes, weights: &structure.weights, timetable: &structure.timetable, time: *time, free: free.clone() }
    }

    /// Returns the system of the differences between the members of a class.
    pub(super) fn apart<'t>(&'t self, class: usize, timetable: &'t Timetable, weight: &'t Matrix) -> Turning<'t> {
        Turning { nodes: &self.nodes[class..=class], weights: weight, timetable, time: self.time, free: Vec::new() }
    }

    /// Returns the node of a class.
    pub(crate) fn node(&self, class: usize) -> &Node {
        &self.nodes[class]
    }

    /// Returns the time by which velocities are multiplied \[s\].
    pub(crate) const fn time(&self) -> f64 {
        self.time
    }
}

/// Refuses more samples on the way than the matrix of the frame may have, before memory for them is allocated.
pub(crate) fn allowed(structure: &Structure, watch: &dyn Watch) -> Result<(), AnalysisError> {
    PartCost::of_eigenvalues(SAMPLE * structure.timetable.depth.iter().sum::<usize>()).allowed(watch)
}

/// Returns the contacts of a scene: the peers whose devices grasp the object. Refuses a one-sided contact, which pushes along one axis of the world, and a law
/// with a lag or a memory, which would need further states.
pub(crate) fn contacts(scene: &Scene) -> Result<Contacts, AnalysisError> {
    if linear_law(scene, 0).is_some_and(|law| law.lag > 0 || !law.memory.is_empty()) {
        let why = scene.rotation_parts().and_then(Result::err).unwrap_or("all components are taken together");
        return Err(AnalysisError::Turns { what: scene.coordination.strategy.name(), why });
    }
    if scene.peers.iter().any(|spec| matches!(spec.contact, Contact::Push(_))) {
        let why = scene.rotation_parts().and_then(Result::err).unwrap_or("all components are taken together");
        return Err(AnalysisError::Turns { what: "a one-sided contact", why });
    }
    let touching = scene.peers.iter().map(|spec| spec.contact == Contact::Grasp).collect();
    Ok(Contacts { touching, at_wall: false, absent: vec![false; scene.peers.len()] })
}
