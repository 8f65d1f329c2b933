//! The monodromy matrix of a scene, with names for its states.

use std::time::Duration;

use cohaptic_scene::{FromScene, Scene, Strategies};

use crate::combinations::whole;
use crate::full::{FullMap, Trust, full_along};
use crate::network::NominalNetwork;
use crate::pieces::refuse_turns;
use crate::{AnalysisError, Matrix, StateName, Unwatched};

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
