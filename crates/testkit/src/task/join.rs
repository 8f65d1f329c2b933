//! Outcome of a task, and the handle that waits for the outcome.

use std::cell::RefCell;
use std::fmt;
use std::future::Future;
use std::pin::Pin;
use std::rc::{Rc, Weak};
use std::task::{Context, Poll, Waker};

use super::Task;

/// Handle of a task: a future for the outcome of the task. Dropping the handle does not stop the task.
pub struct JoinHandle<T> {
    state: Rc<RefCell<State<T>>>,
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
    pub(super) const fn new(state: Rc<RefCell<State<T>>>, task: Weak<Task>) -> Self {
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
pub(crate) fn joined<F: Future>(future: F) -> (impl Future<Output = ()>, Rc<RefCell<State<F::Output>>>) {
    let state = Rc::new(RefCell::new(State { outcome: None, waker: None }));
    // The guard reports the end to the waiting task, even if the program is dropped before its end.
    let told = Told(Rc::clone(&state));
    let program = async move {
        let outcome = future.await;
        told.0.borrow_mut().outcome = Some(Ok(outcome));
        drop(told);
    };
    (program, state)
}

/// Guard that stores [`TaskStopped`] if there is no outcome, and wakes the waiting task.
struct Told<T>(Rc<RefCell<State<T>>>);

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
