//! Builders of runtimes.

use std::fmt;
use std::io;
use std::ops::{Deref, DerefMut};
use std::time::Duration;

use loopback::loopback::Loopback;

use super::Runtime;

/// See `tokio::runtime::Builder`.
pub struct Builder(real::runtime::Builder);

/// Methods that set one value of the builder.
macro_rules! setters {
    ($($(#[$condition:meta])* $name:ident($($value:ident: $kind:ty)?);)*) => {
        $(
            $(#[$condition])*
            #[doc = concat!("See `tokio::runtime::Builder::", stringify!($name), "`.")]
            #[track_caller]
            pub fn $name(&mut self $(, $value: $kind)?) -> &mut Self {
                self.0.$name($($value)?);
                self
            }
        )*
    };
}

impl Builder {
    /// See `tokio::runtime::Builder::new_current_thread`.
    pub fn new_current_thread() -> Self {
        Self(real::runtime::Builder::new_current_thread())
    }

    /// See `tokio::runtime::Builder::new_multi_thread`.
    #[cfg(feature = "rt-multi-thread")]
    pub fn new_multi_thread() -> Self {
        Self(real::runtime::Builder::new_multi_thread())
    }

    setters! {
        enable_all();
        #[cfg(any(feature = "net", all(unix, feature = "process"), all(unix, feature = "signal")))]
        enable_io();
        #[cfg(any(feature = "net", all(unix, feature = "process"), all(unix, feature = "signal")))]
        max_io_events_per_tick(capacity: usize);
        #[cfg(feature = "time")]
        enable_time();
        #[cfg(feature = "test-util")]
        start_paused(start_paused: bool);
        worker_threads(number: usize);
        max_blocking_threads(number: usize);
        thread_name(name: impl Into<String>);
        thread_stack_size(size: usize);
        thread_keep_alive(duration: Duration);
        global_queue_interval(interval: u32);
        event_interval(interval: u32);
        thread_name_fn(name: impl Fn() -> String + Send + Sync + 'static);
        on_thread_start(function: impl Fn() + Send + Sync + 'static);
        on_thread_stop(function: impl Fn() + Send + Sync + 'static);
        on_thread_park(function: impl Fn() + Send + Sync + 'static);
        on_thread_unpark(function: impl Fn() + Send + Sync + 'static);
    }

    /// See `tokio::runtime::Builder::name`.
    //@ has runtime/builder.rs|pub fn name(
    #[track_caller]
    pub fn name(&mut self, name: impl Into<String>) -> &mut Self {
        self.0.name(name);
        self
    }

    /// See `tokio::runtime::Builder::max_io_events_per_busy_tick`.
    //@ has runtime/builder.rs|pub fn max_io_events_per_busy_tick(
    #[cfg(any(feature = "net", all(unix, feature = "process"), all(unix, feature = "signal")))]
    #[track_caller]
    pub fn max_io_events_per_busy_tick(&mut self, capacity: usize) -> &mut Self {
        self.0.max_io_events_per_busy_tick(capacity);
        self
    }

    /// See `tokio::runtime::Builder::build`.
    #[track_caller]
    pub fn build(&mut self) -> io::Result<Runtime> {
        match self.prepare() {
            None => self.0.build().map(|real| Runtime::of(real, None)),
            Some((mut builder, loopback)) => builder.build().map(|real| Runtime::of(real, Some(loopback))),
        }
    }

    /// See `tokio::runtime::Builder::build_local`.
    //@ has runtime/builder.rs|build_local(&mut self, _options: LocalOptions)
    #[track_caller]
    pub fn build_local(&mut self, options: real::runtime::LocalOptions) -> io::Result<super::LocalRuntime> {
        match self.prepare() {
            None => self.0.build_local(options).map(|real| super::LocalRuntime::of(real, None)),
            Some((mut builder, loopback)) => builder.build_local(options).map(|real| super::LocalRuntime::of(real, Some(loopback))),
        }
    }

    /// Refuses a runtime inside a test bed, and gives the runtime that is built for a test bed the seed of the test bed, which decides where `select!` begins.
    /// If the environment asks for a loopback, returns the loopback, and the builder of a runtime for it: with one thread, and virtual time.
    #[track_caller]
    fn prepare(&mut self) -> Option<(real::runtime::Builder, Loopback)> {
        super::refuse_in_bed();
        // A seed is left by the test kit, which builds this runtime for a run. Such a runtime has the links of its test bed and no loopback of its own.
        if let Some(seed) = cohaptic_sockets::take_runtime_seed() {
            self.0.cohaptic_seed(seed);
            return None;
        }
        let loopback = Loopback::of_environment()?;
        let mut builder = real::runtime::Builder::new_current_thread();
        loopback.prepare(&mut builder);
        builder.cohaptic_seed(loopback.seed());
        Some((builder, loopback))
    }
}

impl Deref for Builder {
    type Target = real::runtime::Builder;

    fn deref(&self) -> &Self::Target {
        &self.0
    }
}

impl DerefMut for Builder {
    fn deref_mut(&mut self) -> &mut Self::Target {
        &mut self.0
    }
}

impl fmt::Debug for Builder {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.0.fmt(f)
    }
}
