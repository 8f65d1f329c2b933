//! `link` and `fit`.

use std::path::PathBuf;

use clap::Args;

use super::examples::{self, after, after_measurements};
use super::numbers::{any_integer, integer, part, share, signed_duration};

#[derive(Debug, Args)]
#[command(after_help = after(examples::LINK))]
pub(crate) struct LinkArguments {
    /// What the link does: words of tc-netem (delay 20ms 5ms 25% loss 1%), keys of the link table of a scene (delay=24ms loss=1%), or a link of the library
    /// (starlink/down), which keys may follow
    #[arg(required_unless_present_any = ["from", "list"], conflicts_with = "from", value_name = "SPEC", allow_negative_numbers = true)]
    pub(crate) spec: Vec<String>,
    /// List the links of the library: name, grade, delay and rate, and what each is
    #[arg(long, conflicts_with_all = ["spec", "from", "show"])]
    pub(crate) list: bool,
    /// Show every key of a link of the library with its source, and send nothing
    #[arg(long, conflicts_with = "from")]
    pub(crate) show: bool,
    /// Replay a file of fates instead, as --fates writes it
    #[arg(long, value_name = "FATES.csv")]
    pub(crate) from: Option<PathBuf>,
    /// Number of packets to send [default: 100000, with --from as many as the file has]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = integer::<std::num::NonZeroU64>(1, u64::MAX))]
    pub(crate) packets: Option<std::num::NonZeroU64>,
    /// Time from one packet to the next
    #[arg(long, value_name = "TIME", default_value = "1ms", value_parser = cohaptic_units::parse::duration)]
    pub(crate) every: std::time::Duration,
    /// Size of a packet
    #[arg(long, value_name = "SIZE", default_value = "64B", value_parser = cohaptic_units::parse::size)]
    pub(crate) size: cohaptic_units::Bytes,
    /// Seed of all random numbers
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = any_integer, default_value_t = 0)]
    pub(crate) seed: u64,
    /// Meaning of words of tc-netem: what they say, or what Linux 6.6 does
    #[arg(long, value_enum, default_value_t = Profile::Exact)]
    pub(crate) profile: Profile,
    /// Send packets that can carry a congestion mark: they are marked where others would be dropped. classic is ECT(0); l4s is ECT(1), to which the queue
    /// dualpi2 gives a queue of its own
    #[arg(long, value_enum, value_name = "KIND", num_args = 0..=1, require_equals = true, default_missing_value = "classic")]
    pub(crate) ecn: Option<EcnKind>,
    /// Print one JSON document and nothing else
    #[arg(long)]
    pub(crate) json: bool,
    /// Write the fate of every packet, for --from and for cohaptic fit
    #[arg(long, value_name = "FILE.csv")]
    pub(crate) fates: Option<PathBuf>,
    /// Write the fate of every packet as a capture, for packet analysers
    #[arg(long, value_name = "FILE")]
    pub(crate) pcapng: Option<PathBuf>,
    /// Draw the delay of each packet, the distribution of the delays, and the rates of what arrived and of cross-traffic
    #[arg(long, value_name = "FILE.svg")]
    pub(crate) picture: Option<PathBuf>,
}

/// Codepoint of the packets of `cohaptic link --ecn`.
#[derive(Clone, Copy, PartialEq, Eq, Debug, clap::ValueEnum)]
pub(crate) enum EcnKind {
    Classic,
    L4s,
}

impl EcnKind {
    pub(crate) const fn codepoint(self) -> cohaptic_units::Ecn {
        match self {
            Self::Classic => cohaptic_units::Ecn::Capable0,
            Self::L4s => cohaptic_units::Ecn::Capable1,
        }
    }
}

#[derive(Clone, Copy, PartialEq, Eq, Debug, clap::ValueEnum)]
pub(crate) enum Profile {
    Exact,
    #[value(name = "kernel-6.6")]
    Kernel66,
}

#[derive(Debug, Args)]
#[command(after_help = after_measurements(examples::FIT))]
pub(crate) struct FitArguments {
    /// A CSV of one-way measurements (t,delay or sent,arrived), a file of fates, a file of another program such as irtt, ping or iperf3, or the capture of the sender (with that of the receiver)
    pub(crate) file: PathBuf,
    /// The capture of the receiver
    pub(crate) receiver: Option<PathBuf>,
    /// Read only datagrams to this UDP port from captures
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = integer::<u16>(0, 65_535), requires = "receiver")]
    pub(crate) port: Option<u16>,
    /// Way of the packets, of files that have both ways (IRTT, LENS): up is from client to server
    #[arg(long, value_enum, conflicts_with = "receiver")]
    pub(crate) direction: Option<Direction>,
    /// Take this share of each round trip as the delay of one way: even for half, or a share such as 60%; nothing measures it
    #[arg(long, value_name = "SHARE", value_parser = share, conflicts_with = "receiver")]
    pub(crate) split: Option<f64>,
    /// Let the rate change as a walk through five states, estimated from the rates of whole seconds, of files that measure a rate (iperf3, mahimahi, heavy CellReplay)
    #[arg(long, conflicts_with = "receiver")]
    pub(crate) walk: bool,
    /// Bytes that leave at each instant of a line: 1504B of mahimahi [default: 1400B, of CellReplay]
    #[arg(long, value_name = "SIZE", value_parser = cohaptic_units::parse::size, conflicts_with = "receiver")]
    pub(crate) bytes: Option<cohaptic_units::Bytes>,
    /// Tick of the clock that showed the delays [default: as the program prints them, else the greatest step of which all are multiples]
    #[arg(long, value_name = "TIME", value_parser = cohaptic_units::parse::duration)]
    pub(crate) tick: Option<std::time::Duration>,
    /// The clock cuts delays to its tick and does not round them: half a tick is added
    #[arg(long, requires = "tick")]
    pub(crate) cut: bool,
    /// Add this time to the clock of the receiver, and so to every delay, if the clocks are known to be apart; may be negative, such as -20ms
    #[arg(long, value_name = "TIME", allow_hyphen_values = true, value_parser = signed_duration, conflicts_with = "least")]
    pub(crate) offset: Option<f64>,
    /// Take TIME as the least delay, if it is known: all delays are moved by one time, after the drift is removed
    #[arg(long, value_name = "TIME", value_parser = cohaptic_units::parse::duration)]
    pub(crate) least: Option<std::time::Duration>,
    /// Remove the linear drift of one clock against the other first, where it is significant at 1 %
    #[arg(long)]
    pub(crate) skew: bool,
    /// Fit the packets of the first part of the time, and judge the link by those of this share at the end, such as 50%
    #[arg(long, value_name = "SHARE", value_parser = part)]
    pub(crate) hold_out: Option<f64>,
    /// Print one JSON document and nothing else
    #[arg(long)]
    pub(crate) json: bool,
    /// End with status 1, and write nothing, where no law fits the delays, or where the held-out packets refuse the link, or its own measurement the walk of a rate
    #[arg(long)]
    pub(crate) require_law: bool,
    /// Write the link table of a scene into this file, and the delays into a file next to it if no law fits them
    #[arg(long, value_name = "SCENE_LINK.toml")]
    pub(crate) out: Option<PathBuf>,
}

/// Way of the packets.
#[derive(Clone, Copy, PartialEq, Eq, Debug, clap::ValueEnum)]
pub(crate) enum Direction {
    Up,
    Down,
    Rtt,
}

impl From<Direction> for cohaptic_answers::fit::Direction {
    fn from(direction: Direction) -> Self {
        match direction {
            Direction::Up => Self::Up,
            Direction::Down => Self::Down,
            Direction::Rtt => Self::Rtt,
        }
    }
}
