//! Campaigns in folders of their own. A run of a campaign is compared with the same run alone; a table with that of a campaign that nothing disturbed, byte by
//! byte.
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
