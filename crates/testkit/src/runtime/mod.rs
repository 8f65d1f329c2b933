//! Executors: they poll tasks and let time pass.

mod entered;
mod limits;
#[cfg(feature = "tokio")]
pub(crate) mod on_tokio;
pub(crate) mod own;
mod recorder;
