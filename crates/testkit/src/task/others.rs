//! Tasks of tokio that belong to hosts. Tokio polls these tasks, and the test bed stops the tasks of a host together with the host.

use std::sync::{Mutex, PoisonError};

use cohaptic_sockets::Stop;
use cohaptic_wan::NodeId;

use super::signals::Handlers;

/// Handles for stopping tokio's tasks of the hosts of a run, and the signals for which the programs of the hosts listen.
#[derive(Default)]
pub(crate) struct OtherTasks {
    stops: Mutex<Vec<(NodeId, Box<dyn Stop>)>>,
    pub(crate) signals: Handlers,
}

impl OtherTasks {
    pub(crate) fn keep(&self, host: NodeId, stop: Box<dyn Stop>) {
        let mut kept = self.stops.lock().unwrap_or_else(PoisonError::into_inner);
        // Handles of ended tasks are removed whenever the array is full, so the array stays proportional to the number of running tasks.
        if kept.len() == kept.capacity() {
            kept.retain(|(_, stop)| !stop.is_over());
        }
        kept.push((host, stop));
    }

    /// Stops all tasks of a host, whose program then listens for no signal.
    pub(crate) fn stop_all_of(&self, host: NodeId) {
        self.signals.forget(host);
        // The lock ends before tasks are stopped: a destructor may start a task, which takes the lock.
        let of_host: Vec<Box<dyn Stop>> = {
            let mut kept = self.stops.lock().unwrap_or_else(PoisonError::into_inner);
            kept.extract_if(.., |(of, _)| *of == host).map(|(_, stop)| stop).collect()
        };
        of_host.iter().for_each(|stop| stop.stop());
    }
}
