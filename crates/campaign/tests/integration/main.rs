//! Tests with campaigns in temporary folders. A run of a campaign is compared with the same run alone, and a table byte by byte with the table of an
//! undisturbed campaign.
#![allow(clippy::unwrap_used, clippy::panic, clippy::float_cmp, reason = "tests: what is written is what was computed, to the bit")]

mod bench;
mod compare;
mod damaged;
mod folders;
mod resume;
mod shards;
mod spread;
mod tables;
mod verdicts;
