//! The folder of a campaign: names of the files, and the order in which files appear and disappear.
//!
//! ```text
//! cohaptic.lock            held while one process works on the folder alone
//! campaign.json            the manifest, the first file with its final name
//! verdicts.part.csv        the journal of judgements, until the table of judgements is written
//! verdicts.csv             the table of all judgements
//! stability.part.csv       the journal of judgements of a campaign whose table has none
//! stability.csv            the table of these judgements
//! part-00000.parquet …     whole parts
//! part-00000.parquet.sha256 …  the digest of each part
//! runs.parquet             the table; the parts are removed once the table is written
//! ```
//!
//! Workers may do shards of the campaign at the same time, on any machines. Each worker has files of its own, and no two workers write the same file:
//!
//! ```text
//! shard-3-of-8.lock                      held while a worker works on that shard
//! worker-WORKER.log                      log of the worker
//! verdicts.WORKER.part.csv               journal of the worker's judgements
//! part-00000.parquet.WORKER.partial …    file being written by the worker
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
/// End of the names of journals.
const JOURNAL: &str = "part.csv";

/// A folder on which this process works, as long as the value lives.
#[derive(Debug)]
pub(crate) struct Folder {
    path: PathBuf,
    /// Lock of a process working alone; `None` if workers share the folder.
    lock: Option<Lock>,
    /// `true` if the folder was created for this campaign.
    is_new: bool,
}

impl Folder {
    /// Returns `true` if the folder holds a campaign, and changes nothing.
    ///
    /// # Errors
    ///
    /// [`CampaignError::NoFolder`] if the path is a file, [`CampaignError::Foreign`] if the folder holds foreign files.
    pub(crate) fn has_campaign(path: &Path) -> Result<bool, CampaignError> {
        let unreadable = |error| CampaignError::File { verb: "read", path: path.to_path_buf(), error };
        match std::fs::metadata(path) {
            Ok(metadata) if metadata.is_dir() => {}
            Ok(_) => return Err(CampaignError::NoFolder { path: path.to_path_buf() }),
            Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(false),
            // A parent of the path is a file.
            Err(error) if error.kind() == io::ErrorKind::NotADirectory => return Err(CampaignError::NoFolder { path: path.to_path_buf() }),
            Err(error) => return Err(unreadable(error)),
        }
        // Sorted, so that the error names the same file on every system.
        let mut others = BTreeSet::new();
        for entry in std::fs::read_dir(path).map_err(unreadable)? {
            let name = entry.map_err(unreadable)?.file_name();
            if name == MANIFEST {
                return Ok(true);
            }
            // A campaign killed before its manifest was written leaves such files.
            if name != FOLDER_LOCK && !is_partial(Path::new(&name)) && !is_of_shards(&name) {
                others.insert(name);
            }
        }
        match others.pop_first() {
            Some(found) => Err(CampaignError::Foreign { path: path.to_path_buf(), found: found.to_string_lossy().into_owned() }),
            None => Ok(false),
        }
    }

    /// Creates the folder if necessary, and locks it for this process.
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

    /// Creates the folder if necessary, for work shared with other processes.
    pub(crate) fn share(path: &Path) -> Result<Self, CampaignError> {
        let is_new = !path.exists();
        std::fs::create_dir_all(path).map_err(|error| CampaignError::File { verb: "make the folder", path: path.to_path_buf(), error })?;
        Ok(Self { path: path.to_path_buf(), lock: None, is_new })
    }

    /// Checks that no process has locked the folder for itself, as far as this machine and its file system know.
    pub(crate) fn is_shared(&self) -> Result<(), CampaignError> {
        if Lock::is_held(&self.path.join(FOLDER_LOCK)) { Err(CampaignError::Busy { path: self.path.clone() }) } else { Ok(()) }
    }

    /// Fails with [`CampaignError::Shards`] if a worker does a shard in the folder at present: its lease is not stale.
    pub(crate) fn has_no_shards(&self) -> Result<(), CampaignError> {
        let held = cohaptic_files::leases(&self.path, &Owner::here(0), is_lease);
        let held = held.map_err(|error| CampaignError::File { verb: "read", path: self.path.clone(), error })?;
        let Some((lease, holder)) = held.into_iter().find(|(_, holder)| !holder.is_stale()) else { return Ok(()) };
        let shard = Shard::of_lease(&lease).map_or(lease, |shard| format!("shard {shard}"));
        let worker = holder.owner.map_or_else(|| "a process".to_owned(), |owner| owner.to_string());
        Err(CampaignError::Shards { path: self.path.clone(), worker, shard, age_s: holder.age.as_secs() })
    }

    /// Gives the folder back after nothing could be written, and removes the folder if it was created for this campaign.
    pub(crate) fn give_up(self) {
        let Self { path, lock, is_new } = self;
        drop(lock);
        if is_new {
            // Another process may have written to the folder by now. Then the removal fails, as it should.
            let _ = std::fs::remove_dir(path);
        }
    }

    pub(crate) fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the path of the manifest.
    pub(crate) fn manifest(&self) -> PathBuf {
        self.path.join(MANIFEST)
    }

    /// Returns the path of the table.
    pub(crate) fn table(&self, format: Format) -> PathBuf {
        self.path.join(format!("runs.{}", format.name()))
    }

    /// Returns the path of the table of judgements.
    pub(crate) fn verdicts(&self) -> PathBuf {
        self.path.join("verdicts.csv")
    }

    /// Returns the path of the table of judgements made apart from the table of runs.
    pub(crate) fn stability(&self) -> PathBuf {
        self.path.join("stability.csv")
    }

    /// Returns the path of the journal for the table `judgements`. Each worker has a journal of its own.
    pub(crate) fn journal(judgements: &Path, worker: Option<&str>) -> PathBuf {
        match worker {
            None => judgements.with_extension(JOURNAL),
            Some(worker) => judgements.with_extension(format!("{worker}.{JOURNAL}")),
        }
    }

    /// Returns the paths of all journals for the table `judgements`, sorted.
    pub(crate) fn journals(&self, judgements: &Path) -> Result<Vec<PathBuf>, CampaignError> {
        let begin = judgements.file_stem().map(|stem| format!("{}.", stem.to_string_lossy())).unwrap_or_default();
        self.named(|name| name.starts_with(&begin) && name.ends_with(&format!(".{JOURNAL}")))
    }

    /// Returns the parts present by name, with or without a digest. The bytes are not read.
    pub(crate) fn parts(&self, format: Format) -> Result<BTreeSet<u64>, CampaignError> {
        let end = format!(".{}", format.name());
        let mut parts = BTreeSet::new();
        self.each(|name| parts.extend(number(name, &end)))?;
        Ok(parts)
    }

    /// Returns the parts of [`Folder::parts`] with a digest.
    pub(crate) fn parts_with_digests(&self, format: Format) -> Result<BTreeSet<u64>, CampaignError> {
        let end = format!(".{}{DIGEST}", format.name());
        let (mut digests, parts) = (BTreeSet::new(), self.parts(format)?);
        self.each(|name| digests.extend(number(name, &end)))?;
        digests.retain(|part| parts.contains(part));
        Ok(digests)
    }

    /// Returns the paths of the files with names accepted by `is_meant`, sorted.
    fn named(&self, is_meant: impl Fn(&str) -> bool) -> Result<Vec<PathBuf>, CampaignError> {
        let mut found = Vec::new();
        self.each(|name| found.extend(is_meant(name).then(|| self.path.join(name))))?;
        found.sort_unstable();
        Ok(found)
    }

    /// Calls `take` with the name of every file.
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

    /// Removes the partial files of a killed process.
    pub(crate) fn sweep(&self) -> Result<(), CampaignError> {
        self.named(|name| is_partial(Path::new(name)))?.into_iter().try_for_each(remove)
    }

    /// Removes the journals of the table `judgements`, once the table holds all judgements.
    pub(crate) fn remove_journals(&self, judgements: &Path) -> Result<(), CampaignError> {
        self.journals(judgements)?.into_iter().try_for_each(remove)
    }

    /// Removes the leases and logs of finished workers. Nothing is removed while a worker is active.
    pub(crate) fn remove_traces_of_shards(&self) -> Result<(), CampaignError> {
        if self.has_no_shards().is_err() {
            return Ok(());
        }
        self.named(|name| is_of_shards(name.as_ref()))?.into_iter().try_for_each(remove)
    }

    /// Removes the parts, now contained in the table, and their digests.
    pub(crate) fn remove_parts(&self, parts: u64, format: Format) -> Result<(), CampaignError> {
        for part in 0..parts {
            let path = self.part(part, format);
            remove(digest::name_of(&path))?;
            remove(path)?;
        }
        Ok(())
    }
}

/// Returns the number of the part with this name; `None` for other names. `end`: end of the names of parts.
fn number(name: &str, end: &str) -> Option<u64> {
    name.strip_prefix("part-")?.strip_suffix(end)?.parse().ok()
}

/// Returns `true` for a partial file of a campaign: `campaign.json.partial`, `part-….partial`, `runs.….partial`, `verdicts.csv.partial`.
fn is_partial(path: &Path) -> bool {
    const BEGINS: [&str; 7] = ["campaign.", "part-", "runs.", "verdicts.", "stability.", "shard-", "leases."];
    let name = path.file_name().map(|name| name.to_string_lossy()).unwrap_or_default();
    name.ends_with(PARTIAL) && BEGINS.iter().any(|begin| name.starts_with(begin))
}

/// Returns `true` for the leases and logs of workers.
fn is_of_shards(name: &OsStr) -> bool {
    name.to_str().is_some_and(|name| is_lease(name) || is_log(name))
}

/// Removes a file. An absent file is no error.
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
