//! Work shared by several processes: `--shard`, `--merge` and `--status` of campaigns, comparisons, maps and boundaries. Each process does a shard of the work,
//! and all processes write into the same folder.

mod environment;
mod status;
mod worker;

use std::path::Path;
use std::process::ExitCode;

pub(crate) use cohaptic_answers::shards::{Done, Names, Piece};
use cohaptic_answers::shards::{done_document, done_words};
use cohaptic_campaign::Shard;
use cohaptic_files::OwnFolder;

use crate::arguments::{ShardArguments, ShardName};
use crate::document_schema::DocumentSchema;
use crate::failure::Failure;
use crate::file::own_folder;
use crate::output::{self, NO_FILES};

pub(crate) use status::{all_done, has_result, logs_in, missing, show};
use worker::nobody_works_in;
pub(crate) use worker::{Worker, owner};

/// Share of a command in the work.
#[derive(Clone, Copy)]
pub(crate) enum Sharing<'a> {
    /// The whole work, in the folder of `--out` if the option is given.
    Whole(Option<&'a Path>),
    /// A single shard, in the folder.
    Shard(Shard, &'a Path),
    /// Merges the results of shards in the folder.
    Merge(&'a Path),
    /// Reports the done pieces of work in the folder.
    Status(&'a Path),
}

impl<'a> Sharing<'a> {
    /// Reads the options of a command. `out` is the folder of `--out`.
    ///
    /// # Errors
    ///
    /// [`Failure::Input`] if `--shard auto` finds no shard of this process.
    pub(crate) fn of(arguments: &'a ShardArguments, out: Option<&'a Path>) -> Result<Self, Failure> {
        let (shard, folder) = match (arguments, out) {
            (ShardArguments { merge: Some(folder), .. }, _) => return Ok(Self::Merge(folder)),
            (ShardArguments { status: Some(folder), .. }, _) => return Ok(Self::Status(folder)),
            (ShardArguments { shard: Some(shard), .. }, Some(folder)) => (*shard, folder),
            (ShardArguments { .. }, out) => return Ok(Self::Whole(out)),
        };
        let shard = match shard {
            ShardName::Given(shard) => shard,
            ShardName::Auto(count) => {
                environment::auto(&|name| std::env::var(name).ok(), count).map_err(|reason| Failure::Input(format!("--shard auto: {reason}")))?
            }
        };
        Ok(Self::Shard(shard, folder))
    }

    /// Takes the folder for this process alone if the process does the whole work or merges shards. A merge does not check for workers with a lease.
    pub(crate) fn own_folder(self) -> Result<Option<OwnFolder>, Failure> {
        match self {
            Self::Whole(None) | Self::Shard(..) | Self::Status(_) => Ok(None),
            Self::Merge(folder) => own_folder(folder).map(Some),
            Self::Whole(Some(folder)) => {
                // A worker takes its lease first and looks for the owner of the folder second. This process does both in the opposite order, so at least one of
                // the two sees the other.
                let own = own_folder(folder)?;
                nobody_works_in(folder)?;
                Ok(Some(own))
            }
        }
    }

    /// Returns the folder of the files, or `None` if `--out` is not given.
    pub(crate) const fn folder(self) -> Option<&'a Path> {
        match self {
            Self::Whole(folder) => folder,
            Self::Shard(_, folder) | Self::Merge(folder) | Self::Status(folder) => Some(folder),
        }
    }
}

/// Prints that a shard is done.
pub(crate) fn answer(json: bool, done: &Done) -> Result<ExitCode, Failure> {
    output::answer(json, DocumentSchema::SHARD, &done_document(done), || done_words(done), NO_FILES)?;
    Ok(ExitCode::SUCCESS)
}
