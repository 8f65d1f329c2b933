//! Outcome of a task, and the handle that waits for the outcome.

use std::cell::RefCell;
use std::fmt;
use std::future::Future;
use std::pin::Pin;
use std::rc::{Rc, Weak};
use std::task::{Context, Poll, Waker};

use super::Task;

/// Place of the outcome of a task, which the program of the task and the handle share.
type Place<T> = Rc<RefCell<State<T>>>;

/// Handle of a task: a future for the outcome of the task. Dropping the handle does not stop the task.
pub struct JoinHandle<T> {
    state: Place<T>,
    task: Weak<Task>,
}

/// Error of a task that was stopped before its end, by [`JoinHandle::abort`] or because the host crashed.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct TaskStopped;

impl fmt::Display for TaskStopped {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str("the task was stopped before its end: the task was aborted, or its host crashed")
    }
}

impl std::error::Error for TaskStopped {}

#[derive(Debug)]
pub(crate) struct State<T> {
    outcome: Option<Result<T, TaskStopped>>,
    waker: Option<Waker>,
}

impl<T> JoinHandle<T> {
    pub(super) const fn new(state: Place<T>, task: Weak<Task>) -> Self {
        Self { state, task }
    }

    /// Stops the task. The future is dropped at the point at which the task waits.
    pub fn abort(&self) {
        if let Some(task) = self.task.upgrade() {
            task.stop();
        }
    }

    /// Returns whether the task is over or was stopped.
    #[must_use]
    pub fn is_finished(&self) -> bool {
        self.task.upgrade().is_none_or(|task| task.is_over())
    }
}

impl<T> fmt::Debug for JoinHandle<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("JoinHandle").field("is_finished", &self.is_finished()).finish_non_exhaustive()
    }
}

impl<T> Future for JoinHandle<T> {
    type Output = Result<T, TaskStopped>;

    /// Returns the outcome once. A handle that is polled again afterwards stays pending for ever.
    fn poll(self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<Self::Output> {
        let mut state = self.state.borrow_mut();
        if let Some(outcome) = state.outcome.take() {
            return Poll::Ready(outcome);
        }
        state.waker = Some(cx.waker().clone());
        Poll::Pending
    }
}

/// Wraps `future` into a program that stores the output of `future`. Returns the program, and the place of the output.
pub(crate) fn joined<F: Future>(future: Pin<Box<F>>) -> (Joined<F>, Place<F::Output>) {
    let state = Rc::new(RefCell::new(State { outcome: None, waker: None }));
    (Joined(Some(Unfinished { future, told: Told(Rc::clone(&state)) })), state)
}

/// Program that stores the output of a future; `None` once the future is over.
///
/// Not an `async` block, whose state would be looked up at each poll before the state of the future.
pub(crate) struct Joined<F: Future>(Option<Unfinished<F>>);

/// Future of a [`Joined`], with the guard that reports the end to the waiting task even if the program is dropped before its end.
struct Unfinished<F: Future> {
    // Fields are dropped in this order.
    future: Pin<Box<F>>,
    told: Told<F::Output>,
}

impl<F: Future> Future for Joined<F> {
    type Output = ();

    fn poll(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<()> {
        let Some(unfinished) = &mut self.0 else { return Poll::Ready(()) };
        let Poll::Ready(outcome) = unfinished.future.as_mut().poll(cx) else { return Poll::Pending };
        if let Some(Unfinished { future, told }) = self.0.take() {
            // The future is dropped first, so that the waiting task finds its sockets closed.
            drop(future);
            told.tell(outcome);
        }
        Poll::Ready(())
    }
}

/// Guard that stores [`TaskStopped`] if there is no outcome, and wakes the waiting task.
struct Told<T>(Place<T>);

impl<T> Told<T> {
    fn tell(self, outcome: T) {
        self.0.borrow_mut().outcome = Some(Ok(outcome));
    }
}

impl<T> Drop for Told<T> {
    fn drop(&mut self) {
        let mut state = self.0.borrow_mut();
        if state.outcome.is_none() {
            state.outcome = Some(Err(TaskStopped));
        }
        // The waker is called after the borrow has ended: a foreign waker may poll the handle at once.
        let waker = state.waker.take();
        drop(state);
        if let Some(waker) = waker {
            waker.wake();
        }
    }
}
