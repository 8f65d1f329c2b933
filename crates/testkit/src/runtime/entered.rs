//! Registration of a run on its thread.

use std::rc::Rc;
use std::sync::Arc;

use crate::context::{self, Running};
use crate::core::Shared;
use crate::task::Tasks;

/// Guard: a test bed runs on this thread, for the sockets of this crate and for `cohaptic-sockets`, until the guard is dropped.
pub(super) struct Entered {
    // Fields are dropped in this order.
    _running: context::Entered,
    #[cfg(feature = "facade")]
    _registered: cohaptic_sockets::Entered,
}

/// Makes a test bed the running test bed of this thread.
///
/// # Panics
///
/// If another test bed runs on this thread.
pub(super) fn enter(shared: &Arc<Shared>, tasks: &Rc<Tasks>) -> Entered {
    Entered {
        _running: Running { shared: Arc::clone(shared), tasks: Rc::clone(tasks) }.enter(),
        #[cfg(feature = "facade")]
        _registered: cohaptic_sockets::enter(Arc::new(crate::facade::BedOfThread { shared: Arc::clone(shared), others: Arc::clone(&tasks.others) })),
    }
}
