//! What the commands that run in real time share.

mod configured;
mod control;
mod editor;
mod snapshot;
mod traffic;
mod words;

use std::time::Duration;

use cohaptic_realtime::{Pacing, Tolerance, Wishes};

use crate::arguments::RealTimeArguments;

pub(crate) use configured::ConfiguredDelay;
pub(crate) use control::{LiveControl, Look};
pub(crate) use editor::{Edit, KeyedLinks};
pub(crate) use snapshot::{counters, quantiles, quantiles_of};
pub(crate) use traffic::{Publisher, carried, counts, lasted, say, some_length, status};
pub(crate) use words::{late, loading, notes};

impl RealTimeArguments {
    pub(crate) const fn pacing(&self) -> Pacing {
        if self.spin { Pacing::SPIN } else { Pacing::Sleep }
    }

    pub(crate) fn wishes(&self) -> Wishes {
        if self.no_priority { Wishes::NONE } else { Wishes::default() }
    }

    /// Later than what was said is late, or than 1 ms.
    pub(crate) fn tolerance(&self) -> Tolerance {
        Tolerance { limit: self.tolerance.unwrap_or(Duration::from_millis(1)) }
    }
}
