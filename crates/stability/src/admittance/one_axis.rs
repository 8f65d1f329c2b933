//! The admittance along one axis of a scene that does not turn, or on the one axis of an independent part of a turning object.

use cohaptic_peer::{Contact, Exchange, Gains};
use cohaptic_scene::Scene;

use super::harmonic::Harmonic;
use super::response::AdmittancePoint;
use crate::analysis::arms_alone;
use crate::lifted::{Body, Lifted, Node, Sampling};
use crate::linear_form::LinearLaw;
use crate::network::NominalNetwork;
use crate::parts::{radius_of, reduced};
use crate::structure::{Contacts, Structure};
use crate::timetable::{NodeClock, Timetable};
use crate::{AnalysisError, Matrix, Method, Radius, Watch};

/// A linear scene of one axis, reduced to one node per class of equal peers, in which the device of one node is pushed.
#[derive(Clone, Debug)]
pub(super) struct OneAxis {
    pub(super) nodes: Vec<Node>,
    pub(super) weights: Matrix,
    pub(super) timetable: Timetable,
    pub(super) time: f64,
    pub(super) tied: bool,
    /// Index in `nodes` of the pushed node.
    pub(super) pushed: usize,
}

impl OneAxis {
    /// Prepares the push of the device of `peer` along `axis` of a scene that does not turn. Returns the system, the spectral radius of the linear scene, and
    /// notes about the parts left out.
    pub(super) fn of(
        scene: &Scene,
        peer: usize,
        axis: usize,
        network: &NominalNetwork,
        watch: &dyn Watch,
    ) -> Result<(Self, Radius, Vec<String>), AnalysisError> {
        let spec = &scene.peers[peer];
        let (contacts, notes) = closed_contacts(scene, axis);
        let structure = Structure::with_alone(&[scene], network, &contacts, Some(peer))?;
        let (mut found, radius) = Self::of_classes(scene, structure, peer, watch)?;
        // A device that touches nothing is coupled to no copy, so that only its own plant moves. The radius stays that of the scene.
        if !contacts.touching[peer] {
            let device = scene.device_plant(peer);
            let body = Some(Body::new(device, scene.integrator, &spec.clock));
            found.leave_bare(body, NodeClock::of(scene, peer), device.stiffness > 0.0)?;
        }
        Ok((found, radius, network.notes.iter().cloned().chain(notes).collect()))
    }

    /// Prepares the push from classes of equal peers, in which `peer` is alone in its class. Returns the system with the spectral radius of the scene.
    pub(super) fn of_classes(scene: &Scene, structure: Structure, peer: usize, watch: &dyn Watch) -> Result<(Self, Radius), AnalysisError> {
        let radius = radius_of(&reduced(&structure, scene, 1, Method::Reduced, watch)?.parts);
        let nodes = structure.nodes(scene);
        let time = structure.time(scene, &nodes);
        let pushed = structure.classes.iter().position(|class| class[0] == peer).expect("every peer is in a class");
        let Structure { timetable, weights, tied, .. } = structure;
        Ok((Self { nodes, weights, timetable, time, tied, pushed }, radius))
    }

    /// Returns the admittance at a valid frequency `hz` \[Hz\].
    pub(super) fn point(&self, hz: f64) -> AdmittancePoint {
        let Self { nodes, weights, timetable, time, tied, pushed } = self;
        let lifted = Lifted { nodes, weights, timetable, sampling: Sampling::of(nodes), time: *time, tied: *tied };
        Harmonic::new(&lifted, *pushed, hz).point()
    }

    /// Reduces the system to the device of the pushed peer. Every node has a copy of the object, so the node keeps its copy; without a coupling the copy rests.
    fn leave_bare(&mut self, device: Option<Body>, clock: NodeClock, tied: bool) -> Result<(), AnalysisError> {
        let none = Gains { stiffness: 0.0, damping: 0.0 };
        let bare = self.nodes[self.pushed].clone();
        self.nodes =
            vec![Node { device, coupling: none, law: LinearLaw::none(), wall: None, compute_delay: false, exchange: Exchange::EACH_TICK, ..bare }];
        self.weights = Matrix::zeros(1, 1);
        // The device sends and receives no samples, so the frame is a single tick.
        self.timetable = Timetable::new(&[NodeClock { phase: 0, every: 1, exchange: 1, ..clock }], &[])?;
        self.tied = tied;
        self.pushed = 0;
        Ok(())
    }
}

/// Note for a scene with a timeline: the analysis takes the scene before the first change.
pub(super) const TIMELINE: &str = "the timeline is left out: the scene is analysed as it begins";

/// Returns contacts in which every one-sided contact along `axis` is closed and no copy is at a wall, and notes that tell the user about each change.
pub(super) fn closed_contacts(scene: &Scene, axis: usize) -> (Contacts, Vec<String>) {
    let pushes = |peer: usize| match scene.peers[peer].contact {
        Contact::Push(direction) => Some(direction.axis),
        Contact::Grasp | Contact::None => None,
    };
    let touching = |peer: usize| scene.peers[peer].contact == Contact::Grasp || pushes(peer) == Some(axis);
    let touching: Vec<bool> = (0..scene.peers.len()).map(touching).collect();
    let mut notes = Vec::new();
    if (0..scene.peers.len()).any(|peer| pushes(peer) == Some(axis)) {
        notes.push("one-sided contacts are taken as closed: a hand that pulls would let go".to_owned());
    }
    if scene.object.enclosure.is_some() {
        notes.push("the enclosure is left out: the object is away from its walls".to_owned());
    }
    if !scene.timeline.is_empty() {
        notes.push(TIMELINE.to_owned());
    }
    notes.extend(arms_alone(scene));
    let absent = vec![false; scene.peers.len()];
    (Contacts { touching, at_wall: false, absent }, notes)
}
