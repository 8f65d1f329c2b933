//! Reasons for a campaign to be refused or to end early.

use std::io;
use std::path::PathBuf;

use cohaptic_scene::SceneError;

use crate::shard::Missing;
use crate::vary::VaryError;

/// Why a campaign cannot begin, or why it ended early.
#[derive(Debug, thiserror::Error)]
pub enum CampaignError {
    /// A text does not describe a variation of a key.
    #[error(transparent)]
    Vary(#[from] VaryError),
    /// A key is varied twice.
    #[error("{key} is varied twice: expected different keys, and all values of one in one list")]
    SameKey {
        /// The key.
        key: String,
    },
    /// The number of runs, combinations, parts or compared numbers is zero or too large, or rows do not fit the campaign.
    #[error("{0}")]
    Size(String),
    /// The plan varies the seed, and also asks for several runs per combination, whose seeds count up.
    #[error(
        "scene.seed is varied, and the {runs} runs of each combination have seeds of their own: expected one of both; seeds count up from that of the scene"
    )]
    Seeds {
        /// Number of runs per combination.
        runs: u64,
    },
    /// The scene is refused with the values of one combination.
    #[error("{error}")]
    Scene {
        /// The fault in the scene, and its place.
        error: Box<SceneError>,
        /// Overrides of the combination, as texts `KEY=VALUE`.
        varied: Vec<String>,
    },
    /// The scene of one combination can be read but not be run.
    #[error("{message}")]
    NotRun {
        /// The reason.
        message: String,
        /// Overrides of the combination, as texts `KEY=VALUE`.
        varied: Vec<String>,
    },
    /// The path names something other than a folder.
    #[error("{} is not a folder: expected a folder for the campaign, which need not exist yet", path.display())]
    NoFolder {
        /// The path.
        path: PathBuf,
    },
    /// The folder holds files but no campaign.
    #[error("{} holds files, {found} among them, and no campaign: expected a folder of its own for the campaign, which need not exist yet", path.display())]
    Foreign {
        /// The folder.
        path: PathBuf,
        /// The first foreign file by name.
        found: String,
    },
    /// The folder holds another campaign.
    #[error("{} holds another campaign: {}.\nRepeat the command that began it to go on there, or give this one a folder of its own", path.display(), differences.join("; "))]
    Other {
        /// The folder.
        path: PathBuf,
        /// The differences between the two campaigns, in words.
        differences: Vec<String>,
    },
    /// A file of the campaign is not as it was written.
    #[error("{} is not as a campaign writes it ({message}): {way_out}", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// The fault.
        message: String,
        /// Advice to the user.
        way_out: &'static str,
    },
    /// Another process works on the folder.
    #[error("another process works on the campaign in {}: wait until it has ended, or choose another folder", path.display())]
    Busy {
        /// The folder.
        path: PathBuf,
    },
    /// Workers do shards of the campaign in the folder.
    #[error(
        "{worker} works on the campaign in {}, {shard}, and renewed that {age_s} s ago: expected no worker there; wait for the shards and merge them, or choose another folder",
        path.display()
    )]
    Shards {
        /// The folder.
        path: PathBuf,
        /// Owner of the lock: one of the workers.
        worker: String,
        /// The shard of that worker.
        shard: String,
        /// Time since that worker last renewed its lock \[s\].
        age_s: u64,
    },
    /// The folder holds no campaign.
    #[error("{} holds no campaign: expected a folder in which shards were run", path.display())]
    NoCampaign {
        /// The folder.
        path: PathBuf,
    },
    /// Parts of the campaign are not done, so there is no table.
    #[error("{} is not complete: {missing}", path.display())]
    Missing {
        /// The folder.
        path: PathBuf,
        /// The missing parts.
        missing: Missing,
    },
    /// A file cannot be read or written. Finished parts are kept.
    #[error("cannot {verb} {}: {error}", path.display())]
    File {
        /// The refused operation, such as `read` or `write`.
        verb: &'static str,
        /// The file.
        path: PathBuf,
        /// The error of the operating system.
        error: io::Error,
    },
    /// The plan has verdicts, and not every combination is judged.
    #[error("the combinations of this campaign are not judged yet: expected Campaign::judge before Campaign::run")]
    NotJudged,
    /// The watch stopped the check of the combinations: nothing is written yet.
    #[error("ended while the combinations were checked: nothing is written")]
    Stopped,
}

impl CampaignError {
    /// Returns `true` if the state of the system or of its files is the cause, `false` if the input makes no sense.
    #[must_use]
    pub fn is_io(&self) -> bool {
        match self {
            Self::File { .. } | Self::Busy { .. } | Self::Shards { .. } | Self::Missing { .. } | Self::Damaged { .. } => true,
            Self::Scene { error, .. } => error.is_io(),
            Self::Vary(_)
            | Self::SameKey { .. }
            | Self::Size(_)
            | Self::Seeds { .. }
            | Self::NotRun { .. }
            | Self::NoFolder { .. }
            | Self::NoCampaign { .. }
            | Self::Foreign { .. }
            | Self::Other { .. }
            | Self::NotJudged
            | Self::Stopped => false,
        }
    }
}
