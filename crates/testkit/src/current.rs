//! State of the present thread: the run, the task being polled, and the host of the task.

use std::cell::{Cell, RefCell};
use std::rc::Rc;

use cohaptic_wan::NodeId;

thread_local! {
    /// Number of the run; 0 without a run.
    static RUN: Cell<u64> = const { Cell::new(0) };
    /// Host of the task being polled; `None` for a task without a host.
    static HOST: Cell<Option<NodeId>> = const { Cell::new(None) };
    /// Function that describes the task being polled.
    static TASK: RefCell<Option<Rc<dyn Fn() -> String>>> = const { RefCell::new(None) };
}

/// Begins a run on this thread. `task` describes the task being polled.
pub(crate) fn begin(run: u64, task: Rc<dyn Fn() -> String>) {
    RUN.set(run);
    TASK.set(Some(task));
}

/// Ends the run of this thread.
pub(crate) fn end() {
    RUN.set(0);
    drop(TASK.take());
}

/// Returns the number of the run of this thread, or 0 without a run. May be called by a value that is dropped while the thread ends.
#[inline]
pub(crate) fn run() -> u64 {
    RUN.get()
}

/// Returns a description of the task being polled on this thread, or `None` outside of a run.
pub(crate) fn task() -> Option<String> {
    let task = TASK.with_borrow(Clone::clone)?;
    Some(task())
}

/// Returns the host of the task being polled.
pub(crate) fn host() -> Option<NodeId> {
    HOST.get()
}

/// Calls `act` as a task of `host`. The former host is set again afterwards, also after a panic.
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
