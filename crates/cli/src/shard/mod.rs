//! Work that several processes share, each of which does a shard of it in the same folder: `--shard`, `--merge` and `--status` of campaigns, comparisons, maps
//! and boundaries.

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

pub(crate) use status::{all_done, logs_in, missing, show};
use worker::nobody_works_in;
pub(crate) use worker::{Worker, owner};

/// What a command does of its work.
#[derive(Clone, Copy)]
pub(crate) enum Sharing<'a> {
    /// All, in the folder of `--out` if there is one.
    Whole(Option<&'a Path>),
    /// A shard, in the folder.
    Shard(Shard, &'a Path),
    /// Puts together what shards did in the folder.
    Merge(&'a Path),
    /// Says what shards did in the folder.
    Status(&'a Path),
}

impl<'a> Sharing<'a> {
    /// What the options say.
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

    /// Takes the folder for this process alone, if the process does all of the work or puts shards together. A merge leaves workers that are still at work
    /// alone.
    pub(crate) fn own_folder(self) -> Result<Option<OwnFolder>, Failure> {
        match self {
            Self::Whole(None) | Self::Shard(..) | Self::Status(_) => Ok(None),
            Self::Merge(folder) => own_folder(folder).map(Some),
            Self::Whole(Some(folder)) => {
                // A worker that begins looks for the owner of the folder after it has its lease, so that one of the two sees the other.
                let own = own_folder(folder)?;
                nobody_works_in(folder)?;
                Ok(Some(own))
            }
        }
    }

    /// The folder that files are written into, if there is one.
    pub(crate) const fn folder(self) -> Option<&'a Path> {
        match self {
            Self::Whole(folder) => folder,
            Self::Shard(_, folder) | Self::Merge(folder) | Self::Status(folder) => Some(folder),
        }
    }
}

/// Says that a shard is done.
pub(crate) fn answer(json: bool, done: &Done) -> Result<ExitCode, Failure> {
    output::answer(json, DocumentSchema::SHARD, &done_document(done), || done_words(done), NO_FILES)?;
    Ok(ExitCode::SUCCESS)
}
