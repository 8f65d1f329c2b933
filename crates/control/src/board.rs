//! The board between the real-time side of a run and the HTTP side: snapshots go to the HTTP side, changes of links come back.

use std::sync::{Arc, Mutex, PoisonError, TryLockError};

use crate::{Description, Snapshot};

/// The newest [`Snapshot`] of a run, and the run's [`Description`]. A later run can replace an earlier run on the same board.
///
/// The real-time side never waits: [`publish`](Self::publish) gives up if the lock is taken. Readers hold the lock only to count up references.
#[derive(Debug)]
pub struct Board {
    latest: Mutex<Latest>,
}

/// A snapshot, with its number and the description of its run.
#[derive(Clone, Debug)]
pub struct Latest {
    /// Description of the run.
    pub description: Arc<Description>,
    /// Number of snapshots and new runs put up so far, this one included; 0 before the first. Equal numbers mean equal contents.
    pub number: u64,
    /// Newest snapshot; before the first, the default snapshot with nothing counted.
    pub snapshot: Arc<Snapshot>,
}

impl Board {
    /// Creates a board for a run without a snapshot.
    #[must_use]
    pub fn new(description: Description) -> Self {
        Self { latest: Mutex::new(Latest { description: Arc::new(description), number: 0, snapshot: Arc::default() }) }
    }

    /// Returns the description of the present run.
    #[must_use]
    pub(crate) fn description(&self) -> Arc<Description> {
        self.latest().description
    }

    /// Replaces the run by a new run without a snapshot.
    pub fn begin(&self, description: Description) {
        let mut latest = self.latest.lock().unwrap_or_else(PoisonError::into_inner);
        // The number continues, so that no reader mistakes the first snapshot of the new run for a snapshot already sent.
        *latest = Latest { description: Arc::new(description), number: latest.number + 1, snapshot: Arc::default() };
    }

    /// Replaces the snapshot, without waiting. About 20 times per second is often enough.
    ///
    /// Returns the replaced snapshot, so that the caller decides when to free or reuse the memory.
    ///
    /// # Errors
    ///
    /// The given snapshot, if a reader holds the lock at this moment. A caller should try again with the last snapshot of a run.
    pub fn publish(&self, snapshot: Arc<Snapshot>) -> Result<Arc<Snapshot>, Arc<Snapshot>> {
        let mut latest = match self.latest.try_lock() {
            // The lock protects plain data without invariants, so a panic of another thread leaves nothing half done.
            Ok(latest) => latest,
            Err(TryLockError::Poisoned(poisoned)) => poisoned.into_inner(),
            Err(TryLockError::WouldBlock) => return Err(snapshot),
        };
        latest.number += 1;
        Ok(core::mem::replace(&mut latest.snapshot, snapshot))
    }

    /// Returns the newest snapshot with its number.
    #[must_use]
    pub fn latest(&self) -> Latest {
        self.latest.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}

/// Reads and changes the links of a run, one call at a time.
///
/// [`keys`](Self::keys) is called on the thread of the server and should take microseconds, because no other request is answered meanwhile.
/// [`change`](Self::change) is called on another thread and may take longer, for instance to read files. Other changes and readers of keys wait until the
/// change is made.
///
/// The implementor checks a change and passes the change to the real-time side, which applies the change at an instant of its own choice.
pub trait LinkEditor: Send {
    /// Returns the keys given to link number `link`, each once and in any order, with values as TOML text: `("delay", "\"40ms\"")`. A key at its default
    /// may be left out. `link` is below the number of links in the [`Description`](crate::Description).
    fn keys(&self, link: usize) -> Vec<(String, String)>;

    /// Sets keys on each of several links, or changes nothing at all. Keys not named keep their values.
    ///
    /// `links` has at least one number, each below the number of links and none twice. `keys` has at least one entry and no key twice. A key consists of
    /// ASCII letters, digits, `_` and `-`. A value is TOML text: `"40ms"` with its quotes, `0.01`, `{ packets = [3] }`.
    ///
    /// # Errors
    ///
    /// The reason of the refusal, for the user: the key, the value found and the value expected.
    fn change(&mut self, links: &[usize], keys: &[(String, String)]) -> Result<(), String>;
}
