//! Runtimes. A test bed has its own runtime, and refuses further runtimes.

pub use real::runtime::*;

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
