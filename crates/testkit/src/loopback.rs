//! Runtimes of tokio with a link as loopback, for unchanged test suites.
//!
//! The package `tokio` written by `cohaptic tokio` depends on a copy of this crate, compiled against the real tokio. The package builds its runtimes with a
//! [`Loopback`] if the environment asks for a loopback.

use std::env::VarError;
use std::fmt;
use std::future::Future;
use std::panic::Location;
use std::pin::Pin;
use std::sync::{Arc, OnceLock};

use crate::bed::Testbed;
use crate::link;
use crate::runtime::on_tokio::{self, Hook};
use crate::seed::{Place, Seed};

/// Name of the environment variable with the words of the loopback. A runtime of tokio that is built outside of a test bed then runs its programs on a test bed
/// of one host, and packets of the host to itself take a link of these words.
const LOOPBACK_VARIABLE: &str = "COHAPTIC_TEST_LOOPBACK";

/// Link of the loopback of a runtime, and the parts of the runtime for the test beds of its programs: seed, hook and clock.
pub struct Loopback {
    words: String,
    seed: u64,
    hook: Arc<Hook>,
    origin: OnceLock<tokio::time::Instant>,
}

impl Loopback {
    /// Returns the loopback asked for by the environment, or `None` if `COHAPTIC_TEST_LOOPBACK` is not set or empty.
    ///
    /// # Panics
    ///
    /// If the value of the variable describes no link. The message names the variable and the place of the fault.
    #[must_use]
    #[track_caller]
    pub fn of_environment() -> Option<Self> {
        let value = match std::env::var(LOOPBACK_VARIABLE) {
            Ok(value) => value,
            Err(VarError::NotPresent) => return None,
            Err(VarError::NotUnicode(value)) => value.to_string_lossy().into_owned(),
        };
        // No closure: `track_caller` would name the place of the closure.
        if value.is_empty() { None } else { Some(Self::new(&value)) }
    }

    /// Returns a loopback of these words.
    ///
    /// # Panics
    ///
    /// As [`Loopback::of_environment`].
    #[must_use]
    #[track_caller]
    #[expect(clippy::panic, reason = "tests on another network than the one that was asked for are worse than none")]
    pub fn new(words: &str) -> Self {
        if let Err(fault) = link::parse(words) {
            panic!(
                "{LOOPBACK_VARIABLE} cannot be the loopback of the runtime of tokio at {}: {fault}\nexpected words of tc-netem such as `delay 20ms loss 1%`, or no \
                 variable for real sockets",
                Location::caller()
            );
        }
        // The seed of `select!` is needed before the program is known.
        let seed = Seed::choose(None, &Place::here()).value;
        Self { words: words.to_owned(), seed, hook: Arc::default(), origin: OnceLock::new() }
    }

    /// Returns the seed for the runtime. The seed decides with which branch `tokio::select!` begins.
    #[must_use]
    pub const fn seed(&self) -> u64 {
        self.seed
    }

    /// Prepares the builder of the runtime. The runtime must have a single thread.
    pub fn prepare(&self, builder: &mut tokio::runtime::Builder) {
        on_tokio::prepare(builder, &self.hook);
    }

    /// Runs `future` on a test bed of one host until the future is over. `block_on` must run its argument on the runtime.
    ///
    /// # Panics
    ///
    /// As [`Testbed::run`](crate::Testbed::run).
    #[track_caller]
    pub fn block_on<F: Future>(&self, future: F, block_on: impl FnOnce(Pin<&mut dyn Future<Output = ()>>)) -> F::Output {
        Testbed::of_loopback(&*self.words).run_foreign(future, |core, future, watched, recorded| {
            on_tokio::run_beside(core, future, block_on, (&self.hook, &self.origin), watched, recorded)
        })
    }
}

impl fmt::Debug for Loopback {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Loopback").field("words", &self.words).finish_non_exhaustive()
    }
}
