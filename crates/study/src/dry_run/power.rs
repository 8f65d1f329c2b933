//! Power of a study: the share of dry runs in which each difference is found.

use std::fs;
use std::io::Write as _;
use std::path::Path;

use cohaptic_campaign::Share;
use cohaptic_files::{read_text, write_whole};
use cohaptic_harness::Model;
use cohaptic_harness::measures::Measures;
use cohaptic_scene::TaskOutcome;
use cohaptic_wan::random::{Purpose, Stream};
use rayon::prelude::*;
use serde::{Deserialize, Serialize};

use super::Watch;
use crate::analysis::{Analysis, Observation};
use crate::codes::GroupCode;
use crate::error::StudyError;
use crate::folder::StudyFolder;
use crate::model::{Person, Study};
use crate::report::short;
use crate::sequence::{Event, Sequence, Step, TrialPlan};
use crate::text_table;
use crate::trial::Players;

/// Level below which a p counts as a found difference.
const LEVEL: f64 = 0.05;

/// Name of the folder of further runs.
const RUNS: &str = "dry-runs";

/// Power of a study, for each difference.
#[derive(Clone, PartialEq, Debug)]
pub struct Power {
    /// Number of dry runs.
    pub times: u64,
    /// Differences, in the order of measures, then of conditions.
    pub differences: Vec<DifferencePower>,
    /// Trials of all runs that timed out, indexed by condition.
    pub timed_out: Vec<Option<Share>>,
}

/// Shares of dry runs in which a difference to the first condition is found.
#[derive(Clone, PartialEq, Debug)]
pub struct DifferencePower {
    /// Name of the measure.
    pub measure: String,
    /// Index of the condition in [`Study::conditions`].
    pub condition: usize,
    /// Mean over the runs of the mean difference; NaN if no run has the measure.
    pub mean: f64,
    /// Runs with p < 0.05.
    pub alone: Share,
    /// Runs with p < 0.05 after the correction of Holm.
    pub corrected: Share,
}

/// Figures of a dry run, in the form of their file.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Run {
    /// Mean difference, p and corrected p, indexed by measure and condition from the second on; `None` for a measure without units.
    differences: Vec<Vec<Option<[f64; 3]>>>,
    /// Trials that timed out, and all trials, indexed by condition.
    timed_out: Vec<[u64; 2]>,
}

impl Run {
    fn of(study: &Study, analysis: &Analysis) -> Self {
        let measure = |measure: &crate::analysis::Analysed| {
            let figures = |place: usize| measure.differences.get(place).map(|found| [found.estimate.mean, found.p, found.p_holm]);
            (0..study.conditions.len().saturating_sub(1)).map(figures).collect()
        };
        let timed_out = analysis.timed_out.iter().map(|share| share.map_or([0, 0], |share| [share.count, share.of]));
        Self { differences: analysis.measures.iter().map(measure).collect(), timed_out: timed_out.collect() }
    }

    /// Returns whether the run has figures of each measure in each condition but the first.
    fn is_of(&self, study: &Study) -> bool {
        let is_whole = |figures: &Vec<Option<[f64; 3]>>| figures.len() + 1 == study.conditions.len();
        let has_conditions = self.timed_out.len() == study.conditions.len();
        has_conditions && self.differences.len() == study.measures.len() && self.differences.iter().all(is_whole)
    }
}

impl StudyFolder {
    /// Runs the study `times` times in all, the kept run included, each with other persons, and counts the found differences. Finished runs are kept, so that
    /// the same call goes on after an interruption. `None` if the watch stopped the runs.
    ///
    /// # Errors
    ///
    /// [`StudyError`] if a person's scene is refused, or if a file cannot be written.
    pub fn power(&self, times: u64, watch: &dyn Watch) -> Result<Option<Power>, StudyError> {
        let study = self.study();
        let folder = self.path().join(RUNS);
        fs::create_dir_all(&folder).map_err(StudyError::file("make the folder", &folder))?;
        // The kept run of the folder is the first of all runs, so the further runs have the numbers from 1.
        let further = (1..times).into_par_iter().map(|number| {
            let run = run_of(study, number, &folder.join(format!("{number:05}.json")), watch)?;
            if run.is_some() {
                watch.ran();
            }
            Ok(run)
        });
        let further: Vec<Option<Run>> = further.collect::<Result<_, StudyError>>()?;
        // Errors are returned before stopped runs are looked at: an error must not pass for an interruption.
        let Some(further) = further.into_iter().collect::<Option<Vec<Run>>>() else { return Ok(None) };
        let first = Run::of(study, &self.analysis()?);
        Ok(Some(counted(study, &std::iter::once(first).chain(further).collect::<Vec<Run>>())))
    }
}

/// Returns a further run: the kept figures, or the figures of a new run, which are then kept. Figures of an earlier version are replaced.
/// `None` if the watch stopped the run.
fn run_of(study: &Study, number: u64, path: &Path, watch: &dyn Watch) -> Result<Option<Run>, StudyError> {
    if path.exists() {
        let text = read_text(path).map_err(StudyError::file("read", path))?;
        let damaged = |error: serde_json::Error| StudyError::damaged(path, error.to_string());
        let kept: serde_json::Value = serde_json::from_str(&text).map_err(damaged)?;
        // An earlier version kept no timeouts. Such a run is computed again, from the same seed.
        let is_earlier = kept.get("differences").is_some() && kept.get("timed_out").is_none();
        if !is_earlier {
            let run: Run = serde_json::from_value(kept).map_err(damaged)?;
            // The shape is checked here, because `counted` indexes the figures by measure and condition.
            return if run.is_of(study) { Ok(Some(run)) } else { Err(StudyError::damaged(path, "it has figures of other measures or conditions")) };
        }
    }
    // A seed of its own gives the dry run other persons, other seeds of trials and other shuffled orders.
    let seed = Stream::new(study.seed, b"study dry run").packet(number).first(Purpose::Study) >> 11;
    let Some(analysis) = analysis_of(&Study { seed, ..study.clone() }, watch)? else { return Ok(None) };
    let run = Run::of(study, &analysis);
    let text = serde_json::to_string(&run).expect("numbers are written as JSON") + "\n";
    write_whole(path, |file| file.write_all(text.as_bytes())).map_err(StudyError::file("write", path))?;
    Ok(Some(run))
}

/// Plays the analysed trials of all groups, and analyses them. Practice is left out, because a modelled person learns nothing from trial to trial.
pub(super) fn analysis_of(study: &Study, watch: &dyn Watch) -> Result<Option<Analysis>, StudyError> {
    let mut trials: Vec<(usize, TrialPlan, Vec<Person>)> = Vec::new();
    for unit in 0..study.groups {
        // Without questions and breaks every step is a trial, and the loop below sees the whole session.
        let mut session = Sequence::new(&Study { questions: Vec::new(), breaks: None, ..study.clone() }, GroupCode::of_index(unit), unit);
        let persons = study.persons_of(&session);
        while let Step::Trial(plan) = session.step() {
            // Practice is not played but counted: the numbers of the trials, and so their seeds, are those of a session with practice.
            trials.extend((!plan.practice).then(|| (unit, plan, persons.clone())));
            session.handle(Event::TrialEnded { faults: Vec::new() })?;
        }
    }
    let observe = |(unit, plan, persons): &(usize, TrialPlan, Vec<Person>)| {
        if !watch.keep_going() {
            return Ok(None);
        }
        let trial = study.trial_scene(plan, Players::Modelled(persons))?;
        let run = Measures::run(&trial.scene, Model::Least);
        let value = |name: &String| run.values.iter().find(|measured| measured.name.text(&trial.scene) == *name).and_then(|measured| measured.value);
        let timed_out = run.task.as_ref().is_some_and(|task| task.outcome == TaskOutcome::TimedOut);
        let values = study.measures.iter().map(value).collect();
        let movements = run.task.map(|task| task.movements).unwrap_or_default();
        Ok(Some(Observation { unit: *unit, condition: plan.condition, trial: plan.trial, timed_out, values, movements }))
    };
    // All trials are planned before the first is run, because a plan needs its session and a run needs only the plan.
    let observations: Vec<Option<Observation>> = trials.par_iter().map(observe).collect::<Result<_, StudyError>>()?;
    let observations: Option<Vec<Observation>> = observations.into_iter().collect();
    Ok(observations.map(|observations| Analysis::of(study, study.groups, &observations)))
}

fn counted(study: &Study, runs: &[Run]) -> Power {
    let times = runs.len() as u64;
    let share = |found: usize| Share::of(found as u64, times).expect("the first run is one");
    let mut differences = Vec::new();
    for (measure, name) in study.measures.iter().enumerate() {
        for condition in 1..study.conditions.len() {
            // A run without figures stays in the number of runs: a difference that cannot be computed is not found.
            let figures: Vec<[f64; 3]> = runs.iter().filter_map(|run| run.differences[measure][condition - 1]).collect();
            let below = |place: usize| share(figures.iter().filter(|figures| figures[place] < LEVEL).count());
            let means: Vec<f64> = figures.iter().map(|figures| figures[0]).collect();
            let mean = crate::tables::mean(&means);
            differences.push(DifferencePower { measure: name.clone(), condition, mean, alone: below(1), corrected: below(2) });
        }
    }
    let timed_out = (0..study.conditions.len()).map(|condition| {
        let sum = |place: usize| runs.iter().map(|run| run.timed_out[condition][place]).sum();
        Share::of(sum(0), sum(1))
    });
    Power { times, differences, timed_out: timed_out.collect() }
}

/// Returns a share in percent, with its interval.
fn percent(share: Share) -> String {
    let percent = |value: f64| format!("{:.0}", 100.0 * value);
    format!("{} % ({} to {})", percent(share.value()), percent(share.low), percent(share.high))
}

/// Returns the trials of all dry runs that timed out as lines of text, a line per condition below the names of the columns. Empty if no trial timed out.
#[must_use]
pub fn timed_out_lines(study: &Study, power: &Power) -> Vec<String> {
    if power.timed_out.iter().flatten().all(|share| share.count == 0) {
        return Vec::new();
    }
    let head = ["condition", "timed out", "share"].map(str::to_owned);
    let rows = study.conditions.iter().zip(&power.timed_out).map(|(condition, share)| {
        let [count, of_all] = share.map_or_else(Default::default, |share| [format!("{} of {}", share.count, share.of), percent(share)]);
        [condition.label.clone(), count, of_all]
    });
    let rows: Vec<[String; 3]> = std::iter::once(head).chain(rows).collect();
    text_table::lines(&rows)
}

/// Returns the power of a dry run as lines of text, a line per difference below the names of the columns.
#[must_use]
pub fn power_lines(study: &Study, power: &Power) -> Vec<String> {
    let head = ["measure", "condition less the first", "mean difference", "p < 0.05", "after Holm"].map(str::to_owned);
    let rows = power.differences.iter().map(|difference| {
        let condition = study.conditions[difference.condition].label.clone();
        [difference.measure.clone(), condition, short(difference.mean), percent(difference.alone), percent(difference.corrected)]
    });
    let rows: Vec<[String; 5]> = std::iter::once(head).chain(rows).collect();
    text_table::lines(&rows)
}
