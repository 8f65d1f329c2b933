//! What a campaign is, as a file in its folder: the same command goes on, another one is refused.

use std::io::Write as _;
use std::path::{Component, Path, PathBuf};

use cohaptic_files::{WholeFile, write_whole, write_whole_by};
use serde::{Deserialize, Serialize};

use crate::error::CampaignError;
use crate::plan::{Accepted, CampaignPlan, Checked, Parts, PlanSpec, Refused};
use crate::table::{Format, Roster};
use crate::vary::Variation;

/// How files of a campaign are laid out. Another layout is another number.
const LAYOUT: u32 = 1;

/// What a campaign is.
#[derive(Clone, PartialEq, Eq, Debug, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct Manifest {
    layout: u32,
    program: String,
    /// Way to the scene's file from the folder of the campaign; absent of a scene that came from standard input, and of campaigns of earlier versions. It is
    /// no part of what the campaign is.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    file: Option<String>,
    /// The text of the scene.
    scene: String,
    /// Of the scenes, with what the files say that they name.
    fingerprint: String,
    set: Vec<String>,
    vary: Vec<String>,
    /// Of each combination.
    runs: u64,
    /// Parquet or CSV.
    format: String,
    /// As asked for; absent if that was left to the program.
    part: Option<u64>,
    /// How many runs a part has.
    part_runs: u64,
    /// Whether combinations are judged.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    verdicts: bool,
    pub(crate) roster: Roster,
    /// The combinations that are left out.
    #[serde(default, skip_serializing_if = "Refused::is_empty")]
    pub(crate) refused: Refused,
}

impl Manifest {
    /// Of a plan that was checked.
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
        let layout = serde_json::from_slice::<Layout>(&bytes).map_err(|error| damaged(error.to_string()))?.layout;
        if layout != LAYOUT {
            return Err(damaged(format!("layout {layout}: expected {LAYOUT}")));
        }
        let manifest: Self = serde_json::from_slice(&bytes).map_err(|error| damaged(error.to_string()))?;
        if manifest.part_runs == 0 {
            return Err(damaged("parts of 0 runs".to_owned()));
        }
        Ok(manifest)
    }

    /// The same with where the scene's file is from that folder, which exists.
    pub(crate) fn of_file(self, file: &Path, folder: &Path) -> Self {
        Self { file: from_folder(file, folder), ..self }
    }

    /// The plan of which this is the campaign, in that folder.
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

    /// The text of the file without the way to the scene. Tables hold this text, and are the same wherever they are made.
    pub(crate) fn about(&self) -> String {
        Self { file: None, ..self.clone() }.text()
    }

    /// Writes the file, which other workers may be writing too if this is one of them.
    pub(crate) fn write(&self, path: &Path, worker: Option<&str>) -> Result<(), CampaignError> {
        let text = self.text();
        let write = |file: &mut WholeFile| file.write_all(text.as_bytes());
        let written = match worker {
            None => write_whole(path, write),
            Some(worker) => write_whole_by(path, worker, write),
        };
        written.map_err(|error| CampaignError::File { verb: "write", path: path.to_path_buf(), error })
    }

    /// As it stands in the file.
    pub(crate) fn text(&self) -> String {
        // Text and numbers always have a form in JSON.
        let mut text = serde_json::to_string_pretty(self).unwrap_or_default();
        text.push('\n');
        text
    }

    /// The parts that a campaign of a number of runs is cut into.
    pub(crate) const fn parts(&self, runs: u64) -> Parts {
        Parts { runs, size: self.part_runs }
    }

    /// The combinations that are run.
    pub(crate) fn accepted(&self, plan: &CampaignPlan) -> Accepted {
        Accepted::new(plan.combinations(), plan.runs_of_each(), self.refused.keys().copied())
    }

    /// What this campaign, which is there, has that the plan has not, in words; nothing if it is the same one. Files that scenes name are not compared.
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
        if self.scene != plan.text() {
            differences.push(different_line(&self.scene, plan.text()));
        }
        differences
    }

    /// Whether the scenes and the files that they name say what they said when the campaign began.
    pub(crate) fn has_fingerprint(&self, fingerprint: u64) -> bool {
        self.fingerprint == format!("{fingerprint:016x}")
    }
}

/// The way from a folder to a file, both of which exist; `None` if there is none, as between drives.
fn from_folder(file: &Path, folder: &Path) -> Option<String> {
    let (file, folder) = (file.canonicalize().ok()?, folder.canonicalize().ok()?);
    let shared = file.components().zip(folder.components()).take_while(|(one, other)| one == other).count();
    if shared == 0 {
        return None;
    }
    let up = folder.components().skip(shared).map(|_| Component::ParentDir);
    let way: PathBuf = up.chain(file.components().skip(shared)).collect();
    way.to_str().map(|way| way.replace('\\', "/"))
}

/// What every layout has.
#[derive(Deserialize)]
struct Layout {
    layout: u32,
}

fn list(texts: &[String]) -> String {
    if texts.is_empty() { "not given".to_owned() } else { texts.join(" ") }
}

/// Where two texts of scenes part.
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
