//! Search for the lost packets that make a program fail. The search has no clock and starts no program: the caller runs each trial.
//!
//! A run over links with losses by chance shows which packets were lost. A second run can lose packets with the same numbers without chance, and then fewer of
//! them. Programs in real time do not repeat their runs to the byte, so that each set of packets is tried several times, and counts only if the program
//! fails each time.

mod reduce;
#[cfg(test)]
mod tests;

use std::ops::RangeInclusive;

use crate::lost::LostPackets;
use reduce::reduce;

/// Seeds to be searched, and the number of trials of each set of lost packets.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Search {
    /// Seeds of the links, each tried once.
    pub seeds: RangeInclusive<u64>,
    /// Trials of a set of lost packets, at least 1. The program has to fail in each.
    pub runs: u32,
    /// `true` if no further seed is tried after a seed whose lost packets fail in each trial.
    pub until_failure: bool,
}

/// Links with a seed, and lost packets in place of losses by chance.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Case {
    /// Seed of all other random numbers of the links, such as those of jitter.
    pub seed: u64,
    /// Packets that the links lose.
    pub lost: LostPackets,
}

/// Network of a trial.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Trial<'a> {
    /// Links without delay and loss.
    Ideal,
    /// Links as configured, with this seed.
    Seed(u64),
    /// Links as configured, with chosen losses.
    Case(&'a Case),
}

/// Result of a trial.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Tried {
    /// Exit status of the program; 0 for a success.
    pub status: u8,
    /// Packets that the links have dropped.
    pub lost: LostPackets,
}

/// Progress of a search.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Step<'a> {
    /// Result of a seed.
    Seed(u64, &'a Tried),
    /// Result of the trials of a case.
    Case(&'a Case, Count),
    /// Result of the trials over ideal links.
    Ideal(Count),
}

/// Failures among the trials of one network.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct Count {
    /// Failed trials.
    pub failed: u32,
    /// Trials, failed and passed.
    pub runs: u32,
}

impl Count {
    /// Returns whether each trial has failed.
    #[must_use]
    pub const fn is_each(self) -> bool {
        self.failed == self.runs
    }

    /// Counts a trial.
    pub fn add(&mut self, tried: &Tried) {
        self.runs += 1;
        self.failed += u32::from(tried.status != 0);
    }
}

/// Result of a search.
#[derive(Clone, PartialEq, Eq, Debug)]
pub enum Found {
    /// The program has failed with no seed.
    Nothing,
    /// The program fails over ideal links too, so that the network is not the cause.
    Elsewhere,
    /// Smallest set of lost packets with a failing program, and the result of as many further trials as [`Search::runs`]. Without a lost packet the program
    /// fails by other effects of the links, such as their delay.
    Case(Case, Count),
}

/// Largest number of sets of lost packets, from failed seeds, to try until a set fails in each trial.
const MOST_STARTS: usize = 8;

impl Search {
    /// Searches. `run` runs a trial, and `hear` hears each result.
    ///
    /// The order: links without losses, and if the program fails there, ideal links; then each seed once; then the lost packets of failed seeds, fewest
    /// first, until a set fails in each trial; then smaller sets.
    ///
    /// # Errors
    ///
    /// The first error of `run`.
    pub fn run<E>(&self, mut run: impl FnMut(Trial<'_>) -> Result<Tried, E>, mut hear: impl FnMut(Step<'_>)) -> Result<Found, E> {
        let unlossy = Case { seed: *self.seeds.start(), lost: LostPackets::default() };
        let count = self.until_success(Trial::Case(&unlossy), &mut run)?;
        hear(Step::Case(&unlossy, count));
        if count.is_each() {
            let ideal = self.until_success(Trial::Ideal, &mut run)?;
            hear(Step::Ideal(ideal));
            return Ok(if ideal.is_each() { Found::Elsewhere } else { Found::Case(unlossy, count) });
        }
        let Some(Case { seed, lost }) = self.start(&mut run, &mut hear)? else { return Ok(Found::Nothing) };
        let lost = reduce(lost, |lost| {
            let case = Case { seed, lost: lost.clone() };
            let count = self.until_success(Trial::Case(&case), &mut run)?;
            hear(Step::Case(&case, count));
            Ok(count.is_each())
        })?;
        // The set was chosen because it has failed. Only further trials tell how often it fails.
        let case = Case { seed, lost };
        let count = self.count(&case, &mut run, &mut hear)?;
        Ok(Found::Case(case, count))
    }

    /// Tries the seeds, and then the lost packets of failed seeds. Returns the first case that fails in each trial, or else the case that fails most often.
    /// Returns `None` if no seed fails.
    fn start<E>(&self, run: &mut impl FnMut(Trial<'_>) -> Result<Tried, E>, hear: &mut impl FnMut(Step<'_>)) -> Result<Option<Case>, E> {
        let (mut failed, mut counted) = (Vec::new(), Vec::new());
        for seed in self.seeds.clone() {
            let tried = run(Trial::Seed(seed))?;
            hear(Step::Seed(seed, &tried));
            if tried.status == 0 {
                continue;
            }
            let case = Case { seed, lost: tried.lost };
            if !self.until_failure {
                failed.push(case);
                continue;
            }
            let count = self.count(&case, run, hear)?;
            if count.is_each() {
                return Ok(Some(case));
            }
            counted.push((case, count));
        }
        // Few packets are quickly reduced. Among sets of equal size, packets with low numbers exist in most trials, because little has happened before.
        failed.sort_by_key(|case| (case.lost.len(), case.lost.iter().map(|packet| packet.number).max()));
        for case in failed.into_iter().take(MOST_STARTS) {
            let count = self.count(&case, run, hear)?;
            if count.is_each() {
                return Ok(Some(case));
            }
            counted.push((case, count));
        }
        // In reverse order, because `max_by_key` returns the last maximum.
        Ok(counted.into_iter().rev().max_by_key(|(_, count)| count.failed).map(|(case, _)| case))
    }

    /// Counts the failures of a case in [`Search::runs`] trials.
    fn count<E>(&self, case: &Case, run: &mut impl FnMut(Trial<'_>) -> Result<Tried, E>, hear: &mut impl FnMut(Step<'_>)) -> Result<Count, E> {
        let mut count = Count::default();
        while count.runs < self.runs {
            count.add(&run(Trial::Case(case))?);
        }
        hear(Step::Case(case, count));
        Ok(count)
    }

    /// Counts the failures of a network before its first success, in at most [`Search::runs`] trials.
    fn until_success<E>(&self, trial: Trial<'_>, run: &mut impl FnMut(Trial<'_>) -> Result<Tried, E>) -> Result<Count, E> {
        let mut count = Count::default();
        while count.runs < self.runs && count.is_each() {
            count.add(&run(trial)?);
        }
        Ok(count)
    }
}
