//! What happened, by name.

use crate::safety::{Verdict, ZeroCause};

/// Counts since the driver began.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Statistics {
    /// Exchanges begun.
    pub exchanges: u64,
    /// Whole reports.
    pub reports: u64,
    /// Exchanges without a report in time.
    pub timeouts: u64,
    /// Bytes that belonged to no report.
    pub garbage_bytes: u64,
    /// Transfers that failed.
    pub faults: u64,
    /// Reports that a device in one piece could not have sent.
    pub implausible: u64,
    /// Homed reports of angles with which the grip is nowhere.
    pub unlocated: u64,
    /// How often a homed device said that it is not.
    pub unhomed: u64,
    /// Forces asked for that became zero, by cause in the order of [`ZeroCause::ALL`].
    pub zeroed: [u64; ZeroCause::ALL.len()],
    /// Forces asked for that were too large.
    pub limited: u64,
    /// Forces asked for that changed too fast.
    pub slewed: u64,
    /// Forces asked for that a motor could not give.
    pub saturated: u64,
    /// Packets of zero force that were sent on stopping.
    pub farewells: u64,
}

impl Statistics {
    /// How many forces became zero for this cause.
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
