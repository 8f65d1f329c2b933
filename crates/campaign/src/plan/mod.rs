//! The plan of a campaign: the numbering of its runs, and the scene of each run. The plan knows nothing of folders and threads.

mod accepted;
mod check;
mod parts;
#[cfg(test)]
mod tests;

use std::path::{Path, PathBuf};

use cohaptic_harness::measures::Measures;
use cohaptic_harness::{Model, TooLarge, too_large};
use cohaptic_scene::{Scene, at_peer};

use crate::error::CampaignError;
use crate::table::Format;
use crate::vary::{Variation, Varied, same_key};

pub(crate) use accepted::Accepted;
pub use accepted::Refused;
pub(crate) use check::Checked;
pub(crate) use parts::{CHUNK, Parts};

/// Greatest number of combinations of values of a plan.
pub const MOST_COMBINATIONS: u64 = 10_000_000;

/// Greatest number of runs of a campaign.
pub(crate) const MOST_RUNS: u64 = 1_000_000_000;

/// The request of a user, from which a [`CampaignPlan`] is made.
#[derive(Clone, Debug)]
pub struct PlanSpec<'a> {
    /// Text of the scene.
    pub text: &'a str,
    /// File of the scene, for messages. Files named by the scene are searched in the folder of this file.
    pub file: &'a Path,
    /// Overrides `KEY=VALUE` for every run.
    pub set: &'a [String],
    /// Varied keys. Every combination of their values is run; the last key varies fastest.
    pub variations: Vec<Variation>,
    /// Number of runs per combination: the first with the seed of the scene, each further run with the next seed.
    pub runs: u64,
    /// Format of the table.
    pub format: Format,
    /// Number of runs per part; `None` for a size of some seconds of work.
    pub part: Option<u64>,
    /// Name and version of the program. Another program does not continue the campaign.
    pub program: &'a str,
}

/// The plan of a campaign, with a checked number of runs. Runs are numbered from 0, combination by combination.
#[derive(Clone, Debug)]
pub struct CampaignPlan {
    text: String,
    file: PathBuf,
    set: Vec<String>,
    variations: Vec<Variation>,
    runs: u64,
    combinations: u64,
    format: Format,
    part: Option<u64>,
    program: String,
    verdicts: bool,
    /// Overrides which tell a refusal that may be left out from a fault: a refused combination is left out if its scene is accepted with these overrides on
    /// top. `None`: no combination may be left out.
    fallback: Option<Vec<String>>,
}

impl CampaignPlan {
    /// Makes a plan, without reading the scene.
    ///
    /// # Errors
    ///
    /// [`CampaignError`] if a key is varied twice, if there are no runs, too many runs or too many combinations, if a part has no runs, or if the seed is
    /// varied and several runs per combination count seeds up.
    pub fn new(asked: PlanSpec<'_>) -> Result<Self, CampaignError> {
        let PlanSpec { text, file, set, variations, runs, format, part, program } = asked;
        for (place, vary) in variations.iter().enumerate() {
            // Two values for one key would override each other, and the columns would have one name.
            if variations[..place].iter().any(|other| same_key(other.key(), vary.key())) {
                return Err(CampaignError::SameKey { key: vary.key().to_owned() });
            }
        }
        if runs == 0 {
            return Err(CampaignError::Size("0 runs of each combination: expected at least 1".to_owned()));
        }
        if part == Some(0) {
            return Err(CampaignError::Size("parts of 0 runs: expected at least 1".to_owned()));
        }
        // The seeds of the runs count up from the seed of the scene, which a varied seed would contradict.
        if runs > 1 && variations.iter().any(|vary| vary.is_key("scene.seed")) {
            return Err(CampaignError::Seeds { runs });
        }
        // Both products are checked: a plan with 2⁶⁴ runs must be refused and not wrap around.
        let all = variations.iter().try_fold(1_u64, |all, vary| all.checked_mul(vary.count() as u64));
        let combinations = all.filter(|all| *all <= MOST_COMBINATIONS).ok_or_else(|| {
            let counts: Vec<String> = variations.iter().map(|vary| vary.count().to_string()).collect();
            CampaignError::Size(format!("{} combinations: expected at most {MOST_COMBINATIONS}", counts.join(" × ")))
        })?;
        if combinations.checked_mul(runs).is_none_or(|all| all > MOST_RUNS) {
            return Err(CampaignError::Size(format!(
                "{runs} runs of each combination, of which there are {combinations}: expected at most {MOST_RUNS} runs in all"
            )));
        }
        let (text, file, set, program) = (text.to_owned(), file.to_path_buf(), set.to_vec(), program.to_owned());
        Ok(Self { text, file, set, variations, runs, combinations, format, part, program, verdicts: false, fallback: None })
    }

    /// Adds a verdict on each combination, written in the rows of its runs.
    #[must_use]
    pub fn with_verdicts(self) -> Self {
        Self { verdicts: true, ..self }
    }

    /// Lets the campaign leave out a combination whose scene is refused, but is accepted with these overrides on top: the cause of the refusal is then the
    /// value replaced by the overrides. Every other refusal stays an error.
    #[must_use]
    pub fn leaving_out(self, fallback: Vec<String>) -> Self {
        Self { fallback: Some(fallback), ..self }
    }

    /// Returns the file of the scene, for messages.
    #[must_use]
    pub fn file(&self) -> &Path {
        &self.file
    }

    /// Returns `true` if each combination is judged.
    #[must_use]
    pub const fn has_verdicts(&self) -> bool {
        self.verdicts
    }

    /// Returns the number of combinations; 1 if nothing is varied.
    #[must_use]
    pub const fn combinations(&self) -> u64 {
        self.combinations
    }

    /// Returns the number of runs per combination.
    #[must_use]
    pub const fn runs_of_each(&self) -> u64 {
        self.runs
    }

    /// Returns the number of all runs, including the runs of left out combinations.
    #[must_use]
    pub const fn runs(&self) -> u64 {
        self.combinations * self.runs
    }

    /// Returns the varied keys.
    #[must_use]
    pub fn variations(&self) -> &[Variation] {
        &self.variations
    }

    /// Returns the overrides of a combination, as texts `KEY=VALUE`. They come on top of the overrides of all runs.
    #[must_use]
    pub fn varied(&self, combination: u64) -> Vec<String> {
        self.places(combination).into_iter().zip(&self.variations).flat_map(|(place, vary)| vary.overrides(place)).collect()
    }

    /// Returns the values of a combination for the table, indexed by key.
    pub(crate) fn values(&self, combination: u64) -> impl Iterator<Item = &Varied> {
        self.places(combination).into_iter().zip(&self.variations).map(|(place, vary)| &vary.values()[place])
    }

    /// Returns, for each key, the index of its value in a combination.
    #[must_use]
    pub fn places(&self, combination: u64) -> Vec<usize> {
        let mut left = combination;
        let mut places: Vec<usize> = self
            .variations
            .iter()
            // The combination is a number in a mixed base. The last key is the lowest digit, so the digits come out in reverse order.
            .rev()
            .map(|vary| {
                let count = vary.count() as u64;
                let place = left % count;
                left /= count;
                usize::try_from(place).unwrap_or_default()
            })
            .collect();
        places.reverse();
        places
    }

    /// Returns the combination with these indices of values, the inverse of [`CampaignPlan::places`].
    #[must_use]
    pub fn combination(&self, places: &[usize]) -> u64 {
        places.iter().zip(&self.variations).fold(0, |combination, (place, vary)| combination * vary.count() as u64 + *place as u64)
    }

    /// Returns the scene of a combination, with the seed of its first run.
    ///
    /// # Errors
    ///
    /// [`CampaignError::Scene`] if the scene is refused with these values or too large, [`CampaignError::NotRun`] if the seeds of its runs leave the range of
    /// seeds.
    pub fn scene(&self, combination: u64) -> Result<Scene, CampaignError> {
        self.scene_with(combination, &[])
    }

    /// Returns the scene of a combination with further overrides on top.
    fn scene_with(&self, combination: u64, more: &[String]) -> Result<Scene, CampaignError> {
        let varied = self.varied(combination);
        let overrides: Vec<String> = self.set.iter().chain(&varied).chain(more).cloned().collect();
        let scene = match Scene::parse(&self.text, &self.file, &overrides) {
            Ok(scene) => scene,
            Err(error) => return Err(CampaignError::Scene { error: Box::new(error), varied }),
        };
        // The size is checked here, so that a too large scene is refused before the first run.
        if let Some(TooLarge { peer, reason }) = too_large(&scene, Model::Least, Measures::of(&scene).is_some()) {
            let error = Box::new(at_peer(&self.text, &self.file, &overrides, peer, &reason));
            return Err(CampaignError::Scene { error, varied });
        }
        // A scene file can state seeds up to this one. A larger seed could not be repeated as a single run.
        let most = i64::MAX.unsigned_abs();
        if scene.seed > most - (self.runs - 1) {
            let message = format!(
                "scene.seed: the seeds of {} runs from {} on are not all seeds of a scene: expected the last to be at most {most}",
                self.runs, scene.seed
            );
            return Err(CampaignError::NotRun { message, varied });
        }
        Ok(scene)
    }

    /// Returns the format of the table.
    #[must_use]
    pub const fn format(&self) -> Format {
        self.format
    }

    pub(crate) fn program(&self) -> &str {
        &self.program
    }

    /// Returns the text of the scene.
    #[must_use]
    pub fn text(&self) -> &str {
        &self.text
    }

    /// Returns the overrides `KEY=VALUE` of every run.
    #[must_use]
    pub fn set(&self) -> &[String] {
        &self.set
    }

    /// Returns `true` if combinations may be left out.
    pub(crate) const fn may_leave_out(&self) -> bool {
        self.fallback.is_some()
    }

    pub(crate) const fn part(&self) -> Option<u64> {
        self.part
    }
}
