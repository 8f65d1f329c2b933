//! What tells the scenes of a campaign from others: also what files say that they name.

use std::collections::BTreeMap;

use cohaptic_scene::Fingerprint;
use rayon::prelude::*;

use super::CampaignPlan;
use crate::error::CampaignError;

impl CampaignPlan {
    /// A number for all that the scenes say. Looked at are those scenes in which every value of every key appears once: whatever file a value names is
    /// among them.
    ///
    /// # Errors
    ///
    /// If one of these scenes is refused: the first.
    pub(crate) fn fingerprint(&self) -> Result<u64, CampaignError> {
        let numbers: Vec<Result<u64, CampaignError>> =
            self.looked_at().into_par_iter().map(|combination| self.scene(combination).map(|scene| scene.fingerprint().get())).collect();
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
