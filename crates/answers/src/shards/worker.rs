//! Workers, read from their logs.

use cohaptic_campaign::Shard;

/// A worker, known by log and lease.
#[derive(Clone, PartialEq, Debug)]
pub struct Worker {
    /// Shard of the worker.
    pub shard: Shard,
    pub(super) process: u32,
    pub(super) host: String,
    pub(super) state: State,
    /// Number of finished pieces, and in `units` the number of units in these pieces.
    pub(super) pieces: u64,
    pub(super) units: u64,
    /// Time from the begin of the worker to the last finished piece, or to the end \[s\].
    seconds: f64,
}

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum State {
    /// The worker renews the lease.
    Working,
    Done,
    Interrupted,
    Failed,
    /// The worker has neither written an end nor renewed the lease.
    Killed,
}

impl State {
    pub(super) const fn word(self) -> &'static str {
        match self {
            Self::Working => "working",
            Self::Done => "done",
            Self::Interrupted => "interrupted",
            Self::Failed => "failed",
            Self::Killed => "killed",
        }
    }
}

impl Worker {
    pub(super) fn units_per_s(&self) -> Option<f64> {
        #[expect(clippy::cast_precision_loss, reason = "fewer units than 2^52")]
        (self.units > 0 && self.seconds > 0.0).then(|| self.units as f64 / self.seconds)
    }

    /// Reads the log of a worker; `None` if the first line is not whole. `lives`: whether the worker renews the lease.
    #[must_use]
    pub fn read(text: &str, lives: bool) -> Option<Self> {
        // A line without a line feed is torn, or still being written, and is left out.
        let mut lines = text.split_inclusive('\n').filter_map(|line| line.strip_suffix('\n'));
        let [_, shard, _, process, _, host] = *lines.next()?.split(' ').collect::<Vec<_>>() else { return None };
        // A log without an end belongs to a worker at work or to a killed worker.
        let state = if lives { State::Working } else { State::Killed };
        let mut worker =
            Self { shard: shard.parse().ok()?, process: process.parse().ok()?, host: host.to_owned(), state, pieces: 0, units: 0, seconds: 0.0 };
        for line in lines {
            let words: Vec<&str> = line.split(' ').collect();
            let seconds = words.last().and_then(|word| word.parse().ok()).unwrap_or(worker.seconds);
            match *words {
                ["piece", _, units, _] => {
                    worker.pieces += 1;
                    worker.units += units.parse::<u64>().unwrap_or_default();
                }
                ["end", "done", _] => worker.state = State::Done,
                ["end", "interrupted", _] => worker.state = State::Interrupted,
                ["end", "failed", _] => worker.state = State::Failed,
                // Unknown lines, such as lines of later versions, are skipped.
                _ => continue,
            }
            worker.seconds = seconds;
        }
        Some(worker)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_log_says_what_its_worker_did_however_it_ended() {
        let whole = "shard 3/8 process 312 host node1\npiece 2 100 1.000\npiece 10 50 2.500\nend done 2.600\n";
        let read = |text: &str, lives| Worker::read(text, lives);
        let worker = read(whole, true).unwrap();
        assert_eq!((worker.shard.to_string(), worker.process, worker.host.as_str(), worker.state.word()), ("3/8".to_owned(), 312, "node1", "done"));
        assert_eq!((worker.pieces, worker.units, worker.seconds), (2, 150, 2.6));
        let torn = &whole[..whole.find("50 2.500").unwrap() + 4];
        for (lives, word) in [(true, "working"), (false, "killed")] {
            let worker = read(torn, lives).unwrap();
            assert_eq!((worker.state.word(), worker.pieces, worker.units_per_s()), (word, 1, Some(100.0)));
        }
        for (end, word) in [("interrupted", "interrupted"), ("failed", "failed")] {
            assert_eq!(read(&whole.replace("end done", &format!("end {end}")), false).unwrap().state.word(), word);
        }
        assert!(read("", true).is_none() && read("shard 3/8 process", true).is_none() && read("notes\n", true).is_none());
    }
}
