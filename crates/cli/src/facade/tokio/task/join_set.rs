//! Sets of tasks.

use std::fmt;
use std::future::Future;
#[cfg(all(tokio_unstable, feature = "tracing"))]
use std::io;
use std::ops::{Deref, DerefMut};
use std::task::{Context, Poll};

use real::task::{AbortHandle, Id, JoinError};

use super::LocalSet;
use crate::hosted;
use crate::runtime::Handle;

/// See `tokio::task::JoinSet`.
pub struct JoinSet<T>(real::task::JoinSet<T>);

impl<T> JoinSet<T> {
    /// See `tokio::task::JoinSet::new`.
    pub fn new() -> Self {
        Self(real::task::JoinSet::new())
    }

    /// See `tokio::task::JoinSet::len`.
    pub fn len(&self) -> usize {
        self.0.len()
    }

    /// See `tokio::task::JoinSet::is_empty`.
    pub fn is_empty(&self) -> bool {
        self.0.is_empty()
    }
}

impl<T: 'static> JoinSet<T> {
    /// See `tokio::task::JoinSet::build_task`.
    #[cfg(all(tokio_unstable, feature = "tracing"))]
    pub fn build_task(&mut self) -> Builder<'_, T> {
        Builder { set: self, name: None }
    }

    /// See `tokio::task::JoinSet::spawn`.
    #[track_caller]
    pub fn spawn<F>(&mut self, task: F) -> AbortHandle
    where
        F: Future<Output = T> + Send + 'static,
        T: Send,
    {
        hosted::start!(task, self.0.spawn(task), |started| started.clone())
    }

    /// See `tokio::task::JoinSet::spawn_on`.
    #[track_caller]
    pub fn spawn_on<F>(&mut self, task: F, handle: &Handle) -> AbortHandle
    where
        F: Future<Output = T> + Send + 'static,
        T: Send,
    {
        hosted::start!(task, self.0.spawn_on(task, handle), |started| started.clone())
    }

    /// See `tokio::task::JoinSet::spawn_local`.
    #[track_caller]
    pub fn spawn_local<F>(&mut self, task: F) -> AbortHandle
    where
        F: Future<Output = T> + 'static,
    {
        hosted::start!(task, self.0.spawn_local(task), |started| started.clone())
    }

    /// See `tokio::task::JoinSet::spawn_local_on`.
    #[track_caller]
    pub fn spawn_local_on<F>(&mut self, task: F, local: &LocalSet) -> AbortHandle
    where
        F: Future<Output = T> + 'static,
    {
        hosted::start!(task, self.0.spawn_local_on(task, local.real()), |started| started.clone())
    }

    /// See `tokio::task::JoinSet::spawn_blocking`.
    #[track_caller]
    pub fn spawn_blocking<F>(&mut self, function: F) -> AbortHandle
    where
        F: FnOnce() -> T + Send + 'static,
        T: Send,
    {
        match cohaptic_sockets::bed() {
            None => self.0.spawn_blocking(hosted::with_host(function)),
            Some(_) => {
                // The set has a task that awaits the work, because the function `spawn_blocking` holds the time of the test bed during the work.
                let work = super::spawn_blocking(function);
                self.spawn(hosted::outcome_of(work))
            }
        }
    }

    /// See `tokio::task::JoinSet::spawn_blocking_on`.
    #[track_caller]
    pub fn spawn_blocking_on<F>(&mut self, function: F, handle: &Handle) -> AbortHandle
    where
        F: FnOnce() -> T + Send + 'static,
        T: Send,
    {
        match cohaptic_sockets::bed() {
            None => self.0.spawn_blocking_on(hosted::with_host(function), handle),
            Some(_) => {
                let work = handle.spawn_blocking(function);
                self.spawn_on(hosted::outcome_of(work), handle)
            }
        }
    }

    /// See `tokio::task::JoinSet::join_next`.
    pub async fn join_next(&mut self) -> Option<Result<T, JoinError>> {
        self.0.join_next().await
    }

    /// See `tokio::task::JoinSet::join_next_with_id`.
    pub async fn join_next_with_id(&mut self) -> Option<Result<(Id, T), JoinError>> {
        self.0.join_next_with_id().await
    }

    /// See `tokio::task::JoinSet::try_join_next`.
    pub fn try_join_next(&mut self) -> Option<Result<T, JoinError>> {
        self.0.try_join_next()
    }

    /// See `tokio::task::JoinSet::shutdown`.
    pub async fn shutdown(&mut self) {
        self.0.shutdown().await;
    }

    /// See `tokio::task::JoinSet::join_all`.
    //@ has task/join_set.rs|pub async fn join_all
    pub async fn join_all(self) -> Vec<T> {
        self.0.join_all().await
    }

    /// See `tokio::task::JoinSet::abort_all`.
    pub fn abort_all(&mut self) {
        self.0.abort_all();
    }

    /// See `tokio::task::JoinSet::detach_all`.
    pub fn detach_all(&mut self) {
        self.0.detach_all();
    }

    /// See `tokio::task::JoinSet::poll_join_next`.
    pub fn poll_join_next(&mut self, cx: &mut Context<'_>) -> Poll<Option<Result<T, JoinError>>> {
        self.0.poll_join_next(cx)
    }
}

impl<T> Deref for JoinSet<T> {
    type Target = real::task::JoinSet<T>;

    fn deref(&self) -> &Self::Target {
        &self.0
    }
}

impl<T> DerefMut for JoinSet<T> {
    fn deref_mut(&mut self) -> &mut Self::Target {
        &mut self.0
    }
}

impl<T> fmt::Debug for JoinSet<T> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}

impl<T> Default for JoinSet<T> {
    fn default() -> Self {
        Self::new()
    }
}

impl<T, F> FromIterator<F> for JoinSet<T>
where
    F: Future<Output = T> + Send + 'static,
    T: Send + 'static,
{
    fn from_iter<I: IntoIterator<Item = F>>(tasks: I) -> Self {
        let mut set = Self::new();
        set.extend(tasks);
        set
    }
}

impl<T, F> Extend<F> for JoinSet<T>
where
    F: Future<Output = T> + Send + 'static,
    T: Send + 'static,
{
    fn extend<I: IntoIterator<Item = F>>(&mut self, tasks: I) {
        for task in tasks {
            self.spawn(task);
        }
    }
}

/// See `tokio::task::join_set::Builder`.
#[cfg(all(tokio_unstable, feature = "tracing"))]
#[derive(Debug)]
#[must_use = "builders do nothing unless used to spawn a task"]
pub struct Builder<'a, T> {
    set: &'a mut JoinSet<T>,
    name: Option<&'a str>,
}

#[cfg(all(tokio_unstable, feature = "tracing"))]
impl<'a, T: 'static> Builder<'a, T> {
    /// See `tokio::task::join_set::Builder::name`.
    pub fn name(self, name: &'a str) -> Self {
        Self { name: Some(name), ..self }
    }

    /// Returns the builder of the real tokio.
    fn real(&mut self) -> real::task::join_set::Builder<'_, T> {
        let builder = self.set.0.build_task();
        match self.name {
            Some(name) => builder.name(name),
            None => builder,
        }
    }

    /// See `tokio::task::join_set::Builder::spawn`.
    #[track_caller]
    pub fn spawn<F>(mut self, task: F) -> io::Result<AbortHandle>
    where
        F: Future<Output = T> + Send + 'static,
        T: Send,
    {
        Ok(hosted::start!(task, self.real().spawn(task)?, |started| started.clone()))
    }

    /// See `tokio::task::join_set::Builder::spawn_on`.
    #[track_caller]
    pub fn spawn_on<F>(mut self, task: F, handle: &Handle) -> io::Result<AbortHandle>
    where
        F: Future<Output = T> + Send + 'static,
        T: Send,
    {
        Ok(hosted::start!(task, self.real().spawn_on(task, handle)?, |started| started.clone()))
    }

    /// See `tokio::task::join_set::Builder::spawn_local`.
    #[track_caller]
    pub fn spawn_local<F>(mut self, task: F) -> io::Result<AbortHandle>
    where
        F: Future<Output = T> + 'static,
    {
        Ok(hosted::start!(task, self.real().spawn_local(task)?, |started| started.clone()))
    }

    /// See `tokio::task::join_set::Builder::spawn_local_on`.
    #[track_caller]
    pub fn spawn_local_on<F>(mut self, task: F, local: &LocalSet) -> io::Result<AbortHandle>
    where
        F: Future<Output = T> + 'static,
    {
        Ok(hosted::start!(task, self.real().spawn_local_on(task, local.real())?, |started| started.clone()))
    }

    /// See `tokio::task::join_set::Builder::spawn_blocking`. In a test bed the virtual time waits for the function.
    #[track_caller]
    pub fn spawn_blocking<F>(mut self, function: F) -> io::Result<AbortHandle>
    where
        F: FnOnce() -> T + Send + 'static,
        T: Send,
    {
        match cohaptic_sockets::bed() {
            None => self.real().spawn_blocking(hosted::with_host(function)),
            Some(_) => {
                let work = super::spawn_blocking(function);
                self.spawn(hosted::outcome_of(work))
            }
        }
    }

    /// See `tokio::task::join_set::Builder::spawn_blocking_on`. In a test bed the virtual time waits for the function.
    #[track_caller]
    pub fn spawn_blocking_on<F>(mut self, function: F, handle: &Handle) -> io::Result<AbortHandle>
    where
        F: FnOnce() -> T + Send + 'static,
        T: Send,
    {
        match cohaptic_sockets::bed() {
            None => self.real().spawn_blocking_on(hosted::with_host(function), handle),
            Some(_) => {
                let work = handle.spawn_blocking(function);
                self.spawn_on(hosted::outcome_of(work), handle)
            }
        }
    }
}
