//! Who polls tasks and lets time pass.

#[cfg(feature = "tokio")]
pub(crate) mod on_tokio;
pub(crate) mod own;
