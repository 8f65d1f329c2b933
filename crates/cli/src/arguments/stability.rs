//! `stability` and `admittance`.

use std::num::NonZeroUsize;
use std::path::PathBuf;
use std::time::Duration;

use clap::{Args, Subcommand, ValueEnum};
use cohaptic_stability::{Method, PushedAxis};

use super::examples::{self, after};
use super::numbers::{any_integer, integer, memory, real, some, threads};
use super::{PictureArguments, SceneArguments, ShardArguments};

#[derive(Debug, Args)]
#[command(after_help = after(examples::STABILITY))]
pub(crate) struct StabilityArguments {
    #[command(subcommand)]
    pub(crate) command: StabilityCommand,
}

#[derive(Debug, Subcommand)]
pub(crate) enum StabilityCommand {
    /// Judges the scene as it stands; cohaptic stability FILE is short for this
    Point(PointArguments),
    /// Maps where the scene is stable, over two keys
    Map(MapArguments),
    /// Finds where the scene becomes stable and unstable along one key
    Boundary(BoundaryArguments),
}

#[derive(Debug, Args)]
#[command(after_help = after(examples::POINT))]
pub(crate) struct PointArguments {
    #[command(flatten)]
    pub(crate) scene: SceneArguments,
    /// Method of the analysis: equal peers together; long delays as roots of a determinant too (chosen anyway where it pays); or the whole state
    /// pushed through the code that simulates
    #[arg(long, value_enum, default_value_t = MethodName::Reduced)]
    pub(crate) method: MethodName,
    /// Analyse small motions about this state: rest without forces; for an object that turns, rest under constant forces of the hands, or the steady
    /// spin under their constant torques about one axis
    #[arg(long, value_enum, value_name = "REST", default_value_t = RestName::Unloaded, conflicts_with_all = ["graph", "losses_in_a_row", "delay_within"])]
    pub(crate) about: RestName,
    /// Let each of equal peers hear only its neighbours: complete (as the scene is), ring, star, or a CSV file of mutual weights, one row per peer
    #[arg(long, value_name = "GRAPH", conflicts_with_all = ["method", "losses_in_a_row", "delay_within"])]
    pub(crate) graph: Option<String>,
    /// Also prove the verdict for every number of equal peers from 2 on, or FROM.., or FROM..TO
    #[arg(long, value_name = "FROM..TO", num_args = 0..=1, default_missing_value = "2..", value_parser = numbers, conflicts_with_all = ["graph", "method", "about"])]
    pub(crate) every_number: Option<(u64, Option<u64>)>,
    /// With --every-number or --switching, write a file with which a checker confirms the verdicts
    #[arg(long, value_name = "FILE")]
    pub(crate) certificate: Option<PathBuf>,
    /// Prove that the scene is stable however its one-sided contacts and walls open and close, or find a motion that grows
    #[arg(long, conflicts_with_all = ["graph", "method", "about"])]
    pub(crate) switching: bool,
    /// Also judge the worst case with at most this number of samples lost in a row
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = integer::<u32>(0, u32::MAX.into()))]
    pub(crate) losses_in_a_row: Option<u32>,
    /// Also judge the worst case in which every sample takes any time from LO to HI, such as 20ms..26ms
    #[arg(long, value_name = "LO..HI", value_parser = delays)]
    pub(crate) delay_within: Option<(Duration, Duration)>,
    /// In the worst case, whether all links lose and delay together, or each on its own
    #[arg(long, value_enum, value_name = "WHICH", default_value_t = LinksName::Together)]
    pub(crate) links: LinksName,
    /// Largest distance between the bounds of the worst case
    #[arg(long, value_name = "DISTANCE", value_parser = real, default_value_t = 1e-3)]
    pub(crate) accuracy: f64,
    /// Largest number of products of matrices in the search for the worst case
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = any_integer, default_value_t = 100_000)]
    pub(crate) products: u64,
    /// Memory limit of the matrices of a part of the scene; larger parts are refused before they are begun
    #[arg(long, value_name = "SIZE", value_parser = memory, default_value = "8GiB")]
    pub(crate) memory: u64,
}

/// Along or about which axis a device is pushed.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub(crate) enum AxisName {
    X,
    Y,
    Z,
    Rx,
    Ry,
    Rz,
}

impl From<AxisName> for PushedAxis {
    fn from(axis: AxisName) -> Self {
        match axis {
            AxisName::X => Self::X,
            AxisName::Y => Self::Y,
            AxisName::Z => Self::Z,
            AxisName::Rx => Self::Rx,
            AxisName::Ry => Self::Ry,
            AxisName::Rz => Self::Rz,
        }
    }
}

/// Which motion small motions are about.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub(crate) enum RestName {
    Unloaded,
    Loaded,
    Spinning,
}

/// Which links share their fate.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub(crate) enum LinksName {
    Together,
    Each,
}

/// Reads two durations in the form `20ms..26ms`. The first may not exceed the second.
fn delays(text: &str) -> Result<(Duration, Duration), String> {
    let (low, high) = text.split_once("..").ok_or("expected LO..HI, such as 20ms..26ms")?;
    let parse = |text: &str| cohaptic_units::parse::duration(text.trim()).map_err(|error| error.to_string());
    let (low, high) = (parse(low)?, parse(high)?);
    if low <= high { Ok((low, high)) } else { Err("expected the shorter delay first, such as 20ms..26ms".to_owned()) }
}

/// Numbers of peers, as `2..` or `2..100`.
fn numbers(text: &str) -> Result<(u64, Option<u64>), String> {
    let expected = || "expected FROM.. or FROM..TO, such as 2.. or 2..100".to_owned();
    let number = |text: &str| text.trim().parse::<u64>().map_err(|_| expected());
    let (from, to) = text.split_once("..").ok_or_else(expected)?;
    let (from, to) = (number(from)?, if to.trim().is_empty() { None } else { Some(number(to)?) });
    if from < 2 {
        return Err("a scene has at least 2 peers".to_owned());
    }
    if to.is_some_and(|to| to < from) { Err("expected the smaller number first, such as 2..10".to_owned()) } else { Ok((from, to)) }
}

/// Method by which a verdict is reached.
#[derive(Clone, Copy, PartialEq, Eq, Debug, ValueEnum)]
pub(crate) enum MethodName {
    Reduced,
    Determinant,
    Full,
}

impl From<MethodName> for Method {
    fn from(name: MethodName) -> Self {
        match name {
            MethodName::Reduced => Self::Reduced,
            MethodName::Determinant => Self::Determinant,
            MethodName::Full => Self::Full,
        }
    }
}

#[derive(Debug, Args)]
#[command(after_help = after(examples::MAP))]
pub(crate) struct MapArguments {
    #[command(flatten)]
    pub(crate) scene: SceneArguments,
    /// Key along the horizontal axis, with its range: --x coordination.stiffness=0..6000
    #[arg(long, value_name = "KEY=LO..HI")]
    pub(crate) x: String,
    /// Key along the vertical axis, with its range: --y coordination.damping=0..50
    #[arg(long, value_name = "KEY=LO..HI")]
    pub(crate) y: String,
    /// Number of values along each axis, the ends among them
    #[arg(long, value_name = "WxH", value_parser = GridSize::parse, required_unless_present = "prove")]
    pub(crate) grid: Option<GridSize>,
    /// In place of a grid, prove boxes of gains, masses, dampings or a delay stable or unstable throughout; sides are halved at most this number of
    /// times
    #[arg(long, value_name = "HALVINGS", num_args = 0..=1, default_missing_value = "8", conflicts_with = "grid", value_parser = integer::<u32>(0, cohaptic_proofs::MOST_HALVINGS.into()))]
    pub(crate) prove: Option<u32>,
    /// With --prove, for every number of equal peers from 2 on, or FROM.., or FROM..TO
    #[arg(long, value_name = "FROM..TO", num_args = 0..=1, default_missing_value = "2..", value_parser = numbers, requires = "prove", conflicts_with = "grid")]
    pub(crate) every_number: Option<(u64, Option<u64>)>,
    /// With --prove, also write certificate.json for each map into the folder of --out: some 15 kB per box
    #[arg(long, requires = "prove", requires = "out")]
    pub(crate) certificate: bool,
    /// Draw another map into the same picture, with these keys overridden too, repeatable:
    /// --curve scene.count=3,coordination.strategy=proportional-derivative
    #[arg(long, value_name = "KEY=VALUE,...")]
    pub(crate) curve: Vec<String>,
    /// Draw one more map into the same picture, with this key overridden too; all --against together make one map
    #[arg(long, value_name = "KEY=VALUE")]
    pub(crate) against: Vec<String>,
    /// Write map.csv, map-2.csv ..., map.svg and map.html, a page of all, into this folder, and keep the finished part there if it is interrupted
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) shards: ShardArguments,
    #[command(flatten)]
    pub(crate) pictures: PictureArguments,
    /// Number of cells computed at the same time [default: one per core]. Results do not depend on it
    #[arg(long, value_name = "N", visible_alias = "jobs", allow_negative_numbers = true, value_parser = threads)]
    pub(crate) threads: Option<u16>,
}

#[derive(Debug, Args)]
#[command(after_help = after(examples::BOUNDARY))]
pub(crate) struct BoundaryArguments {
    #[command(flatten)]
    pub(crate) scene: SceneArguments,
    /// Key along which to search, with its range: --along coordination.stiffness=0..6000
    #[arg(long, value_name = "KEY=LO..HI")]
    pub(crate) along: String,
    /// Tolerance of a crossing, in the unit of the key [default: a billionth of the range; in the mean square a ten-millionth]
    #[arg(long, value_name = "T", value_parser = real, allow_negative_numbers = true)]
    pub(crate) tolerance: Option<f64>,
    /// Prove which stretches of a gain, mass, damping or delay are stable or unstable, and enclose every crossing
    #[arg(long, conflicts_with = "samples")]
    pub(crate) prove: bool,
    /// With --prove, write certificate.json into the folder of --out too
    #[arg(long, requires = "prove", requires = "out")]
    pub(crate) certificate: bool,
    /// Number of values checked first, the ends among them [default: 400]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = integer::<usize>(0, u64::MAX))]
    pub(crate) samples: Option<usize>,
    /// Largest number of values to check; an answer that would need more says that it is not settled
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = integer::<usize>(2, u64::MAX), default_value_t = BoundaryArguments::VALUES, conflicts_with = "prove")]
    pub(crate) values: usize,
    /// Write boundary.csv, samples.csv, boundary.svg and boundary.html, a page of all, into this folder, and keep the finished part there if it is
    /// interrupted
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) shards: ShardArguments,
    #[command(flatten)]
    pub(crate) pictures: PictureArguments,
}

impl BoundaryArguments {
    /// Default of the largest number of values to check.
    pub(crate) const VALUES: usize = 100_000;
}

/// Number of cells of a map along each axis.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct GridSize {
    pub(crate) width: usize,
    pub(crate) height: usize,
}

impl GridSize {
    /// More cells than this are refused: their radii alone would fill the memory of a small machine.
    pub(crate) const MOST_CELLS: usize = 10_000_000;

    fn parse(text: &str) -> Result<Self, String> {
        let expected = || "expected WIDTHxHEIGHT, such as 60x40".to_owned();
        let (width, height) = text.split_once(['x', 'X']).ok_or_else(expected)?;
        let [width, height] = [width, height].map(|side| side.trim().parse::<usize>());
        let (width, height) = (width.map_err(|_| expected())?, height.map_err(|_| expected())?);
        if width < 2 || height < 2 {
            return Err("a map has two sides of each axis: expected at least 2x2".to_owned());
        }
        if width.checked_mul(height).is_none_or(|cells| cells > Self::MOST_CELLS) {
            return Err(format!("too many cells: expected at most {}", Self::MOST_CELLS));
        }
        Ok(Self { width, height })
    }
}

impl std::fmt::Display for GridSize {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        write!(f, "{}x{}", self.width, self.height)
    }
}

#[derive(Debug, Args)]
#[command(after_help = after(examples::ADMITTANCE))]
pub(crate) struct AdmittanceArguments {
    #[command(flatten)]
    pub(crate) scene: SceneArguments,
    /// Peer whose device is pushed
    #[arg(long, value_name = "PEER")]
    pub(crate) peer: String,
    /// Axis of the push, or of the twist of a device that turns [default: that of its own one-sided contact, or x]
    #[arg(long, value_enum, value_name = "AXIS")]
    pub(crate) axis: Option<AxisName>,
    /// Axis of the observed motion, along or about it, if the object turns [default: that of the push]
    #[arg(long, value_enum, value_name = "AXIS")]
    pub(crate) seen: Option<AxisName>,
    /// Lowest frequency, in Hz [default: 0.01]
    #[arg(long, value_name = "HZ", value_parser = real, allow_negative_numbers = true)]
    pub(crate) from: Option<f64>,
    /// Highest frequency in Hz, at most half the rate of the peer's ticks [default: 100, or that]
    #[arg(long, value_name = "HZ", value_parser = real, allow_negative_numbers = true)]
    pub(crate) to: Option<f64>,
    /// Number of frequencies from the lowest to the highest, in equal ratios [default: 60]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = some)]
    pub(crate) points: Option<NonZeroUsize>,
    /// Compute these frequencies, in Hz, instead: --at 0.01,1,10
    #[arg(long, value_name = "HZ,...", value_parser = real, value_delimiter = ',', allow_negative_numbers = true, conflicts_with_all = ["from", "to", "points"])]
    pub(crate) at: Vec<f64>,
    /// Draw another curve, with these keys overridden too, repeatable:
    /// --curve scene.count=3,coordination.strategy=proportional-derivative
    #[arg(long, value_name = "KEY=VALUE,...")]
    pub(crate) curve: Vec<String>,
    /// Memory limit of the matrices of a part of the scene; larger parts are refused before they are begun
    #[arg(long, value_name = "SIZE", value_parser = memory, default_value = "8GiB")]
    pub(crate) memory: u64,
    /// Write admittance.csv, a Bode plot, admittance.svg, and admittance.html, a page of all, into this folder
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) pictures: PictureArguments,
}
