//! The stored parts of a campaign: writing a part with its digest, reading it back, and merging all parts into the table.
//!
//! Rows come in from `work`, and files go out through `folder` and `table`. No part is trusted without a check of its digest.

use std::io::Write as _;
use std::path::Path;

use cohaptic_files::{WholeFile, write_whole, write_whole_by};
use rayon::prelude::*;

use crate::campaign::{Campaign, unread, unwritten};
use crate::error::CampaignError;
use crate::folder::{Fault, HashingWriter, Label, write_digest};
use crate::table::{OpenPart, Row, TableError};
use crate::watch::Watch;

impl Campaign {
    /// Returns the number of stored runs, counted by the names of parts with a digest. The bytes of the parts are not read; [`Campaign::run`] checks them.
    #[must_use]
    pub fn kept(&self) -> u64 {
        if self.is_finished() {
            return self.runs();
        }
        // An unreadable folder counts as empty, because this number is only shown.
        let kept = self.folder.parts_with_digests(self.plan.format()).unwrap_or_default();
        kept.into_iter().filter(|part| *part < self.parts.count()).map(|part| self.parts.len(part)).sum()
    }

    /// Returns the number of runs in these parts.
    pub(crate) fn runs_of(&self, parts: &[u64]) -> u64 {
        parts.iter().map(|part| self.parts.len(*part)).sum()
    }

    /// Returns the parts without a file or without a digest, in order. The bytes are not read.
    pub(crate) fn absent(&self) -> Result<Vec<u64>, CampaignError> {
        let there = self.folder.parts_with_digests(self.plan.format())?;
        Ok((0..self.parts.count()).filter(|part| !there.contains(part)).collect())
    }

    /// Returns the wanted parts that are absent or damaged, in order. The present parts are read, on all threads of the current thread pool, and `watch` is
    /// told of the damaged parts. If `watch` stops the work, the unread parts count as intact.
    pub(crate) fn missing(&self, is_wanted: &dyn Fn(u64) -> bool, watch: &dyn Watch) -> Result<Vec<u64>, CampaignError> {
        let there = self.folder.parts(self.plan.format())?;
        let wanted: Vec<u64> = (0..self.parts.count()).filter(|part| is_wanted(*part)).collect();
        let looked_at = |part: &u64| match there.contains(part) {
            false => Ok(Some((*part, None))),
            // Reading the parts of a large campaign takes long, so the watch may stop it. The merge checks every part again.
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

    /// Returns the label which the digest of a part must have.
    fn label(&self, part: u64) -> Label<'_> {
        Label { part, runs: self.parts.len(part), campaign: &self.hash }
    }

    /// Opens a part which is present by name; `Ok(Err)` if the part is not as it was written.
    fn open_part(&self, part: u64) -> Result<Result<OpenPart, Fault>, CampaignError> {
        let path = self.folder.part(part, self.plan.format());
        match self.label(part).open(&path) {
            Ok(opened) => Ok(opened.map(|file| OpenPart { path, file, rows: self.parts.len(part) })),
            Err(error) => Err(CampaignError::File { verb: "read", path, error }),
        }
    }

    /// Stores a part with its digest. `worker` is `None` for a process alone in the folder. A worker leaves an intact part of another worker unchanged.
    pub(crate) fn keep(&self, worker: Option<&str>, part: u64, rows: &[Row]) -> Result<(), CampaignError> {
        let path = self.folder.part(part, self.plan.format());
        // All workers make the same bytes for the same part.
        // Alone in the folder, a part is only computed if it was missing or damaged, and is always written.
        if worker.is_some() && path.exists() && self.open_part(part)?.is_ok() {
            return Ok(());
        }
        let about = self.manifest.about();
        let write = |file: &mut WholeFile| {
            // The bytes are hashed on their way to the disk. Bytes read back from a faulty disk would hash to a matching digest.
            let mut to = HashingWriter::new(file);
            self.plan.format().write(&mut to, self.head(&about), rows)?;
            // The digest gets its name before the part: a process killed in between leaves no part without a digest.
            write_digest(self.label(part), &path, to.finish(), |path, text| whole_by(worker, path, |file| Ok(file.write_all(text)?)))
        };
        whole_by(worker, &path, write).map_err(|error| unwritten(&path, error))
    }

    /// Merges the parts into the table. Each part is checked once more right before its bytes are copied.
    pub(crate) fn merge(&self) -> Result<(), CampaignError> {
        let format = self.plan.format();
        // `Range<u64>` is no `ExactSizeIterator`, which the merge needs.
        let count = u32::try_from(self.parts.count()).unwrap_or(u32::MAX);
        let parts = (0..count).map(u64::from).map(|part| {
            let path = self.folder.part(part, format);
            // A fault in a part names the part; a fault in writing names the table.
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
            // `Campaign::run` takes this error as the sign to compute the part again.
            TableError::Part { path, error } => unread(&path, *error, "remove it and repeat the command, which computes it again"),
            error @ (TableError::Io(_) | TableError::Content(_)) => unwritten(&path, error),
        })
    }
}

/// Writes a whole file: alone in the folder, or as one of several workers, whose temporary names differ.
fn whole_by(worker: Option<&str>, path: &Path, write: impl FnOnce(&mut WholeFile) -> Result<(), TableError>) -> Result<(), TableError> {
    match worker {
        None => write_whole(path, write),
        Some(worker) => write_whole_by(path, worker, write),
    }
}
