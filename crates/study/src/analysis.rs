//! From trials and answers to the values of units, groups of people, in each condition.

use cohaptic_campaign::Share;
use cohaptic_harness::task::{Movement, throughput};

use crate::folder::{KeptMovement, StudyFolder, needs_movements};
use crate::model::{After, QuestionKind, Study};
use crate::statistics::{ConditionMean, Difference, condition_means, differences_to_first};
use crate::tables::{KeptTrial, mean};

/// A valid, analysed trial.
#[derive(Clone, PartialEq, Debug)]
pub(crate) struct Observation {
    /// Index of the unit among the units of the analysis.
    pub(crate) unit: usize,
    pub(crate) condition: usize,
    /// Number of the trial in its condition, from 1.
    pub(crate) trial: usize,
    /// `true` if the task timed out.
    pub(crate) timed_out: bool,
    /// Values of the measures, indexed by measure.
    pub(crate) values: Vec<Option<f64>>,
    /// Movements to reached targets, for measures that need the movements of several trials together.
    pub(crate) movements: Vec<Movement>,
}

/// Figures of a measure, or of a question about the conditions.
#[derive(Clone, PartialEq, Debug)]
pub struct Analysed {
    /// Name of the measure or of the question.
    pub name: String,
    /// Means of each unit, indexed by unit and condition. Units without a value in a condition are left out.
    pub rows: Vec<Vec<f64>>,
    /// Number of units that are left out.
    pub left_out: usize,
    /// Means with intervals, indexed by condition; empty without a unit.
    pub means: Vec<ConditionMean>,
    /// Differences of the conditions but the first to the first.
    pub differences: Vec<Difference>,
    /// Trials that timed out and count as the timeout, among all trials with a value, indexed by condition; empty for a question.
    pub timed_out: Vec<Option<Share>>,
    /// Means over the units, indexed by condition and trial; NaN without a value. Empty for a question.
    pub curves: Vec<Vec<f64>>,
}

/// Figures of all measures and of all questions about the conditions.
#[derive(Clone, PartialEq, Debug)]
pub struct Analysis {
    /// Number of units: complete sessions.
    pub units: usize,
    /// Trials that timed out, among all analysed trials, indexed by condition.
    pub timed_out: Vec<Option<Share>>,
    /// Figures of the measures, in the order of the file.
    pub measures: Vec<Analysed>,
    /// Figures of the questions about the conditions, in the order of the file: the mean of a group, and of the Task Load Index the mean of its scales.
    pub questions: Vec<Analysed>,
}

/// Name of the measure that a trial which timed out has no value of, and counts as its timeout.
const TIME: &str = "task_time_s";

impl Analysis {
    /// Analyses some trials of `units` units.
    pub(crate) fn of(study: &Study, units: usize, observations: &[Observation]) -> Self {
        let measures = study.measures.iter().enumerate().map(|(place, name)| measure(study, units, observations, place, name));
        let timed_out = (0..study.conditions.len()).map(|condition| {
            let of_it = || observations.iter().filter(|observation| observation.condition == condition);
            Share::of(of_it().filter(|observation| observation.timed_out).count() as u64, of_it().count() as u64)
        });
        Self { units, timed_out: timed_out.collect(), measures: measures.collect(), questions: Vec::new() }
    }
}

impl StudyFolder {
    /// Analyses the complete sessions: their valid trials, repetitions included, without practice.
    ///
    /// # Errors
    ///
    /// [`StudyError`](crate::StudyError) if a trial is missing or cannot be read.
    pub fn analysis(&self) -> Result<Analysis, crate::StudyError> {
        Ok(self.analysis_of(&self.kept_trials()?))
    }

    pub(crate) fn analysis_of(&self, trials: &[KeptTrial]) -> Analysis {
        let study = self.study();
        let units: Vec<usize> = self.groups().iter().enumerate().filter(|(_, group)| group.is_done()).map(|(place, _)| place).collect();
        // A repeated trial carries the fault `Repeated` or another one, so only the repetition passes and no trial counts twice.
        let counts = |trial: &&KeptTrial| !trial.ended.plan.practice && trial.ended.faults.is_empty();
        let observation = |trial: &KeptTrial| {
            Some(Observation {
                // The list of units is ascending, because the groups are filtered in their order. Trials of incomplete sessions find no unit.
                unit: units.binary_search(&trial.group).ok()?,
                condition: trial.ended.plan.condition,
                trial: trial.ended.plan.trial,
                timed_out: trial.record.outcome == TIMED_OUT,
                values: study.measures.iter().map(|name| trial.record.value(name)).collect(),
                movements: trial.record.movements.iter().copied().map(KeptMovement::movement).collect(),
            })
        };
        let observations: Vec<Observation> = trials.iter().filter(counts).filter_map(observation).collect();
        let asked = study.questions.iter().enumerate().filter(|(_, question)| question.after == After::Condition);
        let questions = asked.map(|(place, question)| {
            let name = match question.kind {
                QuestionKind::Tlx => format!("{} (mean of the scales)", question.name),
                QuestionKind::Scale { .. } => question.name.clone(),
            };
            let value = |unit: usize, condition: usize| {
                let answers = self.groups()[units[unit]].answers().iter();
                let of_it = answers.filter(|answer| answer.question == place && answer.condition == Some(condition));
                // The group is the unit: its value is the mean of its people.
                let values: Vec<f64> = of_it.flat_map(|answer| answer.values.iter().map(|value| f64::from(*value))).collect();
                (!values.is_empty()).then(|| mean(&values))
            };
            analysed(study, name, units.len(), value)
        });
        Analysis { questions: questions.collect(), ..Analysis::of(study, units.len(), &observations) }
    }
}

/// Outcome, as in the records, of a trial whose task timed out. Such a trial has the timeout as its time.
pub(crate) const TIMED_OUT: &str = "timed-out";

fn measure(study: &Study, units: usize, observations: &[Observation], place: usize, name: &str) -> Analysed {
    let value_of = |observation: &Observation| {
        // A timed-out task has no time. Leaving such trials out would favour the condition in which people fail most often.
        let counts_as = (name == TIME && observation.timed_out).then_some(study.limit.as_secs_f64());
        observation.values[place].or(counts_as)
    };
    let of = |condition: usize, wanted: &dyn Fn(&Observation) -> bool| -> Option<f64> {
        let chosen = chosen(observations, condition, wanted);
        if needs_movements(name) {
            // The spread of the ends needs more movements than a trial has.
            return throughput(&chosen.iter().flat_map(|observation| &observation.movements).copied().collect::<Vec<_>>());
        }
        let values: Vec<f64> = chosen.into_iter().filter_map(value_of).collect();
        (!values.is_empty()).then(|| mean(&values))
    };
    // Trials of a unit are averaged first: the trials are not independent, and a unit with more valid trials must not weigh more.
    let value = |unit: usize, condition: usize| of(condition, &|observation| observation.unit == unit);
    let counts = |observation: &&Observation| value_of(observation).is_some() || needs_movements(name);
    let conditions = 0..study.conditions.len();
    let timed_out = conditions.clone().map(|condition| {
        // Both counts leave out trials without a value, so that the share describes the same trials as the mean. A throughput is that of all trials.
        let trials = |wanted: &dyn Fn(&Observation) -> bool| chosen(observations, condition, wanted).into_iter().filter(counts).count() as u64;
        Share::of(trials(&|observation| observation.timed_out), trials(&|_| true))
    });
    // A repetition has the number of the repeated trial and fills its place on the curve.
    let curve =
        |condition: usize| (1..=study.trials).map(|trial| of(condition, &|observation| observation.trial == trial).unwrap_or(f64::NAN)).collect();
    Analysed { timed_out: timed_out.collect(), curves: conditions.map(curve).collect(), ..analysed(study, name.to_owned(), units, value) }
}

fn chosen<'a>(observations: &'a [Observation], condition: usize, wanted: &dyn Fn(&Observation) -> bool) -> Vec<&'a Observation> {
    observations.iter().filter(|observation| observation.condition == condition && wanted(observation)).collect()
}

/// Returns the figures of values by unit and condition.
fn analysed(study: &Study, name: String, units: usize, value: impl Fn(usize, usize) -> Option<f64>) -> Analysed {
    // A unit without a value in one condition is left out of all conditions: intervals and differences need complete rows.
    let row = |unit: usize| (0..study.conditions.len()).map(|condition| value(unit, condition)).collect::<Option<Vec<f64>>>();
    let rows: Vec<Vec<f64>> = (0..units).filter_map(row).collect();
    let (means, differences) = (condition_means(&rows), differences_to_first(&rows, study.seed));
    Analysed { name, left_out: units - rows.len(), rows, means, differences, timed_out: Vec::new(), curves: Vec::new() }
}
