//! Record of a run at its end.

use std::rc::Rc;
use std::sync::Arc;

use crate::core::Shared;
use crate::task::Tasks;
use crate::wire::Recorded;

/// Stores the record of a run when the run ends, however it ends.
pub(crate) struct Recorder<'a> {
    pub(crate) shared: Arc<Shared>,
    pub(crate) tasks: Rc<Tasks>,
    pub(crate) recorded: &'a mut Option<Recorded>,
}

impl Drop for Recorder<'_> {
    fn drop(&mut self) {
        *self.recorded = Some(self.shared.with(|core| core.recorded()));
        // Tasks hold the state, and the state holds wakers of tasks. Stopping the tasks breaks this cycle.
        self.tasks.stop_all();
        self.shared.end();
    }
}
