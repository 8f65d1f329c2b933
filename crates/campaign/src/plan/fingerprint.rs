//! What tells the scenes of a campaign from others: also what files say that they name.

use core::fmt::{self, Write as _};
use std::collections::BTreeMap;
use std::path::PathBuf;

use cohaptic_scene::Scene;
use rayon::prelude::*;

use super::Plan;
use crate::error::CampaignError;

/// A number that other texts do not have: FNV-1a of 64 bits (Fowler, Noll & Vo 1991). It is no protection against malice.
struct Fnv(u64);

impl Fnv {
    const NONE: Self = Self(0xcbf2_9ce4_8422_2325);
}

impl fmt::Write for Fnv {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        self.0 = text.bytes().fold(self.0, |hash, byte| (hash ^ u64::from(byte)).wrapping_mul(0x0100_0000_01b3));
        Ok(())
    }
}

impl Plan {
    /// A number for all that the scenes say. Looked at are those scenes in which every value of every key appears once: whatever file a value names is
    /// among them.
    ///
    /// # Errors
    ///
    /// If one of these scenes is refused: the first.
    pub(crate) fn fingerprint(&self) -> Result<u64, CampaignError> {
        let numbers: Vec<Result<u64, CampaignError>> =
            self.looked_at().into_par_iter().map(|combination| self.scene(combination).map(number_of)).collect();
        Ok(all_of(numbers.into_iter().collect::<Result<Vec<u64>, CampaignError>>()?))
    }

    /// The same of scenes that have been read already: the [numbers](number_of) of those that are looked at, by combination.
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

/// A number for all that a scene says.
pub(super) fn number_of(mut scene: Scene) -> u64 {
    // The same scene under another name is the same; a title that is written stands in the text.
    scene.file = PathBuf::new();
    scene.title.clear();
    let mut number = Fnv::NONE;
    let _ = write!(number, "{scene:?}");
    number.0
}

/// One number for many, in their order.
fn all_of(numbers: impl IntoIterator<Item = u64>) -> u64 {
    let mut all = Fnv::NONE;
    for number in numbers {
        // Writing a number does not fail.
        let _ = write!(all, "{number:016x}");
    }
    all.0
}
