//! Notes about the simplifications behind a verdict.

use cohaptic_stability::Judgement;

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
