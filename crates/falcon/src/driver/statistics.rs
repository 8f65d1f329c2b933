//! Counts of events, by name.

use crate::safety::{Verdict, ZeroCause};

/// Counts since the start of the driver.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Statistics {
    /// Started exchanges.
    pub exchanges: u64,
    /// Complete reports.
    pub reports: u64,
    /// Exchanges without a report in time.
    pub timeouts: u64,
    /// Bytes outside of any report.
    pub garbage_bytes: u64,
    /// Failed transfers.
    pub faults: u64,
    /// Reports of a movement that is too fast for any device.
    pub implausible: u64,
    /// Homed reports of angles without a position of the grip.
    pub unlocated: u64,
    /// Losses of homing, as reported by the device.
    pub unhomed: u64,
    /// Forces that became zero, by cause in the order of [`ZeroCause::ALL`].
    pub zeroed: [u64; ZeroCause::ALL.len()],
    /// Forces shortened to the largest force.
    pub limited: u64,
    /// Forces with a change shortened to the fastest change.
    pub slewed: u64,
    /// Forces lowered to the limit of a motor.
    pub saturated: u64,
    /// Packets of zero force sent at a stop.
    pub farewells: u64,
}

impl Statistics {
    /// Returns the number of forces that became zero for this cause.
    #[must_use]
    pub const fn zeroed_by(&self, cause: ZeroCause) -> u64 {
        self.zeroed[cause.index()]
    }

    pub(super) fn count(&mut self, verdict: Verdict) {
        match verdict {
            Verdict::Zero(cause) => self.zeroed[cause.index()] += 1,
            Verdict::Out(changes) => {
                self.limited += u64::from(changes.limited);
                self.slewed += u64::from(changes.slewed);
                self.saturated += u64::from(changes.saturated);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_cause_has_its_own_place() {
        for (place, cause) in ZeroCause::ALL.into_iter().enumerate() {
            assert_eq!(cause.index(), place);
            let mut statistics = Statistics::default();
            statistics.count(Verdict::Zero(cause));
            assert_eq!((statistics.zeroed_by(cause), statistics.zeroed.iter().sum::<u64>()), (1, 1));
        }
    }
}
