//! Common parts of the commands in real time (`live`, `relay`, `router` and others): live control, messages, and the options for pacing and priority.

mod addresses;
mod control;
#[cfg(target_os = "linux")]
mod control_files;
#[cfg(target_os = "linux")]
mod session_key;
mod words;

use std::time::Duration;

use cohaptic_realtime::Tolerance;
#[cfg(target_os = "linux")]
use cohaptic_realtime::{Pacing, Wishes};

use crate::arguments::PaceArguments;

pub(crate) use addresses::{local, own_address, reached_from_elsewhere};
#[cfg(target_os = "linux")]
pub(crate) use control::{Edit, KeyedLinks};
pub(crate) use control::{LiveControl, Look, counters, quantiles, quantiles_of, refused_server, token_of};
#[cfg(target_os = "linux")]
pub(crate) use control_files::ControlFiles;
#[cfg(target_os = "linux")]
pub(crate) use session_key::session_key;
#[cfg(target_os = "linux")]
pub(crate) use words::notes;
pub(crate) use words::{ConfiguredDelay, Publisher, carried, counts, late, say, some_length, status, unicode_words};

impl PaceArguments {
    /// Returns how the thread waits for its next deadline: by spinning with `--spin`, otherwise by sleeping.
    #[cfg(target_os = "linux")]
    pub(crate) const fn pacing(&self) -> Pacing {
        if self.spin { Pacing::SPIN } else { Pacing::Sleep }
    }

    /// Returns the real-time privileges to ask the system for: none with `--no-priority`, otherwise the default set.
    #[cfg(target_os = "linux")]
    pub(crate) fn wishes(&self) -> Wishes {
        if self.no_priority { Wishes::NONE } else { Wishes::default() }
    }

    /// Returns the lateness above which an event counts as late: the value of `--tolerance`, by default 1 ms.
    pub(crate) fn tolerance(&self) -> Tolerance {
        Tolerance { limit: self.tolerance.unwrap_or(Duration::from_millis(1)) }
    }
}
