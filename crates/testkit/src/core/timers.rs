//! Timers: wakers and their deadlines.

use std::collections::BTreeMap;
use std::task::Waker;

use cohaptic_units::Instant;

/// A timer: its deadline, and a number that makes it different from others with the same one.
pub(crate) type TimerId = (Instant, u64);

/// Timers, in the order in which they go off: by deadline, then by when they were set.
#[derive(Debug, Default)]
pub(crate) struct Timers {
    wakers: BTreeMap<TimerId, Waker>,
    set: u64,
}

impl Timers {
    pub(crate) fn set(&mut self, deadline: Instant, waker: Waker) -> TimerId {
        let id = (deadline, self.set);
        self.set += 1;
        self.wakers.insert(id, waker);
        id
    }

    /// Sees to it that another one is woken.
    pub(crate) fn renew(&mut self, id: TimerId, waker: &Waker) {
        if let Some(known) = self.wakers.get_mut(&id) {
            known.clone_from(waker);
        }
    }

    pub(crate) fn cancel(&mut self, id: TimerId) {
        self.wakers.remove(&id);
    }

    pub(crate) fn next(&self) -> Option<Instant> {
        self.wakers.first_key_value().map(|((deadline, _), _)| *deadline)
    }

    /// Takes out those that are due.
    pub(crate) fn fire(&mut self, now: Instant, woken: &mut Vec<Waker>) {
        while let Some(first) = self.wakers.first_entry().filter(|first| first.key().0 <= now) {
            woken.push(first.remove());
        }
    }
}
