//! Tables of inverse distribution functions.

use alloc::boxed::Box;

use super::built_in;
use crate::laws::delay::{DistTable, DistTableError, dist_file_entries};

/// An inverse distribution function at equal steps, in multiples of 1/8192 of the standard deviation: the content of a `.dist` file.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Table {
    entries: Box<[i16]>,
}

impl Table {
    /// Number of entries for the kernel, at most.
    pub const LONGEST: usize = DistTable::MOST;

    /// Makes a table of these entries. Returns `None` unless there are 1 to 16384 entries.
    #[must_use]
    pub fn new(entries: impl Into<Box<[i16]>>) -> Option<Self> {
        let entries = entries.into();
        (1..=Self::LONGEST).contains(&entries.len()).then_some(Self { entries })
    }

    /// Reads a `.dist` file like [`DistTable::parse`], and keeps the order of the file, because the kernel draws an index into the file's order.
    ///
    /// # Errors
    ///
    /// [`DistTableError`] for an entry beyond an integer of 16 bits (`tc` would truncate the entry), for no entry at all, and for more than 16384 entries.
    pub fn parse(text: &str) -> Result<Self, DistTableError> {
        Ok(Self { entries: dist_file_entries(text)?.into() })
    }

    /// Returns the table `normal`, equal in every entry to the table of iproute2.
    ///
    /// Entry j is 8192·x for the last x with Φ(x) < (4j + ½)/16384 on a grid of 5·10⁻⁵ from −10. The support is therefore asymmetric: −4.00 to +3.52.
    #[must_use]
    pub fn normal() -> Self {
        Self { entries: built_in::normal() }
    }

    /// Returns the table `pareto`, equal in every entry to the table of iproute2.
    ///
    /// Entry j is 8192·(u^(−1/3) − 3/2)·4/3 with u = 1 − j/4096, at most 32767. The law is the Pareto law of index 3 from 1 on, with mean 3/2 and deviation
    /// √3/2. The cut at 4 and the factor of 4/3 instead of 2/√3 leave a deviation of 0.82 instead of 1.
    #[must_use]
    pub fn pareto() -> Self {
        Self { entries: built_in::pareto() }
    }

    /// Returns the table `paretonormal`, equal in every entry to the table of iproute2: a quarter of the normal entry plus three quarters of the Pareto entry
    /// of the same rank.
    #[must_use]
    pub fn pareto_normal() -> Self {
        Self { entries: built_in::pareto_normal() }
    }

    /// Returns the entries, in the order of the file.
    #[must_use]
    pub fn entries(&self) -> &[i16] {
        &self.entries
    }

    /// Returns the entry for 32 random bits.
    pub(super) fn entry(&self, random: u32) -> i64 {
        // The remainder prefers low indices unless the length divides 2³², as in the kernel.
        let index = random as usize % self.entries.len();
        i64::from(self.entries[index])
    }
}
