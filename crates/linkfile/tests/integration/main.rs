//! Files of relays and routers as other crates read them.
#![expect(clippy::unwrap_used, clippy::panic, reason = "a test may fail")]

mod relay_file;
mod router_file;
