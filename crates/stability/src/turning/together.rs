//! The classes of a scene that turns, and what of them moves.

use cohaptic_peer::Contact;
use cohaptic_scene::Scene;

use super::displacement::Displacement;
use super::frame::{SAMPLE, Turning};
use super::node::Node;
use super::rigid;
use crate::cost::PartCost;
use crate::network::NominalNetwork;
use crate::structure::{Contacts, Structure, common_time, linear_law};
use crate::timetable::Timetable;
use crate::{AnalysisError, Matrix, Watch};

/// The classes of a scene that turns, and what of them moves.
#[derive(Clone, Debug)]
pub(crate) struct Together {
    pub(crate) structure: Structure,
    pub(super) nodes: Vec<Node>,
    pub(super) time: f64,
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

    /// With one peer in a class of its own.
    pub(crate) fn with_alone(scene: &Scene, network: &NominalNetwork, alone: usize, watch: &dyn Watch) -> Result<Self, AnalysisError> {
        let structure = Structure::with_alone(&[scene], network, &contacts(scene)?, Some(alone))?;
        allowed(&structure, watch)?;
        Ok(Self::new(scene, structure))
    }

    /// The system of the classes' averages.
    pub(crate) fn turning(&self) -> Turning<'_> {
        let Self { structure, nodes, time, free } = self;
        Turning { nodes, weights: &structure.weights, timetable: &structure.timetable, time: *time, free: free.clone() }
    }

    /// How the members of a class differ.
    pub(super) fn apart<'t>(&'t self, class: usize, timetable: &'t Timetable, weight: &'t Matrix) -> Turning<'t> {
        Turning { nodes: &self.nodes[class..=class], weights: weight, timetable, time: self.time, free: Vec::new() }
    }

    /// The node of a class.
    pub(crate) fn node(&self, class: usize) -> &Node {
        &self.nodes[class]
    }

    /// What velocities are multiplied by \[s\].
    pub(crate) const fn time(&self) -> f64 {
        self.time
    }
}

/// Refuses more samples on the way than their matrix may have, before there is room for any of them.
pub(crate) fn allowed(structure: &Structure, watch: &dyn Watch) -> Result<(), AnalysisError> {
    PartCost::of_eigenvalues(SAMPLE * structure.timetable.depth.iter().sum::<usize>()).allowed(watch)
}

/// The peers whose devices hold the object. A finger would push along an axis of the world, and a law that looks back or remembers torques would be another state.
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
