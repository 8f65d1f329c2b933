//! The answers of campaigns: document, words and pictures of a finished campaign, and the judge of combinations.

mod document;
mod judge;
mod page;
mod pictures;
mod words;

use cohaptic_campaign::{CampaignPlan, Report};

pub use document::document;
pub use judge::{ByAnalysis, notes};
pub use page::html;
pub(crate) use pictures::Along;
pub use pictures::{Drawn, pictures};
pub use words::words;

/// A finished campaign.
#[derive(Clone, Debug)]
pub struct Finished {
    /// The plan.
    pub plan: CampaignPlan,
    /// Title of the scene of the first combination.
    pub title: String,
    /// Figures of all combinations.
    pub report: Report,
    /// Notes on the simplifications of the verdicts ([`notes()`]) and on pictures not drawn ([`Drawn::notes`]).
    pub notes: Vec<String>,
}

/// Time and files of a campaign or a comparison.
#[derive(Clone, PartialEq, Debug)]
pub struct Written {
    /// Wall time of this call \[s\].
    pub wall_s: f64,
    /// Path of the folder.
    pub out: String,
    /// Paths of all written files, the table of runs first.
    pub files: Vec<String>,
}

impl Finished {
    /// Returns the number of runs done by this call per second of wall time.
    #[expect(clippy::cast_precision_loss, reason = "fewer runs than 2^52")]
    fn runs_per_s(&self, wall_s: f64) -> f64 {
        self.report.computed as f64 / wall_s
    }
}
