//! Whole campaigns on one thread and on all.

use std::fs;
use std::path::PathBuf;

use cohaptic_benches::effort::Effort;
use serde::Deserialize;

use crate::programs::{Measured, Programs};

/// The scenes: two whose runs go side by side, and one whose queues go run by run.
const SCENES: [&str; 3] = ["paper/5-1-ap-2100", "network/loss-independent", "network/queue-codel"];

/// How many, the option, and the name of the folder.
const THREADS: [(&str, &str, &str); 2] = [("1", " --threads 1", "one-thread"), ("all", "", "all-threads")];

/// What `cohaptic campaign --json` says.
#[derive(Debug, Deserialize)]
struct CampaignDocument {
    title: String,
    runs: u64,
    runs_computed: u64,
    wall_s: f64,
    runs_per_s: f64,
}

/// The table of a campaign, on the disk.
const TABLE: &str = "runs.parquet";

struct Case {
    scene: &'static str,
    threads: &'static str,
    words: String,
    folder: String,
}

fn cases(effort: Effort) -> Vec<Case> {
    let runs = effort.of(10_000, 2_000, 16);
    let of_scene = |scene: &'static str| {
        THREADS.map(|(threads, option, name)| {
            let folder = format!("out/measured/{}-{name}", scene.rsplit('/').next().unwrap_or(scene));
            let words = format!("campaign scenarios/{scene}.toml --runs {runs}{option} --json --out {folder}");
            Case { scene, threads, words, folder }
        })
    };
    SCENES.into_iter().flat_map(of_scene).collect()
}

pub(crate) fn commands(effort: Effort) -> Vec<String> {
    cases(effort).into_iter().map(|case| format!("cohaptic {}", case.words)).collect()
}

pub(crate) fn measure(programs: &Programs) -> Result<Measured, String> {
    let cases = cases(programs.effort);
    let mut rounds: Vec<Vec<CampaignDocument>> = cases.iter().map(|_| Vec::new()).collect();
    for _ in 0..programs.effort.of(3, 3, 1) {
        for (case, documents) in cases.iter().zip(&mut rounds) {
            documents.push(case.run(programs)?);
        }
    }
    let mut body = "| scene | threads | runs | wall \\[s\\] | runs/s | table \\[kB\\] |\n| --- | ---: | ---: | ---: | ---: | ---: |\n".to_owned();
    for (case, documents) in cases.iter().zip(&mut rounds) {
        documents.sort_by(|one, other| one.wall_s.total_cmp(&other.wall_s));
        body.push_str(&case.row(&documents[documents.len() / 2], case.table()?.len()));
    }
    for pair in cases.chunks(THREADS.len()) {
        if let [one, all] = pair
            && one.table()? != all.table()?
        {
            return Err(format!("the tables of {} on one thread and on all differ", one.scene));
        }
    }
    for case in &cases {
        case.remove()?;
    }
    Ok(Measured { body, files: Vec::new() })
}

impl Case {
    fn run(&self, programs: &Programs) -> Result<CampaignDocument, String> {
        // A campaign that is there already would be left as it is.
        self.remove()?;
        let printed = programs.cohaptic(&self.words)?;
        let document: CampaignDocument =
            serde_json::from_str(&printed).map_err(|error| format!("what cohaptic printed is no document of a campaign: {error}"))?;
        if document.runs_computed != document.runs {
            return Err(format!("{} of {} runs were computed in an empty folder", document.runs_computed, document.runs));
        }
        Ok(document)
    }

    fn row(&self, document: &CampaignDocument, bytes: usize) -> String {
        let CampaignDocument { title, runs, wall_s, runs_per_s, .. } = document;
        let Self { scene, threads, .. } = self;
        format!("| {title} (`{scene}`) | {threads} | {runs} | {wall_s:.2} | {runs_per_s:.0} | {} |\n", bytes.div_ceil(1000))
    }

    fn table(&self) -> Result<Vec<u8>, String> {
        let path = self.path().join(TABLE);
        fs::read(&path).map_err(|error| format!("cannot read {}: {error}", path.display()))
    }

    fn remove(&self) -> Result<(), String> {
        match fs::remove_dir_all(self.path()) {
            Err(error) if error.kind() != std::io::ErrorKind::NotFound => Err(format!("cannot remove {}: {error}", self.folder)),
            Ok(()) | Err(_) => Ok(()),
        }
    }

    fn path(&self) -> PathBuf {
        Programs::root().join(&self.folder)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_document_becomes_a_row_and_every_scene_is_shipped() {
        let text = r#"{"title": "Two", "runs": 20, "runs_computed": 20, "wall_s": 0.504, "runs_per_s": 39.7, "out": "x", "diverged": 0}"#;
        let document: CampaignDocument = serde_json::from_str(text).unwrap();
        let cases = cases(Effort::Smoke);
        assert_eq!(cases[2].row(&document, 1001), "| Two (`network/loss-independent`) | 1 | 20 | 0.50 | 40 | 2 |\n");
        assert!(cases.iter().all(|case| Programs::root().join(format!("scenarios/{}.toml", case.scene)).is_file()));
        // What the comment on the scenes says.
        let shapes = SCENES.map(|scene| {
            let path = Programs::root().join(format!("scenarios/{scene}.toml"));
            let scene = cohaptic_scene::Scene::parse(&fs::read_to_string(&path).unwrap(), &path, &[]).unwrap();
            cohaptic_harness::same_shape(&scene, &scene)
        });
        assert_eq!(shapes, [true; 3]);
        let folders: std::collections::BTreeSet<&str> = cases.iter().map(|case| case.folder.as_str()).collect();
        assert_eq!(folders.len(), cases.len());
    }
}
