//! The test bed that runs on this thread, which a program finds around it.

use std::cell::RefCell;
use std::io;
use std::panic::Location;
use std::rc::Rc;
use std::sync::Arc;

use cohaptic_wan::NodeId;

use crate::core::Shared;
use crate::current;
use crate::task::Tasks;

thread_local! {
    static RUNNING: RefCell<Option<Running>> = const { RefCell::new(None) };
}

/// A test bed that runs.
#[derive(Clone)]
pub(crate) struct Running {
    pub(crate) shared: Arc<Shared>,
    pub(crate) tasks: Rc<Tasks>,
}

/// Makes a test bed the one that runs on this thread, until it is dropped.
pub(crate) struct Entered(());

impl Running {
    /// # Panics
    ///
    /// If another one runs on this thread.
    #[expect(clippy::panic, reason = "a misuse, and the way out")]
    pub(crate) fn enter(self) -> Entered {
        RUNNING.with_borrow_mut(|running| {
            if running.is_some() {
                panic!("a test bed runs inside another one: the time of both cannot pass. Give both programs hosts of one test bed, or run one after the other");
            }
            let Self { shared, tasks } = self.clone();
            current::begin(shared.run(), Rc::new(move || tasks.current(shared.names())));
            *running = Some(self);
        });
        Entered(())
    }
}

impl Drop for Entered {
    fn drop(&mut self) {
        let left = RUNNING.with_borrow_mut(Option::take);
        current::end();
        drop(left);
    }
}

/// The test bed that runs on this thread.
pub(crate) fn running() -> Option<Running> {
    RUNNING.with_borrow(Clone::clone)
}

/// Its state.
pub(crate) fn shared() -> Option<Arc<Shared>> {
    RUNNING.with_borrow(|running| running.as_ref().map(|running| Arc::clone(&running.shared)))
}

/// The test bed that runs on this thread.
///
/// # Panics
///
/// If there is none.
#[expect(clippy::panic, reason = "a misuse, and the way out")]
pub(crate) fn expect_running(what: &str) -> Running {
    running().unwrap_or_else(|| panic!("{}", outside_text(what)))
}

/// Asks the state of the test bed that runs on this thread.
///
/// # Panics
///
/// If there is none.
#[expect(clippy::panic, reason = "a misuse, and the way out")]
pub(crate) fn ask<T>(what: &str, question: impl FnOnce(&Arc<Shared>) -> T) -> T {
    RUNNING.with_borrow(|running| match running {
        Some(running) => question(&running.shared),
        None => panic!("{}", outside_text(what)),
    })
}

/// A call that makes a socket, where a test has written it. The call needs a running test bed and a host.
#[derive(Clone, Copy)]
pub(crate) struct Call {
    name: &'static str,
    place: &'static Location<'static>,
}

impl Call {
    /// The call of that name at the place of the caller.
    ///
    /// # Panics
    ///
    /// If no test bed runs on this thread.
    #[track_caller]
    pub(crate) fn here(name: &'static str) -> Self {
        let call = Self { name, place: Location::caller() };
        if shared().is_none() {
            call.is_outside();
        }
        call
    }

    /// Returns the running test bed, and the host on which the task lives that is being polled. `how` a task that lives on no host does the same.
    ///
    /// # Panics
    ///
    /// If there is no test bed or no host. An error would be swallowed by a program that tries again until it succeeds.
    #[track_caller]
    #[expect(clippy::panic, reason = "a misuse, and the way out")]
    pub(crate) fn host(self, how: &str) -> (Arc<Shared>, NodeId) {
        let Some(shared) = shared() else { self.is_outside() };
        if let Some(host) = current::host() {
            return (shared, host);
        }
        let Self { name, place } = self;
        let text = format!("`{name}` at {place} is called by a task that lives on no host: spawn the task with `Host::spawn`, or {how}");
        // Tokio catches the panic of its own tasks, and the run is to fail all the same.
        shared.note_fault(&text);
        panic!("{text}");
    }

    #[cold]
    #[track_caller]
    #[expect(clippy::panic, reason = "a misuse, and the way out")]
    fn is_outside(self) -> ! {
        panic!("`{}` at {} is called outside of a test bed: call it within `Testbed::run`, on its thread", self.name, self.place);
    }
}

/// The error of what works only inside a test bed.
pub(crate) fn outside(what: &str) -> io::Error {
    io::Error::new(io::ErrorKind::NotFound, outside_text(what))
}

fn outside_text(what: &str) -> String {
    format!("only inside a running test bed {what}: call it within `Testbed::run`, on its thread")
}
