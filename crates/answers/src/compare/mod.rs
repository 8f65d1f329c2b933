//! What comparisons of strategies answer: the document, the words, the table of figures and the page of one that is finished, and verdicts on its combinations.

mod document;
mod figures;
mod judge;
mod page;
mod rows_file;
mod words;

use cohaptic_campaign::{CampaignPlan, Comparison, Judgement, Report, Variation};

pub use document::document;
pub use judge::ByAnalysisOrRuns;
pub use page::{PageSource, html};
pub use rows_file::csv;
pub use words::words;

/// A comparison that is finished.
#[derive(Clone, Debug)]
pub struct Finished {
    /// The plan, whose first key has the strategies as its values.
    pub plan: CampaignPlan,
    /// The title of the scene of the first combination that is run.
    pub title: String,
    /// Figures of all combinations.
    pub report: Report,
    /// The strategies side by side.
    pub comparison: Comparison,
    /// The judgement of each combination.
    pub stability: Vec<Judgement>,
}

impl Finished {
    /// Returns the keys that vary beside the strategy.
    fn keys(&self) -> &[Variation] {
        &self.plan.variations()[1..]
    }

    /// Returns which value of each of [`Finished::keys`] a combination of them has.
    fn places(&self, other: usize) -> Vec<usize> {
        // Of the baseline, whose combinations come first.
        self.plan.places(other as u64).split_off(1)
    }

    /// Returns the values of a combination of the other keys, as they are written.
    fn values(&self, other: usize) -> Vec<String> {
        self.keys().iter().zip(self.places(other)).map(|(key, place)| key.value_text(place).to_owned()).collect()
    }

    /// Returns the judgement of a strategy at a combination of the other keys.
    fn judgement(&self, strategy: usize, other: usize) -> Option<&Judgement> {
        self.stability.get(strategy * self.comparison.others() + other)
    }
}
