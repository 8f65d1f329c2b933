//! Builders of tasks, which tokio has with its feature `tracing` and `--cfg tokio_unstable`.

use std::future::Future;
use std::io;

use real::task::JoinHandle;

use super::LocalSet;
use crate::hosted;
use crate::runtime::Handle;

/// See `tokio::task::Builder`.
#[derive(Default, Debug)]
pub struct Builder<'a>(real::task::Builder<'a>);

impl<'a> Builder<'a> {
    /// See `tokio::task::Builder::new`.
    pub fn new() -> Self {
        Self::default()
    }

    /// See `tokio::task::Builder::name`.
    pub fn name(&self, name: &'a str) -> Self {
        Self(self.0.name(name))
    }

    /// See `tokio::task::Builder::spawn`.
    #[track_caller]
    pub fn spawn<F>(self, future: F) -> io::Result<JoinHandle<F::Output>>
    where
        F: Future + Send + 'static,
        F::Output: Send + 'static,
    {
        hosted::expect_runtime();
        Ok(hosted::start!(future, self.0.spawn(future)?, |started| started.abort_handle()))
    }

    /// See `tokio::task::Builder::spawn_on`.
    #[track_caller]
    pub fn spawn_on<F>(self, future: F, handle: &Handle) -> io::Result<JoinHandle<F::Output>>
    where
        F: Future + Send + 'static,
        F::Output: Send + 'static,
    {
        Ok(hosted::start!(future, self.0.spawn_on(future, handle)?, |started| started.abort_handle()))
    }

    /// See `tokio::task::Builder::spawn_local`.
    #[track_caller]
    pub fn spawn_local<F>(self, future: F) -> io::Result<JoinHandle<F::Output>>
    where
        F: Future + 'static,
        F::Output: 'static,
    {
        Ok(hosted::start!(future, self.0.spawn_local(future)?, |started| started.abort_handle()))
    }

    /// See `tokio::task::Builder::spawn_local_on`.
    #[track_caller]
    pub fn spawn_local_on<F>(self, future: F, local: &LocalSet) -> io::Result<JoinHandle<F::Output>>
    where
        F: Future + 'static,
        F::Output: 'static,
    {
        Ok(hosted::start!(future, self.0.spawn_local_on(future, local.real())?, |started| started.abort_handle()))
    }

    /// See `tokio::task::Builder::spawn_blocking`. In a test bed the virtual time waits for the function.
    #[track_caller]
    pub fn spawn_blocking<F, R>(self, function: F) -> io::Result<JoinHandle<R>>
    where
        F: FnOnce() -> R + Send + 'static,
        R: Send + 'static,
    {
        hosted::expect_runtime();
        Ok(hosted::start_blocking!(function, self.0.spawn_blocking(function)?, |task| real::task::spawn(task)))
    }

    /// See `tokio::task::Builder::spawn_blocking_on`. In a test bed the virtual time waits for the function.
    #[track_caller]
    pub fn spawn_blocking_on<F, R>(self, function: F, handle: &Handle) -> io::Result<JoinHandle<R>>
    where
        F: FnOnce() -> R + Send + 'static,
        R: Send + 'static,
    {
        Ok(hosted::start_blocking!(function, self.0.spawn_blocking_on(function, handle)?, |task| handle.spawn(task)))
    }
}
