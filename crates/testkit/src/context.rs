//! The running test bed of the present thread: the way of programs to the state of the run.

use std::cell::RefCell;
use std::fmt;
use std::io;
use std::mem::ManuallyDrop;
use std::panic::Location;
use std::rc::Rc;
use std::sync::Arc;

use cohaptic_wan::NodeId;

use crate::core::Shared;
use crate::current;
use crate::task::Tasks;

thread_local! {
    /// `ManuallyDrop`, because a thread-local value that needs no drop is accessed without a check whether it was dropped. [`Entered`] empties the value.
    static RUNNING: RefCell<ManuallyDrop<Option<Running>>> = const { RefCell::new(ManuallyDrop::new(None)) };
}

/// Running test bed.
#[derive(Clone)]
pub(crate) struct Running {
    pub(crate) shared: Arc<Shared>,
    pub(crate) tasks: Rc<Tasks>,
}

/// Guard: a test bed runs on this thread until the guard is dropped.
pub(crate) struct Entered;

impl Running {
    /// Makes this test bed the running test bed of this thread.
    ///
    /// # Panics
    ///
    /// If another test bed runs on this thread.
    #[expect(clippy::panic, reason = "a misuse, and the way out")]
    pub(crate) fn enter(self) -> Entered {
        RUNNING.with_borrow_mut(|running| {
            if running.is_some() {
                panic!(
                    "a test bed was started inside the run of another test bed, whose virtual time cannot pass meanwhile. Give both programs hosts of one test \
                     bed, or run the two test beds one after the other"
                );
            }
            let Self { shared, tasks } = self.clone();
            current::begin(shared.run(), Rc::new(move || tasks.current(shared.names())));
            **running = Some(self);
        });
        Entered
    }
}

impl Drop for Entered {
    fn drop(&mut self) {
        // Dropped after the borrow and after `current::end`: the destructors of the run may look for a running test bed, and must find none.
        let left = RUNNING.with_borrow_mut(|running| running.take());
        current::end();
        drop(left);
    }
}

/// Returns the running test bed of this thread.
pub(crate) fn running() -> Option<Running> {
    RUNNING.with_borrow(|running| (**running).clone())
}

/// Returns the state of the running test bed of this thread.
pub(crate) fn shared() -> Option<Arc<Shared>> {
    RUNNING.with_borrow(|running| running.as_ref().map(|running| Arc::clone(&running.shared)))
}

/// Like [`shared`], for a hook of panics: the thread may end, or the state of the thread may be borrowed.
pub(crate) fn try_shared() -> Option<Arc<Shared>> {
    RUNNING.try_with(|running| Some(Arc::clone(&running.try_borrow().ok()?.as_ref()?.shared))).ok()?
}

/// Returns the running test bed of this thread. `what` completes the message of the panic.
///
/// # Panics
///
/// If no test bed runs on this thread.
#[expect(clippy::panic, reason = "a misuse, and the way out")]
pub(crate) fn expect_running(what: &str) -> Running {
    running().unwrap_or_else(|| panic!("{}", outside_text(what)))
}

/// Asks the state of the running test bed of this thread. `what` completes the message of the panic.
///
/// # Panics
///
/// If no test bed runs on this thread.
#[expect(clippy::panic, reason = "a misuse, and the way out")]
pub(crate) fn ask<T>(what: &str, question: impl FnOnce(&Arc<Shared>) -> T) -> T {
    RUNNING.with_borrow(|running| match &**running {
        Some(running) => question(&running.shared),
        None => panic!("{}", outside_text(what)),
    })
}

/// Call for making a socket, with its place in the test. The call needs a running test bed and a host.
#[derive(Clone, Copy)]
pub(crate) struct Call {
    name: &'static str,
    /// `None` for a call of the system, whose caller is not known.
    place: Option<&'static Location<'static>>,
}

impl fmt::Display for Call {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.place {
            Some(place) => write!(f, "`{}` at {place}", self.name),
            None => write!(f, "the call `{}` of the system", self.name),
        }
    }
}

impl Call {
    /// Describes the call `name` at the place of the caller.
    ///
    /// # Panics
    ///
    /// If no test bed runs on this thread.
    #[track_caller]
    pub(crate) fn here(name: &'static str) -> Self {
        let call = Self { name, place: Some(Location::caller()) };
        if shared().is_none() {
            call.is_outside();
        }
        call
    }

    /// Returns the running test bed, and the host of the task being polled. `how` is the advice of the message for a task without a host.
    ///
    /// # Panics
    ///
    /// If there is no test bed or no host. A panic, because a program that retries until success would swallow an error.
    #[track_caller]
    #[expect(clippy::panic, reason = "a misuse, and the way out")]
    pub(crate) fn host(self, how: &str) -> (Arc<Shared>, NodeId) {
        let Some(shared) = shared() else { self.is_outside() };
        if let Some(host) = current::host() {
            return (shared, host);
        }
        let text = format!("{self} was called by a task that belongs to no host: spawn the task with `Host::spawn`, or {how}");
        // Tokio catches the panic of its own tasks. The noted fault fails the run nevertheless.
        shared.note_fault(&text);
        panic!("{text}");
    }

    #[cold]
    #[track_caller]
    #[expect(clippy::panic, reason = "a misuse, and the way out")]
    fn is_outside(self) -> ! {
        panic!("{self} was called outside of a test bed: make the call within `Testbed::run`, on the thread of the run");
    }
}

#[cfg(feature = "facade")]
impl From<cohaptic_sockets::Call> for Call {
    fn from(call: cohaptic_sockets::Call) -> Self {
        Self { name: call.name, place: call.place }
    }
}

/// Returns the error of a call that works only inside a test bed.
pub(crate) fn outside(what: &str) -> io::Error {
    io::Error::new(io::ErrorKind::NotFound, outside_text(what))
}

fn outside_text(what: &str) -> String {
    format!("{what} only inside a running test bed: make the call within `Testbed::run`, on the thread of the run")
}
