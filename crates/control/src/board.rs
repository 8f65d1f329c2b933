//! Where the real-time side leaves what the HTTP side shows, and what the HTTP side asks for.

use std::sync::{Arc, Mutex, PoisonError, TryLockError};

use crate::{Description, Snapshot};

/// The last [`Snapshot`] of a run, and its [`Description`]. One run may follow another.
///
/// Neither side waits for the other: what reads holds the lock for as long as it takes to count a reference, and what publishes tries once.
#[derive(Debug)]
pub struct Board {
    latest: Mutex<Latest>,
}

/// A snapshot with its number, and what its numbers belong to.
#[derive(Clone, Debug)]
pub struct Latest {
    /// The run.
    pub description: Arc<Description>,
    /// How many snapshots were published, this one included; 0 before the first. Two that have the same number are the same.
    pub number: u64,
    /// The snapshot; before the first one, a run in which nothing has happened.
    pub snapshot: Arc<Snapshot>,
}

impl Board {
    /// A board on which nothing has happened yet.
    #[must_use]
    pub fn new(description: Description) -> Self {
        Self { latest: Mutex::new(Latest { description: Arc::new(description), number: 0, snapshot: Arc::default() }) }
    }

    /// The run.
    #[must_use]
    pub fn description(&self) -> Arc<Description> {
        self.latest().description
    }

    /// Another run takes the place of this one: nothing has happened in it yet.
    pub fn begin(&self, description: Description) {
        let mut latest = self.latest.lock().unwrap_or_else(PoisonError::into_inner);
        *latest = Latest { description: Arc::new(description), number: latest.number + 1, snapshot: Arc::default() };
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

/// Reads and changes the links of a run, one call at a time. Keys are read on the thread of the server and should take microseconds: until then nobody else
/// is answered. A change is made on another thread and may take longer, for instance to read files; other changes and readers of keys wait for it.
///
/// The implementor reads and checks what it is given and hands the change to the real-time side, which takes it up at an instant of its own.
pub trait LinkEditor: Send {
    /// The keys that this link was told, each once, in any order, with their values as TOML text: `("delay", "\"40ms\"")`. A key at its default
    /// may be left out. The number is below that of the links in the [`Description`](crate::Description).
    fn keys(&self, link: usize) -> Vec<(String, String)>;

    /// Lays keys over those of each of these links, or changes nothing at all.
    ///
    /// `links` has at least one number, each below that of the links, none twice. Of `keys` there is at least one and none twice. A key is of ASCII
    /// letters, digits, `_` and `-`; a value is TOML text: `"40ms"` with its quotes, `0.01`, `{ packets = [3] }`.
    ///
    /// # Errors
    ///
    /// Why it cannot be, as it is shown to the user: which key, what was found, what was expected.
    fn change(&mut self, links: &[usize], keys: &[(String, String)]) -> Result<(), String>;
}
