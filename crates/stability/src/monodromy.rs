//! The monodromy matrix of a scene, with names for its states.

use std::time::Duration;

use cohaptic_scene::{FromScene, Scene, Strategies};

use crate::combinations::whole;
use crate::full::{FullMap, Trust, full_along};
use crate::network::NominalNetwork;
use crate::pieces::refuse_turns;
use crate::{AnalysisError, Matrix, StateName, Unwatched};

/// Matrix by which one frame multiplies the relative state of a linear scene.
#[derive(Clone, PartialEq, Debug)]
pub struct Monodromy {
    /// The matrix, with one row and one column per state.
    pub matrix: Matrix,
    /// Names of the states, in the order of the rows and columns.
    pub states: Vec<StateName>,
    /// Length of a frame. Frames begin at multiples of the length, before the events of that instant.
    pub frame: Duration,
    /// Factor that turns velocities into lengths \[s\].
    pub time: f64,
    /// Number of rigid-body modes that were left out.
    pub rigid_modes: usize,
    /// Bound of the errors of the entries, as the largest sum over a row.
    pub error: f64,
    /// Peer to whose copy positions are relative, indexed by peer and axis: the first peer, or with waves, which carry no position, the peer itself. `None`
    /// where the origin is known.
    pub relative: Vec<Vec<Option<usize>>>,
}

/// Returns the monodromy matrix of a scene at its beginning, computed by the general path.
///
/// # Errors
///
/// [`AnalysisError`] as for [`crate::analyse`], and [`AnalysisError::SeveralModes`] if the scene is not linear because of one-sided contacts. Walls are left
/// out.
pub fn monodromy(scene: &Scene) -> Result<Monodromy, AnalysisError> {
    pushed(scene, Trust::Linear, &FromScene)
}

/// Like [`monodromy`], with the caller's own strategies.
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
