//! The part of a socket's state that is read without the state: whether a task that has read all may wait again at once.

use std::sync::atomic::{AtomicU8, AtomicUsize, Ordering};
use std::task::Waker;

use super::waking::registered;

/// What a socket knows without the state of its run. A task that reads in a loop asks once more after each datagram, in vain; to take the state for that took
/// 25 instructions more, and 3 % of the time of a datagram.
///
/// Both sides use it on the thread that has the state at hand, so that nothing happens between two looks.
#[derive(Debug, Default)]
pub(crate) struct Inlet {
    state: AtomicU8,
    /// The waker that the socket keeps, as [`Registered`](super::waking::Registered).
    known: [AtomicUsize; 2],
}

/// There may be something to read, or an error; or there is no waker.
const BUSY: u8 = 0;
/// There is nothing to read and no error, and the socket keeps a waker.
const QUIET: u8 = 1;
/// As [`QUIET`]; and the task of that waker waits, which the state does not know.
const WAITED_FOR: u8 = 2;

impl Inlet {
    /// The task of that waker waits, if there is nothing to read and the socket keeps this waker. Says whether that is so.
    #[inline]
    pub(crate) fn waits_again(&self, waker: &Waker) -> bool {
        let is_known = self.known.iter().zip(registered(waker)).all(|(known, part)| known.load(Ordering::Relaxed) == part);
        if is_known {
            self.state.store(WAITED_FOR, Ordering::Relaxed);
        }
        is_known
    }

    /// Whether there may be something to read. If not, and with the state at hand, [`Inlet::waits_again`] may be asked.
    #[inline]
    pub(crate) fn is_busy(&self) -> bool {
        self.state.load(Ordering::Relaxed) == BUSY
    }

    /// The socket keeps another waker.
    pub(super) fn keep(&self, waker: &Waker) {
        for (known, part) in self.known.iter().zip(registered(waker)) {
            known.store(part, Ordering::Relaxed);
        }
    }

    /// All was read, and the socket keeps a waker.
    #[inline]
    pub(super) fn set_quiet(&self) {
        self.state.store(QUIET, Ordering::Relaxed);
    }

    /// Whether a task waits of which the state does not know.
    pub(super) fn is_waited_for(&self) -> bool {
        self.state.load(Ordering::Relaxed) == WAITED_FOR
    }

    /// From now on there may be something to read. Says whether a task waited of which the state did not know.
    #[inline]
    pub(super) fn set_busy(&self) -> bool {
        let is_waited_for = self.is_waited_for();
        self.state.store(BUSY, Ordering::Relaxed);
        is_waited_for
    }
}
