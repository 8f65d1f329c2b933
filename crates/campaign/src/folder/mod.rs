//! The folder of a campaign: which files there are, and in which order they come and go.
//!
//! ```text
//! cohaptic.lock            as long as one process works on it alone
//! campaign.json            what the campaign is; the first file with its own name
//! verdicts.part.csv        judgements as they are made, until the table is there
//! verdicts.csv             all judgements
//! stability.part.csv       judgements of a campaign whose table has none
//! stability.csv
//! part-00000.parquet …     whole parts
//! part-00000.parquet.sha256 …  what each of them must be
//! runs.parquet             the table; the parts go when it is there
//! ```
//!
//! Workers that do shards of it at the same time, on any machines, have files of their own besides, and no two of them write the same file:
//!
//! ```text
//! shard-3-of-8.lock                      as long as a worker works on that shard
//! worker-WORKER.log                      what it did
//! verdicts.WORKER.part.csv               judgements that it made
//! part-00000.parquet.WORKER.partial …    what it is writing
//! ```

mod digest;
mod manifest;

use std::collections::BTreeSet;
use std::ffi::OsStr;
use std::io;
use std::path::{Path, PathBuf};

use cohaptic_files::{FOLDER_LOCK, Lock, Owner, PARTIAL};

use crate::error::CampaignError;
use crate::shard::{Shard, is_lease, is_log};
use crate::table::Format;

pub(crate) use digest::{Fault, HashingWriter, Label, hash, write as write_digest};
pub(crate) use manifest::Manifest;

use digest::DIGEST;

pub(crate) const MANIFEST: &str = "campaign.json";
/// How the names of files of judgements end as they are made.
const JOURNAL: &str = "part.csv";

/// A folder that this process works on, as long as this value lives.
#[derive(Debug)]
pub(crate) struct Folder {
    path: PathBuf,
    /// As long as it works there alone; `None` if workers share the folder.
    lock: Option<Lock>,
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
            if name != FOLDER_LOCK && !is_partial(Path::new(&name)) && !is_of_shards(&name) {
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
        let file = path.join(FOLDER_LOCK);
        match Lock::take(&file) {
            Ok(Some(lock)) => Ok(Self { path: path.to_path_buf(), lock: Some(lock), is_new }),
            Ok(None) => Err(CampaignError::Busy { path: path.to_path_buf() }),
            Err(error) => Err(CampaignError::File { verb: "lock", path: file, error }),
        }
    }

    /// Makes the folder if there is none, for work that other processes do at the same time.
    pub(crate) fn share(path: &Path) -> Result<Self, CampaignError> {
        let is_new = !path.exists();
        std::fs::create_dir_all(path).map_err(|error| CampaignError::File { verb: "make the folder", path: path.to_path_buf(), error })?;
        Ok(Self { path: path.to_path_buf(), lock: None, is_new })
    }

    /// That no process works on the folder alone, as far as this machine and its file system know.
    pub(crate) fn is_shared(&self) -> Result<(), CampaignError> {
        if Lock::is_held(&self.path.join(FOLDER_LOCK)) { Err(CampaignError::Busy { path: self.path.clone() }) } else { Ok(()) }
    }

    /// That no worker does a shard here.
    pub(crate) fn has_no_shards(&self) -> Result<(), CampaignError> {
        let held = cohaptic_files::leases(&self.path, &Owner::here(0), is_lease);
        let held = held.map_err(|error| CampaignError::File { verb: "read", path: self.path.clone(), error })?;
        let Some((lease, holder)) = held.into_iter().find(|(_, holder)| !holder.is_stale()) else { return Ok(()) };
        let shard = Shard::of_lease(&lease).map_or(lease, |shard| format!("shard {shard}"));
        let worker = holder.owner.map_or_else(|| "a process".to_owned(), |owner| owner.to_string());
        Err(CampaignError::Shards { path: self.path.clone(), worker, shard, age_s: holder.age.as_secs() })
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

    /// The file of judgements as they are made, before they are all in the table of that name: each worker has its own.
    pub(crate) fn journal(judgements: &Path, worker: Option<&str>) -> PathBuf {
        match worker {
            None => judgements.with_extension(JOURNAL),
            Some(worker) => judgements.with_extension(format!("{worker}.{JOURNAL}")),
        }
    }

    /// All such files.
    pub(crate) fn journals(&self, judgements: &Path) -> Result<Vec<PathBuf>, CampaignError> {
        let begin = judgements.file_stem().map(|stem| format!("{}.", stem.to_string_lossy())).unwrap_or_default();
        self.named(|name| name.starts_with(&begin) && name.ends_with(&format!(".{JOURNAL}")))
    }

    /// Which parts are there by their names, each with its digest or without. Whether their bytes are those that were written is not looked at.
    pub(crate) fn parts(&self, format: Format) -> Result<BTreeSet<u64>, CampaignError> {
        let end = format!(".{}", format.name());
        let mut parts = BTreeSet::new();
        self.each(|name| parts.extend(number(name, &end)))?;
        Ok(parts)
    }

    /// Of [`Folder::parts`], those with a digest.
    pub(crate) fn parts_with_digests(&self, format: Format) -> Result<BTreeSet<u64>, CampaignError> {
        let end = format!(".{}{DIGEST}", format.name());
        let (mut digests, parts) = (BTreeSet::new(), self.parts(format)?);
        self.each(|name| digests.extend(number(name, &end)))?;
        digests.retain(|part| parts.contains(part));
        Ok(digests)
    }

    /// The files with such names, sorted.
    fn named(&self, is_meant: impl Fn(&str) -> bool) -> Result<Vec<PathBuf>, CampaignError> {
        let mut found = Vec::new();
        self.each(|name| found.extend(is_meant(name).then(|| self.path.join(name))))?;
        found.sort_unstable();
        Ok(found)
    }

    /// Takes the names of all files.
    fn each(&self, mut take: impl FnMut(&str)) -> Result<(), CampaignError> {
        let unreadable = |error| CampaignError::File { verb: "read", path: self.path.clone(), error };
        for entry in std::fs::read_dir(&self.path).map_err(unreadable)? {
            let name = entry.map_err(unreadable)?.file_name();
            name.to_str().into_iter().for_each(&mut take);
        }
        Ok(())
    }

    pub(crate) fn part(&self, part: u64, format: Format) -> PathBuf {
        self.path.join(format!("part-{part:05}.{}", format.name()))
    }

    /// Removes what was being written when a campaign was killed.
    pub(crate) fn sweep(&self) -> Result<(), CampaignError> {
        self.named(|name| is_partial(Path::new(name)))?.into_iter().try_for_each(remove)
    }

    /// Removes the judgements as they were made, which are all in their table.
    pub(crate) fn remove_journals(&self, judgements: &Path) -> Result<(), CampaignError> {
        self.journals(judgements)?.into_iter().try_for_each(remove)
    }

    /// Removes what workers leave that are at work no more.
    pub(crate) fn remove_traces_of_shards(&self) -> Result<(), CampaignError> {
        if self.has_no_shards().is_err() {
            return Ok(());
        }
        self.named(|name| is_of_shards(name.as_ref()))?.into_iter().try_for_each(remove)
    }

    /// Removes the parts, which are all in the table, and their digests.
    pub(crate) fn remove_parts(&self, parts: u64, format: Format) -> Result<(), CampaignError> {
        for part in 0..parts {
            let path = self.part(part, format);
            remove(digest::name_of(&path))?;
            remove(path)?;
        }
        Ok(())
    }
}

/// The number of the part that a name with this end has.
fn number(name: &str, end: &str) -> Option<u64> {
    name.strip_prefix("part-")?.strip_suffix(end)?.parse().ok()
}

/// Whether a file of a campaign was being written: `campaign.json.partial`, `part-….partial`, `runs.….partial`, `verdicts.csv.partial`.
fn is_partial(path: &Path) -> bool {
    const BEGINS: [&str; 7] = ["campaign.", "part-", "runs.", "verdicts.", "stability.", "shard-", "leases."];
    let name = path.file_name().map(|name| name.to_string_lossy()).unwrap_or_default();
    name.ends_with(PARTIAL) && BEGINS.iter().any(|begin| name.starts_with(begin))
}

/// Whether a file says what a worker does or did.
fn is_of_shards(name: &OsStr) -> bool {
    name.to_str().is_some_and(|name| is_lease(name) || is_log(name))
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
            ("runs.parquet.index.partial", true),
            ("campaign.json.partial", true),
            ("a/part-00012.csv.node-7-1f.partial", true),
            ("part-00012.parquet", false),
            ("part-00012.parquet.sha256", false),
            ("part-00012.parquet.sha256.partial", true),
            ("thesis.partial", false),
        ] {
            assert_eq!(is_partial(name.as_ref()), swept, "{name}");
        }
    }
}
