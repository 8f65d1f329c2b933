//! The watcher of a campaign.

/// Is told how far a campaign has come, and can end it. Called from many threads.
pub trait Watch: Sync {
    /// Whether to go on. PlanSpec before every few combinations that are checked, before each that is judged, and before every few runs.
    fn keep_going(&self) -> bool {
        true
    }

    /// So many more combinations have been checked.
    fn checked(&self, _combinations: u64) {}

    /// A number of combinations more have been judged.
    fn judged(&self, _combinations: u64) {}

    /// So many more runs have been done.
    fn ran(&self, _runs: u64) {}
}

/// Nobody looks on.
#[derive(Clone, Copy, Debug, Default)]
pub struct NoWatch;

impl Watch for NoWatch {}
