//! Whether a scene is stable, by analysis where that is a matter of seconds and leaves nothing out.

use cohaptic_scene::Scene;
use cohaptic_stability::{AnalysisError, Judgement, Limits, Method, NOMINAL, QUICK_UNKNOWNS, UNLOADED, Watch, has_chance, judge_watched};

/// How many operations, as the analysis estimates them, this program does in a second and on one thread: measured on a shared core of a server, 0.5
/// billion of a mean square with bursts on six links, 1.7 of an admittance, 5 of the eigenvalues of 400 rows. It tells seconds from hours, and nothing
/// finer.
pub const OPERATIONS_A_SECOND: f64 = 1e9;

/// What the analysis says.
#[derive(Clone, PartialEq, Debug)]
pub enum Quick {
    /// Its judgement, which leaves nothing out.
    Known(Box<Judgement>),
    /// None that holds for the scene as it is, which is left to a simulation. With the reason where the chance of the links has a second moment that cannot be
    /// followed in that time.
    Simulate(Option<String>),
    /// The watch ended it.
    Stopped,
}

/// Whether a scene is stable, by analysis, if that takes at most `seconds` by the estimate. One that is not linear, that changes on its way, or whose chance has
/// no second moment that can be followed in that time, is left to a simulation, as is an object that turns and does more than small motions near rest.
#[must_use]
pub fn quick_verdict(scene: &Scene, seconds: f64, watch: &dyn Watch) -> Quick {
    if !scene.timeline.is_empty() || !scene.turns_about_rest() {
        return Quick::Simulate(None);
    }
    let limits = Limits { unknowns: QUICK_UNKNOWNS, operations: seconds * OPERATIONS_A_SECOND, watch };
    let judgement = match judge_watched(scene, Method::Reduced, &limits) {
        Ok(judgement) => judgement,
        Err(AnalysisError::Stopped) => return Quick::Stopped,
        Err(_) => return Quick::Simulate(None),
    };
    let refused = judgement.analysis.notes.iter().find_map(|note| note.strip_prefix(NOMINAL)).map(str::to_owned);
    // Without a second moment, whatever was replaced by something nominal is better simulated as it is.
    let is_left_out = judgement.analysis.notes.iter().any(|note| note != UNLOADED);
    let nominal = judgement.mean_square.is_none() && (has_chance(scene) || is_left_out);
    if judgement.analysis.combines_contacts() || nominal { Quick::Simulate(refused) } else { Quick::Known(Box::new(judgement)) }
}
