//! The command line: commands, options and their help.

mod compare;
mod examples;
mod exec;
mod existing;
mod falcon;
mod inverse3;
mod join;
mod links;
mod numbers;
mod pages;
mod paper;
mod program;
mod realtime;
mod scenes;
mod shards;
mod stability;
mod study;
mod tables;
#[cfg(test)]
mod tests;

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};
use cohaptic_picture::{Size, SizeError};

pub(crate) use compare::{CompareArguments, PresetName};
pub(crate) use exec::ExecArguments;
pub(crate) use existing::{TestArguments, TokioArguments};
pub(crate) use falcon::{
    FalconArguments, FalconCommand, Force, HandName, HomeArguments, ProbeArguments, SimulateArguments, WatchArguments, WhichFalcon,
};
pub(crate) use inverse3::{
    FaultText, FaultWhen, FormatName, Inverse3Arguments, Inverse3Command, Inverse3ProbeArguments, Inverse3SimulateArguments, Inverse3WatchArguments,
    WhichInverse3,
};
pub(crate) use join::{JoinArguments, JoinDevice};
pub(crate) use links::{EcnKind, FitArguments, LinkArguments, Profile};
pub(crate) use pages::{CompletionsArguments, FileKind, InitArguments, ManArguments, SchemaArguments};
pub(crate) use paper::PaperArguments;
pub(crate) use realtime::{ControlFilesArguments, LiveArguments, PaceArguments, PlayArguments, RealTimeArguments, RelayArguments, RouterArguments};
pub(crate) use scenes::{CampaignArguments, CheckArguments, ExplainArguments, MeasureArguments, RunArguments};
pub(crate) use shards::{ShardArguments, ShardName};
pub(crate) use stability::{
    AdmittanceArguments, BoundaryArguments, GridSize, LinksName, MapArguments, PointArguments, RestName, StabilityArguments, StabilityCommand,
};
pub(crate) use study::{StudyArguments, StudyCommand, StudyFolderArguments, StudyForgetArguments, StudyRunArguments};
pub(crate) use tables::{TableArguments, TableFormat};

/// Several people feel and move one virtual object together, over a bad network.
///
/// A scene is one TOML file: the object, the peers, the links between them, and the expected result. docs/reference-keys.md lists every key.
#[derive(Debug, Parser)]
#[command(name = "cohaptic", version, after_help = examples::of_program())]
pub(crate) struct Arguments {
    /// Print nothing but errors on standard error: no progress, and no names of written files
    #[arg(short, long, global = true)]
    pub(crate) quiet: bool,
    #[command(subcommand)]
    pub(crate) command: Command,
}

#[derive(Debug, Subcommand)]
pub(crate) enum Command {
    /// Simulates a scene in virtual time and says what happened
    Run(RunArguments),
    #[command(about = "Runs scenes as tests: each against its own [expect]")]
    Check(CheckArguments),
    /// Lists what the program models for a scene, what it leaves out and why, and what a run costs
    Explain(ExplainArguments),
    /// Runs a scene many times, over values of its keys and over seeds, into one table: on all cores, and resumable
    Campaign(CampaignArguments),
    /// Compares strategies over values of keys and with the same seeds: measures with their intervals, a table and a page
    Compare(CompareArguments),
    /// Says without a simulation whether a scene is stable, maps the stable region, and finds where the verdict changes
    Stability(StabilityArguments),
    /// Says what the hand of one peer feels, frequency by frequency, without simulating it
    Admittance(AdmittanceArguments),
    /// Runs a scene by the wall clock, with other programs and Falcons attached, all through the emulated links
    Live(LiveArguments),
    /// Joins a live session at another computer: one peer of its scene, with a device here
    Join(JoinArguments),
    /// Opens a page on which people pull the object by mouse, finger or stick, and see what the network does to it
    Play(PlayArguments),
    /// Runs a study with people in groups, or with modelled persons: balanced orders, questions, tables, a report, and the power of the design
    Study(StudyArguments),
    /// Puts the emulator between programs that speak UDP to each other, or TCP with --tcp
    Relay(RelayArguments),
    /// Puts the emulator between two network devices: any IP traffic
    Router(RouterArguments),
    /// Runs a program in any language in a network of its own, whose packets pass an emulated link to the real world
    Exec(ExecArguments),
    /// Writes a package that stands in for tokio, so that programs run on the test kit unchanged, with their dependencies
    Tokio(TokioArguments),
    /// Runs cargo test with the package of cohaptic tokio in the place of tokio, and leaves Cargo.lock as it was
    Test(TestArguments),
    /// Looks at a Novint Falcon, homes it, watches and pushes it, or simulates one
    Falcon(FalconArguments),
    /// Looks at a Haply Inverse3, watches and pushes it, or simulates it and its service
    #[command(name = "inverse3")]
    Inverse3(Inverse3Arguments),
    /// Sends a steady stream over one link and compares the result with the configuration
    Link(LinkArguments),
    /// Estimates the link that made a file of measurements, captures or fates
    Fit(FitArguments),
    /// Computes every figure and claim of Rakhsha and Constantinescu (2015) again, and says which hold
    Paper(PaperArguments),
    /// Writes a scene to begin with, in which every key is explained
    Init(InitArguments),
    /// Prints a JSON Schema of scenes, relay files, router files, exec files or study files: names, meanings, units and defaults of all keys, for editors
    Schema(SchemaArguments),
    /// Prints completions for a shell
    Completions(CompletionsArguments),
    /// Prints a manual page, or writes all
    Man(ManArguments),
}

/// Arguments that all commands on one scene take.
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
    /// Override a key of the scene by its dotted path, repeatable: --set coordination.stiffness=1000 --set link.delay=8ms
    /// --set peers.left.contact=none
    #[arg(long = "set", value_name = "KEY=VALUE")]
    pub(crate) set: Vec<String>,
}

#[derive(Debug, Args)]
pub(crate) struct PictureArguments {
    /// The size of pictures: one-column or two-columns of a paper, page, WIDTHxHEIGHT in pixels (960x400) or millimetres (85x60mm) [default: page]
    #[arg(long, value_name = "SIZE", requires = "out")]
    size: Option<NamedSize>,
}

/// A size with the word that named it.
#[derive(Clone, Debug)]
struct NamedSize {
    word: String,
    size: Size,
}

impl std::str::FromStr for NamedSize {
    type Err = SizeError;

    fn from_str(word: &str) -> Result<Self, SizeError> {
        Ok(Self { word: word.to_owned(), size: word.parse()? })
    }
}

impl PictureArguments {
    /// Returns the size of the pictures; the default size without `--size`.
    pub(crate) fn size(&self) -> Size {
        self.size.as_ref().map(|asked| asked.size).unwrap_or_default()
    }

    /// Returns the size as the user wrote it, or `None` without `--size`.
    pub(crate) fn word(&self) -> Option<&str> {
        self.size.as_ref().map(|asked| asked.word.as_str())
    }
}
