//! The parts that are put away: each with a digest, read back before anything goes on from it, and put together as the table.

use std::io::Write as _;
use std::path::Path;

use cohaptic_files::{WholeFile, write_whole, write_whole_by};
use rayon::prelude::*;

use crate::campaign::{Campaign, Watch, unread, unwritten};
use crate::error::CampaignError;
use crate::folder::{Fault, HashingWriter, Label, write_digest};
use crate::table::{OpenPart, Row, TableError};

impl Campaign {
    /// How many runs are kept so far, by the names of their parts: whether the bytes of a part are those that were written is known when the campaign is continued.
    #[must_use]
    pub fn kept(&self) -> u64 {
        if self.is_finished() {
            return self.runs();
        }
        // In a folder that cannot be read nothing is known to be kept.
        let kept = self.folder.parts_with_digests(self.plan.format()).unwrap_or_default();
        kept.into_iter().filter(|part| *part < self.parts.count()).map(|part| self.parts.len(part)).sum()
    }

    /// How many runs these parts have.
    pub(crate) fn runs_of(&self, parts: &[u64]) -> u64 {
        parts.iter().map(|part| self.parts.len(*part)).sum()
    }

    /// The parts that are not there by their names.
    pub(crate) fn absent(&self) -> Result<Vec<u64>, CampaignError> {
        let there = self.folder.parts_with_digests(self.plan.format())?;
        Ok((0..self.parts.count()).filter(|part| !there.contains(part)).collect())
    }

    /// The wanted parts that are not there as they were written. All others are read, on all threads of the pool that this is called in, and the watch is told
    /// of the damaged parts. If the watch ends it, parts that were not read yet count as they are named.
    pub(crate) fn missing(&self, is_wanted: &dyn Fn(u64) -> bool, watch: &dyn Watch) -> Result<Vec<u64>, CampaignError> {
        let there = self.folder.parts(self.plan.format())?;
        let wanted: Vec<u64> = (0..self.parts.count()).filter(|part| is_wanted(*part)).collect();
        let looked_at = |part: &u64| match there.contains(part) {
            false => Ok(Some((*part, None))),
            true if watch.keep_going() => Ok(self.open_part(*part)?.err().map(|fault| (*part, Some(fault)))),
            true => Ok(None),
        };
        let looked_at = wanted.par_iter().map(looked_at).collect::<Result<Vec<_>, CampaignError>>()?;
        let missing = looked_at.into_iter().flatten().map(|(part, fault)| {
            if let Some(Fault(words)) = fault {
                let runs = self.parts.len(part);
                watch.damaged(&self.folder.part(part, self.plan.format()), &format!("{words}. Its {runs} runs are computed again"));
            }
            part
        });
        Ok(missing.collect())
    }

    /// The part that a file of the folder must be.
    fn label(&self, part: u64) -> Label<'_> {
        Label { part, runs: self.parts.len(part), campaign: &self.hash }
    }

    /// A part that is there by its name; `Ok(Err)` if it is not as it was written.
    fn open_part(&self, part: u64) -> Result<Result<OpenPart, Fault>, CampaignError> {
        let path = self.folder.part(part, self.plan.format());
        match self.label(part).open(&path) {
            Ok(opened) => Ok(opened.map(|file| OpenPart { path, file, rows: self.parts.len(part) })),
            Err(error) => Err(CampaignError::File { verb: "read", path, error }),
        }
    }

    /// Puts a part away with its digest: alone, or as a worker of that name among others, which leaves a part alone that another worker has put away.
    pub(crate) fn keep(&self, worker: Option<&str>, part: u64, rows: &[Row]) -> Result<(), CampaignError> {
        let path = self.folder.part(part, self.plan.format());
        // All workers make the same bytes.
        if worker.is_some() && path.exists() && self.open_part(part)?.is_ok() {
            return Ok(());
        }
        let about = self.manifest.about();
        let write = |file: &mut WholeFile| {
            // The bytes are hashed on their way to the disk, not read back from it.
            let mut to = HashingWriter::new(file);
            self.plan.format().write(&mut to, self.head(&about), rows)?;
            // The digest has its name before the part has: a process that is killed in between leaves no part without a digest.
            write_digest(self.label(part), &path, to.finish(), |path, text| whole_by(worker, path, |file| Ok(file.write_all(text)?)))
        };
        whole_by(worker, &path, write).map_err(|error| unwritten(&path, error))
    }

    /// Puts the parts together, each checked once more right before its bytes are copied.
    pub(crate) fn merge(&self) -> Result<(), CampaignError> {
        let format = self.plan.format();
        // A range of `u64` does not know its length.
        let count = u32::try_from(self.parts.count()).unwrap_or(u32::MAX);
        let parts = (0..count).map(u64::from).map(|part| {
            let path = self.folder.part(part, format);
            let of_part = TableError::of_part(&path);
            match self.open_part(part) {
                Ok(Ok(open)) => Ok(open),
                Ok(Err(Fault(words))) => Err(of_part(TableError::Content(words))),
                Err(CampaignError::File { error, .. }) => Err(of_part(error.into())),
                Err(error) => Err(of_part(TableError::Content(error.to_string()))),
            }
        });
        let about = self.manifest.about();
        let path = self.folder.table(format);
        let merged = write_whole(&path, |file| format.merge(file, self.head(&about), parts));
        merged.map_err(|error| match error {
            TableError::Part { path, error } => unread(&path, *error, "remove it and repeat the command, which computes it again"),
            error @ (TableError::Io(_) | TableError::Content(_)) => unwritten(&path, error),
        })
    }
}

/// Writes a file as a whole: alone, or as a worker of that name among others.
fn whole_by(worker: Option<&str>, path: &Path, write: impl FnOnce(&mut WholeFile) -> Result<(), TableError>) -> Result<(), TableError> {
    match worker {
        None => write_whole(path, write),
        Some(worker) => write_whole_by(path, worker, write),
    }
}
