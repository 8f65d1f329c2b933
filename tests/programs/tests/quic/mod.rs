//! Unmodified QUIC endpoints over emulated links.

mod determinism;
mod letter;
mod new_reno;
mod roaming;
mod transfer;
mod trouble;
