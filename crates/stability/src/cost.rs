//! How much work an analysis is, told beforehand from its sizes.
//!
//! An operation is a multiplication with an addition on one number. Estimates count what the innermost loops do and leave out the rest; they are good to a
//! factor of about three, which is enough to tell seconds from hours. What an operation takes in time is the machine's affair, not this crate's.

use crate::structure::count;

/// The sizes of a frame in which a second moment is followed event by event.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct FrameCost {
    /// Samplings, arrivals and ticks of a frame.
    pub events: usize,
    /// The numbers that describe the scene at an instant of it: states, samples of the frame and of earlier ones, samples held.
    pub rows: usize,
    /// The joint states of the chains of all links; at least 1.
    pub joint: usize,
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
    pub fn operations(&self) -> f64 {
        TO_PREPARE * count(self.events) + PASSES * self.of_a_pass()
    }

    /// One way through the frame, and the work for all numbers at its end.
    pub(crate) fn of_a_pass(&self) -> f64 {
        OF_AN_EVENT * count(self.joint) * count(self.rows) * count(self.events) + BETWEEN * self.numbers()
    }

    /// How many numbers are kept at once within the frame.
    #[must_use]
    pub fn numbers(&self) -> f64 {
        count(self.joint) * count(self.rows) * count(self.rows)
    }
}

/// The operations that it takes to push unit vectors through the events of a frame along all axes, and then to find the eigenvalues.
#[must_use]
pub fn full_operations(states: usize, events: usize, axes: usize) -> f64 {
    pushed_operations(events, axes) * count(states) + eigenvalue_operations(states)
}

/// Those of one of the vectors: a tick of a peer is some sixty operations an axis.
pub(crate) fn pushed_operations(events: usize, axes: usize) -> f64 {
    60.0 * count(events) * count(axes)
}

/// How many operations the eigenvalues of a matrix of that size take: 10·n³ (Golub & Van Loan 2013, Section 7.5.6).
#[must_use]
pub fn eigenvalue_operations(size: usize) -> f64 {
    10.0 * count(size).powi(3)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Twice the events are twice the work, as long as a frame has more of them than rows; so are twice the joint states. Ten times the rows are ten
    /// times the work of each event.
    #[test]
    fn the_cost_follows_events_rows_and_joint_states() {
        let frame = FrameCost { events: 10_000_000, rows: 100, joint: 1 };
        let ratio = |other: FrameCost| other.operations() / frame.operations();
        assert!((ratio(FrameCost { events: 20_000_000, ..frame }) - 2.0).abs() < 0.01);
        assert!((ratio(FrameCost { joint: 2, ..frame }) - 2.0).abs() < 0.1);
        assert!((ratio(FrameCost { rows: 1000, ..frame }) - 10.0).abs() < 0.5);
        // 8 bytes each: a gibibyte is 2^27 numbers.
        assert_eq!(FrameCost { events: 1, rows: 8192, joint: 2 }.numbers().to_bits(), 134_217_728_f64.to_bits());
    }

    /// 300 peers with 4 states and 2·4 numbers of samples each: the eigenvalues of 3600 rows are 4.7·10^11 operations.
    #[test]
    fn of_many_states_the_eigenvalues_are_what_costs() {
        let all = full_operations(3600, 300 * (8 + 300), 1);
        assert!((eigenvalue_operations(3600) / 4.6656e11 - 1.0).abs() < 1e-12 && all < 1.5 * eigenvalue_operations(3600), "{all:e}");
    }
}
