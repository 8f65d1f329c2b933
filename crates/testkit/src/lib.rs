//! Tests of networked programs over emulated bad links, in virtual time, the same way every time.

#[cfg(feature = "strategies")]
pub mod strategies;

#[cfg(feature = "strategies")]
pub use proptest;
