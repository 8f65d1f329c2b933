//! Promises of links and networks, tried on random configurations and operations and, for known laws, on long fixed runs.
#![expect(clippy::unwrap_used, reason = "a test may fail")]
#![expect(clippy::cast_precision_loss, reason = "tests count samples")]
#![expect(clippy::wildcard_enum_match_arm, reason = "a model says so when it meets a kind that it does not know")]
#![expect(clippy::float_cmp, reason = "0 and 1 are exact")]

mod any_link;
mod awaited;
mod bounds;
mod broadcast;
mod by_stage;
mod conservation;
mod cross_traffic;
mod delay_laws;
mod determinism;
mod dualpi2_laws;
mod edges;
mod event_queue;
mod every_stage;
mod fingerprints;
mod kernel_tbf;
mod laws;
mod loss_laws;
mod mere_arrivals;
mod metamorphic;
mod naive;
mod on_demand;
mod oracle;
mod queue_laws;
mod random_links;
mod relay;
mod some_links;
mod trains;
