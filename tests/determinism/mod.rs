//! The same scene and seed give the same bytes, whatever the machinery, the number of threads, and who else takes part.
#![allow(clippy::unwrap_used, clippy::panic, reason = "helpers of tests may fail as tests do")]

mod arrays;
mod bystander;
mod changes;
mod clocks;
mod models;
mod queues;
mod threads;
mod topologies;
mod turning;
mod watched;
