//! What links and networks promise, tried on random configurations and operations and, where a law is known, on long fixed runs.
#![expect(clippy::unwrap_used, reason = "a test may fail")]
#![expect(clippy::cast_precision_loss, reason = "tests count samples")]

mod bounds;
mod conservation;
mod determinism;
mod edges;
mod event_queue;
mod laws;
mod naive;
mod oracle;
mod random_links;
