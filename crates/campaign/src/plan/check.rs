//! Reads the scene of every combination before the first run, and computes the fingerprint of a campaign's scenes.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};

use cohaptic_scene::{Fingerprint, Scene};
use rayon::prelude::*;

use super::{CampaignPlan, Refused};
use crate::error::CampaignError;
use crate::table::Roster;
use crate::watch::Watch;

/// Number of combinations checked between two questions to the watch.
const BLOCK: u64 = 64;

/// Result of the check of all combinations.
#[derive(Clone, Debug)]
pub(crate) struct Checked {
    pub(crate) roster: Roster,
    /// Approximate number of events (ticks and packets) of the longest run.
    pub(crate) events: u64,
    /// Fingerprints of the scenes covered by the fingerprint of the campaign, by combination. Kept here because reading these scenes again would repeat the
    /// check.
    pub(crate) numbers: BTreeMap<u64, u64>,
    /// Left out combinations.
    pub(crate) refused: Refused,
}

/// Result of the check of one block of combinations.
#[derive(Default)]
struct Block {
    /// Roster of the accepted combinations, and number of events of the longest run; `None` if all combinations are left out.
    runs: Option<(Roster, u64)>,
    numbers: BTreeMap<u64, u64>,
    refused: Refused,
}

impl CampaignPlan {
    /// Checks every combination, on all threads of the current thread pool.
    ///
    /// # Errors
    ///
    /// The error of the first refused combination; [`CampaignError::Stopped`] if the watch stopped the check.
    pub(crate) fn check(&self, watch: &dyn Watch) -> Result<Checked, CampaignError> {
        let blocks = self.combinations.div_ceil(BLOCK);
        // Number of the first refused block so far. Later blocks need no check, because only the error of the first refused block is reported.
        let refused = AtomicU64::new(u64::MAX);
        let check = |block: u64| {
            if refused.load(Ordering::Relaxed) < block {
                return Err(CampaignError::Stopped);
            }
            let checked = self.check_block(block, watch);
            if checked.is_err() {
                refused.fetch_min(block, Ordering::Relaxed);
            }
            checked
        };
        let checked: Vec<Result<Block, CampaignError>> = (0..blocks).into_par_iter().map(check).collect();
        let mut all = Block::default();
        // In the order of the blocks: the first error in this order is reported, whatever the number of threads. A block skipped above comes after the refused
        // block.
        for checked in checked {
            all.join(checked?);
        }
        let Block { runs, numbers, refused } = all;
        match (runs, refused.keys().next()) {
            (Some((roster, events)), _) => Ok(Checked { roster, events, numbers, refused }),
            // No combination is left to run. The first refusal gives the reason.
            (None, Some(first)) => Err(self.scene(*first).map_or_else(|error| error, |_| CampaignError::Stopped)),
            (None, None) => Err(CampaignError::Stopped),
        }
    }

    fn check_block(&self, block: u64, watch: &dyn Watch) -> Result<Block, CampaignError> {
        if !watch.keep_going() {
            return Err(CampaignError::Stopped);
        }
        let combinations = block * BLOCK..((block + 1) * BLOCK).min(self.combinations);
        let count = combinations.end - combinations.start;
        let mut all = Block::default();
        for combination in combinations {
            let (scene, reason) = self.scene_or_fallback(combination)?;
            match reason {
                Some(reason) => drop(all.refused.insert(combination, reason)),
                None => all.add(Roster::of(&scene), events(&scene)),
            }
            // The fingerprint also covers left out combinations, since a value may name a file there.
            if self.is_looked_at(combination) {
                all.numbers.insert(combination, scene.fingerprint().get());
            }
        }
        watch.checked(count);
        Ok(all)
    }

    /// Returns the scene of a combination. For a left out combination, returns its scene with the fallback, and the reason of the refusal.
    fn scene_or_fallback(&self, combination: u64) -> Result<(Scene, Option<String>), CampaignError> {
        let error = match self.scene(combination) {
            Ok(scene) => return Ok((scene, None)),
            Err(error) => error,
        };
        // Only a refused scene may be left out. Seeds beyond their range are an error with every strategy.
        let reason = match (&self.fallback, &error) {
            (Some(fallback), CampaignError::Scene { error: refused, .. }) => {
                let reason = refused.diagnostic().map_or_else(|| refused.to_string(), |diagnostic| diagnostic.message().to_owned());
                self.scene_with(combination, fallback).ok().map(|scene| (scene, Some(reason)))
            }
            _ => None,
        };
        reason.ok_or(error)
    }
}

impl Block {
    fn join(&mut self, other: Self) {
        if let Some((roster, events)) = other.runs {
            self.add(roster, events);
        }
        self.numbers.extend(other.numbers);
        self.refused.extend(other.refused);
    }

    fn add(&mut self, roster: Roster, events: u64) {
        match &mut self.runs {
            None => self.runs = Some((roster, events)),
            Some((all, most)) => {
                all.add(&roster);
                *most = events.max(*most);
            }
        }
    }
}

/// Returns the number of ticks of all peers plus the number of packets on all links.
fn events(scene: &Scene) -> u64 {
    let count = |period: std::time::Duration| scene.duration.as_nanos() / period.as_nanos().max(1);
    let ticks: u128 = scene.peers.iter().map(|peer| count(peer.clock.tick)).sum();
    let peers = scene.peers.len() as u128;
    // Every peer sends to every other peer once per update.
    let packets = count(scene.coordination.update) * peers * (peers - 1);
    u64::try_from(ticks + packets).unwrap_or(u64::MAX)
}

impl CampaignPlan {
    /// Returns the fingerprint of the scenes and of the files named by the scenes. The fingerprint covers the scenes in which at most one key differs from its
    /// first value: every value of every key occurs there, and so does every file named by a value. A left out combination counts with its fallback.
    ///
    /// # Errors
    ///
    /// The error of the first of these scenes to be refused.
    pub(crate) fn fingerprint(&self) -> Result<u64, CampaignError> {
        let numbers: Vec<Result<u64, CampaignError>> = self
            .looked_at()
            .into_par_iter()
            .map(|combination| self.scene_or_fallback(combination).map(|(scene, _)| scene.fingerprint().get()))
            .collect();
        Ok(all_of(numbers.into_iter().collect::<Result<Vec<u64>, CampaignError>>()?))
    }

    /// Returns the same number as [`CampaignPlan::fingerprint`], from scenes read before. `numbers`: fingerprints of the covered scenes, by combination.
    pub(crate) fn fingerprint_of(&self, numbers: &BTreeMap<u64, u64>) -> u64 {
        all_of(self.looked_at().into_iter().filter_map(|combination| numbers.get(&combination).copied()))
    }

    /// Returns `true` if the fingerprint covers a combination: at most one key differs from its first value.
    pub(super) fn is_looked_at(&self, combination: u64) -> bool {
        self.places(combination).into_iter().filter(|place| *place > 0).count() <= 1
    }

    /// Returns the combinations covered by the fingerprint, in the order of the fingerprint.
    fn looked_at(&self) -> Vec<u64> {
        let first = vec![0; self.variations.len()];
        let mut combinations = vec![0];
        for (key, vary) in self.variations.iter().enumerate() {
            // The first combination has the first value of every key. Each further value is combined with the first values of the other keys.
            combinations.extend((1..vary.count()).map(|place| {
                let mut places = first.clone();
                places[key] = place;
                self.combination(&places)
            }));
        }
        combinations
    }
}

/// Returns one number for many, sensitive to their order.
fn all_of(numbers: impl IntoIterator<Item = u64>) -> u64 {
    Fingerprint::of(numbers.into_iter().map(|number| format!("{number:016x}")).collect::<String>()).get()
}
