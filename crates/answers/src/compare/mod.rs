//! The answers of a comparison of strategies: document, words, table, page, and the judge of combinations.

mod document;
mod figures;
mod judge;
mod page;
mod rows_file;
mod words;

use cohaptic_campaign::{CampaignPlan, Comparison, Judgement, Report, Variation};

pub use document::document;
pub use judge::ByAnalysisOrRuns;
pub use page::{PageSource, html, pictures};
pub use rows_file::csv;
pub use words::words;

/// A finished comparison.
#[derive(Clone, Debug)]
pub struct Finished {
    /// The plan. The values of the first key are the strategies.
    pub plan: CampaignPlan,
    /// Title of the scene of the first run combination.
    pub title: String,
    /// Figures of all combinations.
    pub report: Report,
    /// The compared figures.
    pub comparison: Comparison,
    /// Judgements, indexed by combination.
    pub stability: Vec<Judgement>,
}

impl Finished {
    /// Returns the varied keys other than the strategy.
    fn keys(&self) -> &[Variation] {
        &self.plan.variations()[1..]
    }

    /// Returns the index of the value of each of [`Finished::keys`] in a combination of these keys.
    fn places(&self, other: usize) -> Vec<usize> {
        // The combinations of the baseline come first, so combination `other` of the plan has the same other values.
        self.plan.places(other as u64).split_off(1)
    }

    /// Returns the values of a combination of the other keys, as written.
    fn values(&self, other: usize) -> Vec<String> {
        self.keys().iter().zip(self.places(other)).map(|(key, place)| key.value_text(place).to_owned()).collect()
    }

    /// Returns the judgement of a strategy at a combination of the other keys; `None` if there is no such combination.
    fn judgement(&self, strategy: usize, other: usize) -> Option<&Judgement> {
        self.stability.get(strategy * self.comparison.others() + other)
    }
}
