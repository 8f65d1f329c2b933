//! `join`.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, ValueEnum};
use cohaptic_units::parse;

use super::examples::{self, after};
use super::realtime::looked_up;
use super::{Overrides, PaceArguments};

#[derive(Debug, Args)]
#[command(after_help = after(examples::JOIN))]
pub(crate) struct JoinArguments {
    /// Address at which the session listens (cohaptic live --listen)
    #[arg(value_name = "HOST:PORT", value_parser = looked_up)]
    pub(crate) session: SocketAddr,
    /// The scene of the session, a TOML file; - reads it from standard input
    pub(crate) scene: PathBuf,
    #[command(flatten)]
    pub(crate) overrides: Overrides,
    /// Print one JSON document and nothing else
    #[arg(long)]
    pub(crate) json: bool,
    /// Peer of the scene that is at this computer; its kind in the scene is udp
    #[arg(long, value_name = "NAME")]
    pub(crate) peer: String,
    /// Device at this computer
    #[arg(long, value_enum)]
    pub(crate) device: JoinDevice,
    /// File of the session key, the same as that of the session
    #[arg(long, value_name = "FILE")]
    pub(crate) key_file: Option<PathBuf>,
    /// Also join a session at another computer without a key
    #[arg(long)]
    pub(crate) allow_remote: bool,
    /// End by itself this time after the welcome of the session, or after the start without a welcome [default: on Ctrl-C]
    #[arg(long = "for", value_name = "TIME", value_parser = parse::duration)]
    pub(crate) length: Option<Duration>,
    #[command(flatten)]
    pub(crate) pace: PaceArguments,
    /// The firmware for a Falcon that has none yet (docs/falcon.md)
    #[arg(long, value_name = "FILE")]
    pub(crate) firmware: Option<PathBuf>,
    /// Write trajectory.csv, a row for each tick of this peer, and lateness.csv into this folder
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub(crate) enum JoinDevice {
    /// A Novint Falcon, with the keys falcon of the peer
    Falcon,
    /// A Haply Inverse3, with the keys inverse3 of the peer
    Inverse3,
    /// The device and the hand of the peer, simulated
    Simulated,
}

impl JoinDevice {
    /// Returns the kind of a peer with this device in a scene.
    pub(crate) const fn kind(self) -> &'static str {
        match self {
            Self::Falcon => "falcon",
            Self::Inverse3 => "inverse3",
            Self::Simulated => "simulated",
        }
    }
}
