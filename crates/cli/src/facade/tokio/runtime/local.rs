//! Runtimes that stay on their thread.

use std::future::Future;
use std::io;

use real::task::JoinHandle;

use crate::hosted;

super::runtime!(LocalRuntime);

impl LocalRuntime {
    /// See `tokio::runtime::LocalRuntime::new`.
    #[track_caller]
    pub fn new() -> io::Result<Self> {
        super::Builder::new_current_thread().enable_all().build_local(Default::default())
    }

    /// See `tokio::runtime::LocalRuntime::spawn_local`.
    #[track_caller]
    pub fn spawn_local<F>(&self, future: F) -> JoinHandle<F::Output>
    where
        F: Future + 'static,
        F::Output: 'static,
    {
        hosted::start!(future, self.real.spawn_local(future), |started| started.abort_handle())
    }
}
