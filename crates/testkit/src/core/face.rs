//! Part of the state that is read without the lock of the state: the time, and the number of calls at the present instant.

use std::sync::atomic::{AtomicU64, Ordering};
#[cfg(feature = "facade")]
use std::sync::{Mutex, PoisonError};

use cohaptic_units::Instant;
use cohaptic_units::print::Seconds;

use crate::address::AddressPlan;
#[cfg(feature = "facade")]
use crate::address::Addresses;
use crate::current;

/// The time of the run, and the number of calls since time last passed. Only the holder of the state writes the time. Two threads may count a call at once and
/// lose one count; the limits are so high that a lost count does not matter.
#[derive(Debug)]
pub(crate) struct Face {
    /// Time of the run \[ns\].
    now: AtomicU64,
    /// Calls since time last passed.
    calls: AtomicU64,
    /// Polls of tasks since time last passed, as counted by [`Face::count_poll`].
    #[cfg(feature = "tokio")]
    polled: AtomicU64,
    /// Limit of `polled`.
    #[cfg(feature = "tokio")]
    patience: u64,
    /// Limit of `calls`: ten times the patience.
    most_calls: u64,
    /// Addresses of the hosts, for programs that look names up on other threads.
    #[cfg(feature = "facade")]
    plan: Mutex<AddressPlan>,
}

impl Face {
    pub(super) fn new(patience: u64, plan: &AddressPlan) -> Self {
        #[cfg(not(feature = "facade"))]
        let _ = plan;
        Self {
            now: AtomicU64::new(0),
            calls: AtomicU64::new(0),
            #[cfg(feature = "tokio")]
            polled: AtomicU64::new(0),
            #[cfg(feature = "tokio")]
            patience,
            most_calls: patience.saturating_mul(10),
            #[cfg(feature = "facade")]
            plan: Mutex::new(plan.clone()),
        }
    }

    /// Shows the changed addresses of the hosts.
    #[cfg(feature = "facade")]
    pub(super) fn publish(&self, plan: &AddressPlan) {
        plan.clone_into(&mut self.plan.lock().unwrap_or_else(PoisonError::into_inner));
    }

    /// Returns the addresses of the host named `name`. Every thread may ask.
    #[cfg(feature = "facade")]
    pub(crate) fn addresses(&self, name: &str) -> Option<Addresses> {
        self.plan.lock().unwrap_or_else(PoisonError::into_inner).addresses(name)
    }

    #[inline]
    pub(crate) fn now(&self) -> Instant {
        Instant::from_nanos(self.now.load(Ordering::Relaxed))
    }

    /// Sets the time to `now`, and the counts to zero.
    #[inline]
    pub(super) fn pass(&self, now: Instant) {
        self.now.store(now.as_nanos(), Ordering::Relaxed);
        self.calls.store(0, Ordering::Relaxed);
        #[cfg(feature = "tokio")]
        self.polled.store(0, Ordering::Relaxed);
    }

    /// Counts a poll of a task. Returns the patience if the tasks were polled more often than that since time last passed.
    #[cfg(feature = "tokio")]
    pub(super) fn count_poll(&self) -> Option<u64> {
        // Only the thread of the run polls tasks, so a load and a store suffice in place of a locked addition.
        let polled = self.polled.load(Ordering::Relaxed) + 1;
        self.polled.store(polled, Ordering::Relaxed);
        (polled > self.patience).then_some(self.patience)
    }

    /// Counts a request of a program that takes no time.
    ///
    /// # Panics
    ///
    /// If programs have called so often since time last passed that a task seems to wait for time without letting time pass.
    #[inline]
    pub(crate) fn note_call(&self) {
        if !self.count_call() {
            self.lose_patience(None);
        }
    }

    /// Like [`Face::note_call`], but returns whether the calls are within the limit, in place of a panic.
    #[inline]
    pub(super) fn count_call(&self) -> bool {
        let calls = self.calls.load(Ordering::Relaxed).wrapping_add(1);
        self.calls.store(calls, Ordering::Relaxed);
        calls <= self.most_calls
    }

    /// Fails the run, because time does not pass. `socket` names the socket that was called last.
    #[cold]
    #[expect(clippy::panic, reason = "time cannot pass; says who keeps it, why, and the way out")]
    pub(super) fn lose_patience(&self, socket: Option<&str>) -> ! {
        // A value that is dropped during the unwinding may call again. Without the reset that call would panic within a panic and abort the process.
        self.calls.store(0, Ordering::Relaxed);
        let who = match (current::task(), socket) {
            (Some(task), Some(socket)) => format!(". The caller is {task}, which called {socket} last"),
            (Some(task), None) => format!(". The caller is {task}"),
            (None, Some(socket)) => format!(". The last call was of {socket}"),
            (None, None) => String::new(),
        };
        panic!(
            "time stands still at {} s: a task asks for the time, sends, or tries to receive again and again without waiting; let the task wait, for instance \
             by `sleep(..).await`{who}",
            Seconds(self.now())
        );
    }
}
