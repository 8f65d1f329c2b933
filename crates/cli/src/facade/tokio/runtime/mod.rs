//! Runtimes. A test bed has its own runtime, and refuses further runtimes.

pub use real::runtime::*;

/// Defines a runtime around a real runtime, with the methods common to tokio's two kinds of runtime.
macro_rules! runtime {
    ($name:ident) => {
        #[doc = concat!("See `tokio::runtime::", stringify!($name), "`.")]
        #[derive(Debug)]
        pub struct $name {
            real: real::runtime::$name,
            handle: $crate::runtime::Handle,
            /// Loopback of the programs on the runtime; `None` for real sockets.
            loopback: Option<loopback::loopback::Loopback>,
        }

        impl $name {
            pub(super) fn of(real: real::runtime::$name, loopback: Option<loopback::loopback::Loopback>) -> Self {
                let handle = $crate::runtime::Handle::new(real.handle());
                Self { real, handle, loopback }
            }

            #[doc = concat!("See `tokio::runtime::", stringify!($name), "::handle`.")]
            pub fn handle(&self) -> &$crate::runtime::Handle {
                &self.handle
            }

            #[doc = concat!("See `tokio::runtime::", stringify!($name), "::spawn_blocking`.")]
            #[track_caller]
            pub fn spawn_blocking<F, R>(&self, function: F) -> real::task::JoinHandle<R>
            where
                F: FnOnce() -> R + Send + 'static,
                R: Send + 'static,
            {
                self.handle.spawn_blocking(function)
            }

            #[doc = concat!("See `tokio::runtime::", stringify!($name), "::block_on`.")]
            #[track_caller]
            pub fn block_on<F: std::future::Future>(&self, future: F) -> F::Output {
                // With a loopback every call of `block_on` is the run of a test bed.
                match &self.loopback {
                    None => self.real.block_on(future),
                    Some(loopback) => loopback.block_on(future, |run| self.real.block_on(run)),
                }
            }

            #[doc = concat!("See `tokio::runtime::", stringify!($name), "::enter`.")]
            pub fn enter(&self) -> real::runtime::EnterGuard<'_> {
                self.real.enter()
            }

            #[doc = concat!("See `tokio::runtime::", stringify!($name), "::shutdown_timeout`.")]
            pub fn shutdown_timeout(self, duration: std::time::Duration) {
                self.real.shutdown_timeout(duration);
            }

            #[doc = concat!("See `tokio::runtime::", stringify!($name), "::shutdown_background`.")]
            pub fn shutdown_background(self) {
                self.real.shutdown_background();
            }
        }

        impl std::ops::Deref for $name {
            type Target = real::runtime::$name;

            fn deref(&self) -> &Self::Target {
                &self.real
            }
        }
    };
}
use runtime;

mod builder;
mod handle;
mod rt;

pub use {builder::Builder, handle::Handle, rt::Runtime};
//@ has runtime/builder.rs|build_local(&mut self, _options: LocalOptions)
mod local;
//@ has runtime/builder.rs|build_local(&mut self, _options: LocalOptions)
pub use local::LocalRuntime;

/// Refuses a further runtime in a test bed.
#[track_caller]
fn refuse_in_bed() {
    if cohaptic_sockets::is_in_bed() {
        let place = std::panic::Location::caller();
        panic!(
            "{place} builds a runtime of tokio inside a test bed: its threads would be outside of virtual time. Start what it runs with `tokio::spawn`, or with \
             `Host::spawn` of the test bed, whose runtime has one thread"
        );
    }
}
