//! The verdict on a scene as it stands, and what it says of itself.

use std::time::Duration;

use cohaptic_scene::Scene;

use crate::network::NominalNetwork;
use crate::parts::Part;
use crate::{Method, Radius, Verdict};

/// The stability of a scene, as far as it is known.
#[derive(Clone, PartialEq, Debug)]
pub struct Analysis {
    /// The largest radius of all modes of contact, the rigid-body modes left out.
    pub radius: Radius,
    /// How many rigid-body modes were removed: displacements of everything together (with waves of each copy by itself), and of each device that touches nothing, per axis. Of the mode of
    /// contact with the largest radius; of an object that turns, of all its motions.
    pub rigid_modes: usize,
    /// How many states are left: of bodies, of forces that wait to be applied, and of samples that are held or in flight.
    pub dimension: usize,
    /// How it was reached.
    pub method: Method,
    /// The span that the radius is over: after it everything repeats.
    pub frame: Duration,
    /// One entry for a linear scene; one for each combination of open and closed contacts otherwise; and all this for each motion of an object that turns.
    pub modes: Vec<ContactMode>,
    /// What the verdict leaves out, in words.
    pub notes: Vec<String>,
}

impl Analysis {
    /// What the radius says.
    #[must_use]
    pub fn verdict(&self) -> Verdict {
        self.radius.verdict()
    }

    /// Whether the verdict is that of the worst of several combinations of contacts.
    #[must_use]
    pub fn combines_contacts(&self) -> bool {
        combines(&self.modes)
    }
}

/// Whether any motion has several modes of contact.
fn combines(modes: &[ContactMode]) -> bool {
    modes.windows(2).any(|pair| pair[0].motion == pair[1].motion)
}

/// A combination of contacts in which the scene is linear.
#[derive(Clone, PartialEq, Debug)]
pub struct ContactMode {
    /// Of an object that turns: the components of its motion that move so, apart from all others, in words; otherwise empty.
    pub motion: String,
    /// Which contacts are closed, in words; empty for a linear scene.
    pub contacts: String,
    /// The largest radius of its parts.
    pub radius: Radius,
    /// The parts that do not mix.
    pub parts: Vec<Part>,
    pub(crate) rigid_modes: usize,
    pub(crate) dimension: usize,
    pub(crate) frame: Duration,
}

/// The mode with the largest radius.
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

/// What a verdict says of contacts that open and close, of which each combination is analysed as if it lasted.
pub const CHANGES_LEFT_OUT: &str = "changing between them is not covered";

/// What a verdict leaves out, in addition to the notes so far.
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
    notes
}

/// The note on an object that turns, whose equations are those of small motions.
pub const UNLOADED: &str = "the object turns: the verdict is about small motions near rest, all copies together, with no hand pushing";
