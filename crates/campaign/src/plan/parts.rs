//! Cuts the runs of a campaign into parts, the units of storage.

use core::ops::Range;

use super::CampaignPlan;
use super::check::Checked;
use crate::error::CampaignError;

/// Number of runs handed to a thread at once: as many as [`cohaptic_harness::run_side_by_side`] runs at the same time, and few enough to keep all threads busy
/// until the end.
pub(crate) const CHUNK: u64 = 8;
/// Approximate number of events per part: some seconds of one thread.
const EVENTS: u64 = 200_000_000;
/// Greatest number of runs of a part with a size chosen by the number of events.
const MOST_FOR_EVENTS: u64 = 16_384;
/// Greatest number of runs of a part with a size chosen by the program.
const MOST: u64 = 65_536;
/// Greatest number of values of a part with a size chosen by the program: about 200 MB while the part is collected.
const MOST_VALUES: u64 = 8_000_000;
/// Usual bound on the number of parts: a kill then costs a thousandth of the campaign.
const USUAL_PARTS: u64 = 1000;
/// Usual bound on the number of column chunks in the table. Each chunk takes some hundred bytes in the index of a Parquet file.
const USUAL_STRETCHES: u64 = 100_000;
/// Greatest number of parts in a folder.
const MOST_PARTS: u64 = 100_000;

/// The runs of a campaign, cut into parts of equal size. The last part may be smaller.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Parts {
    /// Number of all runs.
    pub(crate) runs: u64,
    /// Number of runs in each part but the last; at least 1.
    pub(crate) size: u64,
}

impl Parts {
    /// Chooses the size of the parts from the plan alone. Nothing depends on the machine, so every machine cuts a campaign alike.
    ///
    /// # Errors
    ///
    /// [`CampaignError::Size`] if the user's size gives more than [`MOST_PARTS`] parts.
    pub(crate) fn of(plan: &CampaignPlan, checked: &Checked, columns: usize) -> Result<Self, CampaignError> {
        let runs = plan.runs();
        if let Some(size) = plan.part() {
            // The user's size is kept, unless a folder would have too many files.
            let parts = runs.div_ceil(size);
            if parts > MOST_PARTS {
                let least = runs.div_ceil(MOST_PARTS);
                return Err(CampaignError::Size(format!("{runs} runs in parts of {size} are {parts} files: expected at least {least} runs a part")));
            }
            return Ok(Self { runs, size });
        }
        let columns = columns as u64;
        // Three bounds: seconds of work per part, few parts and column chunks, and bounded memory. The bound on memory comes last and wins.
        let of_work = (EVENTS / checked.events.max(1)).clamp(CHUNK, MOST_FOR_EVENTS);
        let of_count = runs.div_ceil(USUAL_PARTS).max((runs * columns).div_ceil(USUAL_STRETCHES)).min(MOST);
        let size = of_work.max(of_count).min((MOST_VALUES / columns).max(CHUNK));
        // Whole chunks, so that only the last chunk of the campaign may be smaller.
        Ok(Self { runs, size: size.next_multiple_of(CHUNK) })
    }

    /// Returns the number of parts.
    pub(crate) const fn count(self) -> u64 {
        self.runs.div_ceil(self.size)
    }

    /// Returns the runs of a part. `part` must be below [`Parts::count`].
    pub(crate) fn range(self, part: u64) -> Range<u64> {
        part * self.size..((part + 1) * self.size).min(self.runs)
    }

    /// Returns the number of runs of a part.
    pub(crate) fn len(self, part: u64) -> u64 {
        let Range { start, end } = self.range(part);
        end - start
    }
}
