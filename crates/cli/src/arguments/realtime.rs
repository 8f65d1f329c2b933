//! `live`, `play`, `relay` and `router`, and what they and `join` share.

use std::ffi::OsString;
use std::net::{SocketAddr, ToSocketAddrs as _};
use std::path::PathBuf;
use std::time::Duration;

use clap::Args;
use cohaptic_linkfile::{AddressError, address};
use cohaptic_units::{Bytes, parse};

use super::Overrides;
use super::examples::{self, after};
use super::numbers::integer;

/// Options for punctuality.
#[derive(Debug, Args)]
pub(crate) struct PaceArguments {
    /// Wake up to 120 µs before each deadline and spin: more punctual, and keeps a core busy
    #[arg(long)]
    pub(crate) spin: bool,
    /// Do not ask the system for SCHED_FIFO and locked memory
    #[arg(long)]
    pub(crate) no_priority: bool,
    /// Accept this lateness: a run is not valid if more than one in a thousand ticks or packets was later [default: that of the file, or 1ms]
    #[arg(long, value_name = "TIME", value_parser = parse::duration)]
    pub(crate) tolerance: Option<Duration>,
}

/// Options for punctuality, and live control.
#[derive(Debug, Args)]
pub(crate) struct RealTimeArguments {
    #[command(flatten)]
    pub(crate) pace: PaceArguments,
    /// Serve live control and /metrics over HTTP at this address [without one: a free port of 127.0.0.1]. The URL with its token is printed
    #[arg(long, value_name = "ADDRESS", value_parser = looked_up, num_args = 0..=1, default_missing_value = "127.0.0.1:0")]
    pub(crate) control: Option<SocketAddr>,
    /// Take the token of live control from this file, which only its owner may read [default: a random token]
    #[arg(long, value_name = "FILE", requires = "control")]
    pub(crate) token_file: Option<PathBuf>,
    /// Also listen on addresses that other machines can reach
    #[arg(long)]
    pub(crate) allow_remote: bool,
}

/// Files for live control of links. Sessions of a study have none, because the conditions of the study alone set links.
#[derive(Debug, Args)]
pub(crate) struct ControlFilesArguments {
    /// Let live control name the files of this folder in keys of links [default: only files that a link names already]
    #[arg(long, value_name = "DIR", requires = "control")]
    pub(crate) control_files: Option<PathBuf>,
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
    #[command(flatten)]
    pub(crate) files: ControlFilesArguments,
    /// Length of the session, in place of the scene's duration
    #[arg(long = "for", value_name = "TIME", value_parser = parse::duration)]
    pub(crate) length: Option<Duration>,
    /// Address to which peers in other programs (kind = "udp") send their samples
    #[arg(long, value_name = "ADDRESS", value_parser = looked_up, default_value = "127.0.0.1:7400")]
    pub(crate) listen: SocketAddr,
    /// File of the session key: every datagram must carry a tag made with this key
    #[arg(long, value_name = "FILE")]
    pub(crate) key_file: Option<PathBuf>,
    /// Make a session key, write it to a new file, and do nothing else
    #[arg(long, value_name = "FILE", conflicts_with = "scene")]
    pub(crate) new_key: Option<PathBuf>,
    /// The firmware for Falcons that have none yet (docs/falcon.md)
    #[arg(long, value_name = "FILE")]
    pub(crate) firmware: Option<PathBuf>,
    /// Write the files of run --out into this folder, and inputs.csv (all that came from outside: run --inputs replays it), releases.csv,
    /// lateness.csv and live.html, a page of all
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
}

#[derive(Debug, Args)]
#[command(after_help = after(examples::PLAY))]
pub(crate) struct PlayArguments {
    /// The scene, a TOML file; - reads it from standard input [default: three users, average-position, 24 ms]
    pub(crate) scene: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) overrides: Overrides,
    #[command(flatten)]
    pub(crate) real_time: RealTimeArguments,
    #[command(flatten)]
    pub(crate) files: ControlFilesArguments,
    /// Do not open a browser
    #[arg(long)]
    pub(crate) no_open: bool,
    /// End by itself after this time [default: on Ctrl-C]
    #[arg(long = "for", value_name = "TIME", value_parser = parse::duration)]
    pub(crate) length: Option<Duration>,
    /// Keep the scene and the inputs of each part in this folder: run --inputs replays them
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
}

#[derive(Debug, Args)]
#[command(after_help = after(examples::RELAY), override_usage = USAGE)]
pub(crate) struct RelayArguments {
    /// A relay file: the programs, and the links between them; - reads it from standard input. With --listen the link, as for cohaptic link: words of
    /// tc-netem (delay 20ms 5ms 25% loss 1%), or keys (delay=24ms loss=1%). With --tcp: delay, jitter and rate, and faults (stall 2s, close-after 5s,
    /// reset-after 1s, cut-after 10kB, slice 100B 10ms, slow-close 1s; each may end with for 10%, a share of the connections) and buffer 64kB
    #[arg(required_unless_present = "listen", value_name = "FILE | SPEC", allow_negative_numbers = true)]
    pub(crate) words: Vec<OsString>,
    /// Relay connections of TCP in place of datagrams, on every system. The relay sees bytes and no packets: loss needs cohaptic exec or router
    #[arg(long, conflicts_with_all = ["packets", "spin", "no_priority", "control_files"])]
    pub(crate) tcp: bool,
    /// Override a key of the relay file by its dotted path, repeatable: --set relay.forget-after=10s --set link.delay=8ms
    /// --set links.left.right.loss=5% --set programs.left.port=127.0.0.1:7101
    #[arg(long, value_name = "KEY=VALUE")]
    pub(crate) set: Vec<String>,
    /// Print one JSON document and nothing else
    #[arg(long)]
    pub(crate) json: bool,
    /// Address to which clients send datagrams for --to, or connect; port 0 takes any free port
    #[arg(long, value_name = "ADDRESS", value_parser = looked_up, requires = "to", conflicts_with = "set")]
    pub(crate) listen: Option<SocketAddr>,
    /// Address of the program that clients speak to
    #[arg(long, value_name = "ADDRESS", value_parser = looked_up, requires = "listen")]
    pub(crate) to: Option<SocketAddr>,
    /// Link from the program to the clients, up to the next option [default: the same in both directions]
    #[arg(long, value_name = "SPEC", num_args = 1.., requires = "listen", allow_negative_numbers = true)]
    pub(crate) back: Option<Vec<OsString>>,
    #[command(flatten)]
    pub(crate) real_time: RealTimeArguments,
    #[command(flatten)]
    pub(crate) files: ControlFilesArguments,
    /// End by itself after this time [default: on Ctrl-C]
    #[arg(long = "for", value_name = "TIME", value_parser = parse::duration)]
    pub(crate) length: Option<Duration>,
    /// Seed of all random numbers [default: that of the file, or 0]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = integer::<u64>(0, i64::MAX.unsigned_abs()))]
    pub(crate) seed: Option<u64>,
    /// Largest number of datagrams in flight at once; more are dropped [default: that of the file, or 262144]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = integer::<u64>(1, 1 << 24))]
    pub(crate) packets: Option<u64>,
    /// Largest number of bytes in flight at once; more are dropped, or wait with --tcp [default: that of the file, or 64MB]
    #[arg(long, value_name = "SIZE", value_parser = room)]
    pub(crate) bytes: Option<Bytes>,
}

const USAGE: &str = "cohaptic relay [OPTIONS] <FILE>\n       cohaptic relay [OPTIONS] --listen <ADDRESS> --to <ADDRESS> [SPEC]... [--back <SPEC>...]";

/// Reads an amount of memory for datagrams, at least the size of the largest datagram.
fn room(text: &str) -> Result<Bytes, String> {
    let size = parse::size(text).map_err(|error| error.to_string())?;
    if size.get() < 65_535 { Err("expected at least 65535B, one datagram".to_owned()) } else { Ok(size) }
}

#[derive(Debug, Args)]
#[command(after_help = after(examples::ROUTER))]
pub(crate) struct RouterArguments {
    /// A router file: two devices, the links between them, and rules that say which packets take which link; - reads it from
    /// standard input
    pub(crate) file: PathBuf,
    /// Override a key of the router file by its dotted path, repeatable: --set links.wan.delay=8ms --set router.default=drop
    /// --set router.memory.packets=1000
    #[arg(long, value_name = "KEY=VALUE")]
    pub(crate) set: Vec<String>,
    /// Print one JSON document and nothing else
    #[arg(long)]
    pub(crate) json: bool,
    #[command(flatten)]
    pub(crate) real_time: RealTimeArguments,
    #[command(flatten)]
    pub(crate) files: ControlFilesArguments,
    /// End by itself after this time [default: on Ctrl-C]
    #[arg(long = "for", value_name = "TIME", value_parser = parse::duration)]
    pub(crate) length: Option<Duration>,
}

/// Reads an address with a port, and looks up a name. Takes the first IPv4 address of a name, or the first address if the name has no IPv4 address. Two names
/// with addresses of both versions then give the two ends of a relay the same version.
pub(super) fn looked_up(text: &str) -> Result<SocketAddr, String> {
    const EXPECTED: &str = "expected an address with a port, such as 127.0.0.1:7000, [::1]:7000 or localhost:7000";
    match address(text) {
        Ok(address) => Ok(address),
        Err(AddressError::Name) => {
            let found: Vec<SocketAddr> = text.to_socket_addrs().map_err(|error| format!("the name is not known ({error}): {EXPECTED}"))?.collect();
            let first = found.iter().find(|address| address.is_ipv4()).or_else(|| found.first());
            first.copied().ok_or_else(|| format!("the name has no address: {EXPECTED}"))
        }
        Err(other) => Err(format!("{other}: {EXPECTED}")),
    }
}
