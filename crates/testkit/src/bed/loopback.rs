//! Test bed of one host with a link as loopback.

use std::future::Future;
use std::panic::Location;

use super::Testbed;
use crate::core::Core;
use crate::link::ToLink;
use crate::seed::{Place, Seed};
use crate::watch::{Watched, span};
use crate::wire::Recorded;

/// Name of the host.
const HOST: &str = "host";

/// Name of the receiver of the link, in the trace and in names of files.
const LOOPBACK: &str = "loopback";

/// Name of the environment variable with the time limit of tests that make no test bed, and thus cannot call [`Testbed::time_limit`].
const LIMIT_VARIABLE: &str = "COHAPTIC_TEST_LIMIT";

impl Testbed {
    /// Creates a test bed of one host. The packets of the host to itself take the link.
    ///
    /// # Panics
    ///
    /// If a variable of the environment has a wrong value.
    pub(crate) fn of_loopback(link: impl ToLink) -> Self {
        let mut bed = Self::new([HOST, LOOPBACK]).link(HOST, LOOPBACK, link).on_tokio().with_standard_of_environment();
        bed.setup.settings.loopback = Some(bed.setup.names.path(HOST, LOOPBACK));
        bed.setup.settings.limits.time = span(LIMIT_VARIABLE, bed.setup.settings.limits.time);
        bed
    }

    /// Runs a future of another program on the host. `execute` gets the state of the run, the number of hosts, and the host.
    ///
    /// # Panics
    ///
    /// As [`Testbed::run`].
    #[track_caller]
    pub(crate) fn run_foreign<F: Future>(
        self,
        future: F,
        execute: impl FnOnce((Core, usize, cohaptic_wan::NodeId), F, &Watched, &mut Option<Recorded>) -> F::Output,
    ) -> F::Output {
        let (seed, host) = (Seed::choose(self.setup.seed, &Place::of(&future)), self.setup.names.node(HOST));
        self.run_with(&seed, Location::caller(), |core, hosts, watched, recorded| execute((core, hosts, host), future, watched, recorded)).0
    }
}
