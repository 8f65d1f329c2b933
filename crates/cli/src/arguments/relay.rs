//! `relay`.

use std::ffi::OsString;
use std::net::SocketAddr;
use std::time::Duration;

use clap::Args;
use cohaptic_units::{Bytes, parse};

use super::RealTimeArguments;
use super::address::looked_up;
use super::examples::{self, after};
use super::numbers::integer;

#[derive(Debug, Args)]
#[command(after_help = after(examples::RELAY), override_usage = USAGE)]
pub(crate) struct RelayArguments {
    /// A relay file: the programs, and the links between them; - reads it from standard input. With --listen in its place the impairments of the link, as for cohaptic link: words of tc-netem
    /// (delay 20ms 5ms 25% loss 1%), or keys of the link table of a scene (delay=24ms loss=1%)
    #[arg(required_unless_present = "listen", value_name = "FILE | SPEC", allow_negative_numbers = true)]
    pub(crate) words: Vec<OsString>,
    /// Override a key of the relay file by its dotted path, again and again: --set relay.forget-after=10s --set link.delay=8ms
    /// --set links.left.right.loss=5% --set programs.left.port=127.0.0.1:7101
    #[arg(long, value_name = "KEY=VALUE")]
    pub(crate) set: Vec<String>,
    /// Print one JSON document and nothing else
    #[arg(long)]
    pub(crate) json: bool,
    /// Where clients send to, what is meant for --to; port 0 is a free one
    #[arg(long, value_name = "ADDRESS", value_parser = looked_up, requires = "to", conflicts_with = "set")]
    pub(crate) listen: Option<SocketAddr>,
    /// Whom clients speak to
    #[arg(long, value_name = "ADDRESS", value_parser = looked_up, requires = "listen")]
    pub(crate) to: Option<SocketAddr>,
    /// The link from there to the clients, up to the next option [default: the same in both directions]
    #[arg(long, value_name = "SPEC", num_args = 1.., requires = "listen", allow_negative_numbers = true)]
    pub(crate) back: Option<Vec<OsString>>,
    #[command(flatten)]
    pub(crate) real_time: RealTimeArguments,
    /// End by itself after this time [default: on Ctrl-C]
    #[arg(long = "for", value_name = "TIME", value_parser = parse::duration)]
    pub(crate) length: Option<Duration>,
    /// The seed of all random numbers [default: that of the file, or 0]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = integer::<u64>(0, i64::MAX.unsigned_abs()))]
    pub(crate) seed: Option<u64>,
    /// So many datagrams may be on their way at once; what comes beyond is dropped [default: that of the file, or 262144]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = integer::<u64>(1, 1 << 24))]
    pub(crate) packets: Option<u64>,
    /// So many bytes of them [default: that of the file, or 64MB]
    #[arg(long, value_name = "SIZE", value_parser = room)]
    pub(crate) bytes: Option<Bytes>,
}

const USAGE: &str = "cohaptic relay [OPTIONS] <FILE>\n       cohaptic relay [OPTIONS] --listen <ADDRESS> --to <ADDRESS> [SPEC]... [--back <SPEC>...]";

/// One datagram at least.
fn room(text: &str) -> Result<Bytes, String> {
    let size = parse::size(text).map_err(|error| error.to_string())?;
    if size.get() < 65_535 { Err("expected at least 65535B, one datagram".to_owned()) } else { Ok(size) }
}
