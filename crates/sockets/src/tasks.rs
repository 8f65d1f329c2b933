//! Tasks of foreign executors on hosts of a test bed.

use std::cell::RefCell;
use std::fmt;
use std::io;
use std::net::SocketAddr;
use std::sync::Arc;
use std::task::{Context, Poll};

thread_local! {
    /// Host of this thread outside of the run, as for a thread of `spawn_blocking`.
    static HOST: RefCell<Option<Arc<dyn Host>>> = const { RefCell::new(None) };
}

/// A host of a test bed, for tasks that the test bed does not poll itself.
pub trait Host: Send + Sync {
    /// Returns the name of the host.
    fn name(&self) -> String;

    /// Returns the addresses of `name`, a host's name or a literal address without port. May be called on every thread.
    ///
    /// # Errors
    ///
    /// [`io::ErrorKind::NotFound`] if no host has that name.
    fn look_up(&self, name: &str, port: u16) -> io::Result<Vec<SocketAddr>>;

    /// Notes a fault of the test, with which the run fails after the polled task has returned. May be called on every thread.
    fn note_fault(&self, text: &str);

    /// Calls `act` as a task of this host: sockets made by `act` belong to this host.
    fn within(&self, act: &mut dyn FnMut());

    /// Keeps `stop`, and calls `stop` when the program of the host ends: by a crash, or because the program is killed.
    fn keep(&self, stop: Box<dyn Stop>);

    /// Listens for the signal `number`, such as 15 for `SIGTERM`. From then on the program handles the signal, and the signal does not end the program.
    fn listen_for(&self, number: i32) -> Box<dyn Signals>;
}

impl fmt::Debug for dyn Host {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Host").finish_non_exhaustive()
    }
}

/// Signals of one kind that come to the program of a host.
pub trait Signals: fmt::Debug + Send + Sync {
    /// Waits for the next signal. Signals that come before the program asks again are one signal. Registers the waker of the context if no signal has come.
    fn poll_receive(&mut self, cx: &mut Context<'_>) -> Poll<()>;
}

/// The way to stop a task.
pub trait Stop: Send {
    /// Stops the task by dropping the task's future.
    fn stop(&self);

    /// Returns whether the task is over, so that `stop` need not be kept any more.
    fn is_over(&self) -> bool;
}

/// Guard: the virtual time of a test bed stands still until the guard is dropped.
pub trait Hold: Send {}

/// Returns the host of the present task: the host of the task under the test bed's poll, or this thread's host.
#[must_use]
pub fn host() -> Option<Arc<dyn Host>> {
    match crate::bed() {
        // Inside a run the test bed knows the polled task. The thread's own host counts only on threads without a test bed, such as threads of
        // `spawn_blocking`.
        Some(bed) => bed.host(),
        None => HOST.try_with(|host| host.borrow().clone()).ok().flatten(),
    }
}

/// Guard: this thread works for a host until the guard is dropped.
#[derive(Debug)]
#[must_use = "the thread works for the host until the guard is dropped"]
pub struct OnHost {
    before: Option<Arc<dyn Host>>,
}

/// Declares that this thread, without a test bed of its own, works for `host` until the returned guard is dropped. Tasks started by the thread live on `host`.
pub fn on_host(host: Arc<dyn Host>) -> OnHost {
    OnHost { before: HOST.with_borrow_mut(|here| here.replace(host)) }
}

impl Drop for OnHost {
    fn drop(&mut self) {
        // Guards nest: the host before this guard is in force again.
        let before = self.before.take();
        // The value is dropped after the borrow has ended, because the host's destructor is foreign.
        let left = HOST.try_with(|host| host.replace(before));
        drop(left);
    }
}
