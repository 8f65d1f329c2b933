//! What all commands that run in real time take, and `live`, `relay` and `router`.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

use clap::Args;
use cohaptic_units::parse;

use super::{EXIT_STATUS, SceneArguments};

/// How to be on time, and who may look.
#[derive(Debug, Args)]
pub(crate) struct RealTimeArguments {
    /// Spin the last 120 µs before each deadline: a hundred times closer to it, for a core that is busy meanwhile
    #[arg(long)]
    pub(crate) spin: bool,
    /// Do not ask the system for SCHED_FIFO and locked memory
    #[arg(long)]
    pub(crate) no_priority: bool,
    /// The run says that it was not valid if more than one in a thousand ticks or packets was later than this
    #[arg(long, value_name = "DURATION", value_parser = parse::duration, default_value = "1ms")]
    pub(crate) tolerance: Duration,
    /// Serve live control and /metrics over HTTP at this address; without one, at a free port of 127.0.0.1. The URL with its token is printed
    #[arg(long, value_name = "ADDRESS", num_args = 0..=1, default_missing_value = "127.0.0.1:0")]
    pub(crate) control: Option<SocketAddr>,
    /// The token of live control, 16 to 128 letters and digits [default: a random one]
    #[arg(long, value_name = "TOKEN", requires = "control", env = "COHAPTIC_TOKEN", hide_env_values = true)]
    pub(crate) token: Option<String>,
    /// Listen on addresses that are not of this computer too
    #[arg(long)]
    pub(crate) allow_remote: bool,
}

#[derive(Debug, Args)]
#[command(after_help = EXIT_STATUS)]
pub(crate) struct LiveArguments {
    #[command(flatten)]
    pub(crate) scene: SceneArguments,
    #[command(flatten)]
    pub(crate) real_time: RealTimeArguments,
    /// How long, in place of the scene's duration
    #[arg(long = "for", value_name = "DURATION", value_parser = parse::duration)]
    pub(crate) length: Option<Duration>,
    /// Where peers in other programs (kind = "udp") send their samples
    #[arg(long, value_name = "ADDRESS", default_value = "127.0.0.1:7400")]
    pub(crate) listen: SocketAddr,
    /// The session key: every datagram must carry a tag under it. `cohaptic live --new-key FILE` makes one
    #[arg(long, value_name = "FILE")]
    pub(crate) key_file: Option<PathBuf>,
    /// Write the files of `run --out` into this folder, and inputs.csv (all that came from outside: `run --inputs` replays it), releases.csv and
    /// lateness.csv
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
}
