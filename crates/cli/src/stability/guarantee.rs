//! Parts shared by all commands that prove: the progress bar, the failures of a proof, and the note about pieces without a certificate.

use std::path::Path;

use cohaptic_proofs::ProofError;
use cohaptic_stability::{AnalysisError, FamilyError, Watch};
use cohaptic_units::print::Counted;

use crate::failure::{Failure, not_analysed};
use crate::interrupt;
use crate::progress::Progress;

/// Watcher of a proof: shows the number of checked pieces, and stops the proof when the user interrupts the command. Dropping the watcher clears the bar.
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
        // A proof announces pieces as it divides boxes, so that the length of the bar grows during the proof.
        self.0.expect(operations as u64);
    }

    fn done(&self, _operations: f64) {
        self.0.one_more();
    }

    fn stops(&self) -> bool {
        interrupt::requested()
    }
}

/// Converts an error of a proof to a failure. `option` is the option of the proof, and `family` converts errors about the scene.
pub(super) fn failure(error: ProofError, option: &str, scene: &Path, family: impl FnOnce(FamilyError) -> Failure) -> Failure {
    if let ProofError::Analysis(error) = &error {
        return if *error == AnalysisError::Stopped { ended() } else { not_analysed(scene, error) };
    }
    if let ProofError::Family(error) = error { family(error) } else { Failure::Input(format!("{option}: {error}")) }
}

/// Returns the failure of an interrupted proof. The verdicts found before the interruption hold.
pub(super) fn ended() -> Failure {
    Failure::Interrupted(UNFINISHED.to_owned())
}

/// Returns the note about `pieces` pieces with a verdict but without a certificate; `None` for no such piece.
pub(super) fn left_open(pieces: usize) -> Option<String> {
    (pieces > 0).then(|| format!("the certificate leaves open {} of those that are decided here", Counted(pieces, "piece")))
}

/// Message about a proof that was stopped before every piece was judged.
pub(super) const UNFINISHED: &str = "the proof was stopped; pieces that it had not reached are undecided, all others hold";
