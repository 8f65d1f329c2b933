//! The folder of a campaign: which files there are, and in which order they come and go.
//!
//! ```text
//! campaign.lock            as long as somebody works on it
//! campaign.json            what the campaign is; the first file with its own name
//! verdicts.part.csv        judgements, as long as not all are known
//! verdicts.csv             all judgements
//! stability.part.csv       judgements of a campaign whose table has none
//! stability.csv
//! part-00000.parquet …     whole parts
//! runs.parquet             the table; the parts go when it is there
//! ```

mod lock;
mod manifest;

use std::collections::BTreeSet;
use std::io;
use std::path::{Path, PathBuf};

use crate::error::CampaignError;
use crate::table::Format;

pub(crate) use manifest::Manifest;

use lock::Lock;

const MANIFEST: &str = "campaign.json";
const LOCK: &str = "campaign.lock";

/// A folder that this process alone works on, as long as this value lives.
#[derive(Debug)]
pub(crate) struct Folder {
    path: PathBuf,
    lock: Lock,
    /// Whether it was made for this campaign.
    is_new: bool,
}

impl Folder {
    /// Whether there is a campaign in a folder, looked at without changing anything.
    ///
    /// # Errors
    ///
    /// If something else is there: a file, or a folder with files of others.
    pub(crate) fn has_campaign(path: &Path) -> Result<bool, CampaignError> {
        let unreadable = |error| CampaignError::File { verb: "read", path: path.to_path_buf(), error };
        match std::fs::metadata(path) {
            Ok(metadata) if metadata.is_dir() => {}
            Ok(_) => return Err(CampaignError::NoFolder { path: path.to_path_buf() }),
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(false),
            Err(error) if error.kind() == io::ErrorKind::NotADirectory => return Err(CampaignError::NoFolder { path: path.to_path_buf() }),
            Err(error) => return Err(unreadable(error)),
        }
        let mut others = BTreeSet::new();
        for entry in std::fs::read_dir(path).map_err(unreadable)? {
            let name = entry.map_err(unreadable)?.file_name();
            if name == MANIFEST {
                return Ok(true);
            }
            // What a campaign leaves that was killed before it had a manifest.
            if name != LOCK && name != cohaptic_files::partial_name(MANIFEST.as_ref()) {
                others.insert(name);
            }
        }
        match others.pop_first() {
            Some(found) => Err(CampaignError::Foreign { path: path.to_path_buf(), found: found.to_string_lossy().into_owned() }),
            None => Ok(false),
        }
    }

    /// Makes the folder if there is none, and locks it.
    pub(crate) fn take(path: &Path) -> Result<Self, CampaignError> {
        let is_new = !path.exists();
        std::fs::create_dir_all(path).map_err(|error| CampaignError::File { verb: "make the folder", path: path.to_path_buf(), error })?;
        let file = path.join(LOCK);
        match Lock::take(&file) {
            Ok(Some(lock)) => Ok(Self { path: path.to_path_buf(), lock, is_new }),
            Ok(None) => Err(CampaignError::Busy { path: path.to_path_buf() }),
            Err(error) => Err(CampaignError::File { verb: "lock", path: file, error }),
        }
    }

    /// Leaves nothing behind where nothing could be written.
    pub(crate) fn give_up(self) {
        let Self { path, lock, is_new } = self;
        drop(lock);
        if is_new {
            // Unless somebody else has put something there by now.
            let _ = std::fs::remove_dir(path);
        }
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// The file that says what the campaign is.
    pub(crate) fn manifest(&self) -> PathBuf {
        self.path.join(MANIFEST)
    }

    /// The table.
    pub(crate) fn table(&self, format: Format) -> PathBuf {
        self.path.join(format!("runs.{}", format.name()))
    }

    /// All judgements.
    pub(crate) fn verdicts(&self) -> PathBuf {
        self.path.join("verdicts.csv")
    }

    /// All judgements of a campaign whose table has none.
    pub(crate) fn stability(&self) -> PathBuf {
        self.path.join("stability.csv")
    }

    /// The file of judgements as they are made, before they are all in the table of that name.
    pub(crate) fn journal(judgements: &Path) -> PathBuf {
        judgements.with_extension("part.csv")
    }

    pub(crate) fn part(&self, part: u64, format: Format) -> PathBuf {
        self.path.join(format!("part-{part:05}.{}", format.name()))
    }

    /// Removes what was being written when a campaign was killed.
    pub(crate) fn sweep(&self) -> Result<(), CampaignError> {
        let unreadable = |error| CampaignError::File { verb: "read", path: self.path.clone(), error };
        for entry in std::fs::read_dir(&self.path).map_err(unreadable)? {
            let path = entry.map_err(unreadable)?.path();
            if is_partial(&path) {
                std::fs::remove_file(&path).map_err(|error| CampaignError::File { verb: "remove", path, error })?;
            }
        }
        Ok(())
    }

    /// Removes the judgements as they were made, which are all in their table.
    pub(crate) fn remove_journal(journal: PathBuf) -> Result<(), CampaignError> {
        remove(journal)
    }

    /// Removes the parts, which are all in the table.
    pub(crate) fn remove_parts(&self, parts: u64, format: Format) -> Result<(), CampaignError> {
        for part in 0..parts {
            remove(self.part(part, format))?;
        }
        Ok(())
    }
}

/// Whether a file of a campaign was being written: `campaign.json.partial`, `part-….partial`, `runs.….partial`, `verdicts.csv.partial`.
fn is_partial(path: &Path) -> bool {
    let name = path.file_name().map(|name| name.to_string_lossy()).unwrap_or_default();
    name.ends_with(cohaptic_files::PARTIAL) && ["campaign.", "part-", "runs.", "verdicts.", "stability."].iter().any(|begin| name.starts_with(begin))
}

/// Removes a file if it is there.
fn remove(path: PathBuf) -> Result<(), CampaignError> {
    match std::fs::remove_file(&path) {
        Ok(()) => Ok(()),
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(()),
        Err(error) => Err(CampaignError::File { verb: "remove", path, error }),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_files_of_a_campaign_are_swept() {
        for (name, swept) in [
            ("a/part-00012.parquet.partial", true),
            ("runs.csv.partial", true),
            ("campaign.json.partial", true),
            ("part-00012.parquet", false),
            ("thesis.partial", false),
        ] {
            assert_eq!(is_partial(name.as_ref()), swept, "{name}");
        }
    }
}
