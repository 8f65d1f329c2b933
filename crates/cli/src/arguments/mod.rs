//! What can be said on the command line.

mod accuracy;
mod address;
mod admittance;
mod campaign;
mod examples;
mod falcon;
mod links;
mod numbers;
mod pages;
mod paper;
mod pictures;
mod realtime;
mod relay;
mod router;
mod scenes;
mod stability;
#[cfg(test)]
mod tests;

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};

pub(crate) use accuracy::AccuracyArguments;
pub(crate) use admittance::AdmittanceArguments;
pub(crate) use campaign::{CampaignArguments, TableFormat};
pub(crate) use falcon::{
    FalconArguments, FalconCommand, Force, HandName, HomeArguments, ProbeArguments, SimulateArguments, WatchArguments, WhichFalcon,
};
pub(crate) use links::{FitArguments, LinkArguments, Profile};
pub(crate) use pages::{CompletionsArguments, FileKind, InitArguments, ManArguments, SchemaArguments};
pub(crate) use paper::PaperArguments;
pub(crate) use pictures::PictureArguments;
pub(crate) use realtime::{LiveArguments, RealTimeArguments};
pub(crate) use relay::RelayArguments;
pub(crate) use router::RouterArguments;
pub(crate) use scenes::{CheckArguments, ExplainArguments, RunArguments};
pub(crate) use stability::{BoundaryArguments, GridSize, LinksName, MapArguments, PointArguments, StabilityArguments, StabilityCommand};

/// Several people feel and move one virtual object together, over a bad network.
///
/// A scene is one TOML file: the object, the peers, the links between them, and what is expected. docs/scenes.md lists every key.
#[derive(Debug, Parser)]
#[command(name = "cohaptic", version, after_help = examples::of_program())]
pub(crate) struct Arguments {
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Simulates a scene in virtual time and says what happened
    Run(RunArguments),
    #[command(about = "Runs scenes as tests: each against its own [expect]")]
    Check(CheckArguments),
    /// Says what a scene makes the program model, what it leaves out and why, and what it costs
    Explain(ExplainArguments),
    /// Runs a scene many times, over values of its keys and over seeds, into one table: on all cores, and resumable
    Campaign(CampaignArguments),
    /// Says whether a scene is stable without simulating it, maps where it is, and finds where that changes
    Stability(StabilityArguments),
    /// Says what the hand of one peer feels, frequency by frequency, without simulating it
    Admittance(AdmittanceArguments),
    /// Runs a scene by the wall clock, with other programs and Falcons attached, all through the emulated links
    Live(LiveArguments),
    /// Puts the emulator between programs that speak UDP to each other
    Relay(RelayArguments),
    /// Puts the emulator between two network devices: any IP traffic
    Router(RouterArguments),
    /// Looks at a Novint Falcon, homes it, watches and pushes it, or simulates one
    Falcon(FalconArguments),
    /// Sends a steady stream over one link and sets what it achieved beside what it was asked for
    Link(LinkArguments),
    /// Estimates the link that made a file of measurements, captures or fates
    Fit(FitArguments),
    /// Computes every figure and claim of Rakhsha and Constantinescu (2015) again, and says which hold
    Paper(PaperArguments),
    /// Measures what every method costs and how wrong it is, on the same work
    Accuracy(AccuracyArguments),
    /// Writes a scene to begin with, in which every key is explained
    Init(InitArguments),
    /// Prints a JSON Schema of scenes, relay files or router files: names, meanings, units and defaults of all keys, for editors
    Schema(SchemaArguments),
    /// Prints completions for a shell
    Completions(CompletionsArguments),
    /// Prints a manual page, or writes all
    Man(ManArguments),
}

/// What all commands on one scene take.
#[derive(Debug, Args)]
pub(crate) struct SceneArguments {
    /// The scene, a TOML file; - reads it from standard input
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
