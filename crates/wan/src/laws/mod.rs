//! The laws of chance that stages draw by.

pub(crate) mod chance;
pub mod delay;
pub(crate) mod normal;
pub(crate) mod sojourn;
