//! Arguments of commands whose work several processes can share.

use std::path::PathBuf;
use std::str::FromStr;

use clap::Args;
use cohaptic_campaign::{Shard, ShardError};

#[derive(Debug, Args)]
pub(crate) struct ShardArguments {
    /// Do the I-th of N shares of the work, in a folder that processes share; auto or auto/N: as a scheduler says (docs/cluster.md)
    #[arg(long, value_name = "I/N", requires = "out")]
    pub(crate) shard: Option<ShardName>,
    /// In place of --out: put the shards in this folder together; refused while anything is missing
    #[arg(long, value_name = "DIR", conflicts_with_all = ["out", "shard", "status"])]
    pub(crate) merge: Option<PathBuf>,
    /// In place of --out: say what each process did in this folder, and when the rest will be done
    #[arg(long, value_name = "DIR", conflicts_with_all = ["out", "shard"])]
    pub(crate) status: Option<PathBuf>,
}

/// A shard as it is asked for.
#[derive(Clone, Copy, Debug)]
pub(crate) enum ShardName {
    Given(Shard),
    /// By the variables of a scheduler, and of how many if that was said.
    Auto(Option<u64>),
}

impl FromStr for ShardName {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let shard = match text.split_once('/') {
            None if text == "auto" => return Ok(Self::Auto(None)),
            Some(("auto", count)) => {
                return count
                    .parse()
                    .map(|count| Self::Auto(Some(count)))
                    .map_err(|_| format!("\"{count}\" is not a number of shards: expected auto/N, such as auto/8"));
            }
            _ => text.parse(),
        };
        shard.map(Self::Given).map_err(|error: ShardError| format!("{error}, or auto"))
    }
}
