//! Parts of a test bed for a printed test that repeats a run.

use std::panic::Location;
use std::sync::Arc;
use std::time::Duration;

use super::Testbed;
use crate::again::Again;
use crate::seed::Seed;
use crate::settings::{Limits, Settings};
use crate::setup::RECEIVE_BUFFER;

impl Testbed {
    /// Returns the parts of the test bed for a printed test that repeats a run.
    pub(super) fn again(&self, seed: &Seed, place: &'static Location<'static>) -> Again {
        let Settings { receive_buffer, limits, said, laws, .. } = &self.setup.settings;
        let default = Limits::default();
        let nanos = |span: Duration| format!("std::time::Duration::from_nanos({})", u64::try_from(span.as_nanos()).unwrap_or(u64::MAX));
        #[cfg(feature = "tokio")]
        let is_tokio = self.is_tokio;
        #[cfg(not(feature = "tokio"))]
        let is_tokio = false;
        #[cfg(feature = "tcp")]
        let has_constants = !self.tcp.is_empty();
        #[cfg(not(feature = "tcp"))]
        let has_constants = false;
        // Only settings that differ from the defaults are printed, so that the printed test stays short.
        let others = [
            (*receive_buffer != RECEIVE_BUFFER).then(|| format!(".receive_buffer({receive_buffer})")),
            (limits.time != default.time).then(|| format!(".time_limit({})", nanos(limits.time))),
            (limits.steps != default.steps).then(|| format!(".step_limit({})", limits.steps)),
            has_constants.then(|| "// The constants of TCP have no words; copy the call from the test.".to_owned()),
            (!self.setup.changes.is_empty()).then(|| "// The changes of links stand in the file of the test.".to_owned()),
            is_tokio.then(|| ".on_tokio()".to_owned()),
        ];
        #[cfg(feature = "facade")]
        let standard = self.standard_calls();
        #[cfg(not(feature = "facade"))]
        let standard = std::iter::empty();
        Again {
            names: Arc::clone(&self.setup.names),
            hosts: self.setup.hosts(),
            said: Arc::clone(said),
            laws: laws.clone(),
            seed: seed.clone(),
            others: self.address_calls().chain(others.into_iter().flatten()).chain(standard).collect(),
            place,
        }
    }
}
