//! Files of relays and routers, and the library of links, read through the public functions of the crate.
#![expect(clippy::panic, clippy::unwrap_used, reason = "a test may fail")]

mod library;
mod relay_file;
mod router_file;
