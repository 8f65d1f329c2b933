//! Tables of inverse distributions.

use alloc::boxed::Box;

use super::built_in;
use crate::laws::delay::{DistTable, DistTableError, dist_file_entries};

/// An inverse distribution function at equal steps, in multiples of 1/8192 of the deviation: what a `.dist` file holds.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Table {
    entries: Box<[i16]>,
}

impl Table {
    /// The most entries the kernel takes.
    pub const LONGEST: usize = DistTable::MOST;

    /// A table of these entries; `None` unless there are 1 to 16384.
    #[must_use]
    pub fn new(entries: impl Into<Box<[i16]>>) -> Option<Self> {
        let entries = entries.into();
        (1..=Self::LONGEST).contains(&entries.len()).then_some(Self { entries })
    }

    /// Reads a `.dist` file as [`DistTable::parse`] does, and keeps the order of the file: the kernel draws a place in it.
    ///
    /// # Errors
    ///
    /// [`DistTableError`] for an entry that is no integer of 16 bits (`tc` would cut it off), no entry at all, or more than 16384.
    pub fn parse(text: &str) -> Result<Self, DistTableError> {
        Ok(Self { entries: dist_file_entries(text)?.into() })
    }

    /// The table `normal`, entry for entry as iproute2 ships it.
    ///
    /// Entry j is 8192·x for the last x on a grid of 5·10⁻⁵ from −10 with Φ(x) < (4j + ½)/16384. So its support is lopsided: −4.00 to +3.52.
    #[must_use]
    pub fn normal() -> Self {
        Self { entries: built_in::normal() }
    }

    /// The table `pareto`, entry for entry as iproute2 ships it.
    ///
    /// Entry j is 8192·(u^(−1/3) − 3/2)·4/3 with u = 1 − j/4096, at most 32767: the Pareto law of index 3 from 1 on, whose mean is 3/2 and whose
    /// deviation is √3/2. The cut at 4 and a factor of 4/3 instead of 2/√3 leave a deviation of 0.82 instead of 1.
    #[must_use]
    pub fn pareto() -> Self {
        Self { entries: built_in::pareto() }
    }

    /// The table `paretonormal`, entry for entry as iproute2 ships it: a quarter of the normal entry and three quarters of the Pareto one, added
    /// rank by rank.
    #[must_use]
    pub fn pareto_normal() -> Self {
        Self { entries: built_in::pareto_normal() }
    }

    /// The entries.
    #[must_use]
    pub fn entries(&self) -> &[i16] {
        &self.entries
    }

    /// The entry that 32 random bits draw.
    pub(super) fn entry(&self, random: u32) -> i64 {
        let index = random as usize % self.entries.len();
        i64::from(self.entries[index])
    }
}
