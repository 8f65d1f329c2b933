//! Why there is no campaign, or why it ended.

use std::io;
use std::path::PathBuf;

use cohaptic_scene::SceneError;

use crate::shard::Missing;
use crate::vary::VaryError;

/// Why there is no campaign, or why it ended.
#[derive(Debug, thiserror::Error)]
pub enum CampaignError {
    /// A text does not vary a key.
    #[error(transparent)]
    Vary(#[from] VaryError),
    /// A key is varied twice.
    #[error("{key} is varied twice: expected different keys, and all values of one in one list")]
    SameKey {
        /// The key.
        key: String,
    },
    /// No runs, or too many.
    #[error("{0}")]
    Size(String),
    /// The seeds of the runs are more than one thing.
    #[error(
        "scene.seed is varied, and the {runs} runs of each combination have seeds of their own: expected one of both; seeds count up from that of the scene"
    )]
    Seeds {
        /// How many runs of each combination.
        runs: u64,
    },
    /// The scene is refused with the values of one combination.
    #[error("{error}")]
    Scene {
        /// Why, and where.
        error: Box<SceneError>,
        /// What the combination puts into the scene: texts `KEY=VALUE`.
        varied: Vec<String>,
    },
    /// The scene of one combination can be read and not be run.
    #[error("{message}")]
    NotRun {
        /// Why.
        message: String,
        /// What the combination puts into the scene.
        varied: Vec<String>,
    },
    /// There is something else than a folder.
    #[error("{} is no folder: expected one for the campaign, which need not exist yet", path.display())]
    NoFolder {
        /// The name of the thing found there.
        path: PathBuf,
    },
    /// The folder holds files and no campaign.
    #[error("{} holds files, {found} among them, and no campaign: expected a folder of its own for the campaign, which need not exist yet", path.display())]
    Foreign {
        /// The folder.
        path: PathBuf,
        /// The first of the files by name.
        found: String,
    },
    /// The folder holds another campaign.
    #[error("{} holds another campaign: {}.\nRepeat the command that began it to go on there, or give this one a folder of its own", path.display(), differences.join("; "))]
    Other {
        /// The folder.
        path: PathBuf,
        /// The differences, in words.
        differences: Vec<String>,
    },
    /// What the folder holds is not as it was written.
    #[error("{} is not as a campaign writes it ({message}): {way_out}", path.display())]
    Damaged {
        /// The file.
        path: PathBuf,
        /// The fault.
        message: String,
        /// What helps.
        way_out: &'static str,
    },
    /// Another process works on the folder.
    #[error("another process works on the campaign in {}: expected to be the only one; wait for it, or choose another folder", path.display())]
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
        /// One of the workers.
        worker: String,
        /// Its shard.
        shard: String,
        /// How long ago it renewed its lock \[s\].
        age_s: u64,
    },
    /// The folder holds no campaign.
    #[error("{} holds no campaign: expected the folder in which shards of it were done", path.display())]
    NoCampaign {
        /// The folder.
        path: PathBuf,
    },
    /// Parts of the campaign are not done, so there is no table.
    #[error("{} is not whole: {missing}", path.display())]
    Missing {
        /// The folder.
        path: PathBuf,
        /// The parts that are missing.
        missing: Missing,
    },
    /// A file cannot be read or written. Finished parts are kept.
    #[error("cannot {verb} {}: {error}", path.display())]
    File {
        /// What cannot be done to it.
        verb: &'static str,
        /// The file.
        path: PathBuf,
        /// Why.
        error: io::Error,
    },
    /// Verdicts are asked for and not known.
    #[error("the combinations of this campaign are not judged yet: expected Campaign::judge before Campaign::run")]
    NotJudged,
    /// It was ended while the combinations were checked: nothing is written yet.
    #[error("ended while the combinations were checked: nothing is written")]
    Stopped,
}

impl CampaignError {
    /// Whether the system refuses something, as opposed to input that makes no sense.
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
