//! Shards: shares of numbered work, each done by a worker of its own. The names of a worker's lease and log are defined here; the locks are taken by the
//! callers.

use core::fmt;
use core::str::FromStr;

/// A share of numbered pieces of work. Share I of N, written `I/N`, has the pieces I − 1, I − 1 + N, I − 1 + 2·N and so on, counted from 0.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Shard {
    /// Number of the shard, from 1 to `count`.
    index: u64,
    count: u64,
}

/// Why a text names no shard.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[error("\"{}\" names no shard: expected I/N, with I from 1 to N: 3/8 is the third of eight", found.escape_debug())]
pub struct ShardError {
    /// The text of the user.
    found: String,
}

impl Shard {
    /// Returns shard `index`, counted from 1, of `count` shards; `None` if `index` is outside of 1 to `count`.
    #[must_use]
    pub const fn new(index: u64, count: u64) -> Option<Self> {
        if 1 <= index && index <= count { Some(Self { index, count }) } else { None }
    }

    /// Returns `true` if the shard has a piece, counted from 0.
    #[must_use]
    pub const fn has(self, piece: u64) -> bool {
        piece % self.count == self.index - 1
    }

    /// Returns the number of shards into which the work is divided, at least 1.
    #[must_use]
    pub const fn count(self) -> u64 {
        self.count
    }

    /// Returns the name of the lock file held by a worker of the shard.
    #[must_use]
    pub fn lease(self) -> String {
        format!("{LEASE}{}-of-{}{LEASE_END}", self.index, self.count)
    }

    /// Returns the shard of a lock file with this name; `None` for other names.
    #[must_use]
    pub fn of_lease(name: &str) -> Option<Self> {
        let (index, count) = name.strip_prefix(LEASE)?.strip_suffix(LEASE_END)?.split_once("-of-")?;
        Self::new(index.parse().ok()?, count.parse().ok()?)
    }
}

const LEASE: &str = "shard-";
const LEASE_END: &str = ".lock";
const LOG: &str = "worker-";
const LOG_END: &str = ".log";

/// Returns `true` for the name of a shard's lock file.
pub(crate) fn is_lease(name: &str) -> bool {
    Shard::of_lease(name).is_some()
}

/// Returns the name of the log of a worker.
#[must_use]
pub fn worker_log(worker: &str) -> String {
    format!("{LOG}{worker}{LOG_END}")
}

/// Returns `true` for the name of a worker's log.
#[must_use]
pub fn is_log(name: &str) -> bool {
    name.starts_with(LOG) && name.ends_with(LOG_END)
}

impl fmt::Display for Shard {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(formatter, "{}/{}", self.index, self.count)
    }
}

impl FromStr for Shard {
    type Err = ShardError;

    fn from_str(text: &str) -> Result<Self, ShardError> {
        let read = || {
            let (index, count) = text.split_once('/')?;
            Self::new(index.trim().parse().ok()?, count.trim().parse().ok()?)
        };
        read().ok_or_else(|| ShardError { found: text.to_owned() })
    }
}

/// Missing pieces of shared work.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Missing {
    /// Name of a piece in the singular, such as `part` of a campaign or `row` of a map.
    pub piece: &'static str,
    /// Number of all pieces.
    pub count: u64,
    /// Missing pieces, counted from 0, in rising order.
    pub pieces: Vec<u64>,
}

impl Missing {
    /// Returns the shards with a missing piece, of `of` shards, in words. At most [`MOST_RANGES`] ranges are listed.
    fn shards(&self, of: u64) -> String {
        let mut shards: Vec<u64> = self.pieces.iter().map(|piece| piece % of + 1).collect();
        shards.sort_unstable();
        shards.dedup();
        ranges(&shards)
    }

    /// Returns the message, with the shards to repeat if the number of shards is known.
    #[must_use]
    pub fn words(&self, shards: Option<u64>) -> String {
        let mut text = self.to_string();
        if let Some(of) = shards {
            text.push_str(&format!("; of {of} shards, these do them: {}", self.shards(of)));
        }
        text
    }
}

impl fmt::Display for Missing {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { piece, count, pieces } = self;
        write!(formatter, "{} of {count} {piece}s are missing, counted from 0: {}", pieces.len(), ranges(pieces))
    }
}

/// Greatest number of ranges in a message. Further numbers are only counted.
const MOST_RANGES: usize = 20;

/// Returns rising numbers as a list of ranges: `1, 3 to 5`.
fn ranges(numbers: &[u64]) -> String {
    let mut ranges: Vec<(u64, u64)> = Vec::new();
    for number in numbers {
        match ranges.last_mut() {
            Some((_, last)) if *last + 1 == *number => *last = *number,
            _ => ranges.push((*number, *number)),
        }
    }
    let one = |(first, last): &(u64, u64)| if first == last { first.to_string() } else { format!("{first} to {last}") };
    let mut text = ranges.iter().take(MOST_RANGES).map(one).collect::<Vec<_>>().join(", ");
    let more: u64 = ranges.iter().skip(MOST_RANGES).map(|(first, last)| last - first + 1).sum();
    if more > 0 {
        text.push_str(&format!(" and {more} more"));
    }
    text
}

#[cfg(test)]
mod tests {
    use cohaptic_tests_common::properties;
    use proptest::prelude::*;

    use super::*;

    properties! {
        #[test]
        fn every_piece_is_in_one_shard(count in 1_u64..40, piece: u64) {
            let having = (1..=count).filter(|index| Shard::new(*index, count).unwrap().has(piece)).count();
            prop_assert_eq!(having, 1);
        }
    }

    #[test]
    fn a_shard_reads_back_and_what_is_none_is_refused() {
        for (text, shard) in [("1/1", Shard { index: 1, count: 1 }), ("3/8", Shard { index: 3, count: 8 }), (" 8 / 8", Shard { index: 8, count: 8 })]
        {
            assert_eq!(text.parse(), Ok(shard));
            assert_eq!(shard.to_string().parse(), Ok(shard));
            assert_eq!(Shard::of_lease(&shard.lease()), Some(shard));
        }
        for text in ["", "3", "0/8", "9/8", "-1/8", "1/0", "a/b", "1/8/2", "18446744073709551616/18446744073709551617"] {
            assert!(text.parse::<Shard>().unwrap_err().to_string().contains("expected I/N"), "{text}");
        }
        for name in ["shard-1-of-0.lock", "shard-9-of-8.lock", "shard-1-of-8.lock.a.partial", "cohaptic.lock"] {
            assert!(!is_lease(name), "{name}");
        }
        assert!(is_log(&worker_log("node-7-1f")) && !is_log("worker-1") && !is_log("a.log"));
    }

    #[test]
    fn what_is_missing_is_said_in_ranges_and_by_shards() {
        let missing = |pieces: &[u64]| Missing { piece: "part", count: 99, pieces: pieces.to_vec() };
        assert_eq!(missing(&[1, 3, 4, 5]).to_string(), "4 of 99 parts are missing, counted from 0: 1, 3 to 5");
        assert_eq!(missing(&[0, 8, 9]).words(Some(8)), "3 of 99 parts are missing, counted from 0: 0, 8 to 9; of 8 shards, these do them: 1 to 2");
        let every_other: Vec<u64> = (0..46).step_by(2).collect();
        assert!(missing(&every_other).to_string().ends_with(", 38 and 3 more"));
    }
}
