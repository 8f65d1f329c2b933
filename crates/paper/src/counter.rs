//! The smallest scene in which something happens that a claim says does not.
//!
//! Candidates are gone through in a fixed order, from the simple to the complicated: the fewest peers, then the shortest delay, then the roundest numbers, the paper's own
//! first. Of the first in which it happens the delay is then shortened, a millisecond at a time, for as long as it still happens.

use cohaptic_stability::Verdict;
use rayon::prelude::*;

use crate::case::{Case, Mass, Strategy};
use crate::{PaperError, Watch};

/// The numbers of peers that are tried.
pub(crate) const PEERS: [usize; 5] = [2, 3, 4, 5, 8];
/// The delays that are tried, one way [µs].
const DELAYS: [u32; 6] = [0, 4000, 8000, 16_000, 24_000, 48_000];
/// KT, the roundest first [N/m].
const STIFFNESSES: [f64; 9] = [1000.0, 2000.0, 100.0, 5000.0, 500.0, 200.0, 3000.0, 4000.0, 1500.0];
/// KC, the paper's first [N/m].
const COUPLINGS: [f64; 4] = [3500.0, 1000.0, 2000.0, 5000.0];
/// BT = BC, the paper's first [N·s/m].
const DAMPINGS: [f64; 2] = [5.0, 0.0];
/// A radius nearer to 1 than this convinces nobody.
const MARGIN: f64 = 1e-4;

/// All candidates, the simplest first, with AP.
fn candidates() -> Vec<Case> {
    let mut all: Vec<(usize, Case)> = Vec::new();
    for peers in PEERS {
        for delay_us in DELAYS {
            let begin = all.len();
            for (k, stiffness) in STIFFNESSES.into_iter().enumerate() {
                for (c, coupling_stiffness) in COUPLINGS.into_iter().enumerate() {
                    for (b, damping) in DAMPINGS.into_iter().enumerate() {
                        for (m, mass) in Mass::BOTH.into_iter().enumerate() {
                            // All touch, then one, then two of them, and so on.
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

/// The smallest candidate in which it happens; `None` if it happens in none.
pub(crate) fn smallest(watch: &dyn Watch, happens: impl Fn(&Case) -> Result<bool, PaperError> + Sync) -> Result<Option<Case>, PaperError> {
    // Whatever stops the search, stops it at the same candidate with any number of threads.
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
    while case.delay_us >= 1000 {
        let shorter = Case { delay_us: case.delay_us - 1000, ..case };
        if !happens(&shorter)? {
            break;
        }
        case = shorter;
    }
    Ok(Some(case))
}

/// Whether a case is stable, clearly.
pub(crate) fn is_stable(case: &Case) -> Result<bool, PaperError> {
    let radius = case.radius()?;
    Ok(radius.verdict() == Verdict::Stable && radius.value < 1.0 - MARGIN)
}

/// Whether a case is unstable, clearly.
pub(crate) fn is_unstable(case: &Case) -> Result<bool, PaperError> {
    let radius = case.radius()?;
    Ok(radius.verdict() == Verdict::Unstable && radius.value > 1.0 + MARGIN)
}

/// The case with one peer more, which touches if all do.
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
