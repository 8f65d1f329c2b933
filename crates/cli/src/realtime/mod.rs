//! What the commands that run in real time share.

mod control;
mod editor;
mod snapshot;
mod words;

use cohaptic_realtime::{Pacing, Tolerance, Wishes};

use crate::arguments::RealTimeArguments;

pub(crate) use control::{LiveControl, Look};
pub(crate) use editor::{Edit, KeyedLinks};
pub(crate) use snapshot::{counters, quantiles, quantiles_of};
pub(crate) use words::{late, loading, notes};

impl RealTimeArguments {
    pub(crate) const fn pacing(&self) -> Pacing {
        if self.spin { Pacing::SPIN } else { Pacing::Sleep }
    }

    pub(crate) fn wishes(&self) -> Wishes {
        if self.no_priority { Wishes::NONE } else { Wishes::default() }
    }

    pub(crate) const fn tolerance(&self) -> Tolerance {
        Tolerance { limit: self.tolerance }
    }
}
