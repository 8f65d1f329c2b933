//! Tasks that wait, and how they are woken.

use std::task::{RawWakerVTable, Waker};

/// The wakers of tasks that wait for one thing.
#[derive(Debug, Default)]
pub(super) struct Waiters {
    waiting: Vec<Waker>,
    /// One that was woken: most often the same task waits again.
    known: Option<Waker>,
}

impl Waiters {
    /// A task waits, once.
    #[inline]
    pub(super) fn wait(&mut self, waker: &Waker) {
        if self.waiting.iter().any(|waiting| waiting.will_wake(waker)) {
            return;
        }
        let known = self.known.take().filter(|known| known.will_wake(waker));
        self.waiting.push(known.unwrap_or_else(|| waker.clone()));
    }

    pub(super) const fn is_empty(&self) -> bool {
        self.waiting.is_empty()
    }

    pub(super) fn clear(&mut self) {
        self.waiting.clear();
    }

    /// All go on.
    #[inline]
    pub(super) fn wake(&mut self, woken: &mut Woken) {
        for waker in self.waiting.drain(..) {
            self.known = woken.wake(waker).or_else(|| self.known.take());
        }
    }
}

/// Tasks to be woken. A waker may run anything, what asks for the state included, so that it waits here until nobody holds that. Those of the executor of this crate
/// only note which task goes on.
#[derive(Debug, Default)]
pub(crate) struct Woken {
    later: Vec<Waker>,
    own: Option<&'static RawWakerVTable>,
}

impl Woken {
    /// Wakers like this one only wake.
    pub(crate) fn trust(&mut self, waker: &Waker) {
        self.own = Some(waker.vtable());
    }

    /// Wakes now if it may, and gives the waker back then.
    #[inline]
    pub(super) fn wake(&mut self, waker: Waker) -> Option<Waker> {
        if self.own.is_some_and(|own| std::ptr::eq(own, waker.vtable())) {
            waker.wake_by_ref();
            return Some(waker);
        }
        self.later.push(waker);
        None
    }

    /// Whether some wait for that.
    #[cfg(feature = "tokio")]
    pub(crate) const fn is_any(&self) -> bool {
        !self.later.is_empty()
    }

    /// Those that are to be woken once nobody holds the state; `None`: there are none.
    #[inline]
    pub(crate) fn take(&mut self) -> Option<Vec<Waker>> {
        (!self.later.is_empty()).then(|| std::mem::take(&mut self.later))
    }
}
