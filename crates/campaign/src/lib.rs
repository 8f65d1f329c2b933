//! Campaigns: many runs of one scene, over varied values of its keys and over consecutive seeds.
//!
//! Use this crate if you run one scene many times from Rust, over values of its keys and over seeds.
//!
//! A [`CampaignPlan`] is a scene, keys to [vary](Variation), and the number of runs per combination of values. [`Campaign::open`] checks every combination
//! before it writes anything, and binds the plan to a folder; [`Campaign::run`] does the missing runs on all threads. Finished parts stay in the folder, so a
//! campaign can be stopped at any time and continued later. The bytes of the table depend neither on the number of threads nor on interruptions by Ctrl-C, a
//! full disk or a loss of power.
//!
//! Every run equals, to the last bit, the run of [`cohaptic_harness::Simulation`] over the same scene with the same seed.
//!
//! A plan [with verdicts](CampaignPlan::with_verdicts) lets a [`Judge`] of the caller judge each combination once, before the first run.
//!
//! A campaign over [`Strategies`] can be [compared](Campaign::compare): the mean of every measure per strategy, the difference to the first strategy seed by
//! seed, and the intervals of both. The combinations refused by a strategy are [left out](CampaignPlan::leaving_out), and are known before the first run.
//!
//! Each part is stored with a digest: its SHA-256, its number and its campaign. A continued campaign checks every part against the digest; the watch is
//! [told](Watch::damaged) of a damaged part, and the part is computed again.
//!
//! Several processes, on any machines with a shared folder, can each do a [`Shard`] of one campaign ([`SharedCampaign`]); [`Campaign::open_whole`] then merges
//! the parts into a table with the same bytes.
//!
//! The crate prints nothing and reads no clock.
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
mod judgement;
mod kept;
mod plan;
mod report;
mod shard;
mod shared;
mod spread;
mod table;
mod value;
mod vary;
mod verdicts;
mod watch;
mod work;

pub use campaign::{Campaign, Outcome};
pub use compare::{Cell, Comparison, Estimate, Figures, MOST_NUMBERS_COMPARED, MeasuredColumn, Share, Strategies, StrategiesError};
pub use error::CampaignError;
pub use judgement::{Judgement, Verdict};
pub use plan::{CampaignPlan, MOST_COMBINATIONS, PlanSpec, Refused};
pub use report::{CombinationReport, MOST_COMBINATIONS_OF_QUANTILES, MOST_RUNS_OF_QUANTILES, Quantiles, Report};
pub use shard::{Missing, Shard, ShardError, is_log, worker_log};
pub use shared::{FolderState, PartState, ShardReport, SharedCampaign};
pub use spread::SpreadCampaign;
pub use table::{Column, Format, Row, write_table};
pub use value::{Kind, Value};
pub use vary::{Variation, VaryError, split_at_commas};
pub use verdicts::Judge;
pub use watch::{NoWatch, Watch};
