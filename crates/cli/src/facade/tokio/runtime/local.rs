//! Runtimes that stay on their thread.

use std::future::Future;
use std::io;
use std::ops::Deref;
use std::time::Duration;

use real::runtime::EnterGuard;
use real::task::JoinHandle;

use super::Handle;
use crate::hosted;

/// See `tokio::runtime::LocalRuntime`.
#[derive(Debug)]
pub struct LocalRuntime {
    real: real::runtime::LocalRuntime,
    handle: Handle,
}

impl LocalRuntime {
    pub(super) fn of(real: real::runtime::LocalRuntime) -> Self {
        let handle = Handle::new(real.handle());
        Self { real, handle }
    }

    /// See `tokio::runtime::LocalRuntime::new`.
    #[track_caller]
    pub fn new() -> io::Result<Self> {
        super::Builder::new_current_thread().enable_all().build_local(Default::default())
    }

    /// See `tokio::runtime::LocalRuntime::handle`.
    pub fn handle(&self) -> &Handle {
        &self.handle
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

    /// See `tokio::runtime::LocalRuntime::spawn_blocking`.
    #[track_caller]
    pub fn spawn_blocking<F, R>(&self, function: F) -> JoinHandle<R>
    where
        F: FnOnce() -> R + Send + 'static,
        R: Send + 'static,
    {
        self.handle.spawn_blocking(function)
    }

    /// See `tokio::runtime::LocalRuntime::block_on`.
    #[track_caller]
    pub fn block_on<F: Future>(&self, future: F) -> F::Output {
        self.real.block_on(future)
    }

    /// See `tokio::runtime::LocalRuntime::enter`.
    pub fn enter(&self) -> EnterGuard<'_> {
        self.real.enter()
    }

    /// See `tokio::runtime::LocalRuntime::shutdown_timeout`.
    pub fn shutdown_timeout(self, duration: Duration) {
        self.real.shutdown_timeout(duration);
    }

    /// See `tokio::runtime::LocalRuntime::shutdown_background`.
    pub fn shutdown_background(self) {
        self.real.shutdown_background();
    }
}

impl Deref for LocalRuntime {
    type Target = real::runtime::LocalRuntime;

    fn deref(&self) -> &Self::Target {
        &self.real
    }
}
