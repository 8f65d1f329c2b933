//! What is written from the kept trials and answers, and can be written again: tables and report. Also what compares both, and what removes a person from both.

mod forget;
#[cfg(test)]
mod tests;
mod verify;

use std::io::Write as _;

use cohaptic_campaign::Format;
use cohaptic_files::write_whole;

use crate::error::StudyError;
use crate::folder::StudyFolder;

pub use verify::Verified;

impl StudyFolder {
    /// Writes the tables and the report again, from what is kept.
    ///
    /// # Errors
    ///
    /// [`StudyError::File`] if a file cannot be read or written, [`StudyError::Damaged`] if the record of a trial is none.
    pub fn write_tables(&self) -> Result<(), StudyError> {
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
        whole("report.html", self.report(&trials).as_bytes())
    }
}
