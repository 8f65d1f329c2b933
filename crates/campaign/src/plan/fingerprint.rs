//! What tells the scenes of a campaign from others: also what files say that they name.

use core::fmt::{self, Write as _};
use std::path::PathBuf;

use rayon::prelude::*;

use super::Plan;
use crate::error::CampaignError;

/// A number that other texts do not have: FNV-1a of 64 bits (Fowler, Noll & Vo 1991). It is no protection against malice.
struct Fnv(u64);

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
        let first = vec![0; self.variations.len()];
        let mut combinations = vec![0];
        for (key, vary) in self.variations.iter().enumerate() {
            combinations.extend((1..vary.count()).map(|place| {
                let mut places = first.clone();
                places[key] = place;
                self.combination(&places)
            }));
        }
        let numbers: Vec<Result<u64, CampaignError>> = combinations.into_par_iter().map(|combination| self.number_of(combination)).collect();
        let mut all = Fnv(0xcbf2_9ce4_8422_2325);
        for number in numbers {
            // Writing a number does not fail.
            let _ = write!(all, "{:016x}", number?);
        }
        Ok(all.0)
    }

    fn number_of(&self, combination: u64) -> Result<u64, CampaignError> {
        let mut scene = self.scene(combination)?;
        // The same scene under another name is the same; a title that is written stands in the text.
        scene.file = PathBuf::new();
        scene.title.clear();
        let mut number = Fnv(0xcbf2_9ce4_8422_2325);
        let _ = write!(number, "{scene:?}");
        Ok(number.0)
    }
}
