//! Parts that the commands which prove have in common: their bar, and why a proof is refused.

use std::path::Path;

use cohaptic_proofs::ProofError;
use cohaptic_stability::{AnalysisError, FamilyError, Watch};
use cohaptic_units::print::Counted;

use crate::failure::{Failure, not_analysed};
use crate::interrupt;
use crate::progress::Progress;

/// Shows how many pieces of a set were looked at, and ends the proof when the user asks for it.
pub(super) struct PieceWatch(Progress);

impl PieceWatch {
    pub(super) fn new() -> Self {
        let progress = Progress::new(0, "{bar:30} {pos}/{len} pieces so far, {elapsed} passed");
        progress.tick();
        Self(progress)
    }
}

impl Drop for PieceWatch {
    fn drop(&mut self) {
        self.0.clear();
    }
}

impl Watch for PieceWatch {
    #[expect(clippy::cast_possible_truncation, clippy::cast_sign_loss, reason = "a count")]
    fn expects(&self, operations: f64) {
        self.0.expect(operations as u64);
    }

    fn done(&self, _operations: f64) {
        self.0.one_more();
    }

    fn stops(&self) -> bool {
        interrupt::requested()
    }
}

/// Why nothing is proven, for the option that asked for it; `family` has the words about scenes that are refused.
pub(super) fn failure(error: ProofError, option: &str, scene: &Path, family: impl FnOnce(FamilyError) -> Failure) -> Failure {
    if let ProofError::Analysis(error) = &error {
        return if *error == AnalysisError::Stopped { ended() } else { not_analysed(scene, error) };
    }
    if let ProofError::Family(error) = error { family(error) } else { Failure::Input(format!("{option}: {error}")) }
}

/// The words about a proof that was ended: its verdicts hold, but they are not all.
pub(super) fn ended() -> Failure {
    Failure::Interrupted("the proof was ended; pieces that it had not looked at are undecided, all others hold".to_owned())
}

/// The note on pieces that have a verdict and no certificate, if there are any.
pub(super) fn left_open(pieces: usize) -> String {
    if pieces == 0 {
        String::new()
    } else {
        format!("    note: the certificate leaves open {} of those that are decided here\n", Counted(pieces, "piece"))
    }
}
