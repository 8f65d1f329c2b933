//! Searches for the smallest counterexample of a claim.
//!
//! Candidates are tried in a fixed order, from simple to complicated: fewest peers first, then the shortest delay, then the roundest numbers, with the
//! paper's own numbers first. The delay of the first counterexample is then shortened in steps of a millisecond, as long as the scene stays a
//! counterexample.

use cohaptic_stability::Verdict;
use rayon::prelude::*;

use crate::case::{Case, Mass, Strategy};
use crate::{PaperError, Watch};

/// Numbers of peers tried.
pub(crate) const PEERS: [usize; 5] = [2, 3, 4, 5, 8];
/// Delays tried, one way \[µs\].
const DELAYS: [u32; 6] = [0, 4000, 8000, 16_000, 24_000, 48_000];
/// Values of KT tried, the roundest first \[N/m\].
const STIFFNESSES: [f64; 9] = [1000.0, 2000.0, 100.0, 5000.0, 500.0, 200.0, 3000.0, 4000.0, 1500.0];
/// Values of KC tried, the paper's first \[N/m\].
const COUPLINGS: [f64; 4] = [3500.0, 1000.0, 2000.0, 5000.0];
/// Values of BT = BC tried, the paper's first \[N·s/m\].
const DAMPINGS: [f64; 2] = [5.0, 0.0];
/// Least distance of a spectral radius from 1 that counts as a clear verdict.
const MARGIN: f64 = 1e-4;

/// Returns all candidates with AP, the simplest first.
fn candidates() -> Vec<Case> {
    let mut all: Vec<(usize, Case)> = Vec::new();
    for peers in PEERS {
        for delay_us in DELAYS {
            // Candidates with equal peers and delay begin here and are sorted by complexity: the sum of the positions in the lists above. The sort is stable.
            let begin = all.len();
            for (k, stiffness) in STIFFNESSES.into_iter().enumerate() {
                for (c, coupling_stiffness) in COUPLINGS.into_iter().enumerate() {
                    for (b, damping) in DAMPINGS.into_iter().enumerate() {
                        for (m, mass) in Mass::BOTH.into_iter().enumerate() {
                            // All touch first, then one peer, two peers, and so on.
                            for (t, touching) in std::iter::once(peers).chain(1..peers).enumerate() {
                                let paper = Case::paper(Strategy::Ap, peers);
                                let case =
                                    Case { delay_us, stiffness, coupling_stiffness, damping, coupling_damping: damping, mass, touching, ..paper };
                                all.push((k + c + b + m + t, case));
                            }
                        }
                    }
                }
            }
            all[begin..].sort_by_key(|(complexity, _)| *complexity);
        }
    }
    all.into_iter().map(|(_, case)| case).collect()
}

/// Returns the smallest candidate for which `happens` is true; `None` if no candidate is.
pub(crate) fn smallest(watch: &dyn Watch, happens: impl Fn(&Case) -> Result<bool, PaperError> + Sync) -> Result<Option<Case>, PaperError> {
    // `find_map_first` returns the first match in the order of the candidates, so the result does not depend on the number of threads. The same holds for
    // errors.
    let found = candidates().par_iter().find_map_first(|case| {
        if watch.stops() {
            return Some(Err(PaperError::Stopped));
        }
        match happens(case) {
            Ok(true) => Some(Ok(*case)),
            Ok(false) => None,
            Err(error) => Some(Err(error)),
        }
    });
    let Some(mut case) = found.transpose()? else { return Ok(None) };
    // Shortened after the parallel search and one step at a time, because each step depends on the step before.
    while case.delay_us >= 1000 {
        let shorter = Case { delay_us: case.delay_us - 1000, ..case };
        if !happens(&shorter)? {
            break;
        }
        case = shorter;
    }
    Ok(Some(case))
}

/// Returns whether a case is clearly stable: by more than [`MARGIN`].
pub(crate) fn is_stable(case: &Case) -> Result<bool, PaperError> {
    let radius = case.radius()?;
    Ok(radius.verdict() == Verdict::Stable && radius.value < 1.0 - MARGIN)
}

/// Returns whether a case is clearly unstable: by more than [`MARGIN`].
pub(crate) fn is_unstable(case: &Case) -> Result<bool, PaperError> {
    let radius = case.radius()?;
    Ok(radius.verdict() == Verdict::Unstable && radius.value > 1.0 + MARGIN)
}

/// Returns the case with one more peer. The new peer touches the object if all others do.
pub(crate) const fn one_more_peer(case: &Case) -> Case {
    let touching = if case.touching == case.peers { case.peers + 1 } else { case.touching };
    Case { peers: case.peers + 1, touching, ..*case }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Unwatched;

    #[test]
    fn the_simplest_candidate_comes_first() {
        let all = candidates();
        assert_eq!(all[0], Case { delay_us: 0, ..Case::paper(Strategy::Ap, 2) });
        assert!(all.windows(2).all(|pair| (pair[0].peers, pair[0].delay_us) <= (pair[1].peers, pair[1].delay_us)));
    }

    #[test]
    fn delays_are_shortened_for_as_long_as_it_happens() {
        let found = smallest(&Unwatched, |case| Ok(case.peers == 4 && case.delay_us > 9500)).unwrap().unwrap();
        assert_eq!((found.peers, found.delay_us, found.touching), (4, 10_000, 4));
        assert_eq!(smallest(&Unwatched, |_| Ok(false)).unwrap(), None);
    }
}
