//! Virtual time to the nanosecond, for programs that do not use tokio's timers.
//!
//! The functions of this module also work on tokio's clock (`Testbed::on_tokio`). The resolution stays a nanosecond, while tokio's own timers are
//! rounded up to milliseconds.

use std::fmt;
use std::future::{Future, poll_fn};
use std::pin::{Pin, pin};
use std::sync::Arc;
use std::task::{Context, Poll, Waker};
use std::time::Duration;

use cohaptic_units::Instant;

use crate::context;
use crate::core::{Registered, Shared, TimerId, counted_now, registered};

/// Returns the time since the run began.
///
/// # Panics
///
/// Outside a running test bed; and if a task asks millions of times without letting time pass, as a busy loop does: let such a loop `sleep`.
#[must_use]
#[inline]
pub fn now() -> Instant {
    // The usual answer needs no call of another function, and therefore saves no registers.
    counted_now().unwrap_or_else(asked_now)
}

#[cold]
#[inline(never)]
fn asked_now() -> Instant {
    context::ask("time is known", |shared| {
        shared.note_call();
        shared.now()
    })
}

/// Waits for a span. A span of zero is over at once.
///
/// # Panics
///
/// Outside a running test bed.
#[must_use = "futures do nothing unless they are awaited"]
pub fn sleep(span: Duration) -> Sleep {
    let shared = context::ask("time passes", Arc::clone);
    let deadline = shared.now().saturating_add(span);
    Sleep { shared, deadline, timer: None }
}

/// Waits until an instant. A wait for an instant that has passed is over at once.
///
/// # Panics
///
/// Outside a running test bed.
#[must_use = "futures do nothing unless they are awaited"]
pub fn sleep_until(deadline: Instant) -> Sleep {
    Sleep { shared: context::ask("time passes", Arc::clone), deadline, timer: None }
}

/// Future of a wait: see [`sleep`].
pub struct Sleep {
    shared: Arc<Shared>,
    deadline: Instant,
    timer: Option<(TimerId, Registered)>,
}

impl Sleep {
    #[cfg(feature = "quinn")]
    pub(crate) const fn of(shared: Arc<Shared>, deadline: Instant) -> Self {
        Self { shared, deadline, timer: None }
    }

    /// Registers the waker with the timer. Not inlined, because most often the timer has the waker already and this path is not needed.
    #[inline(never)]
    fn register(&mut self, waker: &Waker) {
        let registered = registered(waker);
        match &mut self.timer {
            Some((timer, known)) => {
                // The wait may have moved to another task. The timer keeps its place among timers of the same deadline.
                self.shared.with(|core| core.timers.renew(*timer, waker));
                *known = registered;
            }
            None => {
                let timer = self.shared.with(|core| core.timers.set(self.deadline, waker.clone()));
                self.timer = Some((timer, registered));
            }
        }
    }

    /// Returns the instant at which the wait is over.
    #[must_use]
    pub const fn deadline(&self) -> Instant {
        self.deadline
    }

    /// Changes the end of the wait to another instant.
    pub fn reset(&mut self, deadline: Instant) {
        if let Some((timer, _)) = self.timer.take() {
            self.shared.with(|core| core.timers.cancel(timer));
        }
        self.deadline = deadline;
    }
}

impl fmt::Debug for Sleep {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Sleep").field("deadline", &self.deadline).finish_non_exhaustive()
    }
}

impl Future for Sleep {
    type Output = ();

    #[inline]
    fn poll(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<()> {
        let this = &mut *self;
        if this.shared.now() < this.deadline {
            if this.timer.as_ref().is_none_or(|(_, known)| *known != registered(cx.waker())) {
                this.register(cx.waker());
            }
            return Poll::Pending;
        }
        // The timer has gone off when time passed to its deadline, and need not be cancelled. Without a timer the task has not waited, and a loop of such waits
        // would let no time pass: the call is counted.
        if this.timer.take().is_none() {
            this.shared.note_call();
        }
        Poll::Ready(())
    }
}

impl Drop for Sleep {
    fn drop(&mut self) {
        if let Some((timer, _)) = self.timer.take() {
            self.shared.release(move |core| core.timers.cancel(timer));
        }
    }
}

/// Error of a [`timeout`] after the end of the time.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Elapsed;

impl fmt::Display for Elapsed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the time was up before the future was ready")
    }
}

impl std::error::Error for Elapsed {}

impl From<Elapsed> for std::io::Error {
    fn from(elapsed: Elapsed) -> Self {
        Self::new(std::io::ErrorKind::TimedOut, elapsed)
    }
}

/// Waits for a future, but at most for `span`. If both are over at the same instant, the future wins.
///
/// # Errors
///
/// [`Elapsed`] if the time was up first. The future is dropped.
///
/// # Panics
///
/// Outside a running test bed.
pub async fn timeout<F: Future>(span: Duration, future: F) -> Result<F::Output, Elapsed> {
    let (mut future, mut time) = (pin!(future), pin!(sleep(span)));
    poll_fn(move |cx| {
        // The future is polled first, so that the future wins at an equal instant.
        if let Poll::Ready(outcome) = future.as_mut().poll(cx) {
            return Poll::Ready(Ok(outcome));
        }
        time.as_mut().poll(cx).map(|()| Err(Elapsed))
    })
    .await
}

/// Ticks at equal distances, beginning at once.
///
/// # Panics
///
/// Outside a running test bed, and with a period of zero.
#[must_use]
pub fn interval(period: Duration) -> Interval {
    assert!(!period.is_zero(), "an interval with a period of zero never lets time pass: give a period above zero");
    let shared = context::ask("time passes", Arc::clone);
    let next = shared.now();
    Interval { shared, next, period }
}

/// Source of ticks at equal distances: see [`interval`]. Missed ticks follow at once, one after the other.
pub struct Interval {
    shared: Arc<Shared>,
    next: Instant,
    period: Duration,
}

impl Interval {
    /// Waits for the next tick, and returns its scheduled instant.
    pub async fn tick(&mut self) -> Instant {
        let at = self.next;
        Sleep { shared: Arc::clone(&self.shared), deadline: at, timer: None }.await;
        // The next tick counts from the scheduled instant and not from now, so that a late task does not shift the ticks after it.
        self.next = at + self.period;
        at
    }
}

impl fmt::Debug for Interval {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Interval").field("next", &self.next).field("period", &self.period).finish_non_exhaustive()
    }
}

/// Lets the other tasks that can go on now run first. Time does not pass.
pub async fn yield_now() {
    let mut has_yielded = false;
    poll_fn(|cx| {
        if std::mem::replace(&mut has_yielded, true) {
            return Poll::Ready(());
        }
        cx.waker().wake_by_ref();
        Poll::Pending
    })
    .await;
}
