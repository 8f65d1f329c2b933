//! The result of an analysis: the verdict on a scene, with the covered modes of contact and notes about the parts left out.

use std::time::Duration;

use cohaptic_peer::operator::OperatorLaw;
use cohaptic_scene::Scene;

use crate::network::NominalNetwork;
use crate::operators::Crossover;
use crate::parts::Part;
use crate::{Method, Radius, Verdict};

/// Result of the analysis of a scene, with all modes of contact.
#[derive(Clone, PartialEq, Debug)]
pub struct Analysis {
    /// Largest radius of all modes of contact, without the rigid-body modes.
    pub radius: Radius,
    /// Number of removed rigid-body modes: along each axis, displacements of all bodies together (with waves, of each copy alone) and of each device
    /// that touches nothing. Counted in the mode of contact with the largest radius; if the object turns, added over all its motions.
    pub rigid_modes: usize,
    /// Number of remaining states: of bodies, of waiting forces, of exchanges with devices, and of samples held or in flight.
    pub dimension: usize,
    /// Method by which the radius was found.
    pub method: Method,
    /// Length of the frame over which the radius is taken. All events repeat after a frame.
    pub frame: Duration,
    /// Modes of contact: one for a linear scene, otherwise one per combination of open and closed contacts. If the object turns, each motion has
    /// modes of its own.
    pub modes: Vec<ContactMode>,
    /// Sentences about the parts of the scene that the verdict leaves out.
    pub notes: Vec<String>,
}

impl Analysis {
    /// Returns the verdict from the radius.
    #[must_use]
    pub fn verdict(&self) -> Verdict {
        self.radius.verdict()
    }

    /// Tells whether the verdict concerns the worst of several combinations of contacts.
    #[must_use]
    pub fn combines_contacts(&self) -> bool {
        combines(&self.modes)
    }
}

/// Tells whether any motion has several modes of contact. The modes of a motion stand next to one another in `modes`.
fn combines(modes: &[ContactMode]) -> bool {
    modes.windows(2).any(|pair| pair[0].motion == pair[1].motion)
}

/// Result for one combination of contacts, in which the scene is linear.
#[derive(Clone, PartialEq, Debug)]
pub struct ContactMode {
    /// Names of the components of a turning object's motion that this mode is about. Empty if the object does not turn.
    pub motion: String,
    /// Description of the closed contacts. Empty for a linear scene.
    pub contacts: String,
    /// Largest radius of the parts.
    pub radius: Radius,
    /// Parts of the mode with independent motions.
    pub parts: Vec<Part>,
    pub(crate) rigid_modes: usize,
    pub(crate) dimension: usize,
    pub(crate) frame: Duration,
}

/// Returns the mode with the largest radius, or `None` if there is no mode.
fn largest<'a>(modes: impl Iterator<Item = &'a ContactMode>) -> Option<&'a ContactMode> {
    modes.max_by(|one, other| one.radius.value.total_cmp(&other.radius.value))
}

pub(crate) fn combine(modes: Vec<ContactMode>, method: Method, network: &NominalNetwork, scene: &Scene) -> Analysis {
    let radius = modes.iter().map(|mode| mode.radius).reduce(Radius::or).unwrap_or(Radius { value: 0.0, error: 0.0 });
    let mut motions: Vec<&str> = modes.iter().map(|mode| mode.motion.as_str()).collect();
    motions.dedup();
    let of_motion = |motion: &&str| largest(modes.iter().filter(|mode| mode.motion == *motion));
    let all = motions.iter().filter_map(of_motion);
    let (rigid_modes, dimension) = all.fold((0, 0), |(rigid_modes, dimension), mode| (rigid_modes + mode.rigid_modes, dimension + mode.dimension));
    let largest = largest(modes.iter());
    let frame = largest.map_or(Duration::ZERO, |mode| mode.frame);
    let determinant = largest.is_some_and(|mode| mode.parts.iter().any(|part| part.method == Method::Determinant));
    let method = match method {
        Method::Full => Method::Full,
        Method::Reduced | Method::Determinant => {
            if determinant {
                Method::Determinant
            } else {
                Method::Reduced
            }
        }
    };
    let notes = notes(&network.notes, combines(&modes), scene);
    Analysis { radius, rigid_modes, dimension, method, frame, modes, notes }
}

/// End of the note about contacts that open and close: each combination is analysed as if it lasted.
pub const CHANGES_LEFT_OUT: &str = "changing between them is not covered";

/// Returns the notes in `said`, followed by notes about the parts of the scene that a verdict leaves out.
pub fn notes(said: &[String], combines: bool, scene: &Scene) -> Vec<String> {
    let mut notes = said.to_vec();
    if combines {
        notes.push(format!(
            "the scene is not linear: every combination of its contacts is analysed as if it lasted, and the verdict is that of the worst; {CHANGES_LEFT_OUT}"
        ));
    }
    if !scene.timeline.is_empty() {
        notes.push("the timeline is left out: the scene is analysed as it begins".to_owned());
    }
    if scene.rotation.is_some() {
        notes.push(UNLOADED.to_owned());
    }
    notes.extend(arms_alone(scene));
    if Crossover::first_peer(scene).is_some() {
        notes.push(TRACKED.to_owned());
    }
    notes
}

/// Note for operators who make movements: what follows from a look at a seen copy is no part of the analysis.
pub const ARMS_ALONE: &str =
    "of operators who make movements the arms alone are analysed: a movement is a wanted motion, and depends on what is seen only at its plan";

/// Returns [`ARMS_ALONE`] for a scene with an operator who makes movements; `None` without one.
pub(crate) fn arms_alone(scene: &Scene) -> Option<String> {
    let moves = |peer: usize| scene.operator(peer).is_some_and(|operator| matches!(operator.law, OperatorLaw::Moves(_)));
    (0..scene.peers.len()).any(moves).then(|| ARMS_ALONE.to_owned())
}

/// Note for operators who track: nothing of their law is left out, but the law begins and ends with the task.
pub const TRACKED: &str = "operators who track are analysed as during the task: their hands follow what they see, about the motion of the target";

/// Note for an object that turns: its equations are linearised for small motions.
pub const UNLOADED: &str = "the object turns: the verdict is about small motions near rest, all copies together, with no hand pushing";
