//! Tasks that wait, and how they are woken.

use std::task::{RawWakerVTable, Waker};

/// A waker, by the addresses of its parts. They are those of no other waker as long as it is kept.
pub(crate) type Registered = [usize; 2];

pub(crate) fn registered(waker: &Waker) -> Registered {
    [waker.data().addr(), std::ptr::from_ref(waker.vtable()).addr()]
}

/// The wakers of tasks that wait for one thing.
#[derive(Debug, Default)]
pub(super) struct Waiters {
    /// Whether the first one waits. It is kept when it was woken: most often the same task waits again, and then nothing is moved.
    first_waits: bool,
    first: Option<Waker>,
    others: Vec<Waker>,
}

impl Waiters {
    /// A task waits, once.
    #[inline]
    pub(super) fn wait(&mut self, waker: &Waker) {
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
        // They are woken in the order in which they came: others wait only while the first one does.
        if self.first_waits {
            self.others.push(waker.clone());
        } else {
            (self.first_waits, self.first) = (true, Some(waker.clone()));
        }
    }

    pub(super) const fn is_empty(&self) -> bool {
        !self.first_waits && self.others.is_empty()
    }

    /// Returns whether that task waits.
    pub(super) fn has(&self, waker: &Waker) -> bool {
        let first = self.first.as_ref().filter(|_| self.first_waits);
        first.into_iter().chain(&self.others).any(|waiting| waiting.will_wake(waker))
    }

    #[cfg(feature = "tcp")]
    pub(super) fn clear(&mut self) {
        (self.first_waits, self.first) = (false, None);
        self.others.clear();
    }

    /// All go on.
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

    /// Wakes now if it may.
    #[inline]
    pub(super) fn wake_by_ref(&mut self, waker: &Waker) {
        if self.own.is_some_and(|own| std::ptr::eq(own, waker.vtable())) {
            waker.wake_by_ref();
        } else {
            self.wake_later(waker);
        }
    }

    #[inline(never)]
    fn wake_later(&mut self, waker: &Waker) {
        self.later.push(waker.clone());
    }

    /// Wakes now if it may.
    pub(super) fn wake(&mut self, waker: Waker) {
        if self.own.is_some_and(|own| std::ptr::eq(own, waker.vtable())) {
            waker.wake();
        } else {
            self.later.push(waker);
        }
    }

    /// Whether some wait for that.
    #[cfg(feature = "tokio")]
    pub(crate) const fn is_any(&self) -> bool {
        !self.later.is_empty()
    }

    /// Those that are to be woken once nobody holds the state, if there are any.
    #[inline]
    pub(super) fn take(&mut self) -> Option<Vec<Waker>> {
        (!self.later.is_empty()).then(|| std::mem::take(&mut self.later))
    }
}
