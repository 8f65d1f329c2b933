//! Watchdog by the wall clock: a thread that checks now and then whether tasks and nodes have returned to the test bed.
//!
//! A loop that never calls the test bed cannot be interrupted. Hence the process ends, after the task was named. A task that returns is never reported by the
//! watchdog: the limits on polls and calls at one instant catch such a task.

mod guard;
mod thread;

use std::collections::BTreeMap;
use std::panic::Location;
use std::sync::atomic::{AtomicU64, AtomicUsize, Ordering};
use std::sync::{Arc, Mutex, OnceLock, PoisonError, Weak};
use std::time::Duration;

use cohaptic_wan::NodeId;

use crate::artefacts::Artefacts;
use crate::core::Shared;
use crate::names::Names;
use crate::seed::Seed;

pub use guard::STALL_VARIABLE;
pub(crate) use guard::limit;
#[cfg(feature = "loopback")]
pub(crate) use guard::span;

/// Default time without a return after which the process ends.
pub(crate) const LIMIT: Duration = Duration::from_secs(60);

/// Activity of a run, for the watchdog. The thread of the run writes the atomics; the watchdog only reads them.
#[derive(Debug, Default)]
pub(crate) struct Pulse {
    /// Number of polls and other turns of the executor so far.
    turns: AtomicU64,
    /// Number of the present runner, from 1; 0 without a runner.
    running: AtomicUsize,
    /// Runners that have been numbered.
    known: Mutex<Runners>,
}

#[derive(Debug, Default)]
struct Runners {
    /// Runners; the runner with the number n has the index n - 1.
    all: Vec<Runner>,
    /// Number of each runner, by host and address of the place.
    numbers: BTreeMap<(Option<NodeId>, usize), usize>,
}

/// Tasks of a host, or of no host, that were spawned at the same place.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Runner {
    pub(crate) host: Option<NodeId>,
    pub(crate) origin: &'static Location<'static>,
}

impl Runner {
    /// Returns the name of a task in messages: the place where the task was spawned, and its host.
    pub(crate) fn words(self, hosts: &[String]) -> String {
        match self.host.and_then(|host| hosts.get(host.index())) {
            Some(host) => format!("the task of host `{host}` that was spawned at {}", self.origin),
            None => format!("the task that was spawned at {}", self.origin),
        }
    }
}

impl Pulse {
    /// Returns the number of a runner, the same for equal runners. Nodes need no runner, because nodes are numbered in their order.
    pub(crate) fn number(&self, runner: Runner) -> usize {
        let mut known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        let Runners { all, numbers } = &mut *known;
        // Addresses are enough for the comparison of places: a place stored twice by the compiler only has two numbers.
        *numbers.entry((runner.host, std::ptr::from_ref(runner.origin).addr())).or_insert_with(|| {
            all.push(runner);
            all.len()
        })
    }

    /// Notes that the runner `number` runs from now on.
    #[inline]
    pub(crate) fn begins(&self, number: usize) {
        self.running.store(number, Ordering::Relaxed);
        self.turns();
    }

    /// Notes that the runner has returned.
    #[inline]
    pub(crate) fn returns(&self) {
        self.running.store(0, Ordering::Relaxed);
    }

    /// Notes that time passes, or that the executor is at work outside of tasks.
    #[inline]
    pub(crate) fn turns(&self) {
        // Only this thread writes, so a load and a store suffice in place of a locked addition.
        self.turns.store(self.turns.load(Ordering::Relaxed).wrapping_add(1), Ordering::Relaxed);
    }

    fn now(&self) -> (u64, usize) {
        (self.turns.load(Ordering::Relaxed), self.running.load(Ordering::Relaxed))
    }

    /// Returns the running task. While a panic unwinds, the result is the task that panicked.
    pub(crate) fn running(&self) -> Option<Runner> {
        self.runner(self.now().1)
    }

    fn runner(&self, number: usize) -> Option<Runner> {
        let known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        known.all.get(number.checked_sub(1)?).copied()
    }
}

/// Watched run. The watch ends when the value is dropped.
#[derive(Debug)]
pub(crate) struct Watched {
    pub(crate) pulse: Arc<Pulse>,
    hosts: Arc<Names>,
    limit: Duration,
    seed: Seed,
    artefacts: Artefacts,
    kind: Kind,
    shared: OnceLock<Weak<Shared>>,
}

/// Kind of a run. While no task or node is noted as running, the complaint about a run that hangs names the holder of the thread by the kind.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Kind {
    /// Run of nodes: the test has the thread, for as long as it wants.
    Nodes,
    /// Run on the executor of this crate: the function that makes the program, or a waker.
    Own,
    /// Run on tokio: also tasks of tokio.
    #[cfg(feature = "tokio")]
    Tokio,
}

impl Watched {
    /// Begins to watch. `said` is the limit that the test sets; the environment takes precedence.
    pub(crate) fn begin(kind: Kind, hosts: &Arc<Names>, said: Duration, seed: &Seed, artefacts: &Artefacts) -> Arc<Self> {
        let watched = Arc::new(Self {
            pulse: Arc::default(),
            hosts: Arc::clone(hosts),
            limit: limit(said),
            seed: seed.clone(),
            artefacts: artefacts.clone(),
            kind,
            shared: OnceLock::new(),
        });
        if watched.limit != Duration::MAX {
            thread::watch(&watched);
        }
        watched
    }

    /// Sets the state of the run, from which the watchdog reads the time and the record.
    pub(crate) fn is_of(&self, shared: &Arc<Shared>) {
        // A run has only one state, so a second call cannot happen.
        let _ = self.shared.set(Arc::downgrade(shared));
    }
}
