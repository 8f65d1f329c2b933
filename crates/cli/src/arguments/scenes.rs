//! `run`, `check`, `explain` and `campaign`.

use std::path::PathBuf;

use clap::Args;

use super::examples::{self, after};
use super::numbers::{any_integer, integer, threads};
use super::{Overrides, PictureArguments, SceneArguments, ShardArguments, TableArguments};

#[derive(Debug, Args)]
#[command(after_help = after(examples::RUN))]
pub(crate) struct RunArguments {
    #[command(flatten)]
    pub(crate) scene: SceneArguments,
    /// Seed of all random numbers, in place of the key scene.seed [default: that of the scene]
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = integer::<u64>(0, i64::MAX.unsigned_abs()))]
    pub(crate) seed: Option<u64>,
    /// Run the scene a second time with these keys overridden too, with the same random numbers, and show both:
    /// --against coordination.strategy=proportional-derivative
    #[arg(long, value_name = "KEY=VALUE")]
    pub(crate) against: Vec<String>,
    #[command(flatten)]
    pub(crate) measure: MeasureArguments,
    /// Write trajectory.csv, packets.csv, links.csv, plots (SVG) and run.html, a page of all, into this folder; the second run into its folder against
    #[arg(long, value_name = "DIR")]
    pub(crate) out: Option<PathBuf>,
    /// Write one row per link, as in links.csv of --out, into this file or pipe: all links, also where there are more than 1,000
    #[arg(long, value_name = "FILE", conflicts_with = "against")]
    pub(crate) links: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) pictures: PictureArguments,
    /// Draw the copies in motion into this file, an SVG that moves; with --against those of both runs
    #[arg(long, value_name = "FILE")]
    pub(crate) motion: Option<PathBuf>,
    /// Replay a live session: its inputs.csv, with its scene and its --set. Fates and motion are the same to the bit
    #[arg(long, value_name = "FILE", conflicts_with_all = ["against", "general"])]
    pub(crate) inputs: Option<PathBuf>,
    /// Replay even if the scene or its --set are not those of the session, or the record is cut short, and say what differs
    #[arg(long, requires = "inputs")]
    pub(crate) force: bool,
    /// Do not draw positions in the terminal, and do not write run.html. Without --out only counters are kept then, which is fastest
    #[arg(long)]
    pub(crate) no_plot: bool,
    /// Number of threads that share an unobserved run where that pays, as explain says [default: one per core]. Results do not depend on it
    #[arg(long, value_name = "N", visible_alias = "jobs", allow_negative_numbers = true, value_parser = threads)]
    pub(crate) threads: Option<u16>,
    /// Simulate everything the program has, needed or not: slower, and the same answer to the last bit
    #[arg(long)]
    pub(crate) general: bool,
}

#[derive(Debug, Args)]
#[command(after_help = after(examples::CHECK))]
pub(crate) struct CheckArguments {
    /// Scenes, or folders of scenes; - reads a scene from standard input
    #[arg(required = true, value_name = "SCENE")]
    pub(crate) scenes: Vec<PathBuf>,
    #[command(flatten)]
    pub(crate) overrides: Overrides,
    /// Print one JSON document and nothing else
    #[arg(long)]
    pub(crate) json: bool,
    /// Write one page (HTML) into this file: each expectation with its result, as numbers and as a bar
    #[arg(long, value_name = "FILE")]
    pub(crate) page: Option<PathBuf>,
    /// Number of scenes that run at the same time [default: one per core]. Results do not depend on it
    #[arg(long, value_name = "N", visible_alias = "jobs", allow_negative_numbers = true, value_parser = threads)]
    pub(crate) threads: Option<u16>,
    /// Simulate everything the program has, needed or not: slower, and the same answer to the last bit
    #[arg(long)]
    pub(crate) general: bool,
}

#[derive(Debug, Args)]
#[command(after_help = after(examples::EXPLAIN))]
pub(crate) struct ExplainArguments {
    #[command(flatten)]
    pub(crate) scene: SceneArguments,
    /// Also measure the cost and the error of each method that the scene can choose: engines, axes, integrators, sampling, analysis. Takes a second or two
    #[arg(long)]
    pub(crate) cost: bool,
    /// With --cost, draw costs against errors (cost.svg) into this folder
    #[arg(long, value_name = "DIR", requires = "cost")]
    pub(crate) out: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) pictures: PictureArguments,
}

#[derive(Debug, Args)]
#[command(after_help = after(examples::CAMPAIGN))]
pub(crate) struct CampaignArguments {
    /// The scene, a TOML file; - reads it from standard input. With --merge and --status it may be left out: the folder knows its campaign
    #[arg(required_unless_present_any = ["merge", "status"])]
    pub(crate) scene: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) overrides: Overrides,
    /// Print one JSON document and nothing else
    #[arg(long)]
    pub(crate) json: bool,
    /// Vary a key: --vary coordination.stiffness=0..6000/13 (13 values, both ends among them), --vary coordination.stiffness=10..1000/5:log (equal ratios),
    /// --vary link.delay=8ms,24ms (these values). Repeatable: every combination is run, the last key varying fastest
    #[arg(long, value_name = "KEY=VALUES")]
    pub(crate) vary: Vec<String>,
    /// Number of runs of each combination: with the seed of the scene, with the next seed, and so on
    #[arg(long, value_name = "N", allow_negative_numbers = true, value_parser = any_integer, default_value_t = 1)]
    pub(crate) runs: u64,
    #[command(flatten)]
    pub(crate) measure: MeasureArguments,
    /// Folder of the campaign: the table, pictures and campaign.html, a page of all, and until the table is complete its parts. Repeat the command to go on
    /// from there
    #[arg(long, value_name = "DIR", required_unless_present_any = ["merge", "status"])]
    pub(crate) out: Option<PathBuf>,
    #[command(flatten)]
    pub(crate) shards: ShardArguments,
    /// Judge each combination as stability point does, and write the verdict into the rows of its runs
    #[arg(long)]
    pub(crate) verdicts: bool,
    #[command(flatten)]
    pub(crate) table: TableArguments,
    /// Do not draw pictures, and do not write campaign.html
    #[arg(long)]
    pub(crate) no_plot: bool,
    #[command(flatten)]
    pub(crate) pictures: PictureArguments,
}

#[derive(Debug, Args)]
pub(crate) struct MeasureArguments {
    /// Measure all, or the measures with these names: --measure energy_j,travel_s. In place of the key measure.names; docs/scenes.md lists them
    #[arg(long, value_name = "all|NAMES")]
    measure: Option<String>,
}

impl MeasureArguments {
    /// Returns the arguments that `--measure all` gives.
    pub(crate) fn all() -> Self {
        Self { measure: Some("all".to_owned()) }
    }

    /// Returns the value of `--measure` as the user wrote it; `None` without `--measure`.
    pub(crate) fn word(&self) -> Option<&str> {
        self.measure.as_deref()
    }

    /// As an override of the scene.
    pub(crate) fn override_text(&self) -> Option<String> {
        let names = self.measure.as_deref()?.trim();
        let name = |name: &str| serde_json::Value::from(name.trim()).to_string();
        let value = if names == "all" { name(names) } else { format!("[{}]", names.split(',').map(name).collect::<Vec<_>>().join(", ")) };
        Some(format!("measure.names={value}"))
    }
}
