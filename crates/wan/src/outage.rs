//! Scheduled outages: spans during which a link takes no packet.

use alloc::vec::Vec;

use cohaptic_units::Instant;

/// One outage: packets offered at `from` or later, but before `to`, are dropped.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Outage {
    /// The first instant at which the link is down.
    pub from: Instant,
    /// The first instant at which it is up again.
    pub to: Instant,
}

/// Outages in order of time, none empty and none overlapping another.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Outages(Vec<Outage>);

/// Why a list of outages is refused. The index counts from zero in the order given.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum OutagesError {
    /// The outage ends before it begins, or when it begins.
    #[error("outage {index} ends at {to}, which is not after {from} when it begins")]
    Empty {
        /// Which outage.
        index: usize,
        /// When it begins.
        from: Instant,
        /// When it ends.
        to: Instant,
    },
    /// The outage begins before the one listed before it has ended.
    #[error("outage {index} begins at {from}, before the one listed before it has ended at {ended}")]
    Overlap {
        /// Which outage.
        index: usize,
        /// When it begins.
        from: Instant,
        /// When the previous one ends.
        ended: Instant,
    },
}

impl Outages {
    /// Checks the list.
    ///
    /// # Errors
    ///
    /// [`OutagesError`] if an outage is empty or the list is not in order of time.
    pub fn new(outages: Vec<Outage>) -> Result<Self, OutagesError> {
        let mut ended = Instant::ZERO;
        for (index, &Outage { from, to }) in outages.iter().enumerate() {
            if to <= from {
                return Err(OutagesError::Empty { index, from, to });
            }
            if from < ended {
                return Err(OutagesError::Overlap { index, from, ended });
            }
            ended = to;
        }
        Ok(Self(outages))
    }

    /// Whether there is none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }

    /// Whether the link is down at `now`. Down at the first instant of an outage, up at its end.
    #[must_use]
    #[inline]
    pub fn covers(&self, now: Instant) -> bool {
        if self.0.is_empty() {
            return false;
        }
        let next = self.0.partition_point(|outage| outage.to <= now);
        self.0.get(next).is_some_and(|outage| outage.from <= now)
    }

    /// The outages in order of time.
    #[must_use]
    pub fn as_slice(&self) -> &[Outage] {
        &self.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn outage(from: u64, to: u64) -> Outage {
        Outage { from: Instant::from_nanos(from), to: Instant::from_nanos(to) }
    }

    #[test]
    fn a_link_is_down_from_the_first_instant_and_up_at_the_last() {
        let outages = Outages::new(vec![outage(10, 20), outage(20, 30), outage(50, 60)]).unwrap();
        let down: Vec<u64> = (0..70).filter(|&t| outages.covers(Instant::from_nanos(t))).collect();
        assert_eq!(down, (10..30).chain(50..60).collect::<Vec<_>>());
    }

    #[test]
    fn an_outage_that_is_empty_or_out_of_order_is_refused() {
        assert!(matches!(Outages::new(vec![outage(10, 10)]), Err(OutagesError::Empty { index: 0, .. })));
        assert!(matches!(Outages::new(vec![outage(10, 20), outage(15, 30)]), Err(OutagesError::Overlap { index: 1, .. })));
    }
}
