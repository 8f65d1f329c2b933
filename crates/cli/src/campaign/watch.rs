//! Progress, and Ctrl-C.

use cohaptic_campaign::Watch;

use crate::interrupt;
use crate::progress::Progress;

/// Shows how far it came on the terminal, and ends it when the user asks for it.
pub(super) struct Shown(Progress);

impl Shown {
    pub(super) fn checking(combinations: u64) -> Self {
        Self(Progress::through_combinations(combinations))
    }

    pub(super) fn judging(combinations: u64) -> Self {
        Self(Progress::through_verdicts(combinations))
    }

    pub(super) fn running(runs: u64, kept: u64) -> Self {
        Self(Progress::through_runs(runs, kept))
    }

    pub(super) fn clear(&self) {
        self.0.clear();
    }
}

impl Watch for Shown {
    fn keep_going(&self) -> bool {
        !interrupt::requested()
    }

    fn checked(&self, combinations: u64) {
        self.0.more(combinations);
    }

    fn judged(&self, combinations: u64) {
        self.0.more(combinations);
    }

    fn ran(&self, runs: u64) {
        self.0.more(runs);
    }
}
