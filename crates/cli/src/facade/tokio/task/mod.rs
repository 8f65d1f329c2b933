//! Tasks, which keep the host of a test bed on which they were started, and end with it.

pub use real::task::*;

#[cfg(all(feature = "rt", tokio_unstable, feature = "tracing"))]
mod builder;
#[cfg(all(feature = "rt", tokio_unstable))]
pub mod join_set;
#[cfg(all(feature = "rt", not(tokio_unstable)))]
mod join_set;
#[cfg(feature = "rt")]
mod local;
#[cfg(feature = "rt")]
mod spawn;

#[cfg(feature = "rt")]
pub use {
    join_set::JoinSet,
    local::{LocalSet, spawn_local},
    spawn::{spawn, spawn_blocking},
};

#[cfg(feature = "rt-multi-thread")]
pub use spawn::block_in_place;

#[cfg(all(feature = "rt", tokio_unstable, feature = "tracing"))]
pub use builder::Builder;
