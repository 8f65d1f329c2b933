//! Runtimes.

use std::future::Future;
use std::io;
use std::ops::Deref;
use std::time::Duration;

use real::runtime::EnterGuard;
use real::task::JoinHandle;

use super::Handle;

/// See `tokio::runtime::Runtime`.
#[derive(Debug)]
pub struct Runtime {
    real: real::runtime::Runtime,
    handle: Handle,
}

impl Runtime {
    pub(super) fn of(real: real::runtime::Runtime) -> Self {
        let handle = Handle::new(real.handle());
        Self { real, handle }
    }

    /// See `tokio::runtime::Runtime::new`.
    #[cfg(feature = "rt-multi-thread")]
    #[track_caller]
    pub fn new() -> io::Result<Self> {
        super::Builder::new_multi_thread().enable_all().build()
    }

    /// See `tokio::runtime::Runtime::handle`.
    pub fn handle(&self) -> &Handle {
        &self.handle
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

    /// See `tokio::runtime::Runtime::spawn_blocking`.
    #[track_caller]
    pub fn spawn_blocking<F, R>(&self, function: F) -> JoinHandle<R>
    where
        F: FnOnce() -> R + Send + 'static,
        R: Send + 'static,
    {
        self.handle.spawn_blocking(function)
    }

    /// See `tokio::runtime::Runtime::block_on`.
    #[track_caller]
    pub fn block_on<F: Future>(&self, future: F) -> F::Output {
        self.real.block_on(future)
    }

    /// See `tokio::runtime::Runtime::enter`.
    pub fn enter(&self) -> EnterGuard<'_> {
        self.real.enter()
    }

    /// See `tokio::runtime::Runtime::shutdown_timeout`.
    pub fn shutdown_timeout(self, duration: Duration) {
        self.real.shutdown_timeout(duration);
    }

    /// See `tokio::runtime::Runtime::shutdown_background`.
    pub fn shutdown_background(self) {
        self.real.shutdown_background();
    }
}

impl Deref for Runtime {
    type Target = real::runtime::Runtime;

    fn deref(&self) -> &Self::Target {
        &self.real
    }
}
