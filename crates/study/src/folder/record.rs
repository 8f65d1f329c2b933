//! `trial.json`: outcome, measures and faults of a trial. The measures come from a replay of scene and inputs.

use std::io::Write as _;
use std::path::Path;
use std::time::Duration;

use cohaptic_files::{read_text, write_whole};
use cohaptic_harness::live::{Inputs, RecordedScene, replay};
use cohaptic_harness::measures::Measures;
use cohaptic_harness::task::Movement;
use cohaptic_scene::{Measure, Scene, link_keys_of_text, scene_content_of_text};
use serde::{Deserialize, Serialize};

use crate::codes::TrialCode;
use crate::error::StudyError;
use crate::sequence::Fault;

/// Quality of a trial: faults, late ticks and round trips.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct TrialFacts {
    /// Reasons for which the trial is not valid; empty for a valid trial.
    pub faults: Vec<Fault>,
    /// Ticks that were late by the clock of the computer.
    pub late_ticks: u64,
    /// Round trips between the computer and the browser of each person, indexed by seat; `None` where nothing was measured. Empty for a dry run.
    pub round_trips: Vec<Option<RoundTrip>>,
}

/// Round trips to a browser, which add to the delay of the scene.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RoundTrip {
    /// Median \[s\].
    pub p50_s: f64,
    /// Quantile of 99 % \[s\].
    pub p99_s: f64,
}

/// Record of a trial, kept beside scene and inputs.
#[derive(Clone, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct TrialRecord {
    /// Code of the trial.
    pub trial: TrialCode,
    /// Reasons for which the trial was not valid at its end.
    pub faults: Vec<Fault>,
    /// Ticks that were late by the clock of the computer.
    pub late_ticks: u64,
    /// Round trips to the browsers, indexed by seat.
    pub round_trips: Vec<Option<RoundTrip>>,
    /// Outcome of the task in a word.
    pub outcome: String,
    /// Time from the start of the task to its outcome \[s\].
    pub time_s: f64,
    /// Values of the measures, in the order of [`Study::measures`](crate::Study::measures); `None` for a measure without a value.
    pub values: Vec<(String, Option<f64>)>,
    /// Movements to reached targets, for a study whose measures need the movements of several trials together; otherwise empty. Also empty in the record of
    /// an earlier version, which kept no movements.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub movements: Vec<KeptMovement>,
}

/// Movement to a target, along the line from the target before.
#[derive(Clone, Copy, PartialEq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KeptMovement {
    /// Distance moved \[m\].
    pub distance_m: f64,
    /// Position of the end beyond the target \[m\].
    pub beyond_m: f64,
    /// Time of the movement \[s\].
    pub time_s: f64,
}

impl KeptMovement {
    pub(crate) fn of(movement: &Movement) -> Self {
        Self { distance_m: movement.distance, beyond_m: movement.deviation, time_s: movement.time.as_secs_f64() }
    }

    pub(crate) fn movement(self) -> Movement {
        // A negative or infinite time was written by hand, and `verify` names the change.
        let time = Duration::try_from_secs_f64(self.time_s).unwrap_or_default();
        Movement { distance: self.distance_m, deviation: self.beyond_m, time }
    }
}

/// Returns whether a measure of a condition needs the movements of several trials together: the spread of the ends, and so the throughput.
pub(crate) fn needs_movements(measure: &str) -> bool {
    measure == Measure::Throughput.name()
}

/// Name of the record in the folder of a trial.
const RECORD: &str = "trial.json";

impl TrialRecord {
    /// Returns the record of the trial in a folder, whose scene and inputs are replayed.
    pub(crate) fn of(trial: TrialCode, folder: &Path, facts: TrialFacts) -> Result<Self, StudyError> {
        let TrialFacts { mut faults, late_ticks, round_trips } = facts;
        faults.sort_unstable();
        faults.dedup();
        let Replayed { outcome, time_s, values, movements } = Replayed::of(folder)?;
        Ok(Self { trial, faults, late_ticks, round_trips, outcome, time_s, values, movements })
    }

    pub(crate) fn write(&self, folder: &Path) -> Result<(), StudyError> {
        let path = folder.join(RECORD);
        let text = serde_json::to_string_pretty(self).expect("numbers and words are written as JSON") + "\n";
        write_whole(&path, |file| file.write_all(text.as_bytes())).map_err(StudyError::file("write", &path))
    }

    pub(crate) fn read(folder: &Path) -> Result<Self, StudyError> {
        let path = folder.join(RECORD);
        let text = read_text(&path).map_err(StudyError::file("read", &path))?;
        serde_json::from_str(&text).map_err(|error| StudyError::damaged(&path, error.to_string()))
    }

    /// Returns the record with the movements that an earlier version did not keep, taken from a replay of scene and inputs. A record that has all movements, or
    /// needs none, is returned unchanged.
    ///
    /// # Errors
    ///
    /// [`StudyError::Damaged`] if the replay has another outcome, time or value than the record; errors of the replay.
    pub(crate) fn with_movements(self, folder: &Path) -> Result<Self, StudyError> {
        // A trial in which no target was reached has no movements either. Its replay finds none.
        if !self.movements.is_empty() || !self.values.iter().any(|(name, _)| needs_movements(name)) {
            return Ok(self);
        }
        let replayed = Replayed::of(folder)?;
        // A replay with other results is the replay of another trial, and so its movements do not belong to this record.
        match self.differences_to(&replayed).first() {
            Some(difference) => {
                let message = format!("it has no movements, which earlier versions did not keep, and its replay is of another trial: {difference}");
                Err(StudyError::damaged(&folder.join(RECORD), message))
            }
            None => Ok(Self { movements: replayed.movements, ..self }),
        }
    }

    /// Returns the value of a measure; `None` for a measure without a value.
    pub(crate) fn value(&self, name: &str) -> Option<f64> {
        self.values.iter().find(|(known, _)| known == name).and_then(|(_, value)| *value)
    }

    /// Returns the differences between the record and the replay of the trial's scene and inputs, in words.
    pub(crate) fn differences(&self, folder: &Path) -> Result<Vec<String>, StudyError> {
        Ok(self.differences_to(&Replayed::of(folder)?))
    }

    fn differences_to(&self, replayed: &Replayed) -> Vec<String> {
        let Replayed { outcome, time_s, values, movements } = replayed;
        let mut differences = Vec::new();
        let mut compare = |name: &str, kept: String, replayed: String| {
            if kept != replayed {
                differences.push(format!("{name} is {kept} in the record and {replayed} in the replay"));
            }
        };
        compare("outcome", self.outcome.clone(), outcome.clone());
        // Numbers are compared as their shortest texts, which differ whenever two finite numbers differ, and serve the message too.
        compare("time_s", format!("{:?}", self.time_s), format!("{time_s:?}"));
        // An earlier version kept no movements, so their absence is no change of the record.
        if !self.movements.is_empty() {
            compare("a movement", format!("{:?}", self.movements), format!("{movements:?}"));
        }
        let text = |value: &Option<f64>| value.map_or_else(|| "nothing".to_owned(), |value| format!("{value:?}"));
        // The longer list sets the end, so that a missing measure and an additional one are both found.
        for place in 0..self.values.len().max(values.len()) {
            let name = |values: &[(String, Option<f64>)]| values.get(place).map(|(name, _)| name.clone());
            let value = |values: &[(String, Option<f64>)]| values.get(place).map_or_else(|| "not there".to_owned(), |(_, value)| text(value));
            let shown = name(&self.values).or_else(|| name(values)).unwrap_or_default();
            if name(&self.values) == name(values) {
                compare(&shown, value(&self.values), value(values));
            } else {
                compare("a measure", name(&self.values).unwrap_or_default(), name(values).unwrap_or_default());
            }
        }
        differences
    }
}

/// Result of the replay of a trial.
struct Replayed {
    outcome: String,
    time_s: f64,
    values: Vec<(String, Option<f64>)>,
    movements: Vec<KeptMovement>,
}

impl Replayed {
    fn of(folder: &Path) -> Result<Self, StudyError> {
        let (scene_file, inputs_file) = (folder.join("scene.toml"), folder.join("inputs.csv"));
        let text = read_text(&scene_file).map_err(StudyError::file("read", &scene_file))?;
        let scene = Scene::parse_live(&text, &scene_file, &[])?;
        let rows = read_text(&inputs_file).map_err(StudyError::file("read", &inputs_file))?;
        let refused = |message: String| StudyError::damaged(&inputs_file, message);
        let content = scene_content_of_text(&text, &scene_file, &[])?;
        let recorded = RecordedScene::read(&rows).map_err(|error| refused(error.to_string()))?;
        let recorded = recorded.ok_or_else(|| refused("it does not say of which scene it is".to_owned()))?;
        // Inputs of another scene would be replayed without any complaint and give wrong measures.
        if let Some(difference) = recorded.differences(&RecordedScene::of(&scene, content)).first() {
            return Err(refused(difference.to_string()));
        }
        let keys = link_keys_of_text(&text, &scene_file, &[])?.into_values().next();
        let inputs = match keys {
            Some(keys) => Inputs::read(&rows, &scene, &keys).map_err(|error| refused(error.to_string()))?,
            None => Inputs::default(),
        };
        let Some(mut measures) = Measures::of(&scene) else { return Err(StudyError::damaged(&scene_file, "it measures nothing")) };
        let Ok(summary) = replay(&scene, &inputs, &mut measures);
        let Some(task) = measures.task(&summary) else { return Err(StudyError::damaged(&scene_file, "it has no task")) };
        let values = measures.values(summary.duration).into_iter().map(|measured| (measured.name.text(&scene), measured.value));
        let values: Vec<(String, Option<f64>)> = values.collect();
        let needed = values.iter().any(|(name, _)| needs_movements(name));
        let movements = if needed { task.movements.iter().map(KeptMovement::of).collect() } else { Vec::new() };
        Ok(Self { outcome: task.outcome.name().to_owned(), time_s: task.time.as_secs_f64(), values, movements })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Without `float_roundtrip`, `serde_json` reads the first number as 7.4719999999999995.
    #[test]
    fn numbers_of_a_record_are_read_to_the_last_bit() {
        for number in [7.472, 0.390_536_237_206_244_3, -0.0, 5e-324, f64::MAX] {
            let read: RoundTrip = serde_json::from_str(&serde_json::to_string(&RoundTrip { p50_s: number, p99_s: 1.0 }).unwrap()).unwrap();
            assert_eq!(read.p50_s.to_bits(), number.to_bits(), "{number}");
        }
    }
}
