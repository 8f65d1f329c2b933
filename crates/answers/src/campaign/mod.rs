//! What campaigns answer: the document and the words of one that is finished, its pictures, and verdicts on its combinations.

mod document;
mod judge;
mod pictures;
mod words;

use cohaptic_campaign::{CampaignPlan, Report};

pub use document::document;
pub use judge::{ByAnalysis, notes};
pub(crate) use pictures::Along;
pub use pictures::{Drawn, pictures};
pub use words::words;

/// A campaign that is finished.
#[derive(Clone, Debug)]
pub struct Finished {
    /// The plan.
    pub plan: CampaignPlan,
    /// The title of the scene of the first combination.
    pub title: String,
    /// Figures of all combinations.
    pub report: Report,
    /// The simplifications of verdicts ([`notes()`]), and the pictures that are not drawn ([`Drawn::notes`]).
    pub notes: Vec<String>,
}

/// The time that a campaign or a comparison took, and what it wrote.
#[derive(Clone, PartialEq, Debug)]
pub struct Written {
    /// The time of this call \[s\].
    pub wall_s: f64,
    /// The folder.
    pub out: String,
    /// The paths of all files that are there, the table of runs first.
    pub files: Vec<String>,
}

impl Finished {
    /// Returns how many runs were made in a second, of those of this call.
    #[expect(clippy::cast_precision_loss, reason = "fewer runs than 2^52")]
    fn runs_per_s(&self, wall_s: f64) -> f64 {
        self.report.computed as f64 / wall_s
    }
}
