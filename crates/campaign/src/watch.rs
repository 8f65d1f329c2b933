//! Observers of a campaign.

use std::path::Path;

/// An observer of a campaign, which can also stop it. The methods are called from many threads.
pub trait Watch: Sync {
    /// Returns whether to go on. Asked before every few checked combinations, before each judged combination, and before every few runs.
    fn keep_going(&self) -> bool {
        true
    }

    /// Called when all runs are done and the merge of the parts begins. [`Watch::keep_going`] is not asked any more.
    fn puts_together(&self) {}

    /// Reports the number of combinations checked since the last call.
    fn checked(&self, _combinations: u64) {}

    /// Reports the number of combinations judged since the last call.
    fn judged(&self, _combinations: u64) {}

    /// Reports the number of runs done since the last call.
    fn ran(&self, _runs: u64) {}

    /// Reports a damaged file, which the campaign does not continue from. `fault` describes the difference and the work to be repeated, in words.
    fn damaged(&self, _file: &Path, _fault: &str) {}

    /// Reports a stored part with its number of runs.
    fn kept(&self, _part: u64, _runs: u64) {}
}

/// A watch without any effect: the campaign runs to its end.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoWatch;

impl Watch for NoWatch {}
