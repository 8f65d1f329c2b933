//! What can be said on the command line.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};

/// Several people feel and move one virtual object together, over a bad network.
///
/// A scene is one TOML file: the object, the peers, the links between them, and what is expected. docs/scenes.md lists every key.
#[derive(Debug, Parser)]
#[command(name = "cohaptic", version, after_help = EXIT_STATUS)]
pub(crate) struct Arguments {
    #[command(subcommand)]
    pub(crate) command: Command,
}

const EXIT_STATUS: &str = "Exit status: 0 done, 1 an expectation failed, 2 a bad argument or scene, 3 an input or output error, 130 interrupted.";

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Simulates a scene in virtual time and says what happened
    Run(RunArguments),
    /// Runs scenes as tests: each against its own \[expect\]
    Check(CheckArguments),
    /// Says what a scene makes the program model, what it leaves out and why, and what it costs
    Explain(ExplainArguments),
    /// Sends a steady stream over one link and sets what it achieved beside what it was asked for
    Link(LinkArguments),
    /// Estimates the link that made a file of measurements, captures or fates
    Fit(FitArguments),
    /// Computes every figure and claim of Rakhsha and Constantinescu (2015) again, and says which hold
    Paper(PaperArguments),
}

/// What all commands on one scene take.
#[derive(Debug, Args)]
pub(crate) struct SceneArguments {
    /// The scene, a TOML file
    pub(crate) scene: PathBuf,
    #[command(flatten)]
    pub(crate) overrides: Overrides,
    /// Print one JSON document and nothing else
    #[arg(long)]
    pub(crate) json: bool,
}

#[derive(Debug, Args)]
pub(crate) struct Overrides {
    /// Override a key of the scene by its dotted path, again and again: --set coordination.stiffness=1000 --set link.delay=8ms
    /// --set peers.left.contact=none
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(crate) set: Vec<String>,
}

#[derive(Debug, Args)]
#[command(after_help = EXIT_STATUS)]
pub(crate) struct RunArguments {
    #[command(flatten)]
    pub(crate) scene: SceneArguments,
    /// Run the scene a second time with these keys overridden too, with the same random numbers, and show both:
    /// --against coordination.strategy=proportional-derivative
    #[arg(long, value_name = "KEY=VALUE")]
    pub(crate) against: Vec<String>,
    /// Write trajectory.csv, packets.csv, links.csv and plots (SVG) into this folder; the second run goes into its folder `against`
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Do not draw positions in the terminal. Nothing is looked at then but counters, which is fastest
    #[arg(long)]
    pub(crate) no_plot: bool,
    /// Simulate everything the program has, needed or not: slower, and the same answer to the last bit
    #[arg(long)]
    pub(crate) general: bool,
}

#[derive(Debug, Args)]
#[command(after_help = EXIT_STATUS)]
pub(crate) struct CheckArguments {
    /// Scenes, or folders of scenes
    #[arg(required = true, value_name = "SCENE")]
    pub(crate) scenes: Vec<PathBuf>,
    #[command(flatten)]
    pub(crate) overrides: Overrides,
    /// Print one JSON document and nothing else
    #[arg(long)]
    pub(crate) json: bool,
    /// How many scenes run at the same time [default: one a core]. Results do not depend on it
    #[arg(long, value_name = "N")]
    pub(crate) jobs: Option<std::num::NonZeroUsize>,
    /// Simulate everything the program has, needed or not: slower, and the same answer to the last bit
    #[arg(long)]
    pub(crate) general: bool,
}

#[derive(Debug, Args)]
#[command(after_help = EXIT_STATUS)]
pub(crate) struct ExplainArguments {
    #[command(flatten)]
    pub(crate) scene: SceneArguments,
}

#[derive(Debug, Args)]
#[command(after_help = EXIT_STATUS)]
pub(crate) struct LinkArguments {
    /// What the link does: words of tc-netem (delay 20ms 5ms 25% loss 1%), or keys of the link table of a scene (delay=24ms loss=1%)
    #[arg(required_unless_present = "from", conflicts_with = "from", value_name = "SPEC", allow_negative_numbers = true)]
    pub(crate) spec: Vec<String>,
    /// Replay a file of fates instead, as --fates writes it
    #[arg(long, value_name = "FATES.csv")]
    pub(crate) from: Option<PathBuf>,
    /// How many packets are sent [default: 100000, with --from as many as the file has]
    #[arg(long, value_name = "N")]
    pub(crate) packets: Option<std::num::NonZeroU64>,
    /// The time from one packet to the next
    #[arg(long, value_name = "TIME", default_value = "1ms", value_parser = cohaptic_units::parse::duration)]
    pub(crate) every: std::time::Duration,
    /// The size of a packet
    #[arg(long, value_name = "SIZE", default_value = "64B", value_parser = cohaptic_units::parse::size)]
    pub(crate) size: cohaptic_units::Bytes,
    /// The seed of all random numbers
    #[arg(long, value_name = "N", default_value_t = 1)]
    pub(crate) seed: u64,
    /// What words of tc-netem mean: what they say, or what Linux 6.6 does
    #[arg(long, value_enum, default_value_t = Profile::Exact)]
    pub(crate) profile: Profile,
    /// Packets can carry a congestion mark: they are marked where others would be dropped
    #[arg(long)]
    pub(crate) ecn: bool,
    /// Print one JSON document and nothing else
    #[arg(long)]
    pub(crate) json: bool,
    /// Write what became of every packet, for --from and for cohaptic fit
    #[arg(long, value_name = "FILE.csv")]
    pub(crate) fates: Option<PathBuf>,
    /// Write what became of every packet as a capture, for packet analysers
    #[arg(long, value_name = "FILE")]
    pub(crate) pcapng: Option<PathBuf>,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug, clap::ValueEnum)]
pub(crate) enum Profile {
    Exact,
    #[value(name = "kernel-6.6")]
    Kernel66,
}

#[derive(Debug, Args)]
#[command(after_help = EXIT_STATUS)]
pub(crate) struct FitArguments {
    /// A CSV of one-way measurements (t,delay or sent,arrived), a file of fates, or the capture of the sender
    pub(crate) file: PathBuf,
    /// The capture of the receiver
    pub(crate) receiver: Option<PathBuf>,
    /// Only datagrams to this UDP port, of captures
    #[arg(long, value_name = "N", requires = "receiver")]
    pub(crate) port: Option<u16>,
    /// Remove a linear drift of one clock against the other first
    #[arg(long)]
    pub(crate) skew: bool,
    /// Print one JSON document and nothing else
    #[arg(long)]
    pub(crate) json: bool,
    /// Write the link table of a scene into this file
    #[arg(long, value_name = "SCENE_LINK.toml")]
    pub(crate) out: Option<PathBuf>,
}

#[derive(Debug, Args)]
#[command(after_help = EXIT_STATUS)]
pub(crate) struct PaperArguments {
    /// Write index.html, the figures (SVG), the data behind them (CSV) and claims.json into this folder
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Coarser grids: some seconds, and areas to about a percent
    #[arg(long)]
    pub(crate) quick: bool,
    /// Print one JSON document and nothing else
    #[arg(long)]
    pub(crate) json: bool,
}
