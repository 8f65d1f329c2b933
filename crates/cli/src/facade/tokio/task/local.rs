//! Tasks that stay on their thread.

use std::fmt;
use std::future::Future;
use std::ops::{Deref, DerefMut};
use std::pin::Pin;
use std::task::{Context, Poll};

use real::task::{JoinHandle, LocalEnterGuard};

use crate::hosted;
use crate::runtime::Runtime;

/// See `tokio::task::spawn_local`.
#[track_caller]
pub fn spawn_local<F>(future: F) -> JoinHandle<F::Output>
where
    F: Future + 'static,
    F::Output: 'static,
{
    hosted::start!(future, real::task::spawn_local(future), |started| started.abort_handle())
}

/// See `tokio::task::LocalSet`.
#[derive(Default)]
pub struct LocalSet(real::task::LocalSet);

impl LocalSet {
    /// See `tokio::task::LocalSet::new`.
    pub fn new() -> Self {
        Self(real::task::LocalSet::new())
    }

    /// See `tokio::task::LocalSet::enter`.
    pub fn enter(&self) -> LocalEnterGuard {
        self.0.enter()
    }

    /// See `tokio::task::LocalSet::spawn_local`.
    #[track_caller]
    pub fn spawn_local<F>(&self, future: F) -> JoinHandle<F::Output>
    where
        F: Future + 'static,
        F::Output: 'static,
    {
        hosted::start!(future, self.0.spawn_local(future), |started| started.abort_handle())
    }

    /// See `tokio::task::LocalSet::block_on`.
    #[track_caller]
    pub fn block_on<F: Future>(&self, runtime: &Runtime, future: F) -> F::Output {
        runtime.block_on(self.0.run_until(future))
    }

    /// See `tokio::task::LocalSet::run_until`.
    pub async fn run_until<F: Future>(&self, future: F) -> F::Output {
        self.0.run_until(future).await
    }

    pub(crate) fn real(&self) -> &real::task::LocalSet {
        &self.0
    }
}

impl Deref for LocalSet {
    type Target = real::task::LocalSet;

    fn deref(&self) -> &Self::Target {
        &self.0
    }
}

impl DerefMut for LocalSet {
    fn deref_mut(&mut self) -> &mut Self::Target {
        &mut self.0
    }
}

impl Future for LocalSet {
    type Output = ();

    fn poll(mut self: Pin<&mut Self>, cx: &mut Context<'_>) -> Poll<()> {
        Pin::new(&mut self.0).poll(cx)
    }
}

impl fmt::Debug for LocalSet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}
