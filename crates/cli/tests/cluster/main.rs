//! Shards on real schedulers, all on this machine: Slurm with two nodes, a Dask cluster with two workers, GNU parallel. A worker is killed in the middle of each,
//! and the table is that of one process, to the byte.
//!
//! Each is skipped with a word where its programs are missing. `.ci/run` installs them where it can: Debian's `slurmctld`, `slurmd`, `slurm-client`, `munge` and
//! `parallel`; `distributed` of PyPI in a virtual environment, `target/dask`, or the one that `COHAPTIC_DASK` names. Traffic stays on the loopback interface.
//!
//! `measured.rs` writes `docs/measured-cluster.md`, when it is asked for.
#![cfg(target_os = "linux")]
#![allow(clippy::unwrap_used, clippy::panic, reason = "a test may fail")]
#![expect(clippy::print_stderr, reason = "a test that cannot run here says so")]

mod dask;
mod measured;
mod parallel;
mod slurm;
mod work;
