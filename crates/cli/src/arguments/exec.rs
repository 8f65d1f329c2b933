//! `exec`: programs in networks of their own.

use std::ffi::OsString;
use std::net::{IpAddr, Ipv4Addr, SocketAddr};
use std::ops::RangeInclusive;
use std::path::PathBuf;

use clap::Args;

use super::examples;
use super::numbers::integer;
use super::realtime::PaceArguments;

#[derive(Debug, Args)]
#[command(after_help = examples::of_exec(), override_usage = USAGE)]
pub(crate) struct ExecArguments {
    /// The link between the command and the world, the same in both directions, as for cohaptic link: words of tc-netem ('delay 50ms loss 1%'), keys
    /// (delay=50ms loss=1%), or a link of the library (starlink). Without a command a file: hosts with their commands, and the links between the hosts
    #[arg(required = true, value_name = "SPEC | FILE", allow_negative_numbers = true)]
    pub(crate) spec: Vec<String>,
    /// The command and its arguments, after two dashes
    #[arg(last = true, value_name = "COMMAND")]
    pub(crate) command: Vec<OsString>,
    /// Override a key of the file by its dotted path, repeatable: --set link.delay=8ms --set links.client.server.loss=5%
    #[arg(long, value_name = "KEY=VALUE", conflicts_with = "command")]
    pub(crate) set: Vec<String>,
    /// Another link from the world to the command, in one argument: --back 'delay 20ms rate 10mbit'
    #[arg(long, value_name = "SPEC", allow_negative_numbers = true)]
    pub(crate) back: Option<String>,
    /// Lead connections and datagrams that arrive at this port of the machine through the link to the same port of the command, repeatable
    /// [without an address: 127.0.0.1]
    #[arg(long, value_name = "[ADDRESS:]PORT", value_parser = listened)]
    pub(crate) listen: Vec<SocketAddr>,
    /// Lead packets of the command to its own addresses, such as localhost, through the link too: a test that starts its own server needs no change. The
    /// server's side of the link has the name loopback
    #[arg(long)]
    pub(crate) loopback: bool,
    /// Name server that answers the command's questions [default: the first of /etc/resolv.conf]
    #[arg(long, value_name = "ADDRESS", value_parser = served)]
    pub(crate) dns: Option<SocketAddr>,
    /// Write a capture of the packets of each command, and a report of the links, into this folder
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Seed of all random numbers [default: that of the file, or 0]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = integer::<u64>(0, i64::MAX.unsigned_abs()))]
    pub(crate) seed: Option<u64>,
    /// Lose these packets of a link, counted from 0, and none by chance, repeatable: --lose 'command -> world: 0, 3'. none loses none
    #[arg(long, value_name = "FROM -> TO: N,... | none", conflicts_with = "seeds")]
    pub(crate) lose: Vec<String>,
    /// Run the command with each of these seeds and say which fail. Then search for the fewest lost packets with which the command fails, and print the
    /// command line that loses them. The command has an empty standard input
    #[arg(long, value_name = "A..B", value_parser = seeds, conflicts_with = "seed")]
    pub(crate) seeds: Option<RangeInclusive<u64>>,
    /// Run the command this many times and count its failures. With --seeds: lost packets have to fail as many times [default with --seeds: 5]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = integer::<u32>(1, 1_000_000))]
    pub(crate) runs: Option<u32>,
    /// Try no seed after one whose lost packets fail each time
    #[arg(long, requires = "seeds")]
    pub(crate) until_failure: bool,
    /// Print one JSON document on standard output and nothing else. The output of the command goes to standard error
    #[arg(long)]
    pub(crate) json: bool,
    #[command(flatten)]
    pub(crate) pace: PaceArguments,
}

const USAGE: &str = "cohaptic exec [OPTIONS] <SPEC>... -- <COMMAND>...\n       cohaptic exec [OPTIONS] <FILE>";

/// Reads a first and a last seed: `1..40`.
fn seeds(text: &str) -> Result<RangeInclusive<u64>, String> {
    let seed = integer::<u64>(0, i64::MAX.unsigned_abs());
    let (first, last) = text.split_once("..").ok_or("expected the first and the last seed, such as 1..40")?;
    let (first, last) = (seed(first)?, seed(last)?);
    if first > last {
        return Err(format!("the last seed is below the first: expected {last}..{first}"));
    }
    Ok(first..=last)
}

/// Reads an address with a port, or a port of 127.0.0.1.
fn listened(text: &str) -> Result<SocketAddr, String> {
    let address = text.parse().map_or_else(|_| text.parse().map(|port| SocketAddr::new(IpAddr::V4(Ipv4Addr::LOCALHOST), port)), Ok);
    let fault = || "expected a port such as 8080, or an address with a port such as 0.0.0.0:8080".to_owned();
    // Port 0 names no port of the command.
    address.ok().filter(|address| address.port() != 0).ok_or_else(fault)
}

/// Reads the address of a name server, with port 53 if the text has none.
fn served(text: &str) -> Result<SocketAddr, String> {
    const DNS: u16 = 53;
    let address = text.parse().or_else(|_| text.parse().map(|address| SocketAddr::new(address, DNS)));
    address.map_err(|_| "expected an address such as 192.0.2.53, or with a port 127.0.0.1:5353".to_owned())
}
