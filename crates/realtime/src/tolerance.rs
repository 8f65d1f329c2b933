//! When a run in real time counts.

use core::fmt;
use std::time::Duration;

use cohaptic_units::print::Span;

use crate::Lateness;

/// How late things may be for a run to be valid: no more than one in a thousand later than `limit`, or a single one.
///
/// One in a thousand and not none, because on a system that does other things too the worst of a million wake-ups says more about that system than
/// about the run; the worst is reported all the same.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Tolerance {
    /// Later than this is late.
    pub limit: Duration,
}

/// Whether a run counts.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Validity {
    /// It was on time.
    Valid,
    /// It was not: what it showed is not what was asked for.
    NotValid {
        /// So many things were late,
        late: u64,
        /// of this number,
        of: u64,
        /// by more than this.
        limit: Duration,
    },
}

impl Tolerance {
    /// Judges what was recorded.
    #[must_use]
    pub fn judge(&self, lateness: &Lateness) -> Validity {
        let (late, of) = (lateness.count_later_than(self.limit), lateness.count());
        // A single late one of a few is no fault of a short run: it must be more than one.
        if late > 1 && late > of / 1000 { Validity::NotValid { late, of, limit: self.limit } } else { Validity::Valid }
    }
}

impl Validity {
    /// Whether the run counts.
    #[must_use]
    pub const fn is_valid(&self) -> bool {
        matches!(self, Self::Valid)
    }
}

impl fmt::Display for Validity {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Valid => f.write_str("valid"),
            Self::NotValid { late, of, limit } => {
                write!(f, "not valid: {late} of {of} were more than {} late, expected at most one in a thousand", Span(*limit))
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_run_is_valid_up_to_one_late_in_a_thousand() {
        let tolerance = Tolerance { limit: Duration::from_millis(1) };
        let run = |on_time: u64, late: u64| {
            let mut lateness = Lateness::new();
            (0..on_time).for_each(|_| lateness.record(Duration::from_micros(60)));
            (0..late).for_each(|_| lateness.record(Duration::from_millis(3)));
            tolerance.judge(&lateness)
        };
        assert_eq!(run(0, 0), Validity::Valid);
        assert_eq!(run(9_990, 10), Validity::Valid);
        assert_eq!(run(9_989, 11), Validity::NotValid { late: 11, of: 10_000, limit: Duration::from_millis(1) });
        assert_eq!(run(10, 1), Validity::Valid);
        let text = run(10, 2).to_string();
        assert_eq!(text, "not valid: 2 of 12 were more than 1ms late, expected at most one in a thousand");
    }
}
