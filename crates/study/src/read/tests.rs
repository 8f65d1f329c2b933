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
    fs::write(folder.path().join("delays.csv"), "10\n20\n").unwrap();
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
        ("\"task_time_s\"", "\"task_time\"", "study.toml:34:13: analysis.measures.0", "did you mean \"task_time_s\"?"),
        ("\"internal_force_n\"", "\"effort_n2_s\"", "study.toml:34:28: analysis.measures.1", "peers.left.effort_n2_s"),
        ("\"internal_force_n\"", "\"task_time_s\"", "study.toml:34:28: analysis.measures.1", "each measure once"),
        ("\"0ms\", \"100ms\"", "\"0ms\", \"0ms\"", "study.toml:18:16: conditions.link.delay", "expected"),
        (
            "\"0ms\", \"100ms\"",
            "\"0ms\", \"100 parsecs\"",
            "study.toml:18:16: conditions.link.delay: in the condition \"average-position, 100 parsecs\", link.delay",
            "unknown unit",
        ),
        ("\"link.delay\" =", "\"link.dealy\" =", "study.toml:18:16: conditions.link.dealy: in the condition", "did you mean \"delay\"?"),
        ("kind = \"tlx\"", "kind = \"tlx\"\nsteps = 3", "study.toml:23:9: questions.0.steps", "only a question of the kind scale"),
        ("steps = 7", "step = 7", "study.toml:31:1: questions.1.step", "did you mean \"steps\"?"),
        ("ends = [\"not at all\", \"completely\"]", "ends = [\"not at all\"]", "study.toml:30:8: questions.1.ends", "two texts"),
        ("\"together\"", "\"task_time_s\"", "study.toml:25:1: questions.1", "that of an analysed measure"),
        ("\"together\"", "\"WORKLOAD\"", "study.toml:25:1: questions.1", "two questions have the name"),
        ("[analysis]", "[operator]\ncrossover = 2\n[analysis]", "study.toml:34:13: operator.crossover", "no condition has a task of kind track"),
        (
            "[analysis]",
            "[operator]\nvisual-delay = \"5s\"\n[analysis]",
            "study.toml:34:16: operator.visual-delay: a person may have 2.5 times this mean: 12.5s are 12500 ticks",
            "at most 10000, 10s",
        ),
        ("\"consent.md\"", "\"consnet.md\"", "study.toml:13:11: study.consent", "cannot read"),
        ("[task]\nkind = \"reach\"", "[tsak]\nkind = \"reach\"", "study.toml:5:9, by the key study.scene", "did you mean \"task\"?"),
        ("mass = 0.45", "mass = -0.45", "pull.toml:8:8: object.mass", "expected"),
        ("delay = \"0ms\"\n", "trace = \"nothing.csv\"\n", "pull.toml:29:9: link.trace", "cannot read"),
        ("kind = \"pointer\"", "kind = \"simulated\"", "study.toml:5:9: study.scene", "no pointer"),
        (
            "\"link.delay\" =",
            "\"peers.left.kind\" = [\"pointer\", \"simulated\"]\n\"link.delay\" =",
            "study.toml:16:1: conditions",
            "the pointers are right",
        ),
        ("\"link.delay\" =", "\"scene.duration\" = [\"30s\", \"10s\"]\n\"link.delay\" =", "study.toml:16:1: conditions", "the same time in all"),
        (
            "\"link.delay\" = [\"0ms\", \"100ms\"]",
            "link = [{ delay = \"0ms\" }, { trace = \"delays.csv\" }]",
            "study.toml:16:1: conditions",
            "names the file delays.csv",
        ),
        ("[analysis]\nmeasures", "[analysis]\nmeasure", "study.toml:34:1: analysis.measure", "did you mean \"measures\"?"),
    ] {
        let error = read(from, to).expect_err(to);
        assert!(error.contains(place) && error.contains(words), "{to}:\n{error}");
        assert!(error.contains("expected"), "{to}:\n{error}");
        assert!(!error.contains("\\n"), "{to}:\n{error}");
    }
}

#[test]
fn a_question_without_a_name_has_its_kind_and_its_number() {
    let study = read("name = \"workload\"\n", "").unwrap_or_else(|error| panic!("{error}"));
    let names: Vec<&str> = study.questions.iter().map(|question| question.name.as_str()).collect();
    assert_eq!(names, ["tlx1", "together"]);
}

#[test]
fn a_value_may_have_commas_within_braces_and_the_report_has_a_cell_per_key() {
    let from = "[\"average-position\", \"proportional-derivative\"]";
    let to = "[\"average-position\", \"wave{impedance=30, on-loss=hold}\"]";
    let study = read(from, to).unwrap_or_else(|error| panic!("{error}"));
    assert_eq!(study.conditions[3].texts, ["wave{impedance=30,on-loss=hold}", "100ms"]);
    let scene = study.condition_scene(3).unwrap_or_else(|error| panic!("{error}"));
    assert!(scene.text.contains("impedance = 30"), "{}", scene.text);
    let from = "\"link.delay\" = [\"0ms\", \"100ms\"]";
    let study = read(from, "link = [{ delay = \"0ms\" }, { delay = \"100ms\", loss = \"1%\" }]").unwrap_or_else(|error| panic!("{error}"));
    let condition = &study.conditions[3];
    assert!(condition.texts.len() == 2 && condition.label.matches(", ").count() > 1, "{condition:?}");
}

/// A study file is written by hand: whatever stands in it, the answer is a message.
#[test]
fn no_number_and_no_text_makes_a_panic() {
    for (from, to) in [
        ("trials = 5", "trials = 99999999999999999999"),
        ("trials = 5", "trials = nan"),
        ("trials = 5", "trials = 5\ntrials = 5"),
        ("participants = 12", "participants = 9223372036854775807"),
        ("participants = 12", "participants = -2"),
        ("seed = 1", "seed = -1"),
        ("group = 2", "group = 0"),
        ("at-least = \"30s\"", "at-least = \"99999999999999999999h\""),
        ("every = 10", "every = 0"),
        ("\"0ms\", \"100ms\"", "nan, inf"),
        ("\"0ms\", \"100ms\"", ""),
        ("\"0ms\", \"100ms\"", "[\"0ms\"], {}"),
        ("\"0ms\", \"100ms\"", "\"\", \"\u{202e}=,]\""),
        ("\"link.delay\" =", "\"\" ="),
        ("\"link.delay\" =", "\"=\" ="),
        ("\"link.delay\" =", "\"link.delay=1ms\" ="),
        ("\"link.delay\" =", "link.delay ="),
        ("\"together\"", "\"../../together\""),
        ("steps = 7", "steps = 4294967296"),
        ("[analysis]", "[operator]\nnoise = nan\n[analysis]"),
        ("[analysis]", "[operator]\nnoise = inf\n[analysis]"),
        ("[analysis]", "[operator]\nmove = \"0s\"\n[analysis]"),
        ("[study]", "[[study]]"),
        ("[study]", "[studies]"),
        ("[analysis]", "[[analysis]]"),
        ("[[questions]]", "[questions]"),
        ("\"consent.md\"", "\"\""),
        ("\"consent.md\"", "\".\""),
        ("\"pull.toml\"", "\"study.toml\""),
    ] {
        let error = read(from, to).expect_err(to);
        assert!(!error.is_empty(), "{to}");
    }
}
