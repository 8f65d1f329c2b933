//! How much work an analysis is, told beforehand from its sizes.
//!
//! An operation is a multiplication with an addition on one number. Estimates count what the innermost loops do and leave out the rest; they are good to a
//! factor of about three, which is enough to tell seconds from hours. What an operation takes in time is the machine's affair, not this crate's.

use crate::rounding::real;

/// The most memory that the matrices of a part may take if nobody says otherwise, 8 GiB: those of 8192 states.
pub const MOST_MEMORY: u64 = 8 << 30;

/// How many matrices of its size the eigenvalues of a part take at once, with the enclosure of their errors; measured, of 759 and of 1509 states.
const MATRICES: f64 = 16.0;

/// Estimated cost of the analysis of a part, told before the analysis begins.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct PartCost {
    /// How many states the part has: of bodies, of forces that wait to be applied, and of samples that are held or on the way.
    pub states: usize,
    /// The memory of its matrices \[bytes\].
    pub bytes: f64,
    /// How many operations it takes.
    pub operations: f64,
}

impl std::fmt::Display for PartCost {
    fn fmt(&self, formatter: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let Self { states, bytes, .. } = *self;
        if bytes < MEBIBYTE { write!(formatter, "{states} states") } else { write!(formatter, "{states} states, {}", Memory(bytes)) }
    }
}

const MEBIBYTE: f64 = 1_048_576.0;

/// A number of bytes in words.
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
    /// The eigenvalues of a part.
    #[must_use]
    pub(crate) fn of_eigenvalues(states: usize) -> Self {
        let bytes = 8.0 * MATRICES * real(states).powi(2);
        Self { states, bytes, operations: eigenvalue_operations(states) }
    }

    /// The same of a part whose unit vectors are pushed, one by one, through that number of events along all axes.
    pub(crate) fn of_full(states: usize, events: usize, axes: usize) -> Self {
        Self { operations: full_operations(states, events, axes), ..Self::of_eigenvalues(states) }
    }
}

/// The sizes of a frame in which a second moment is followed event by event.
#[derive(Clone, Copy, PartialEq, Debug)]
pub(crate) struct FrameCost {
    /// Samplings, arrivals and ticks of a frame.
    pub(crate) events: usize,
    /// The numbers that describe the scene at an instant of it: states, samples of the frame and of earlier ones, samples held.
    pub(crate) rows: usize,
    /// The joint states of the chains of all links; at least 1.
    pub(crate) joint: usize,
    /// Moments that deliveries on links that remember add up in a frame, each from one joint state to another.
    pub(crate) sums: usize,
}

/// How often a frame is gone through: by the iteration, and for the bounds that are tried.
pub(crate) const PASSES: f64 = 60.0;
/// The work for each number between two passes: it is made orthogonal, twice, to those of all passes before.
const BETWEEN: f64 = 4.0 * 0.5 * PASSES;
/// What an event does to each of the columns of its rows.
const OF_AN_EVENT: f64 = 8.0;
/// What it takes to work out an event beforehand, the matrix of a tick above all.
const TO_PREPARE: f64 = 2e3;

impl FrameCost {
    /// How many operations the spectral radius takes.
    #[must_use]
    pub(crate) fn operations(&self) -> f64 {
        TO_PREPARE * real(self.events) + PASSES * self.of_a_pass()
    }

    /// One way through the frame, and the work for all numbers at its end.
    pub(crate) fn of_a_pass(&self) -> f64 {
        // Half of a symmetric moment is added up.
        let sums = 0.5 * real(self.sums) * real(self.rows).powi(2);
        OF_AN_EVENT * real(self.joint) * real(self.rows) * real(self.events) + sums + BETWEEN * self.numbers()
    }

    /// How many numbers are kept at once within the frame.
    #[must_use]
    pub(crate) fn numbers(&self) -> f64 {
        real(self.joint) * real(self.rows) * real(self.rows)
    }
}

/// The operations that it takes to push unit vectors through the events of a frame along all axes, and then to find the eigenvalues.
#[must_use]
pub(crate) fn full_operations(states: usize, events: usize, axes: usize) -> f64 {
    pushed_operations(events, axes) * real(states) + eigenvalue_operations(states)
}

/// Those of one of the vectors: a tick of a peer is some sixty operations an axis.
pub(crate) fn pushed_operations(events: usize, axes: usize) -> f64 {
    60.0 * real(events) * real(axes)
}

/// How many operations the eigenvalues of a matrix of that size take: 10·n³ (Golub & Van Loan 2013, Section 7.5.6).
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
