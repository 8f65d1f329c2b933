//! Verification of a study: every trial is replayed, and every table is made again.

use std::fs;

use cohaptic_campaign::Format;
use rayon::prelude::*;

use crate::error::StudyError;
use crate::folder::StudyFolder;
use crate::sequence::Fault;
use crate::tables::KeptTrial;
use crate::trial::Players;

/// Result of a verification.
#[derive(Clone, PartialEq, Eq, Debug, Default)]
pub struct Verified {
    /// Number of replayed trials.
    pub trials: usize,
    /// Differences between the kept files and the replays in words, each with the name of a file or trial.
    pub differences: Vec<String>,
}

impl StudyFolder {
    /// Replays every trial, and compares the measures with the record, the scene with the planned scene, and the tables with tables of the records.
    ///
    /// # Errors
    ///
    /// [`StudyError::File`] if a file cannot be read. Files with another content are differences.
    pub fn verify(&self) -> Result<Verified, StudyError> {
        // Records of earlier versions stay as they are here: each trial is replayed below, and every difference is then listed.
        let trials = self.recorded_trials()?;
        // Replays run in parallel. The collected order is the order of the trials, so the report does not depend on the threads.
        let found: Vec<Vec<String>> = trials.par_iter().map(|trial| self.differences_of(trial)).collect::<Result<_, StudyError>>()?;
        let mut differences: Vec<String> = found.into_iter().flatten().collect();
        for (name, table) in [("trials", self.trial_table(&trials)), ("answers", self.answer_table())] {
            for format in [Format::Csv, Format::Parquet] {
                let file = format!("{name}.{}", format.name());
                let path = self.path().join(&file);
                // Tables made from the same records by the same program have the same bytes, so no reader of tables is needed.
                let expected = self.table_bytes(format, &table).map_err(StudyError::file("write", &path))?;
                match fs::read(&path) {
                    Ok(bytes) if bytes == expected => {}
                    Ok(bytes) => differences.push(format!("{file}: {}", first_difference(format, &bytes, &expected))),
                    Err(error) if error.kind() == std::io::ErrorKind::NotFound => {
                        differences.push(format!("{file}: not there: cohaptic study report writes it"));
                    }
                    Err(error) => return Err(StudyError::file("read", &path)(error)),
                }
            }
        }
        Ok(Verified { trials: trials.len(), differences })
    }

    fn differences_of(&self, trial: &KeptTrial) -> Result<Vec<String>, StudyError> {
        let plan = &trial.ended.plan;
        let folder = self.trial(plan.code);
        let of_trial = |difference: String| format!("{}: {difference}", plan.code);
        // The experimenter may have repeated a valid trial after its record was kept.
        let faults: Vec<Fault> =
            trial.ended.faults.iter().copied().filter(|fault| *fault != Fault::Repeated || trial.record.faults.contains(fault)).collect();
        let is_as_told = trial.record.trial == plan.code && trial.record.faults == faults;
        let told = (!is_as_told).then(|| "trial.json has another code, or other faults, than the session".to_owned());
        let replayed = match trial.record.differences(&folder) {
            Ok(differences) => differences,
            // A damaged record or scene is a difference, not a failure of the verification.
            Err(error @ (StudyError::Damaged { .. } | StudyError::Study(_))) => vec![error.to_string()],
            Err(error) => return Err(error),
        };
        // Scenes of a dry run contain the persons, who follow from the seed and are drawn again here.
        let persons = self
            .is_dry()
            .then(|| (0..self.study().group_size()).map(|seat| self.study().person(plan.code.group.person(seat, self.study().group_size()))));
        let persons = persons.map(Iterator::collect::<Vec<_>>);
        let scene = self.study().trial_scene(plan, persons.as_deref().map_or(Players::People, Players::Modelled))?;
        let path = folder.join("scene.toml");
        // The replay proves only that record, scene and inputs agree. A scene of another condition is found by this comparison.
        let is_planned = fs::read_to_string(&path).map_err(StudyError::file("read", &path))? == scene.text;
        let other = (!is_planned).then(|| "scene.toml is not the scene of this trial".to_owned());
        Ok(replayed.into_iter().chain(other).chain(told).map(of_trial).collect())
    }
}

/// Returns the first difference of a table in words, with both lines for comma-separated values.
fn first_difference(format: Format, found: &[u8], expected: &[u8]) -> String {
    const OTHER: &str = "not the table of the kept trials and answers";
    if format == Format::Parquet {
        return OTHER.to_owned();
    }
    let (found, expected) = (String::from_utf8_lossy(found), String::from_utf8_lossy(expected));
    // Both sides are continued without end by `None`, so that a line missing at the end differs from the line expected there.
    let pairs = found.lines().map(Some).chain(std::iter::repeat(None)).zip(expected.lines().map(Some).chain(std::iter::repeat(None)));
    let differing = pairs.take(found.lines().count().max(expected.lines().count())).enumerate().find(|(_, (found, expected))| found != expected);
    differing.map_or_else(
        // Files can differ without a differing line: in the ends of lines, or in bytes that are no UTF-8.
        || OTHER.to_owned(),
        |(line, (found, expected))| format!("line {}: {} in place of {}", line + 1, found.unwrap_or("nothing"), expected.unwrap_or("nothing")),
    )
}
