//! Parts of a run that call the system in a test bed: the test kit and its layers themselves.

use std::cell::Cell;
use std::marker::PhantomData;

thread_local! {
    /// Number of guards of [`outside`] on this thread.
    static GUARDS: Cell<u32> = const { Cell::new(0) };
}

/// Guard: calls of the system on this thread reach the system until the guard is dropped, also in a test bed.
#[derive(Debug)]
#[must_use = "the calls reach the system until the guard is dropped"]
pub struct Outside {
    /// The guard counts for the thread that made it, and must be dropped there.
    _here: PhantomData<*const ()>,
}

/// Lets calls of the system on this thread reach the system until the returned guard is dropped. Guards nest.
///
/// Code that stands for a socket of a test bed needs sockets of the system itself, and would otherwise get sockets of the test bed.
pub fn outside() -> Outside {
    GUARDS.set(GUARDS.get() + 1);
    Outside { _here: PhantomData }
}

impl Drop for Outside {
    fn drop(&mut self) {
        GUARDS.set(GUARDS.get() - 1);
    }
}

/// Returns whether a call of the system on this thread belongs to the test bed of the thread. Takes no memory and no lock, so that every call on every thread may
/// ask.
#[must_use]
pub fn catches_calls() -> bool {
    crate::is_in_bed() && GUARDS.get() == 0
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn guards_nest() {
        let first = outside();
        let second = outside();
        drop(first);
        assert_eq!(GUARDS.get(), 1);
        drop(second);
        assert_eq!(GUARDS.get(), 0);
        assert!(!catches_calls());
    }
}
