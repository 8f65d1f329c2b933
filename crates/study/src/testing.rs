//! Study of the tests.

use std::path::Path;
use std::time::Duration;

use crate::model::{Breaks, Question, Study};

/// Path of the shipped example.
pub(crate) fn example() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../../studies/pull/study.toml")
}

/// Returns the shipped example with one trial for practice, three trials, breaks, and the Task Load Index after each condition.
pub(crate) fn study() -> Study {
    let study = Study::read(&example()).unwrap_or_else(|error| panic!("{error}"));
    let tlx: Vec<Question> = study.questions.iter().filter(|question| question.name == "workload").cloned().collect();
    Study { practice: 1, trials: 3, questions: tlx, breaks: Some(Breaks { every: 5, at_least: Duration::from_secs(30) }), ..study }
}

/// Writes the shipped example with a moving target and two trials of each condition into a folder, and returns the study.
pub(crate) fn track_study(folder: &Path) -> Study {
    const REACH: &str = "kind = \"reach\"";
    for name in ["study.toml", "pull.toml", "consent.md", "task.md"] {
        let text = std::fs::read_to_string(example().with_file_name(name)).unwrap_or_else(|error| panic!("{error}"));
        let mut text =
            text.replace("participants = 12", "participants = 4").replace("trials = 5", "trials = 2").replace("practice = 2", "practice = 0");
        text = text.replace("\"task_time_s\"", "\"peers.left.error_rms_m\"").replace("[analysis]", "[operator]\ncrossover = 2.0\n\n[analysis]");
        if let Some((scene, _)) = text.clone().split_once(REACH) {
            text = format!(
                "{scene}kind = \"track\"\nsines = [{{ amplitude = [0.02, 0.0], frequency = 0.25 }}]\nstart = \"500ms\"\nwarm-up = \"1s\"\ntimeout = \"4s\"\nend = \"stop\"\n"
            );
        }
        std::fs::write(folder.join(name), text).unwrap_or_else(|error| panic!("{error}"));
    }
    Study::read(&folder.join("study.toml")).unwrap_or_else(|error| panic!("{error}"))
}
