//! Waiting tasks, and the order and time of their waking.

use std::task::{RawWakerVTable, Waker};

/// Identity of a waker: the addresses of data and table. No other waker has the same identity while this waker is kept.
pub(crate) type Registered = [usize; 2];

pub(crate) fn registered(waker: &Waker) -> Registered {
    [waker.data().addr(), std::ptr::from_ref(waker.vtable()).addr()]
}

/// Wakers of the tasks that wait for the same thing, such as a datagram at a socket.
#[derive(Debug, Default)]
pub(super) struct Waiters {
    /// `true` if the task of `first` waits. `first` is kept after the waking: most often the same task waits again, and the waker need not be cloned.
    first_waits: bool,
    /// Waker of the first waiting task. If `first_waits` is false, a waker woken before, or `None`.
    first: Option<Waker>,
    /// Further waiting tasks, in the order of arrival. Empty while `first_waits` is false.
    others: Vec<Waker>,
}

impl Waiters {
    /// Adds a waiting task. A task that waits already is not added twice.
    #[inline]
    pub(super) fn wait(&mut self, waker: &Waker) {
        // Most sockets have one reader, and the waker of its last wait is still there.
        if self.first.as_ref().is_some_and(|first| first.will_wake(waker)) {
            self.first_waits = true;
            return;
        }
        self.wait_as_another(waker);
    }

    #[inline(never)]
    fn wait_as_another(&mut self, waker: &Waker) {
        if self.others.iter().any(|waiting| waiting.will_wake(waker)) {
            return;
        }
        // The tasks are woken in the order of arrival. `others` may be filled only while the first task waits.
        if self.first_waits {
            self.others.push(waker.clone());
        } else {
            (self.first_waits, self.first) = (true, Some(waker.clone()));
        }
    }

    pub(super) const fn is_empty(&self) -> bool {
        !self.first_waits && self.others.is_empty()
    }

    /// Returns whether the task with the waker `waker` waits.
    pub(super) fn has(&self, waker: &Waker) -> bool {
        let first = self.first.as_ref().filter(|_| self.first_waits);
        first.into_iter().chain(&self.others).any(|waiting| waiting.will_wake(waker))
    }

    #[cfg(feature = "tcp")]
    pub(super) fn clear(&mut self) {
        (self.first_waits, self.first) = (false, None);
        self.others.clear();
    }

    /// Wakes all waiting tasks.
    #[inline]
    pub(super) fn wake(&mut self, woken: &mut Woken) {
        if std::mem::take(&mut self.first_waits)
            && let Some(first) = &self.first
        {
            woken.wake_by_ref(first);
        }
        if !self.others.is_empty() {
            self.wake_others(woken);
        }
    }

    #[inline(never)]
    fn wake_others(&mut self, woken: &mut Woken) {
        self.others.drain(..).for_each(|waker| woken.wake(waker));
    }
}

/// Wakers to call after the borrow of the state ends. A foreign waker may run any code, which may ask the state. A waker of the executor of this crate only
/// notes which task goes on, and is called at once.
#[derive(Debug, Default)]
pub(crate) struct Woken {
    /// Foreign wakers that were not called yet.
    later: Vec<Waker>,
    /// `true` if something is left to do after the answer of the state: wakers to call, or a state to bring home.
    pub(super) is_work_left: bool,
    /// Table of the wakers of the executor of this crate.
    own: Option<&'static RawWakerVTable>,
}

impl Woken {
    /// Declares that wakers with the table of `waker` only note a task and may be called during a borrow of the state.
    pub(crate) fn trust(&mut self, waker: &Waker) {
        self.own = Some(waker.vtable());
    }

    /// Calls the waker now if it is trusted, otherwise after the borrow.
    #[inline]
    pub(super) fn wake_by_ref(&mut self, waker: &Waker) {
        // All wakers of one kind share a table, so the address of the table tells the kind.
        if self.own.is_some_and(|own| std::ptr::eq(own, waker.vtable())) {
            waker.wake_by_ref();
        } else {
            self.wake_later(waker);
        }
    }

    #[inline(never)]
    fn wake_later(&mut self, waker: &Waker) {
        self.later.push(waker.clone());
        self.is_work_left = true;
    }

    /// Calls the waker now if it is trusted, otherwise after the borrow.
    pub(super) fn wake(&mut self, waker: Waker) {
        if self.own.is_some_and(|own| std::ptr::eq(own, waker.vtable())) {
            waker.wake();
        } else {
            self.later.push(waker);
            self.is_work_left = true;
        }
    }

    /// Returns whether wakers are to be called after the borrow.
    #[cfg(feature = "tokio")]
    pub(crate) const fn is_any(&self) -> bool {
        !self.later.is_empty()
    }

    /// Takes the wakers to call after the answer of the state.
    pub(super) fn take(&mut self) -> Vec<Waker> {
        self.is_work_left = false;
        std::mem::take(&mut self.later)
    }
}
