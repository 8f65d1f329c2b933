//! Estimates of the memory and the operations of an analysis, computed from sizes before the analysis begins.
//!
//! An operation is a multiplication with an addition on one number. The estimates count the innermost loops only and are good to a factor of about three,
//! which is enough to tell seconds from hours. The time of an operation depends on the machine and is not estimated here.

use crate::rounding::real;

/// Default limit of the memory for the matrices of a part, 8 GiB \[bytes\]. The matrices of 8192 states need this much.
pub const MOST_MEMORY: u64 = 8 << 30;

/// Number of matrices of a part's size that are in memory at once while its eigenvalues and the bounds of their errors are computed. Measured with 759 and
/// with 1509 states.
const MATRICES: f64 = 16.0;

/// Estimated cost of the analysis of a part, told before the analysis begins.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct PartCost {
    /// Number of states of the part: of bodies, of forces that wait to be applied, and of samples that are held or in flight.
    pub states: usize,
    /// Memory of the part's matrices \[bytes\].
    pub bytes: f64,
    /// Number of operations of the analysis of the part.
    pub operations: f64,
}

impl std::fmt::Display for PartCost {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { states, bytes, .. } = *self;
        if bytes < MEBIBYTE { write!(formatter, "{states} states") } else { write!(formatter, "{states} states, {}", Memory(bytes)) }
    }
}

const MEBIBYTE: f64 = 1_048_576.0;

/// A number of bytes, displayed with a binary unit such as GiB.
pub(crate) struct Memory(pub(crate) f64);

impl Memory {
    #[expect(clippy::cast_precision_loss, reason = "a limit and not a count, said with two digits")]
    pub(crate) const fn of(bytes: u64) -> Self {
        Self(bytes as f64)
    }
}

impl std::fmt::Display for Memory {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        const UNITS: [&str; 4] = ["MiB", "GiB", "TiB", "PiB"];
        let (mut value, mut unit) = (self.0 / MEBIBYTE, 0);
        while value >= 1024.0 && unit + 1 < UNITS.len() {
            (value, unit) = (value / 1024.0, unit + 1);
        }
        write!(formatter, "{value:.1} {}", UNITS[unit])
    }
}

impl PartCost {
    /// Returns the cost of the eigenvalues of a part.
    #[must_use]
    pub(crate) fn of_eigenvalues(states: usize) -> Self {
        let bytes = 8.0 * MATRICES * real(states).powi(2);
        Self { states, bytes, operations: eigenvalue_operations(states) }
    }

    /// Returns the cost of a part on the general path: each unit vector is pushed through `events` events along `axes` axes, then eigenvalues are found.
    pub(crate) fn of_full(states: usize, events: usize, axes: usize) -> Self {
        Self { operations: full_operations(states, events, axes), ..Self::of_eigenvalues(states) }
    }
}

/// Sizes of a frame through which a second moment is followed event by event.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct FrameCost {
    /// Number of samplings, arrivals and ticks of a frame.
    pub(crate) events: usize,
    /// Number of numbers that describe the scene at an instant of the frame: states, samples of this and of earlier frames, held samples.
    pub(crate) rows: usize,
    /// Number of joint states of the chains of all links; at least 1.
    pub(crate) joint: usize,
    /// Number of additions of a moment in a frame, from one joint state to another, by deliveries on links whose chance has a memory.
    pub(crate) sums: usize,
}

/// Number of passes through a frame, by the iteration and for the bounds that are tried.
pub(crate) const PASSES: f64 = 60.0;
/// Operations for each number between two passes: the vector is made orthogonal, twice, to the vectors of all passes before.
const BETWEEN: f64 = 4.0 * 0.5 * PASSES;
/// Operations of an event for each column of its rows.
const OF_AN_EVENT: f64 = 8.0;
/// Operations for the preparation of an event, most of them for the matrix of a tick.
const TO_PREPARE: f64 = 2e3;

impl FrameCost {
    /// Returns the number of operations for the spectral radius of the second moment.
    #[must_use]
    pub(crate) fn operations(&self) -> f64 {
        TO_PREPARE * real(self.events) + PASSES * self.of_a_pass()
    }

    /// Returns the number of operations of one pass through the frame, with the work for all numbers at its end.
    pub(crate) fn of_a_pass(&self) -> f64 {
        // A moment is symmetric, so that only half of its entries are added.
        let sums = 0.5 * real(self.sums) * real(self.rows).powi(2);
        OF_AN_EVENT * real(self.joint) * real(self.rows) * real(self.events) + sums + BETWEEN * self.numbers()
    }

    /// Returns the number of numbers that are kept at once within the frame.
    #[must_use]
    pub(crate) fn numbers(&self) -> f64 {
        real(self.joint) * real(self.rows) * real(self.rows)
    }
}

/// Returns the number of operations for pushing all unit vectors through the events of a frame along all axes and finding the eigenvalues.
#[must_use]
pub(crate) fn full_operations(states: usize, events: usize, axes: usize) -> f64 {
    pushed_operations(events, axes) * real(states) + eigenvalue_operations(states)
}

/// Returns the number of operations for pushing one vector through a frame. A tick of a peer takes about sixty operations per axis.
pub(crate) fn pushed_operations(events: usize, axes: usize) -> f64 {
    60.0 * real(events) * real(axes)
}

/// Returns the number of operations for the eigenvalues of a matrix of n rows: 10·n³ (Golub & Van Loan 2013, Section 7.5.6).
#[must_use]
pub(crate) fn eigenvalue_operations(size: usize) -> f64 {
    10.0 * real(size).powi(3)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Twice the events are twice the work, as long as a frame has more of them than rows; so are twice the joint states. Ten times the rows are ten
    /// times the work of each event.
    #[test]
    fn the_cost_follows_events_rows_and_joint_states() {
        let frame = FrameCost { events: 10_000_000, rows: 100, joint: 1, sums: 0 };
        let ratio = |other: FrameCost| other.operations() / frame.operations();
        assert!((ratio(FrameCost { events: 20_000_000, ..frame }) - 2.0).abs() < 0.01);
        assert!((ratio(FrameCost { joint: 2, ..frame }) - 2.0).abs() < 0.1);
        assert!((ratio(FrameCost { rows: 1000, ..frame }) - 10.0).abs() < 0.5);
        // Sums of moments beside next to no events: each is half of 100² operations.
        let summed = FrameCost { events: 1, sums: 1_000_000, ..frame };
        assert!((summed.operations() / (60.0 * 5e9) - 1.0).abs() < 0.01);
        // 8 bytes each: a gibibyte is 2^27 numbers.
        assert_eq!(FrameCost { events: 1, rows: 8192, joint: 2, sums: 0 }.numbers().to_bits(), 134_217_728_f64.to_bits());
    }

    /// 300 peers with 4 states and 2·4 numbers of samples each: the eigenvalues of 3600 rows are 4.7·10^11 operations.
    #[test]
    fn of_many_states_the_eigenvalues_are_what_costs() {
        let all = full_operations(3600, 300 * (8 + 300), 1);
        assert!((eigenvalue_operations(3600) / 4.6656e11 - 1.0).abs() < 1e-12 && all < 1.5 * eigenvalue_operations(3600), "{all:e}");
    }
}
