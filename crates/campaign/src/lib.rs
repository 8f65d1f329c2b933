//! Many runs of one scene: keys varied over ranges and lists, seeds counted up, on all threads, kept in parts so that a campaign can be stopped anywhere and
//! continued, and put together as one table.
//!
//! Use this crate if you run one scene many times from Rust, over values of its keys and over seeds.
//!
//! A [`CampaignPlan`] is a scene, keys that are [varied](Variation), and how many runs there are of each combination. [`Campaign::open`] checks all
//! of it before anything is written, and binds it to a folder; [`Campaign::run`] does the runs that are missing. The table is the same to the last byte
//! whatever the number of threads and however often it was interrupted, by Ctrl-C, a full disk or the loss of power.
//!
//! Every run is the run that [`cohaptic_harness::Simulation`] makes of the same scene with the same seed, to the last bit.
//!
//! A plan [with verdicts](CampaignPlan::with_verdicts) has each combination judged once, by a [`Judge`] that its caller brings, before anything runs.
//!
//! A campaign over [`Strategies`] is [compared](Campaign::compare): the mean of every measure for each strategy, its difference to the first one seed by seed, and
//! intervals of both. Combinations that a strategy refuses are [left out](CampaignPlan::leaving_out), and known before anything runs.
//!
//! Each part is kept with its SHA-256, its number and the campaign that it belongs to, and checked before a campaign goes on from it: a damaged part is
//! [named](Watch::damaged) and computed again.
//!
//! A [`Shard`] of a campaign is done in the same folder by each of several processes, on any machines that share it ([`SharedCampaign`]);
//! [`Campaign::open_whole`] then puts the table together, to the same bytes.
//!
//! Nothing here is printed and no clock is read.
//!
//! ```
//! use cohaptic_campaign::{PlanSpec, Campaign, Format, NoWatch, Outcome, CampaignPlan, Variation};
//!
//! let text = r#"
//!     scene = { duration = "100ms", count = 2 }
//!     object = { mass = 0.45 }
//!     coordination = { strategy = "average-position", stiffness = 1000.0, damping = 5.0, update = "8ms" }
//!     peer = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
//!     link = { delay = "24ms", loss = "10%" }
//! "#;
//! let folder = tempfile::tempdir()?;
//! let variations = vec![Variation::parse("coordination.stiffness=500..1500/3")?];
//! let spec = PlanSpec { text, file: "two.toml".as_ref(), set: &[], variations, runs: 10, format: Format::Csv, part: None, program: "an example" };
//! let mut campaign = Campaign::open(CampaignPlan::new(spec)?, &folder.path().join("out"), &NoWatch)?;
//! let Outcome::Finished(report) = campaign.run(&NoWatch)? else { unreachable!() };
//! assert_eq!((report.combinations.len(), report.runs), (3, 30));
//! # Ok::<(), Box<dyn std::error::Error>>(())
//! ```

mod campaign;
mod compare;
mod error;
mod folder;
mod kept;
mod plan;
mod report;
mod shard;
mod shared;
mod spread;
mod table;
mod vary;
mod verdicts;
mod work;

pub use campaign::{Campaign, NoWatch, Outcome, Watch};
pub use compare::{Cell, Comparison, Estimate, Figures, MOST_NUMBERS_COMPARED, MeasuredColumn, Share, Strategies, StrategiesError};
pub use error::CampaignError;
pub use plan::{CampaignPlan, MOST_COMBINATIONS, MOST_RUNS, PlanSpec, Refused};
pub use report::{CombinationReport, MOST_COMBINATIONS_OF_QUANTILES, MOST_RUNS_OF_QUANTILES, Quantiles, Report};
pub use shard::{Missing, Shard, ShardError, is_log, worker_log};
pub use shared::{PartState, ShardReport, SharedCampaign};
pub use spread::SpreadCampaign;
pub use table::{Column, Format, Kind, Row, Value};
pub use vary::{MOST_VALUES, Variation, VaryError, split_at_commas};
pub use verdicts::{Judge, Judgement, Verdict};
