//! Files of relays and routers, read through the public functions of the crate.
#![expect(clippy::unwrap_used, reason = "a test may fail")]

mod relay_file;
mod router_file;
