//! The plan of a campaign: which runs there are, and the scene of each.

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

/// The most combinations of values.
pub const MOST_COMBINATIONS: u64 = 10_000_000;

/// The most runs of a campaign.
pub const MOST_RUNS: u64 = 1_000_000_000;

/// What a user asks for.
#[derive(Clone, Debug)]
pub struct PlanSpec<'a> {
    /// The text of the scene.
    pub text: &'a str,
    /// Its file, for messages; its folder is where files that the scene names are looked for.
    pub file: &'a Path,
    /// Texts `KEY=VALUE` that replace values of the scene in every run.
    pub set: &'a [String],
    /// The keys that are varied; every combination of their values is run, the last key varying fastest.
    pub variations: Vec<Variation>,
    /// How many runs there are of each combination: with the seed of the scene, with the next one, and so on.
    pub runs: u64,
    /// As what the table is written.
    pub format: Format,
    /// How many runs are kept together as a part; `None`: what takes some seconds.
    pub part: Option<u64>,
    /// The program and its version; another one does not continue the campaign.
    pub program: &'a str,
}

/// A campaign as it is asked for: its runs are numbered from 0, combination by combination.
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
    /// With these overrides on top a combination is accepted that may be left out; `None`: none may.
    fallback: Option<Vec<String>>,
}

impl CampaignPlan {
    /// Puts a plan together. The scene is not read yet.
    ///
    /// # Errors
    ///
    /// [`CampaignError`] if a key is varied twice, if there are no runs, too many, or too many combinations, if a part is of no runs, or if seeds are varied
    /// and counted up.
    pub fn new(asked: PlanSpec<'_>) -> Result<Self, CampaignError> {
        let PlanSpec { text, file, set, variations, runs, format, part, program } = asked;
        for (place, vary) in variations.iter().enumerate() {
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
        if runs > 1 && variations.iter().any(|vary| vary.is_key("scene.seed")) {
            return Err(CampaignError::Seeds { runs });
        }
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

    /// The same campaign with a verdict on each combination, which stands in the rows of its runs.
    #[must_use]
    pub fn with_verdicts(self) -> Self {
        Self { verdicts: true, ..self }
    }

    /// The same campaign, in which a combination is left out whose scene is refused and would not be with these overrides on top: what refuses it is then the
    /// value that they replace. Any other refusal is an error as ever.
    #[must_use]
    pub fn leaving_out(self, fallback: Vec<String>) -> Self {
        Self { fallback: Some(fallback), ..self }
    }

    /// The file of the scene.
    pub(crate) fn file(&self) -> &Path {
        &self.file
    }

    /// Whether each combination is judged.
    #[must_use]
    pub const fn has_verdicts(&self) -> bool {
        self.verdicts
    }

    /// How many combinations of values there are; 1 if nothing is varied.
    #[must_use]
    pub const fn combinations(&self) -> u64 {
        self.combinations
    }

    /// How many runs there are of each combination.
    #[must_use]
    pub const fn runs_of_each(&self) -> u64 {
        self.runs
    }

    /// How many runs there are in all, if no combination is left out.
    #[must_use]
    pub const fn runs(&self) -> u64 {
        self.combinations * self.runs
    }

    /// The keys that are varied.
    #[must_use]
    pub fn variations(&self) -> &[Variation] {
        &self.variations
    }

    /// What a combination puts into the scene, on top of the overrides of all runs: texts `KEY=VALUE`.
    #[must_use]
    pub fn varied(&self, combination: u64) -> Vec<String> {
        self.places(combination).into_iter().zip(&self.variations).flat_map(|(place, vary)| vary.overrides(place)).collect()
    }

    /// The values of a combination, for the table.
    pub(crate) fn values(&self, combination: u64) -> impl Iterator<Item = &Varied> {
        self.places(combination).into_iter().zip(&self.variations).map(|(place, vary)| &vary.values()[place])
    }

    /// Which value of each key a combination has.
    #[must_use]
    pub fn places(&self, combination: u64) -> Vec<usize> {
        let mut left = combination;
        let mut places: Vec<usize> = self
            .variations
            .iter()
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

    /// The combination with these places.
    #[must_use]
    pub fn combination(&self, places: &[usize]) -> u64 {
        places.iter().zip(&self.variations).fold(0, |combination, (place, vary)| combination * vary.count() as u64 + *place as u64)
    }

    /// The scene of a combination. Its seed is that of the first of its runs.
    ///
    /// # Errors
    ///
    /// [`CampaignError::Scene`] if the scene is refused with these values or too large, [`CampaignError::NotRun`] if its seeds leave their range.
    pub fn scene(&self, combination: u64) -> Result<Scene, CampaignError> {
        self.scene_with(combination, &[])
    }

    /// The scene of a combination with more overrides on top.
    fn scene_with(&self, combination: u64, more: &[String]) -> Result<Scene, CampaignError> {
        let varied = self.varied(combination);
        let overrides: Vec<String> = self.set.iter().chain(&varied).chain(more).cloned().collect();
        let scene = match Scene::parse(&self.text, &self.file, &overrides) {
            Ok(scene) => scene,
            Err(error) => return Err(CampaignError::Scene { error: Box::new(error), varied }),
        };
        if let Some(TooLarge { peer, reason }) = too_large(&scene, Model::Least, Measures::of(&scene).is_some()) {
            let error = Box::new(at_peer(&self.text, &self.file, &overrides, peer, &reason));
            return Err(CampaignError::Scene { error, varied });
        }
        // Seeds are at most what a scene file may say, so that every run can be repeated alone.
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

    pub(crate) const fn format(&self) -> Format {
        self.format
    }

    pub(crate) fn program(&self) -> &str {
        &self.program
    }

    pub(crate) fn text(&self) -> &str {
        &self.text
    }

    pub(crate) fn set(&self) -> &[String] {
        &self.set
    }

    /// Whether combinations may be left out.
    pub(crate) const fn may_leave_out(&self) -> bool {
        self.fallback.is_some()
    }

    pub(crate) const fn part(&self) -> Option<u64> {
        self.part
    }
}
