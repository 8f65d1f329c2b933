//! Work that several processes share, each of which does a shard of it in the same folder: `--shard`, `--merge` and `--status` of campaigns, comparisons, maps
//! and boundaries.

mod environment;
mod status;
mod worker;

use std::path::Path;
use std::process::ExitCode;

use cohaptic_campaign::Shard;
use cohaptic_files::OwnFolder;
use cohaptic_units::print::Counted;

use crate::arguments::{ShardArguments, ShardName};
use crate::document_schema::{DocumentSchema, document};
use crate::failure::Failure;
use crate::file::own_folder;
use crate::output::{self, NO_FILES};

pub(crate) use status::{Piece, all_done, logs_in, missing, show};
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

/// A shard that is done.
pub(crate) struct Done<'a> {
    pub(crate) shard: Shard,
    pub(crate) folder: &'a Path,
    /// What the work is cut into, and what a piece of it is made of.
    pub(crate) names: Names,
    /// How many pieces the shard has, and of how many units they are.
    pub(crate) pieces: u64,
    pub(crate) units: u64,
    /// How many units were computed this time.
    pub(crate) computed: u64,
    pub(crate) wall_s: f64,
}

/// What the work is cut into, such as parts, and what these are made of, such as runs.
#[derive(Clone, Copy)]
pub(crate) struct Names {
    pub(crate) piece: &'static str,
    pub(crate) unit: &'static str,
}

/// Says that a shard is done.
pub(crate) fn answer(json: bool, done: &Done<'_>) -> Result<ExitCode, Failure> {
    let Done { shard, folder, names, pieces, units, computed, wall_s } = done;
    let document = document! {
        shard: shard.to_string(),
        out: output::path(folder),
        piece: names.piece,
        unit: names.unit,
        pieces: pieces,
        units: units,
        units_computed: computed,
        wall_s: wall_s,
    };
    let words = || {
        let folder = output::path(folder);
        if *pieces == 0 {
            return format!("shard {shard} in {folder}: there are fewer {}s than shards, and none is this one's\n", names.piece);
        }
        let there = if computed < units { format!(", {} there already", units - computed) } else { String::new() };
        let (pieces, units) = (Counted(*pieces, names.piece), Counted(*units, names.unit));
        format!("shard {shard} in {folder}: {pieces} of {units}, {computed} computed in {wall_s:.3} s{there}\n")
    };
    output::answer(json, DocumentSchema::SHARD, &document, words, NO_FILES)?;
    Ok(ExitCode::SUCCESS)
}
