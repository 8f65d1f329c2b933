use std::fs;

use super::*;
use crate::model::{After, QuestionKind};
use crate::testing::example;

/// Reads the shipped example with one text in place of another. The texts `study.toml` and `pull.toml` are both searched.
fn read(from: &str, to: &str) -> Result<Study, String> {
    let shipped = example();
    let folder = tempfile::tempdir().unwrap();
    let mut found = 0;
    for name in ["study.toml", "pull.toml", "consent.md", "task.md"] {
        let text = fs::read_to_string(shipped.with_file_name(name)).unwrap();
        found += text.matches(from).count();
        fs::write(folder.path().join(name), text.replace(from, to)).unwrap();
    }
    assert!(found > 0, "nothing says {from:?}");
    Study::read(&folder.path().join("study.toml")).map_err(|error| error.to_string())
}

#[test]
fn the_shipped_example_is_read() {
    let study = Study::read(&example()).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!((study.participants(), study.groups, study.trials, study.practice), (12, 6, 5, 2));
    assert_eq!(study.hands, ["left", "right"]);
    assert_eq!(study.limit, Duration::from_secs(20));
    let labels: Vec<&str> = study.conditions.iter().map(|condition| condition.label.as_str()).collect();
    assert_eq!(labels, ["average-position, 0ms", "average-position, 100ms", "proportional-derivative, 0ms", "proportional-derivative, 100ms"]);
    let columns: Vec<&str> = study.factors.iter().map(|factor| factor.column.as_str()).collect();
    assert_eq!(columns, ["coordination.strategy", "link.delay_ms"]);
    assert_eq!(study.questions_after(After::Condition).count(), 2);
    assert!(matches!(&study.questions[1].kind, QuestionKind::Scale { steps: 7, .. }));
    assert!(study.consent.starts_with("# Taking part"));
}

#[test]
fn every_refusal_has_a_place_and_a_way_out() {
    for (from, to, place, words) in [
        ("participants = 12", "participants = 13", "study.toml:6:16: study.participants", "a multiple of 2"),
        ("group = 2", "group = 3", "study.toml:5:9: study.scene", "a pointer for each person"),
        ("practice = 2", "practise = 2", "study.toml:11:1: study.practise", "did you mean \"practice\"?"),
        ("order = \"williams\"", "order = \"wiliams\"", "study.toml:8:9: study.order", "did you mean \"williams\"?"),
        ("\"task_time_s\"", "\"task_time\"", "study.toml:33:13: analysis.measures.0", "did you mean \"task_time_s\"?"),
        ("\"internal_force_n\"", "\"effort_n2_s\"", "study.toml:33:28: analysis.measures.1", "peers.left.effort_n2_s"),
        ("\"internal_force_n\"", "\"task_time_s\"", "study.toml:33:28: analysis.measures.1", "each measure once"),
        ("\"0ms\", \"100ms\"", "\"0ms\", \"0ms\"", "study.toml:18:16: conditions.link.delay", "expected"),
        ("\"0ms\", \"100ms\"", "\"0ms\", \"100 parsecs\"", "link.delay", "unknown unit"),
        ("\"link.delay\" =", "\"link.dealy\" =", "link.dealy", "did you mean \"delay\"?"),
        ("kind = \"tlx\"", "kind = \"tlx\"\nsteps = 3", "study.toml:23:9: questions.0.steps", "only a question of the kind scale"),
        ("steps = 7", "step = 7", "study.toml:30:1: questions.1.step", "did you mean \"steps\"?"),
        ("ends = [\"not at all\", \"completely\"]", "ends = [\"not at all\"]", "study.toml:29:8: questions.1.ends", "two texts"),
        ("\"consent.md\"", "\"consnet.md\"", "study.toml:13:11: study.consent", "cannot read"),
        ("[task]\nkind = \"reach\"", "[tsak]\nkind = \"reach\"", "study.toml:5:9: study.scene", "did you mean \"task\"?"),
        ("kind = \"pointer\"", "kind = \"simulated\"", "study.toml:5:9: study.scene", "no pointer"),
        ("[analysis]\nmeasures", "[analysis]\nmeasure", "study.toml:33:1: analysis.measure", "did you mean \"measures\"?"),
    ] {
        let error = read(from, to).expect_err(to);
        assert!(error.contains(place) && error.contains(words), "{to}:\n{error}");
        assert!(error.contains("expected"), "{to}:\n{error}");
    }
}
