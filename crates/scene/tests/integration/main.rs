//! Scenes read through the public functions of the crate: whole files, and damaged files.
#![expect(clippy::unwrap_used, clippy::panic, reason = "a test may fail")]
#![expect(clippy::float_cmp, reason = "what is written is what is read, to the bit")]

mod every_key;
mod files;
mod link_keys;
mod link_refusals;
mod manual;
mod many_peers;
mod mutations;
mod sweep;
