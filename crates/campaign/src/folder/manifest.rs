//! The manifest: the file which states the identity of the campaign in a folder. The same command continues the campaign; another command is refused.

use std::io::Write as _;
use std::path::{Component, Path, PathBuf};

use cohaptic_files::{WholeFile, write_whole, write_whole_by};
use serde::{Deserialize, Serialize};

use crate::error::CampaignError;
use crate::plan::{Accepted, CampaignPlan, Checked, Parts, PlanSpec, Refused};
use crate::table::{Format, Roster};
use crate::vary::Variation;

/// Number of the layout of a campaign's files. A change of the layout needs another number.
const LAYOUT: u32 = 1;

/// Identity of a campaign: its plan, and the results of the check of its combinations.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Manifest {
    layout: u32,
    program: String,
    /// Path of the scene's file, relative to the folder of the campaign. Absent for a scene from standard input, and for campaigns of earlier versions. The
    /// path is not part of the identity.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    file: Option<String>,
    /// Text of the scene.
    scene: String,
    /// Fingerprint of the scenes and of the files named by the scenes, in 16 hexadecimal digits.
    fingerprint: String,
    set: Vec<String>,
    vary: Vec<String>,
    /// Number of runs per combination.
    runs: u64,
    /// Format of the table: `parquet` or `csv`.
    format: String,
    /// Number of runs per part chosen by the user; absent if the program chose `part_runs`.
    part: Option<u64>,
    /// Number of runs per part.
    part_runs: u64,
    /// `true` if the plan has verdicts.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    verdicts: bool,
    pub(crate) roster: Roster,
    /// Left out combinations, each with its reason.
    #[serde(default, skip_serializing_if = "Refused::is_empty")]
    pub(crate) refused: Refused,
}

impl Manifest {
    /// Returns the manifest of a checked plan.
    pub(crate) fn new(plan: &CampaignPlan, fingerprint: u64, checked: Checked, parts: Parts) -> Self {
        Self {
            layout: LAYOUT,
            program: plan.program().to_owned(),
            file: None,
            scene: plan.text().to_owned(),
            fingerprint: format!("{fingerprint:016x}"),
            set: plan.set().to_vec(),
            vary: plan.variations().iter().map(|vary| vary.text().to_owned()).collect(),
            runs: plan.runs_of_each(),
            format: plan.format().name().to_owned(),
            part: plan.part(),
            part_runs: parts.size,
            verdicts: plan.has_verdicts(),
            roster: checked.roster,
            refused: checked.refused,
        }
    }

    pub(crate) fn read(path: &Path) -> Result<Self, CampaignError> {
        let bytes = cohaptic_files::read_bytes(path).map_err(|error| CampaignError::File { verb: "read", path: path.to_path_buf(), error })?;
        let damaged =
            |message: String| CampaignError::Damaged { path: path.to_path_buf(), message, way_out: "choose another folder, or remove this one" };
        // The layout is read first: a manifest of another layout may have unknown fields, and the error should name the layout.
        let layout = serde_json::from_slice::<Layout>(&bytes).map_err(|error| damaged(error.to_string()))?.layout;
        if layout != LAYOUT {
            return Err(damaged(format!("layout {layout}: expected {LAYOUT}")));
        }
        let manifest: Self = serde_json::from_slice(&bytes).map_err(|error| damaged(error.to_string()))?;
        // `Parts` divides by the number of runs per part.
        if manifest.part_runs == 0 {
            return Err(damaged("parts of 0 runs".to_owned()));
        }
        Ok(manifest)
    }

    /// Returns the manifest with the path of the scene's file relative to the folder. The folder must exist.
    pub(crate) fn of_file(self, file: &Path, folder: &Path) -> Self {
        Self { file: from_folder(file, folder), ..self }
    }

    /// Rebuilds the plan from the manifest of this folder, for the program with that name and version.
    pub(crate) fn plan(&self, folder: &Path, program: &str) -> Result<CampaignPlan, CampaignError> {
        let damaged = |message: String| CampaignError::Damaged {
            path: folder.join(super::MANIFEST),
            message,
            way_out: "name the scene and the options of the campaign",
        };
        let format = [Format::Parquet, Format::Csv].into_iter().find(|format| format.name() == self.format);
        let format = format.ok_or_else(|| damaged(format!("the format {:?}", self.format)))?;
        let variations = self.vary.iter().map(|text| Variation::parse(text)).collect::<Result<_, _>>().map_err(|error| damaged(error.to_string()))?;
        let file = folder.join(self.file.as_deref().unwrap_or("scene.toml"));
        let spec = PlanSpec { text: &self.scene, file: &file, set: &self.set, variations, runs: self.runs, format, part: self.part, program };
        let plan = CampaignPlan::new(spec)?;
        Ok(if self.verdicts { plan.with_verdicts() } else { plan })
    }

    /// Returns the text of the manifest without the path of the scene's file. The tables contain this text, and so their bytes do not depend on the place of
    /// the folder.
    pub(crate) fn about(&self) -> String {
        Self { file: None, ..self.clone() }.text()
    }

    /// Writes the manifest. As a worker (`worker` is its name) other workers may write the same file at the same time.
    pub(crate) fn write(&self, path: &Path, worker: Option<&str>) -> Result<(), CampaignError> {
        let text = self.text();
        let write = |file: &mut WholeFile| file.write_all(text.as_bytes());
        let written = match worker {
            None => write_whole(path, write),
            Some(worker) => write_whole_by(path, worker, write),
        };
        written.map_err(|error| CampaignError::File { verb: "write", path: path.to_path_buf(), error })
    }

    /// Returns the text of the manifest's file.
    pub(crate) fn text(&self) -> String {
        // Text and numbers always have a form in JSON, so the serialisation cannot fail.
        let mut text = serde_json::to_string_pretty(self).unwrap_or_default();
        text.push('\n');
        text
    }

    /// Returns the parts of a campaign with this number of runs.
    pub(crate) const fn parts(&self, runs: u64) -> Parts {
        Parts { runs, size: self.part_runs }
    }

    /// Returns the accepted combinations of the plan.
    pub(crate) fn accepted(&self, plan: &CampaignPlan) -> Accepted {
        Accepted::new(plan.combinations(), plan.runs_of_each(), self.refused.keys().copied())
    }

    /// Returns the differences between this manifest and a plan, in words; empty if both are the same campaign. The files named by the scenes are not compared:
    /// the fingerprint covers their content.
    pub(crate) fn differences(&self, plan: &CampaignPlan) -> Vec<String> {
        let mut differences = Vec::new();
        let mut compare = |what: &str, there: String, here: String| {
            if there != here {
                differences.push(format!("{what} is {there} there and {here} here"));
            }
        };
        compare("the program", self.program.clone(), plan.program().to_owned());
        compare("--set", list(&self.set), list(plan.set()));
        let vary: Vec<String> = plan.variations().iter().map(|vary| vary.text().to_owned()).collect();
        compare("--vary", list(&self.vary), list(&vary));
        compare("--runs", self.runs.to_string(), plan.runs_of_each().to_string());
        compare("--format", self.format.clone(), plan.format().name().to_owned());
        let part = |part: Option<u64>| part.map_or_else(|| "not given".to_owned(), |part| part.to_string());
        compare("--part", part(self.part), part(plan.part()));
        let given = |verdicts: bool| if verdicts { "given" } else { "not given" }.to_owned();
        compare("--verdicts", given(self.verdicts), given(plan.has_verdicts()));
        if !self.refused.is_empty() && !plan.may_leave_out() {
            differences.push(format!("combinations that are refused, {} of them, are left out there and not here", self.refused.len()));
        }
        // The differing line says more to a user than two hashes would.
        if self.scene != plan.text() {
            differences.push(different_line(&self.scene, plan.text()));
        }
        differences
    }

    /// Returns `true` if the scenes and the files named by the scenes are unchanged since the campaign began.
    pub(crate) fn has_fingerprint(&self, fingerprint: u64) -> bool {
        self.fingerprint == format!("{fingerprint:016x}")
    }
}

/// Returns the path from a folder to a file, with slashes. Both must exist. `None` if there is no relative path, as between drives.
fn from_folder(file: &Path, folder: &Path) -> Option<String> {
    // Both paths are resolved, so that symbolic links and `..` do not hide a common folder.
    let (file, folder) = (file.canonicalize().ok()?, folder.canonicalize().ok()?);
    let shared = file.components().zip(folder.components()).take_while(|(one, other)| one == other).count();
    if shared == 0 {
        return None;
    }
    let up = folder.components().skip(shared).map(|_| Component::ParentDir);
    let way: PathBuf = up.chain(file.components().skip(shared)).collect();
    // Slashes work on every system, so the folder can be moved between systems.
    way.to_str().map(|way| way.replace('\\', "/"))
}

/// The part of the manifest found in every layout.
#[derive(Deserialize)]
struct Layout {
    layout: u32,
}

fn list(texts: &[String]) -> String {
    if texts.is_empty() { "not given".to_owned() } else { texts.join(" ") }
}

/// Returns, in words, the first different line of two scenes.
fn different_line(there: &str, here: &str) -> String {
    let (mut there, mut here) = (there.lines(), here.lines());
    let mut number = 1;
    loop {
        match (there.next(), here.next()) {
            (None, None) => return "the scene has other line ends".to_owned(),
            (there, here) if there == here => number += 1,
            (there, here) => {
                let shown = |line: Option<&str>| {
                    line.map_or_else(|| "at its end".to_owned(), |line| format!("`{}`", line.trim().chars().take(80).collect::<String>()))
                };
                return format!("line {number} of the scene is {} there and {} here", shown(there), shown(here));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_is_said_where_scenes_part() {
        assert_eq!(different_line("a\nb = 1\nc", "a\nb = 2\nc"), "line 2 of the scene is `b = 1` there and `b = 2` here");
        assert_eq!(different_line("a\n", "a\nb\n"), "line 2 of the scene is at its end there and `b` here");
        assert_eq!(different_line("a\n", "a\r\n"), "the scene has other line ends");
    }
}
