//! Tables and report, written from the kept trials and answers; their verification; and the removal of a person.

mod forget;
#[cfg(test)]
mod tests;
mod verify;

use std::fs;
use std::io::{ErrorKind, Write as _};

use cohaptic_campaign::Format;
use cohaptic_files::write_whole;

use crate::error::StudyError;
use crate::folder::StudyFolder;

pub use verify::Verified;

/// Name of the folder with the pictures of the report.
const PICTURES: &str = "pictures";

impl StudyFolder {
    /// Writes the tables, the pictures and the report again, from what is kept.
    ///
    /// # Errors
    ///
    /// [`StudyError::File`] if a file cannot be read or written, [`StudyError::Damaged`] for a damaged record of a trial.
    pub fn write_tables(&self) -> Result<(), StudyError> {
        // The records are read once and before the first write, so a damaged record leaves all tables as they were.
        let trials = self.kept_trials()?;
        let whole = |name: &str, bytes: &[u8]| {
            let path = self.path().join(name);
            write_whole(&path, |file| file.write_all(bytes)).map_err(StudyError::file("write", &path))
        };
        for (name, table) in [("trials", self.trial_table(&trials)), ("answers", self.answer_table())] {
            for format in [Format::Csv, Format::Parquet] {
                let name = format!("{name}.{}", format.name());
                let bytes = self.table_bytes(format, &table).map_err(StudyError::file("write", &self.path().join(&name)))?;
                whole(&name, &bytes)?;
            }
        }
        let pictures = self.path().join(PICTURES);
        // A study that has lost its last complete session has no pictures any more.
        match fs::remove_dir_all(&pictures) {
            Err(error) if error.kind() != ErrorKind::NotFound => return Err(StudyError::file("remove", &pictures)(error)),
            _ => fs::create_dir_all(&pictures).map_err(StudyError::file("make the folder", &pictures))?,
        }
        let analysis = self.analysis_of(&trials);
        for (name, picture) in analysis.pictures(self.study()) {
            whole(&format!("{PICTURES}/{name}.svg"), picture.svg().as_bytes())?;
        }
        whole("report.html", self.report(&trials, &analysis).as_bytes())
    }
}
