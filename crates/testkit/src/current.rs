//! What runs on this thread: a run, the task of it that is being polled, and the host on which the task lives.

use std::cell::{Cell, RefCell};
use std::rc::Rc;

use cohaptic_wan::NodeId;

thread_local! {
    /// Number of the run; 0 if there is none.
    static RUN: Cell<u64> = const { Cell::new(0) };
    static HOST: Cell<Option<NodeId>> = const { Cell::new(None) };
    /// Says in words which task of the run is being polled.
    static TASK: RefCell<Option<Rc<dyn Fn() -> String>>> = const { RefCell::new(None) };
}

/// A run begins on this thread: its number, and what says which task is being polled.
pub(crate) fn begin(run: u64, task: Rc<dyn Fn() -> String>) {
    RUN.set(run);
    TASK.set(Some(task));
}

/// The run is over.
pub(crate) fn end() {
    RUN.set(0);
    drop(TASK.take());
}

/// The number of the run of this thread; 0 if there is none. A value may ask that is dropped while the thread ends.
#[inline]
pub(crate) fn run() -> u64 {
    RUN.get()
}

/// The task that is being polled on this thread, in words; `None` outside of a run.
pub(crate) fn task() -> Option<String> {
    let task = TASK.with_borrow(Clone::clone)?;
    Some(task())
}

/// The host on which the task that is being polled lives.
pub(crate) fn host() -> Option<NodeId> {
    HOST.get()
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
