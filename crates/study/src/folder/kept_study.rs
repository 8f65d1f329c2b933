//! `study.json`: texts of the study file and of the files named there, as of the beginning of the study.

use std::collections::BTreeMap;
use std::io;
use std::path::Path;

use cohaptic_files::read_text;
use cohaptic_linkfile::reading::FileReader;
use serde::{Deserialize, Serialize};

use crate::error::StudyError;
use crate::model::Study;

/// Texts of a study. Files have the names of the study file, because a path of the machine can contain the name of a person.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct KeptStudy {
    /// Name of the study file, without its folder.
    file: String,
    /// `true` if modelled persons play.
    dry_run: bool,
    /// Text of the study file.
    study: String,
    /// Texts of the named files.
    files: BTreeMap<String, String>,
}

impl KeptStudy {
    pub(super) fn of(study: &Study, dry_run: bool) -> Self {
        let file = study.file.file_name().unwrap_or_default().to_string_lossy().into_owned();
        Self { file, dry_run, study: study.text.clone(), files: study.files.clone() }
    }

    pub(super) const fn is_dry(&self) -> bool {
        self.dry_run
    }

    pub(super) fn read(path: &Path) -> Result<Self, StudyError> {
        let text = read_text(path).map_err(StudyError::file("read", path))?;
        serde_json::from_str(&text).map_err(|error| StudyError::damaged(path, error.to_string()))
    }

    pub(super) fn text(&self) -> String {
        serde_json::to_string_pretty(self).expect("texts are written as JSON") + "\n"
    }

    /// Reads the study from the texts.
    pub(super) fn study(&self) -> Result<Study, StudyError> {
        let read = |path: &Path| -> io::Result<Vec<u8>> {
            // The kept path of the study file has no folder, so paths of named files arrive as written, as in the keys of `files`.
            let text = path.to_str().and_then(|name| self.files.get(name));
            text.map(|text| text.as_bytes().to_vec()).ok_or_else(|| io::Error::from(io::ErrorKind::NotFound))
        };
        Ok(Study::parse_with(&self.study, Path::new(&self.file), FileReader(&read))?)
    }

    /// Returns the differences to the study of the present command, in words. The name of the study file does not count.
    pub(super) fn differences(&self, now: &Self) -> Vec<String> {
        let mut differences = Vec::new();
        if self.dry_run != now.dry_run {
            let words = |dry_run: bool| if dry_run { "a dry run" } else { "a study with people" };
            differences.push(format!("{} there, {} here", words(self.dry_run), words(now.dry_run)));
        }
        if self.study != now.study {
            differences.push("the study file says something else there than it does here".to_owned());
        }
        let names = self.files.keys().chain(now.files.keys()).collect::<std::collections::BTreeSet<&String>>();
        let differing = names.into_iter().filter(|name| self.files.get(*name) != now.files.get(*name));
        differences.extend(differing.map(|name| format!("the file {name} says something else there than it does here")));
        differences
    }
}
