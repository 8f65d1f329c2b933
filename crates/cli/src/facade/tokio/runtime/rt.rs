//! Runtimes.

use std::future::Future;
#[cfg(feature = "rt-multi-thread")]
use std::io;

use real::task::JoinHandle;

super::runtime!(Runtime);

impl Runtime {
    /// See `tokio::runtime::Runtime::new`.
    #[cfg(feature = "rt-multi-thread")]
    #[track_caller]
    pub fn new() -> io::Result<Self> {
        super::Builder::new_multi_thread().enable_all().build()
    }

    /// See `tokio::runtime::Runtime::spawn`.
    #[track_caller]
    pub fn spawn<F>(&self, future: F) -> JoinHandle<F::Output>
    where
        F: Future + Send + 'static,
        F::Output: Send + 'static,
    {
        self.handle.spawn(future)
    }
}
