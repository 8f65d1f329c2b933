//! Handles of runtimes.

use std::fmt;
use std::future::Future;
use std::ops::Deref;

use real::runtime::{EnterGuard, RuntimeFlavor, TryCurrentError};
use real::task::JoinHandle;

use crate::hosted;

/// See `tokio::runtime::Handle`.
#[derive(Clone)]
pub struct Handle(real::runtime::Handle);

impl Handle {
    pub(super) fn new(handle: &real::runtime::Handle) -> Self {
        Self(handle.clone())
    }

    /// See `tokio::runtime::Handle::enter`.
    pub fn enter(&self) -> EnterGuard<'_> {
        self.0.enter()
    }

    /// See `tokio::runtime::Handle::current`.
    #[track_caller]
    pub fn current() -> Self {
        Self(real::runtime::Handle::current())
    }

    /// See `tokio::runtime::Handle::try_current`.
    pub fn try_current() -> Result<Self, TryCurrentError> {
        real::runtime::Handle::try_current().map(Self)
    }

    /// See `tokio::runtime::Handle::spawn`.
    #[track_caller]
    pub fn spawn<F>(&self, future: F) -> JoinHandle<F::Output>
    where
        F: Future + Send + 'static,
        F::Output: Send + 'static,
    {
        hosted::start!(future, self.0.spawn(future), |started| started.abort_handle())
    }

    /// See `tokio::runtime::Handle::spawn_blocking`.
    #[track_caller]
    pub fn spawn_blocking<F, R>(&self, function: F) -> JoinHandle<R>
    where
        F: FnOnce() -> R + Send + 'static,
        R: Send + 'static,
    {
        hosted::start_blocking!(function, self.0.spawn_blocking(function), |task| self.0.spawn(task))
    }

    /// See `tokio::runtime::Handle::block_on`.
    #[track_caller]
    pub fn block_on<F: Future>(&self, future: F) -> F::Output {
        self.0.block_on(future)
    }

    /// See `tokio::runtime::Handle::runtime_flavor`.
    pub fn runtime_flavor(&self) -> RuntimeFlavor {
        self.0.runtime_flavor()
    }
}

impl Deref for Handle {
    type Target = real::runtime::Handle;

    fn deref(&self) -> &Self::Target {
        &self.0
    }
}

impl fmt::Debug for Handle {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}
