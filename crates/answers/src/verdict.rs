//! Verdicts by analysis: whether a scene is stable, if the analysis takes seconds only and leaves nothing out, and the simplifications behind a verdict.

use cohaptic_scene::Scene;
use cohaptic_stability::{
    ARMS_ALONE, AnalysisError, Judgement, Limits, Method, NOMINAL, QUICK_UNKNOWNS, TRACKED, UNLOADED, Watch, has_chance, judge_watched,
};

/// Operations per second of this program on one thread, in the units of the analysis's estimate. Measured on a shared core of a server: 0.5 billion for a mean
/// square with bursts on six links, 1.7 for an admittance, 5 for the eigenvalues of 400 rows. The number tells seconds from hours, and nothing finer.
pub const OPERATIONS_A_SECOND: f64 = 1e9;

/// Result of [`quick_verdict`]: a judgement by analysis, or that a simulation must decide.
#[derive(Clone, PartialEq, Debug)]
pub(crate) enum Quick {
    /// The judgement, which leaves nothing out.
    Known(Box<Judgement>),
    /// The analysis has no answer for the whole scene, so a simulation must decide. The text is the reason, if the second moment of the random links cannot be
    /// followed in the allowed time.
    Simulate(Option<String>),
    /// The watch stopped the analysis.
    Stopped,
}

/// Tells by analysis whether a scene is stable, if the estimated time is at most `seconds`.
///
/// Left to a simulation are: a scene which is not linear, a scene with a timeline, a scene whose random links have no second moment computable in that time,
/// and an object with more than small turns about rest.
pub(crate) fn quick_verdict(scene: &Scene, seconds: f64, watch: &dyn Watch) -> Quick {
    if !scene.timeline.is_empty() || !scene.turns_about_rest() {
        return Quick::Simulate(None);
    }
    // The limits refuse a long analysis before it begins, by its estimate.
    let limits = Limits { unknowns: QUICK_UNKNOWNS, operations: seconds * OPERATIONS_A_SECOND, watch };
    let judgement = match judge_watched(scene, Method::Reduced, &limits) {
        Ok(judgement) => judgement,
        Err(AnalysisError::Stopped) => return Quick::Stopped,
        Err(_) => return Quick::Simulate(None),
    };
    let refused = judgement.analysis.notes.iter().find_map(|note| note.strip_prefix(NOMINAL)).map(str::to_owned);
    // Without a second moment the analysis is nominal. A simulation then runs what the analysis would leave out.
    let is_left_out = judgement.analysis.notes.iter().any(|note| ![UNLOADED, ARMS_ALONE, TRACKED].contains(&note.as_str()));
    let nominal = judgement.mean_square.is_none() && (has_chance(scene) || is_left_out);
    if judgement.analysis.combines_contacts() || nominal { Quick::Simulate(refused) } else { Quick::Known(Box::new(judgement)) }
}

/// Returns the simplifications of the analysis and of the mean square, each once. With both figures, each note names the figure it is about.
#[must_use]
pub fn notes(judgement: &Judgement) -> Vec<String> {
    let Some(mean_square) = &judgement.mean_square else {
        return judgement.analysis.notes.clone();
    };
    let nominal = &judgement.analysis.notes;
    let of_nominal = nominal.iter().map(|note| match mean_square.notes.contains(note) {
        true => format!("both radii: {note}"),
        false => format!("the spectral radius, with delays at their mean and no losses: {note}"),
    });
    let of_mean_square = mean_square.notes.iter().filter(|note| !nominal.contains(note)).map(|note| format!("the mean-square radius: {note}"));
    of_nominal.chain(of_mean_square).collect()
}
