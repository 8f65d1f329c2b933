//! Tables of inverse distribution functions: files, and the tables of iproute2, computed.

use alloc::boxed::Box;
use core::f64::consts::SQRT_2;

use crate::laws::delay::{DistTableError, dist_file_entries};

/// An inverse distribution function at equal steps, in multiples of 1/8192 of the standard deviation: the content of a `.dist` file.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Table {
    entries: Box<[i16]>,
}

impl Table {
    /// Reads a `.dist` file like [`DistTable::parse`](crate::law::DistTable::parse), and keeps the order of the file, because the kernel draws an index into
    /// the file's order.
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
        Self { entries: normal_entries() }
    }

    /// Returns the table `pareto`, equal in every entry to the table of iproute2.
    ///
    /// Entry j is 8192·(u^(−1/3) − 3/2)·4/3 with u = 1 − j/4096, at most 32767. The law is the Pareto law of index 3 from 1 on, with mean 3/2 and deviation
    /// √3/2. The cut at 4 and the factor of 4/3 instead of 2/√3 leave a deviation of 0.82 instead of 1.
    #[must_use]
    pub fn pareto() -> Self {
        Self { entries: pareto_entries() }
    }

    /// Returns the table `paretonormal`, equal in every entry to the table of iproute2: a quarter of the normal entry plus three quarters of the Pareto entry
    /// of the same rank.
    #[must_use]
    pub fn pareto_normal() -> Self {
        Self { entries: pareto_normal_entries() }
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

/// Scale of table entries: an entry of 8192 is one standard deviation.
pub(super) const TABLE_SCALE: i32 = 8192;

const ENTRIES: i32 = 4096;

fn normal_entries() -> Box<[i16]> {
    (0..ENTRIES).map(|rank| clamped(normal_entry(rank))).collect()
}

fn pareto_entries() -> Box<[i16]> {
    (0..ENTRIES).map(|rank| clamped(pareto_entry(rank))).collect()
}

fn pareto_normal_entries() -> Box<[i16]> {
    // The lowest normal entry enters the sum before its clamping, and the division rounds towards zero.
    (0..ENTRIES).map(|rank| clamped((normal_entry(rank) + 3 * pareto_entry(rank)) / 4)).collect()
}

/// Returns the quantile of the standard normal law at (4·rank + ½)/16384, rounded down to a grid, in 1/8192.
fn normal_entry(rank: i32) -> i32 {
    const STEP: f64 = 5e-5;
    let point = |index: i32| -10.0 + f64::from(index) * STEP;
    let target = (4.0 * f64::from(rank) + 0.5) / 16_384.0;
    let is_below = |index: i32| 0.5 + 0.5 * libm::erf(point(index) / SQRT_2) < target;
    // Φ(−10) is below every target and Φ(10) above, so the search keeps a grid point on either side.
    let (mut below, mut above) = (0, 400_000);
    while above - below > 1 {
        let middle = i32::midpoint(below, above);
        if is_below(middle) {
            below = middle;
        } else {
            above = middle;
        }
    }
    rounded(point(below) * f64::from(TABLE_SCALE))
}

fn pareto_entry(rank: i32) -> i32 {
    let survival = 1.0 - f64::from(rank) / f64::from(ENTRIES);
    let value = (libm::pow(survival, -1.0 / 3.0) - 1.5) * 4.0 / 3.0;
    // The highest ranks do not fit into 16 bits, and are cut before `pareto_normal_entries`.
    rounded(value * f64::from(TABLE_SCALE)).min(i32::from(i16::MAX))
}

#[expect(clippy::cast_possible_truncation, reason = "entries are below 2^18")]
fn rounded(value: f64) -> i32 {
    libm::rint(value) as i32
}

fn clamped(value: i32) -> i16 {
    i16::try_from(value).unwrap_or(if value < 0 { i16::MIN } else { i16::MAX })
}
