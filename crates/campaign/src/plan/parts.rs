//! Which runs are kept together.

use core::ops::Range;

use super::CampaignPlan;
use super::check::Checked;
use crate::error::CampaignError;

/// How many runs are handed over at once: as many as [`cohaptic_harness::run_side_by_side`] runs at the same time, and few enough that all threads are busy
/// until the end.
pub(crate) const CHUNK: u64 = 8;
/// The events of a part, about: some seconds of one thread.
const EVENTS: u64 = 200_000_000;
/// The most runs of a part whose size is not asked for, for their number of events.
const MOST_FOR_EVENTS: u64 = 16_384;
/// The most runs of a part whose size is not asked for.
const MOST: u64 = 65_536;
/// The most values of such a part: about 200 MB while it is collected.
const MOST_VALUES: u64 = 8_000_000;
/// The most parts of a campaign, about: what a kill can cost is a thousandth of it.
const USUAL_PARTS: u64 = 1000;
/// The most stretches of columns of its table: each costs some hundred bytes at the end of a Parquet file.
const USUAL_STRETCHES: u64 = 100_000;
/// The most parts in a folder.
const MOST_PARTS: u64 = 100_000;

/// The runs of a campaign, cut into parts.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Parts {
    /// How many there are in all.
    pub(crate) runs: u64,
    /// How many are in each part but the last.
    pub(crate) size: u64,
}

impl Parts {
    /// Follows from the specification alone, and from nothing of the machine.
    pub(crate) fn of(plan: &CampaignPlan, checked: &Checked, columns: usize) -> Result<Self, CampaignError> {
        let runs = plan.runs();
        if let Some(size) = plan.part() {
            let parts = runs.div_ceil(size);
            if parts > MOST_PARTS {
                let least = runs.div_ceil(MOST_PARTS);
                return Err(CampaignError::Size(format!("{runs} runs in parts of {size} are {parts} files: expected at least {least} runs a part")));
            }
            return Ok(Self { runs, size });
        }
        let columns = columns as u64;
        let of_work = (EVENTS / checked.events.max(1)).clamp(CHUNK, MOST_FOR_EVENTS);
        let of_count = runs.div_ceil(USUAL_PARTS).max((runs * columns).div_ceil(USUAL_STRETCHES)).min(MOST);
        let size = of_work.max(of_count).min((MOST_VALUES / columns).max(CHUNK));
        Ok(Self { runs, size: size.next_multiple_of(CHUNK) })
    }

    /// How many parts there are.
    pub(crate) const fn count(self) -> u64 {
        self.runs.div_ceil(self.size)
    }

    /// The runs of a part.
    pub(crate) fn range(self, part: u64) -> Range<u64> {
        part * self.size..((part + 1) * self.size).min(self.runs)
    }

    /// How many runs a part has.
    pub(crate) fn len(self, part: u64) -> u64 {
        let Range { start, end } = self.range(part);
        end - start
    }
}
