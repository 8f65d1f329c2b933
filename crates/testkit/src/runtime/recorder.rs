//! What was recorded of a run, when it ends.

use std::rc::Rc;
use std::sync::Arc;

use crate::core::Shared;
use crate::task::Tasks;
use crate::wire::Recorded;

/// Takes what was recorded out of a run that ends, however it ends.
pub(crate) struct Recorder<'a> {
    pub(crate) shared: Arc<Shared>,
    pub(crate) tasks: Rc<Tasks>,
    pub(crate) recorded: &'a mut Option<Recorded>,
}

impl Drop for Recorder<'_> {
    fn drop(&mut self) {
        *self.recorded = Some(self.shared.with(|core| core.recorded()));
        // Tasks hold the state, and the state their wakers.
        self.tasks.stop_all();
        self.shared.end();
    }
}
