//! Laws of a test bed, of which each run gets a copy in the initial state.

use std::fmt;
use std::panic::{RefUnwindSafe, UnwindSafe};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

use cohaptic_wan::Path;
use cohaptic_wan::random::Draws;

use super::{Hit, PacketLaw, SentPacket, Verdict, WordsLaw};

/// Laws of a test bed, in the given order.
#[derive(Clone, Debug, Default)]
pub(crate) struct Laws(Vec<Given>);

/// Law with its path.
#[derive(Clone)]
pub(crate) struct Given {
    pub(crate) path: Path,
    /// Words of the law, or the place where the test gave the law.
    pub(crate) name: String,
    /// Hit, if the law was given in words.
    hit: Option<Hit>,
    fresh: Arc<Fresh>,
}

type Fresh = dyn Fn() -> Box<dyn PacketLaw + Send> + Send + Sync + UnwindSafe + RefUnwindSafe;

impl Laws {
    pub(crate) fn add(&mut self, path: Path, name: String, law: impl PacketLaw + Clone + Send + 'static) {
        // A law need not be `Sync`. The mutex permits clones of a test bed on several threads.
        let law = Mutex::new(law);
        self.0.push(Given { path, name, hit: None, fresh: Arc::new(move || Box::new(lock(&law).clone())) });
    }

    /// Adds a hit given in words.
    pub(crate) fn add_hit(&mut self, path: Path, hit: Hit) {
        self.add(path, hit.to_string(), WordsLaw::new(hit.clone()));
        if let Some(given) = self.0.last_mut() {
            given.hit = Some(hit);
        }
    }

    /// Adds a function as a law.
    pub(crate) fn add_function(&mut self, path: Path, name: String, judge: impl FnMut(&SentPacket<'_>) -> Verdict + Clone + Send + 'static) {
        self.add(path, name, Function(judge));
    }

    pub(crate) fn iter(&self) -> std::slice::Iter<'_, Given> {
        self.0.iter()
    }
}

impl Given {
    /// Returns the hit, if the law was given in words.
    pub(crate) const fn words(&self) -> Option<&Hit> {
        self.hit.as_ref()
    }

    /// Returns a copy of the law in its initial state.
    pub(crate) fn fresh(&self) -> Box<dyn PacketLaw + Send> {
        (self.fresh)()
    }
}

impl fmt::Debug for Given {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Given").field("path", &self.path).field("name", &self.name).finish_non_exhaustive()
    }
}

#[derive(Clone)]
struct Function<F>(F);

impl<F: FnMut(&SentPacket<'_>) -> Verdict> PacketLaw for Function<F> {
    fn judge(&mut self, packet: &SentPacket<'_>, _draws: &mut Draws) -> Verdict {
        (self.0)(packet)
    }
}

/// Locks the mutex, also after a panic, because a law is consistent between two calls.
fn lock<T: ?Sized>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}
