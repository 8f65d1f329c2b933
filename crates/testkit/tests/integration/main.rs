//! Tests of the test kit.
#![allow(clippy::unwrap_used, clippy::panic, clippy::expect_used, clippy::missing_panics_doc, clippy::cast_possible_truncation, reason = "tests")]

#[cfg(feature = "files")]
mod access;
#[cfg(feature = "strategies")]
mod again;
mod artefacts;
#[cfg(all(feature = "tcp", target_os = "linux"))]
mod as_linux;
mod byte_limit;
#[cfg(feature = "strategies")]
mod chapter;
#[cfg(feature = "tcp")]
mod ended;
mod equivalence;
mod facade;
mod faults;
mod hits;
mod holds;
mod interfaces;
mod like_tokio;
#[cfg(feature = "strategies")]
mod limits;
mod link_files;
mod loopback;
mod many_hosts;
mod misuse;
mod multicast;
mod multicast_v6;
mod nat;
mod nodes;
mod once;
mod seeds;
mod sockets;
mod stall;
#[cfg(feature = "strategies")]
mod strategies;
#[cfg(feature = "tcp")]
mod tcp;
#[cfg(all(feature = "facade", any(target_os = "linux", target_os = "android")))]
mod unix;
mod waiting;
