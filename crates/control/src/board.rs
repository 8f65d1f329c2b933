//! Where the real-time side leaves what the HTTP side shows.

use std::sync::{Arc, Mutex, PoisonError, TryLockError};

use crate::{Description, Snapshot};

/// The last [`Snapshot`] of a run, and its [`Description`].
///
/// Neither side waits for the other: what reads holds the lock for as long as it takes to count a reference, and what publishes tries once.
#[derive(Debug)]
pub struct Board {
    description: Description,
    latest: Mutex<Latest>,
}

/// A snapshot with its number.
#[derive(Clone, Debug, Default)]
pub struct Latest {
    /// How many snapshots were published, this one included; 0 before the first. Two that have the same number are the same.
    pub number: u64,
    /// The snapshot; before the first one, a run in which nothing has happened.
    pub snapshot: Arc<Snapshot>,
}

impl Board {
    /// A board on which nothing has happened yet.
    #[must_use]
    pub fn new(description: Description) -> Self {
        Self { description, latest: Mutex::default() }
    }

    /// The run.
    #[must_use]
    pub const fn description(&self) -> &Description {
        &self.description
    }

    /// Puts a snapshot up in place of the last one, without ever waiting. About 20 times a second is often enough.
    ///
    /// `Ok` has the snapshot that it replaced, so that the caller chooses when to free it, or fills it anew if nobody holds it any more.
    ///
    /// # Errors
    ///
    /// The snapshot itself, if somebody was reading at that very moment. The last one of a run is worth another attempt.
    pub fn publish(&self, snapshot: Arc<Snapshot>) -> Result<Arc<Snapshot>, Arc<Snapshot>> {
        let mut latest = match self.latest.try_lock() {
            Ok(latest) => latest,
            Err(TryLockError::Poisoned(poisoned)) => poisoned.into_inner(),
            Err(TryLockError::WouldBlock) => return Err(snapshot),
        };
        latest.number += 1;
        Ok(core::mem::replace(&mut latest.snapshot, snapshot))
    }

    /// The last snapshot and its number.
    #[must_use]
    pub fn latest(&self) -> Latest {
        self.latest.lock().unwrap_or_else(PoisonError::into_inner).clone()
    }
}
