//! What spins is found by the wall clock: a thread looks now and then whether what runs in test beds has returned to them.
//!
//! A loop that asks the test bed for nothing cannot be interrupted, and so the process ends, after the task was named. A task that returns is never found here: then
//! the limits on polls and calls at one instant count.

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

/// After which span without a return a process ends, unless another one is said.
pub(crate) const LIMIT: Duration = Duration::from_secs(60);

/// What runs, for the thread that watches. The thread that runs writes, and the other one only reads.
#[derive(Debug, Default)]
pub(crate) struct Pulse {
    /// How often something has begun, or time has passed.
    turns: AtomicU64,
    /// The number of what runs now, from 1; 0 if nothing does.
    running: AtomicUsize,
    known: Mutex<Runners>,
}

#[derive(Debug, Default)]
struct Runners {
    all: Vec<Runner>,
    /// Their numbers, by host and the address of the place.
    numbers: BTreeMap<(Option<NodeId>, usize), usize>,
}

/// The tasks of a host, or of none, that were spawned at one place.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Runner {
    pub(crate) host: Option<NodeId>,
    pub(crate) origin: &'static Location<'static>,
}

impl Runner {
    /// Returns a task in words: the place where it was spawned, and its host.
    pub(crate) fn words(self, hosts: &[String]) -> String {
        match self.host.and_then(|host| hosts.get(host.index())) {
            Some(host) => format!("the task of host `{host}` that was spawned at {}", self.origin),
            None => format!("the task that was spawned at {}", self.origin),
        }
    }
}

impl Pulse {
    /// The number of tasks that will run. Nodes are numbered in their order.
    pub(crate) fn number(&self, runner: Runner) -> usize {
        let mut known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        let Runners { all, numbers } = &mut *known;
        *numbers.entry((runner.host, std::ptr::from_ref(runner.origin).addr())).or_insert_with(|| {
            all.push(runner);
            all.len()
        })
    }

    /// It runs from now on.
    #[inline]
    pub(crate) fn begins(&self, number: usize) {
        self.running.store(number, Ordering::Relaxed);
        self.turns();
    }

    /// It has returned.
    #[inline]
    pub(crate) fn returns(&self) {
        self.running.store(0, Ordering::Relaxed);
    }

    /// Time passes, or the executor does something else.
    #[inline]
    pub(crate) fn turns(&self) {
        // Nobody else writes: no addition that others wait for.
        self.turns.store(self.turns.load(Ordering::Relaxed).wrapping_add(1), Ordering::Relaxed);
    }

    fn now(&self) -> (u64, usize) {
        (self.turns.load(Ordering::Relaxed), self.running.load(Ordering::Relaxed))
    }

    /// Returns the task that runs now. While a panic unwinds, that is the task that panicked.
    pub(crate) fn running(&self) -> Option<Runner> {
        self.runner(self.now().1)
    }

    fn runner(&self, number: usize) -> Option<Runner> {
        let known = self.known.lock().unwrap_or_else(PoisonError::into_inner);
        known.all.get(number.checked_sub(1)?).copied()
    }
}

/// A run that is watched, until it is dropped.
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

/// What has the thread while nothing is known to run.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) enum Kind {
    /// The test, as long as it wants.
    Nodes,
    /// The function that makes the program, or a waker.
    Own,
    /// Tasks of tokio too.
    #[cfg(feature = "tokio")]
    Tokio,
}

impl Watched {
    /// Begins to watch. The limit is what the test says, unless the environment says another one.
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

    /// The state, for its time and its record.
    pub(crate) fn is_of(&self, shared: &Arc<Shared>) {
        // A run has one state.
        let _ = self.shared.set(Arc::downgrade(shared));
    }
}
