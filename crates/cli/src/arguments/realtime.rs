//! What all commands that run in real time take, and `live`.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

use clap::Args;
use cohaptic_units::parse;

use super::Overrides;
use super::address::looked_up;
use super::examples::{self, after};

/// How to be on time, and who may look.
#[derive(Debug, Args)]
pub(crate) struct RealTimeArguments {
    /// Spin the last 120 µs before each deadline: a hundred times closer to it, for a core that is busy meanwhile
    #[arg(long)]
    pub(crate) spin: bool,
    /// Do not ask the system for SCHED_FIFO and locked memory
    #[arg(long)]
    pub(crate) no_priority: bool,
    /// The run says that it was not valid if more than one in a thousand ticks or packets was later than this [default: that of the file, or 1ms]
    #[arg(long, value_name = "TIME", value_parser = parse::duration)]
    pub(crate) tolerance: Option<Duration>,
    /// Serve live control and /metrics over HTTP at this address [without one: a free port of 127.0.0.1]. The URL with its token is printed
    #[arg(long, value_name = "ADDRESS", value_parser = looked_up, num_args = 0..=1, default_missing_value = "127.0.0.1:0")]
    pub(crate) control: Option<SocketAddr>,
    /// A file with the token of live control [default: a random one]
    #[arg(long, value_name = "FILE", requires = "control")]
    pub(crate) token_file: Option<PathBuf>,
    /// Listen on addresses that other machines reach, too
    #[arg(long)]
    pub(crate) allow_remote: bool,
}

#[derive(Debug, Args)]
#[command(after_help = after(examples::LIVE))]
pub(crate) struct LiveArguments {
    /// The scene, a TOML file; - reads it from standard input
    #[arg(required_unless_present = "new_key")]
    pub(crate) scene: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) overrides: Overrides,
    /// Print one JSON document and nothing else
    #[arg(long)]
    pub(crate) json: bool,
    #[command(flatten)]
    pub(crate) real_time: RealTimeArguments,
    /// How long, in place of the scene's duration
    #[arg(long = "for", value_name = "TIME", value_parser = parse::duration)]
    pub(crate) length: Option<Duration>,
    /// Where peers in other programs (kind = "udp") send their samples
    #[arg(long, value_name = "ADDRESS", value_parser = looked_up, default_value = "127.0.0.1:7400")]
    pub(crate) listen: SocketAddr,
    /// The session key: every datagram must carry a tag made with it
    #[arg(long, value_name = "FILE")]
    pub(crate) key_file: Option<PathBuf>,
    /// Make a session key, write it to a new file, and do nothing else
    #[arg(long, value_name = "FILE", conflicts_with = "scene")]
    pub(crate) new_key: Option<PathBuf>,
    /// The firmware for Falcons that have none yet (docs/falcon.md)
    #[arg(long, value_name = "FILE")]
    pub(crate) firmware: Option<PathBuf>,
    /// Write the files of run --out into this folder, and inputs.csv (all that came from outside: run --inputs replays it), releases.csv and
    /// lateness.csv
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
}
