//! What a program finds around it: the test bed that runs on this thread, and the host on which the task that is being polled lives.

use std::cell::{Cell, RefCell};
use std::io;
use std::rc::Rc;
use std::sync::Arc;

use cohaptic_wan::NodeId;

use crate::core::Shared;
use crate::task::Tasks;

thread_local! {
    static RUNNING: RefCell<Option<Running>> = const { RefCell::new(None) };
    static HOST: Cell<Option<NodeId>> = const { Cell::new(None) };
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
            *running = Some(self);
        });
        Entered(())
    }
}

impl Drop for Entered {
    fn drop(&mut self) {
        let left = RUNNING.with_borrow_mut(Option::take);
        drop(left);
    }
}

/// The test bed that runs on this thread.
pub(crate) fn running() -> Option<Running> {
    RUNNING.with_borrow(Clone::clone)
}

/// Whether the run with that state is the one of this thread. A value may ask that is dropped while the thread ends.
#[inline]
pub(crate) fn is_running(shared: &Shared) -> bool {
    RUNNING.try_with(|running| running.borrow().as_ref().is_some_and(|running| std::ptr::eq(&raw const *running.shared, shared))).unwrap_or(false)
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

/// The task that is being polled on this thread, in words; `None` outside of a run.
pub(crate) fn task() -> Option<String> {
    let running = running()?;
    Some(running.tasks.current(running.shared.names()))
}

/// The host on which the task that is being polled lives.
pub(crate) fn host() -> Option<NodeId> {
    HOST.get()
}

/// The running test bed, and the host on which the task lives that is being polled. `what` such a task may do, and `how` others may.
///
/// # Errors
///
/// [`io::ErrorKind::NotFound`] if there is none.
pub(crate) fn here(outside_of: &str, what: &str, how: &str) -> io::Result<(Arc<Shared>, NodeId)> {
    let shared = shared().ok_or_else(|| outside(outside_of))?;
    let host = host().ok_or_else(|| {
        let text = format!("this task lives on no host, so it is not clear where to {what}; spawn it with `Host::spawn`, or {how}");
        io::Error::new(io::ErrorKind::NotFound, text)
    })?;
    Ok((shared, host))
}

/// Does something as a task of that host.
pub(crate) fn on_host<T>(host: Option<NodeId>, act: impl FnOnce() -> T) -> T {
    struct Back(Option<NodeId>);
    impl Drop for Back {
        fn drop(&mut self) {
            HOST.set(self.0);
        }
    }
    let _back = Back(HOST.replace(host));
    act()
}

/// The error of what works only inside a test bed.
pub(crate) fn outside(what: &str) -> io::Error {
    io::Error::new(io::ErrorKind::NotFound, outside_text(what))
}

fn outside_text(what: &str) -> String {
    format!("only inside a running test bed {what}: call it within `Testbed::run`, on its thread")
}
