//! The monodromy matrix of a scene, with names for its states.

use std::fmt;
use std::time::Duration;

use cohaptic_scene::{FromScene, Scene, Strategies};

use crate::analysis::whole;
use crate::full::{FullMap, Trust, full_along};
use crate::network::NominalNetwork;
use crate::pieces::refuse_turns;
use crate::{AnalysisError, Matrix, Unwatched};

/// What one frame multiplies the relative state of a linear scene by.
#[derive(Clone, PartialEq, Debug)]
pub struct Monodromy {
    /// One row and one column for each state.
    pub matrix: Matrix,
    /// What the states are.
    pub states: Vec<StateName>,
    /// How long a frame is. Frames begin at its multiples, before anything happens at that instant.
    pub frame: Duration,
    /// What velocities are multiplied by to be lengths \[s\].
    pub time: f64,
    /// How many rigid-body modes were left out.
    pub rigid_modes: usize,
    /// A bound of the errors of the entries, as the largest sum over a row.
    pub error: f64,
    /// For each peer and axis, whose copy positions are relative to: the first peer's, or with waves, which carry no position, its own. `None` where the origin
    /// is known.
    pub relative: Vec<Vec<Option<usize>>>,
}

/// A state of a scene. Positions are in metres, relative to a copy ([`Monodromy::relative`]) where nothing ties them to ground; velocities are multiplied by
/// a common time, forces by a compliance, waves by the root of a time over a mass, times the time between samples.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct StateName {
    /// Whose it is, by its place in [`Scene::peers`].
    pub peer: usize,
    /// What it is.
    pub kind: StateKind,
}

/// What a state is. `axis` is 0 for x, 1 for y, 2 for z.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[expect(missing_docs, reason = "axis is said above")]
pub enum StateKind {
    /// Where the device is.
    DevicePosition { axis: usize },
    /// How fast the device is.
    DeviceVelocity { axis: usize },
    /// Where the copy is.
    ObjectPosition { axis: usize },
    /// How fast the copy is.
    ObjectVelocity { axis: usize },
    /// The coupling force that acts next, if forces are applied a tick late.
    PendingCoupling { axis: usize },
    /// The force on the copy that acts next, if forces are applied a tick late.
    PendingForce { axis: usize },
    /// A number that the strategy remembers.
    Memory { number: usize },
    /// Where the copy was at an earlier sampling.
    SamplePosition {
        axis: usize,
        /// 1 for the last sample before the frame, 2 for the one before.
        age: usize,
    },
    /// How fast the copy was at an earlier sampling.
    SampleVelocity {
        axis: usize,
        /// See above.
        age: usize,
    },
    /// The force that a server computed for a client at an earlier sampling.
    SampleForce {
        axis: usize,
        /// See above.
        age: usize,
        /// The place of the client.
        receiver: usize,
    },
    /// The wave that was sent to a peer at an earlier sampling.
    SampleWave {
        axis: usize,
        /// See above.
        age: usize,
        /// The place of that peer.
        receiver: usize,
    },
}

impl fmt::Display for StateKind {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let axis = |axis: usize| ["x", "y", "z"].get(axis).copied().unwrap_or("?");
        match *self {
            Self::DevicePosition { axis: a } => write!(f, "device position {}", axis(a)),
            Self::DeviceVelocity { axis: a } => write!(f, "device velocity {}", axis(a)),
            Self::ObjectPosition { axis: a } => write!(f, "copy position {}", axis(a)),
            Self::ObjectVelocity { axis: a } => write!(f, "copy velocity {}", axis(a)),
            Self::PendingCoupling { axis: a } => write!(f, "coupling force to come {}", axis(a)),
            Self::PendingForce { axis: a } => write!(f, "force on the copy to come {}", axis(a)),
            Self::Memory { number } => write!(f, "memory {number} of the strategy"),
            Self::SamplePosition { axis: a, age } => write!(f, "position {} sampled {age} before", axis(a)),
            Self::SampleVelocity { axis: a, age } => write!(f, "velocity {} sampled {age} before", axis(a)),
            Self::SampleForce { axis: a, age, receiver } => write!(f, "force {} for peer {receiver} sampled {age} before", axis(a)),
            Self::SampleWave { axis: a, age, receiver } => write!(f, "wave {} for peer {receiver} sampled {age} before", axis(a)),
        }
    }
}

/// The monodromy matrix of a scene as it begins, by the general path.
///
/// # Errors
///
/// [`AnalysisError`] as for [`crate::analyse`], and [`AnalysisError::SeveralModes`] if the scene is not linear because of one-sided contacts. Walls are left out.
pub fn monodromy(scene: &Scene) -> Result<Monodromy, AnalysisError> {
    pushed(scene, Trust::Linear, &FromScene)
}

/// [`monodromy`] with strategies of the caller's own.
///
/// # Errors
///
/// As for [`monodromy`], and if a strategy is not linear or remembers what it does not show.
pub fn monodromy_with(scene: &Scene, strategies: &impl Strategies) -> Result<Monodromy, AnalysisError> {
    pushed(scene, Trust::Nothing, strategies)
}

fn pushed(scene: &Scene, trust: Trust, strategies: &impl Strategies) -> Result<Monodromy, AnalysisError> {
    refuse_turns(scene, "the monodromy matrix")?;
    let network = NominalNetwork::of(scene)?;
    let combinations = whole(scene)?;
    let mut linear = combinations.iter().filter(|combination| !combination.contacts.at_wall);
    let (Some(combination), None) = (linear.next(), linear.next()) else {
        return Err(AnalysisError::SeveralModes);
    };
    let map = full_along(combination.axes, scene, &network, &combination.contacts, trust, &Unwatched, strategies)?;
    let FullMap { monodromy, error, rigid_modes, frame, states, time, relative, forces: _ } = map;
    Ok(Monodromy { matrix: monodromy, states, frame, time, rigid_modes, error, relative })
}
