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
