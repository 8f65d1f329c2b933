//! Reads the scene of every combination before anything runs; and what tells the scenes of a campaign from others.

use std::collections::BTreeMap;
use std::sync::atomic::{AtomicU64, Ordering};

use cohaptic_scene::{Fingerprint, Scene};
use rayon::prelude::*;

use super::{CampaignPlan, Refused};
use crate::campaign::Watch;
use crate::error::CampaignError;
use crate::table::Roster;

/// The number of combinations that are checked between two looks at whether to go on.
const BLOCK: u64 = 64;

/// What the scenes of a campaign have in common.
#[derive(Clone, Debug)]
pub(crate) struct Checked {
    pub(crate) roster: Roster,
    /// How many events the longest run has, about: ticks and packets.
    pub(crate) events: u64,
    /// The numbers of those scenes that the fingerprint looks at, by combination: to read them a second time would take as long as the check.
    pub(crate) numbers: BTreeMap<u64, u64>,
    /// The combinations that are left out.
    pub(crate) refused: Refused,
}

/// What a block of combinations comes to.
#[derive(Default)]
struct Block {
    /// Their roster, and the events of the longest run; `None` if all of them are left out.
    runs: Option<(Roster, u64)>,
    numbers: BTreeMap<u64, u64>,
    refused: Refused,
}

impl CampaignPlan {
    /// Checks every combination, on all threads of the pool that it is called in.
    ///
    /// # Errors
    ///
    /// Of the first combination that is refused; [`CampaignError::Stopped`] if nobody wanted to know any more.
    pub(crate) fn check(&self, watch: &dyn Watch) -> Result<Checked, CampaignError> {
        let blocks = self.combinations.div_ceil(BLOCK);
        // Blocks behind one that is refused need not be looked at: the first error is the one that is shown.
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
        for checked in checked {
            all.join(checked?);
        }
        let Block { runs, numbers, refused } = all;
        match (runs, refused.keys().next()) {
            (Some((roster, events)), _) => Ok(Checked { roster, events, numbers, refused }),
            // Nothing is left to be run: the first refusal says why.
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
            if self.is_looked_at(combination) {
                all.numbers.insert(combination, scene.fingerprint().get());
            }
        }
        watch.checked(count);
        Ok(all)
    }

    /// The scene of a combination; of one that is left out its scene with the fallback, and why it is left out.
    fn scene_or_fallback(&self, combination: u64) -> Result<(Scene, Option<String>), CampaignError> {
        let error = match self.scene(combination) {
            Ok(scene) => return Ok((scene, None)),
            Err(error) => error,
        };
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

/// Ticks of all peers, and packets on all links.
fn events(scene: &Scene) -> u64 {
    let count = |period: std::time::Duration| scene.duration.as_nanos() / period.as_nanos().max(1);
    let ticks: u128 = scene.peers.iter().map(|peer| count(peer.clock.tick)).sum();
    let peers = scene.peers.len() as u128;
    let packets = count(scene.coordination.update) * peers * (peers - 1);
    u64::try_from(ticks + packets).unwrap_or(u64::MAX)
}

impl CampaignPlan {
    /// A number for all that the scenes say, and the files that they name. Looked at are those scenes in which every value of every key appears once: whatever file a value names is
    /// among them. A combination that is left out is looked at with the fallback.
    ///
    /// # Errors
    ///
    /// If one of these scenes is refused: the first.
    pub(crate) fn fingerprint(&self) -> Result<u64, CampaignError> {
        let numbers: Vec<Result<u64, CampaignError>> = self
            .looked_at()
            .into_par_iter()
            .map(|combination| self.scene_or_fallback(combination).map(|(scene, _)| scene.fingerprint().get()))
            .collect();
        Ok(all_of(numbers.into_iter().collect::<Result<Vec<u64>, CampaignError>>()?))
    }

    /// The same of scenes that have been read already: the fingerprints of those that are looked at, by combination.
    pub(crate) fn fingerprint_of(&self, numbers: &BTreeMap<u64, u64>) -> u64 {
        all_of(self.looked_at().into_iter().filter_map(|combination| numbers.get(&combination).copied()))
    }

    /// Whether the fingerprint looks at a combination: one in which at most one key has another value than its first.
    pub(super) fn is_looked_at(&self, combination: u64) -> bool {
        self.places(combination).into_iter().filter(|place| *place > 0).count() <= 1
    }

    /// The combinations that the fingerprint looks at, in its order.
    fn looked_at(&self) -> Vec<u64> {
        let first = vec![0; self.variations.len()];
        let mut combinations = vec![0];
        for (key, vary) in self.variations.iter().enumerate() {
            combinations.extend((1..vary.count()).map(|place| {
                let mut places = first.clone();
                places[key] = place;
                self.combination(&places)
            }));
        }
        combinations
    }
}

/// One number for many, in their order.
fn all_of(numbers: impl IntoIterator<Item = u64>) -> u64 {
    Fingerprint::of(numbers.into_iter().map(|number| format!("{number:016x}")).collect::<String>()).get()
}
