use std::collections::BTreeSet;
use std::fs;
use std::path::Path;

use super::*;
use crate::dry_run::NoWatch;
use crate::folder::{KeptMovement, RoundTrip, TrialFacts};
use crate::model::{Order, Study};
use crate::sequence::{Event, Fault, Sequence, Step};
use crate::testing::study;
use crate::trial::Players;

const PROGRAM: &str = "a test";

/// Returns the names in a folder, in order.
fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// A study of two groups and two conditions, with one trial each.
fn short() -> Study {
    let study = study();
    let conditions = study.conditions[..2].to_vec();
    Study { groups: 2, trials: 1, practice: 0, breaks: None, order: Order::Given, conditions, ..study }
}

/// Plays the study in a folder.
fn played(path: &Path) -> StudyFolder {
    let mut folder = StudyFolder::open_dry(short(), path, PROGRAM).unwrap();
    assert!(folder.play_dry(&NoWatch).unwrap());
    folder
}

fn lines(path: &Path) -> Vec<String> {
    fs::read_to_string(path).unwrap().lines().map(str::to_owned).collect()
}

/// Returns a column of a table of comma-separated values without quotes.
fn column(path: &Path, name: &str) -> Vec<String> {
    let lines = lines(path);
    let place = lines[0].split(',').position(|column| column == name).unwrap_or_else(|| panic!("{name} in {}", lines[0]));
    lines[1..].iter().map(|line| line.split(',').nth(place).unwrap().to_owned()).collect()
}

#[test]
fn a_study_is_read_from_its_folder_and_its_tables_are_made_again() {
    let at = tempfile::tempdir().unwrap();
    let folder = played(at.path());
    assert!(folder.is_full() && folder.next_group().is_none());
    let trials = at.path().join("trials.csv");
    assert_eq!(column(&trials, "code"), ["P01", "P02", "P01", "P02", "P03", "P04", "P03", "P04"]);
    assert_eq!(column(&trials, "hand"), ["left", "right"].repeat(4));
    assert_eq!(column(&trials, "link.delay_ms"), ["0.0", "0.0", "100.0", "100.0"].repeat(2));
    assert_eq!(column(&trials, "valid"), ["1"; 8]);
    // Six scales and their mean, of four people after each of two conditions.
    assert_eq!(lines(&at.path().join("answers.csv")).len(), 1 + 4 * 2 * 7);
    let before = fs::read(&trials).unwrap();
    drop(folder);
    // The whole study is in the folder: another process needs neither the study file nor its place.
    let again = StudyFolder::begin_again(at.path());
    fs::remove_file(&trials).unwrap();
    again.write_tables().unwrap();
    assert_eq!(fs::read(&trials).unwrap(), before);
}

impl StudyFolder {
    /// Opens a folder as it is, with the shortened study of these tests.
    fn begin_again(path: &Path) -> Self {
        Self::open_dry(short(), path, PROGRAM).unwrap()
    }
}

#[test]
fn only_one_process_works_on_a_folder_and_foreign_files_are_left_alone() {
    let at = tempfile::tempdir().unwrap();
    let _folder = StudyFolder::open(short(), at.path(), PROGRAM).unwrap();
    assert!(matches!(StudyFolder::open(short(), at.path(), PROGRAM), Err(StudyError::Busy { .. })));
    let other = tempfile::tempdir().unwrap();
    fs::write(other.path().join("thesis.txt"), "").unwrap();
    let refused = StudyFolder::open(short(), other.path(), PROGRAM).unwrap_err().to_string();
    assert!(refused.contains("thesis.txt") && fs::read_dir(other.path()).unwrap().count() == 1, "{refused}");
    assert!(matches!(StudyFolder::of_folder(other.path(), PROGRAM), Err(StudyError::NoStudy { .. })));
}

#[test]
fn every_change_of_a_file_is_found() {
    let at = tempfile::tempdir().unwrap();
    let folder = played(at.path());
    let verified = folder.verify().unwrap();
    assert_eq!((verified.trials, verified.differences.as_slice()), (4, &[][..]));
    let change = |file: &str, from: &str, to: &str, expected: &[&str]| {
        let path = at.path().join(file);
        let text = fs::read_to_string(&path).unwrap();
        assert!(text.contains(from), "{file} does not say {from}: {text}");
        fs::write(&path, text.replacen(from, to, 1)).unwrap();
        let found = folder.verify().unwrap().differences;
        fs::write(&path, text).unwrap();
        for words in expected {
            assert!(found.iter().any(|difference| difference.contains(words)), "{file}: {words} in {found:?}");
        }
    };
    change(
        "trials/G01-001/trial.json",
        "\"outcome\": \"done\"",
        "\"outcome\": \"failed\"",
        &["G01-001: outcome is failed in the record and done", "trials.csv: line 2"],
    );
    change(
        "trials/G02-001/trial.json",
        "\"internal_force_n\",\n      0.",
        "\"internal_force_n\",\n      1.",
        &["G02-001: internal_force_n is 1.", "trials.parquet"],
    );
    change("trials/G01-002/scene.toml", "mass = 0.45", "mass = 0.46", &["G01-002: ", "scene.toml is not the scene of this trial"]);
    change("trials/G01-002/inputs.csv", "0,scene,,,", "0,scene,,,0", &["G01-002: "]);
    // A trial is made valid, or not valid, in its record or in its session alone.
    change(
        "trials/G01-002/trial.json",
        "\"faults\": []",
        "\"faults\": [\"hidden-page\"]",
        &["G01-002: trial.json has another code, or other faults"],
    );
    change("trials/G01-002/trial.json", "\"G01-002\"", "\"G01-001\"", &["G01-002: trial.json has another code, or other faults"]);
    change("trials.csv", "P03", "P09", &["trials.csv: line 6"]);
    change("answers.csv", "P04", "P09", &["answers.csv"]);
    fs::remove_file(at.path().join("answers.parquet")).unwrap();
    assert_eq!(folder.verify().unwrap().differences, ["answers.parquet: not there: cohaptic study report writes it"]);
}

#[test]
fn a_forgotten_person_leaves_nothing_and_the_row_is_given_again() {
    let at = tempfile::tempdir().unwrap();
    let mut folder = played(at.path());
    let nobody = folder.forget("P09".parse().unwrap()).unwrap_err().to_string();
    assert!(nobody.contains("P09"), "{nobody}");
    folder.forget("P02".parse().unwrap()).unwrap();
    let kept = names(&at.path().join("trials"));
    assert_eq!(kept, ["G02-001", "G02-002"]);
    assert_eq!(
        column(&at.path().join("trials.csv"), "code").into_iter().collect::<BTreeSet<_>>(),
        BTreeSet::from(["P03".to_owned(), "P04".to_owned()])
    );
    // The partner's answers stay.
    let answers = column(&at.path().join("answers.csv"), "code").into_iter().collect::<BTreeSet<_>>();
    assert_eq!(answers, ["P01", "P03", "P04"].map(str::to_owned).into());
    assert!(!fs::read_to_string(at.path().join("report.html")).unwrap().contains("P02"));
    assert_eq!(folder.verify().unwrap().differences, [""; 0]);
    let next = folder.next_group().unwrap();
    assert_eq!((next.group().to_string(), next.slot()), ("G03".to_owned(), 0));
    // Also after a crash between the file of the session and the trials.
    drop(folder);
    fs::create_dir(at.path().join("trials/G01-001")).unwrap();
    let mut folder = StudyFolder::begin_again(at.path());
    assert_eq!(names(&at.path().join("trials")), ["G02-001", "G02-002"]);
    let session = at.path().join("groups/G01.jsonl");
    let text = fs::read_to_string(&session).unwrap();
    assert!(text.contains("\"question\":0"), "{text}");
    for (from, to) in [
        ("\"question\":0", "\"question\":9"),
        ("\"condition\":0", "\"condition\":2"),
        ("\"values\":[", "\"values\":[5,"),
        ("\"seat\":0", "\"seat\":2"),
    ] {
        fs::write(&session, text.replacen(from, to, 1)).unwrap();
        drop(folder);
        let refused = StudyFolder::open_dry(short(), at.path(), PROGRAM).unwrap_err().to_string();
        assert!(refused.contains("line 2: this answers no question"), "{to}: {refused}");
        fs::write(&session, &text).unwrap();
        folder = StudyFolder::begin_again(at.path());
    }
    folder.forget("P01".parse().unwrap()).unwrap();
    assert!(!column(&at.path().join("answers.csv"), "code").contains(&"P01".to_owned()));
}

/// Records a trial in the staging folder as a session of people without any input does.
fn staged(folder: &StudyFolder, session: &Sequence) {
    let Step::Trial(plan) = session.step() else { panic!("{:?}", session.step()) };
    let trial = folder.study().trial_scene(&plan, Players::People).unwrap();
    let staging = folder.staging().unwrap();
    fs::write(staging.join("scene.toml"), &trial.text).unwrap();
    let content = cohaptic_scene::scene_content_of_text(&trial.text, &staging.join("scene.toml"), &[]).unwrap();
    cohaptic_harness::record::InputRecorder::create(&staging, &trial.scene, content).unwrap().finish().unwrap();
}

#[test]
fn a_trial_counts_once_it_has_its_name_and_an_abandoned_row_is_given_again() {
    let at = tempfile::tempdir().unwrap();
    let mut folder = StudyFolder::open(Study { trials: 2, questions: Vec::new(), ..short() }, at.path(), PROGRAM).unwrap();
    let study = folder.study().clone();
    let mut session = folder.next_group().unwrap();
    staged(&folder, &session);
    let facts =
        TrialFacts { faults: vec![Fault::SilentPointer], late_ticks: 3, round_trips: vec![Some(RoundTrip { p50_s: 0.02, p99_s: 0.05 }), None] };
    let record = folder.keep_trial(&mut session, facts).unwrap();
    assert_eq!(record.outcome, "timed-out");
    // The process is killed after the rename of a trial, before its line: both for the first trial and for a later one.
    staged(&folder, &session);
    folder.keep_trial(&mut session, TrialFacts::default()).unwrap();
    let file = at.path().join("groups/G01.jsonl");
    let text = fs::read_to_string(&file).unwrap();
    for cut in [text.trim_end().rsplit_once('\n').map(|(before, _)| format!("{before}\n")), None] {
        drop(folder);
        match cut {
            Some(cut) => fs::write(&file, cut).unwrap(),
            None => {
                fs::remove_file(&file).unwrap();
                fs::remove_dir_all(at.path().join("trials/G01-002")).unwrap();
            }
        }
        folder = StudyFolder::open(study.clone(), at.path(), PROGRAM).unwrap();
        session = folder.next_group().unwrap();
        let Step::Trial(plan) = session.step() else { panic!("{:?}", session.step()) };
        assert_eq!((session.group().to_string(), plan.code.number), ("G01".to_owned(), fs::read_dir(at.path().join("trials")).unwrap().count() + 1));
        assert_eq!(session.ended()[0].faults, [Fault::SilentPointer]);
    }
    assert!(matches!(folder.keep(&mut session, Event::BreakOver), Err(StudyError::Refused(_))));
    folder.keep(&mut session, Event::Abandon).unwrap();
    let next = folder.next_group().unwrap();
    assert_eq!((next.group().to_string(), next.slot(), next.people()[0].to_string()), ("G02".to_owned(), 0, "P03".to_owned()));
    folder.write_tables().unwrap();
    let trials = at.path().join("trials.csv");
    assert_eq!(column(&trials, "session"), ["abandoned", "abandoned"]);
    assert_eq!(column(&trials, "faults"), ["silent-pointer", "silent-pointer"]);
    assert_eq!(column(&trials, "round_trip_p50_s"), ["0.02", ""]);
    assert_eq!(column(&trials, "late_ticks"), ["3", "3"]);
    assert_eq!(column(&trials, "task_time_s"), ["", ""]);
}

#[test]
fn valid_trials_without_practice_are_analysed_and_a_timeout_counts_as_the_limit() {
    let at = tempfile::tempdir().unwrap();
    let study = Study { practice: 1, trials: 2, questions: Vec::new(), ..short() };
    let mut folder = StudyFolder::open_dry(study, at.path(), PROGRAM).unwrap();
    assert!(folder.play_dry(&NoWatch).unwrap());
    // Trials 1 and 4 of each session are for practice. The time of each trial is its number.
    let mut trials = folder.kept_trials().unwrap();
    for trial in &mut trials {
        let number = f64::from(u32::try_from(trial.ended.plan.code.number).unwrap());
        trial.record.values = vec![("task_time_s".to_owned(), Some(number))];
    }
    let times = |trials: &[crate::tables::KeptTrial]| folder.analysis_of(trials).measures[0].clone();
    assert_eq!(times(&trials).rows, [[2.5, 5.5], [2.5, 5.5]]);
    // A trial that is not valid does not count.
    trials[2].ended.faults = vec![Fault::LateTicks];
    assert_eq!(times(&trials).rows, [[2.0, 5.5], [2.5, 5.5]]);
    // The limit is 20 s.
    trials[5].record.outcome = "timed-out".to_owned();
    trials[5].record.values[0].1 = None;
    let found = times(&trials);
    assert_eq!((found.rows, found.left_out), (vec![vec![2.0, 12.5], vec![2.5, 5.5]], 0));
    assert_eq!(found.timed_out.iter().map(|share| share.map(|share| (share.count, share.of))).collect::<Vec<_>>(), [Some((0, 3)), Some((1, 4))]);
    // A group without any value in a condition is left out as a whole, because differences are within groups.
    for trial in &mut trials[10..] {
        trial.record.outcome = "failed".to_owned();
        trial.record.values[0].1 = None;
    }
    let found = times(&trials);
    assert_eq!((found.rows, found.left_out, found.differences[0].estimate.mean), (vec![vec![2.0, 12.5]], 1, 10.5));
    assert_eq!(folder.analysis_of(&trials).measures[1].left_out, 2);
}

/// Each trial moves to three targets in a plane. One trial of a dry run has a throughput of its own from three ends, and a group in a condition has that of the
/// ends of all of its trials.
#[test]
fn the_throughput_of_a_group_is_that_of_the_movements_of_all_its_trials() {
    let at = tempfile::tempdir().unwrap();
    let study = Study { trials: 2, measures: vec!["throughput_bit_s".to_owned()], questions: Vec::new(), ..short() };
    let mut folder = StudyFolder::open_dry(study, at.path(), PROGRAM).unwrap();
    assert!(folder.play_dry(&NoWatch).unwrap());
    assert_eq!(folder.verify().unwrap().differences, [""; 0]);
    let mut trials = folder.kept_trials().unwrap();
    assert!(trials.iter().all(|trial| trial.record.movements.len() == 3 && trial.record.value("throughput_bit_s").is_some()));
    let kept = folder.analysis().unwrap().measures[0].clone();
    let of_trials = |trials: &[crate::tables::KeptTrial]| {
        let movements: Vec<_> = trials.iter().flat_map(|trial| &trial.record.movements).map(|movement| movement.movement()).collect();
        cohaptic_harness::task::throughput(&movements).unwrap()
    };
    // The first two trials of a session are those of the first condition.
    let expected: Vec<Vec<f64>> = trials.chunks(4).map(|session| session.chunks(2).map(of_trials).collect()).collect();
    assert_eq!(kept.rows, expected);
    // A movement over 0.16 m in each of two trials, whose ends are 2 mm apart: W = √(2πe)·√2 mm. No trial alone has a spread.
    for (trial, end) in trials.iter_mut().zip([0.001, -0.001].into_iter().cycle()) {
        trial.record.movements = vec![KeptMovement { distance_m: 0.16, beyond_m: end, time_s: 0.5 }];
        trial.record.values[0].1 = None;
    }
    let found = folder.analysis_of(&trials).measures[0].clone();
    let width = (2.0 * std::f64::consts::PI * std::f64::consts::E).sqrt() * 2f64.sqrt() * 1e-3;
    let rate = (0.16 / width + 1.0).log2() / 0.5;
    assert!(found.rows.iter().flatten().all(|value| (value - rate).abs() < 1e-12) && found.rows.len() == 2, "{:?}, expected {rate}", found.rows);
    assert_eq!(found.timed_out.iter().flatten().map(|share| (share.count, share.of)).collect::<Vec<_>>(), [(0, 4), (0, 4)]);
    let file = at.path().join("trials/G01-002/trial.json");
    let text = fs::read_to_string(&file).unwrap();
    fs::write(&file, text.replacen("\"distance_m\": ", "\"distance_m\": 1", 1)).unwrap();
    let found = folder.verify().unwrap().differences;
    assert!(found.iter().any(|difference| difference.starts_with("G01-002: a movement is ")), "{found:?}");
}

/// An earlier version kept no movements. The report takes the movements from replays, and refuses a replay that is not the recorded trial.
#[test]
fn records_without_movements_get_them_from_a_replay() {
    let at = tempfile::tempdir().unwrap();
    let study = Study { measures: vec!["throughput_bit_s".to_owned()], questions: Vec::new(), ..short() };
    let mut folder = StudyFolder::open_dry(study, at.path(), PROGRAM).unwrap();
    assert!(folder.play_dry(&NoWatch).unwrap());
    let (trials, analysis, report) = (folder.kept_trials().unwrap(), folder.analysis().unwrap(), fs::read(at.path().join("report.html")).unwrap());
    assert!(analysis.measures[0].rows.len() == 2, "{analysis:?}");
    let file = |trial: &str| at.path().join("trials").join(trial).join("trial.json");
    for name in names(&at.path().join("trials")) {
        let mut record: serde_json::Value = serde_json::from_slice(&fs::read(file(&name)).unwrap()).unwrap();
        assert!(record.as_object_mut().unwrap().remove("movements").is_some(), "{record:#}");
        fs::write(file(&name), record.to_string()).unwrap();
    }
    assert_eq!((folder.kept_trials().unwrap(), folder.analysis().unwrap()), (trials, analysis));
    folder.write_tables().unwrap();
    assert!(fs::read(at.path().join("report.html")).unwrap() == report);
    assert_eq!(folder.verify().unwrap().differences, [""; 0]);
    let text = fs::read_to_string(file("G02-001")).unwrap();
    fs::write(file("G02-001"), text.replacen("\"done\"", "\"failed\"", 1)).unwrap();
    let refused = folder.analysis().unwrap_err().to_string();
    let difference = "outcome is failed in the record and done in the replay";
    for part in ["G02-001/trial.json is not as", "it has no movements, which earlier versions did not keep", difference] {
        assert!(refused.contains(part), "no {part:?} in {refused}");
    }
    let found = folder.verify().unwrap().differences;
    assert!(found.contains(&format!("G02-001: {difference}")), "{found:?}");
}

/// The session records a trial only after the folder of the trial has got its final name.
#[test]
fn a_trial_that_cannot_be_kept_changes_no_session() {
    let at = tempfile::tempdir().unwrap();
    let mut folder = StudyFolder::open(short(), at.path(), PROGRAM).unwrap();
    let mut session = folder.next_group().unwrap();
    let before = session.clone();
    staged(&folder, &session);
    fs::create_dir_all(at.path().join("trials/G01-001/in-the-way")).unwrap();
    assert!(matches!(folder.keep_trial(&mut session, TrialFacts::default()), Err(StudyError::File { .. })));
    assert_eq!((&session, folder.trials(), names(&at.path().join("groups"))), (&before, 0, Vec::new()));
    fs::remove_dir_all(at.path().join("trials/G01-001")).unwrap();
    folder.keep_trial(&mut session, TrialFacts::default()).unwrap();
    assert_eq!((session.ended().len(), folder.trials()), (1, 1));
}

#[test]
fn a_damaged_session_is_refused_with_its_line() {
    let at = tempfile::tempdir().unwrap();
    drop(played(at.path()));
    let file = at.path().join("groups/G01.jsonl");
    let text = fs::read_to_string(&file).unwrap();
    for (from, to, words) in [
        ("\"slot\":0", "\"slot\":7", "line 1"),
        ("trial-ended", "trial-begun", "line 2"),
        ("\"values\":[", "\"values\":[1,", "line 3"),
        ("\"group\":\"G01\"", "\"group\":\"G02\"", "line 1"),
    ] {
        assert!(text.contains(from), "{text}");
        fs::write(&file, text.replacen(from, to, 1)).unwrap();
        let refused = StudyFolder::open_dry(short(), at.path(), PROGRAM).unwrap_err();
        assert!(matches!(refused, StudyError::Damaged { .. }), "{refused}");
        let refused = refused.to_string();
        assert!(refused.contains(words) || refused.contains("no answer"), "{from}: {refused}");
    }
    // Trials are not removed because the file of their session is lost, or is an older one from a copy.
    let trials = names(&at.path().join("trials"));
    let last = at.path().join("groups/G02.jsonl");
    let of_last = fs::read_to_string(&last).unwrap();
    for lost in [None, Some(of_last.lines().next().unwrap())] {
        match lost {
            None => fs::remove_file(&last).unwrap(),
            Some(head) => fs::write(&last, head).unwrap(),
        }
        fs::write(&file, &text).unwrap();
        let refused = StudyFolder::open_dry(short(), at.path(), PROGRAM).unwrap_err().to_string();
        assert!(refused.contains("G02.jsonl") && refused.contains("the trial G02-002 has ended"), "{refused}");
        assert_eq!(names(&at.path().join("trials")), trials);
    }
    fs::write(&last, &of_last).unwrap();
    fs::rename(&file, at.path().join("groups/G03.jsonl")).unwrap();
    assert!(StudyFolder::open_dry(short(), at.path(), PROGRAM).unwrap_err().to_string().contains("G01 is missing"));
}
