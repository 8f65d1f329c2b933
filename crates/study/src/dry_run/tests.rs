use std::cell::Cell;
use std::collections::BTreeMap;
use std::fs;
use std::sync::atomic::{AtomicUsize, Ordering};

use super::*;
use crate::model::{Order, QuestionKind};
use crate::statistics::effect;
use crate::testing::{study, track_study};

/// A study of two groups, with short trials.
fn short() -> Study {
    let study = study();
    let conditions = vec![study.conditions[0].clone(), study.conditions[1].clone()];
    Study { groups: 2, trials: 2, order: Order::Given, conditions, ..study }
}

/// Stops after some trials.
struct StopAfter(AtomicUsize);

impl Watch for StopAfter {
    fn keep_going(&self) -> bool {
        self.0.fetch_update(Ordering::Relaxed, Ordering::Relaxed, |left| left.checked_sub(1)).is_ok()
    }
}

/// Files of a folder by path, with their bytes.
fn files(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut files = BTreeMap::new();
    let mut folders = vec![folder.to_path_buf()];
    while let Some(path) = folders.pop() {
        for entry in fs::read_dir(path).unwrap().map(|entry| entry.unwrap().path()) {
            if entry.is_dir() {
                folders.push(entry);
            } else {
                files.insert(entry.strip_prefix(folder).unwrap().display().to_string(), fs::read(&entry).unwrap());
            }
        }
    }
    files
}

fn played(study: &Study, path: &Path) -> BTreeMap<String, Vec<u8>> {
    let mut folder = StudyFolder::open_dry(study.clone(), path, "a test").unwrap();
    assert!(folder.play_dry(&NoWatch).unwrap());
    drop(folder);
    files(path)
}

#[test]
fn persons_spread_around_the_study_and_keep_their_numbers() {
    let study = study();
    let persons: Vec<Person> = (0..400).map(|index| study.person(GroupCode::of_index(index).person(0, 1))).collect();
    assert_eq!(persons[17], study.person(GroupCode::of_index(8).person(1, 2)));
    for factors in [
        persons.iter().map(|person| person.movement.as_secs_f64() / 0.25).collect::<Vec<f64>>(),
        persons.iter().map(|person| person.visual_delay.as_secs_f64() / 0.2).collect(),
        persons.iter().map(|person| person.noise / 0.1).collect(),
        persons.iter().map(|person| person.crossover / 3.0).collect(),
    ] {
        let logs: Vec<f64> = factors.into_iter().map(f64::ln).collect();
        let mean = logs.iter().sum::<f64>() / 400.0;
        // Mean 0 ± 0.15/√400, and the standard deviation within 15 %: four standard errors of 400 normals.
        let deviation = mean / effect(&logs).unwrap();
        assert!(mean.abs() < 0.03 && (deviation.abs() - 0.15).abs() < 0.022, "{mean} {deviation}");
    }
}

#[test]
fn a_dry_run_that_is_stopped_anywhere_gives_the_bytes_of_one_that_is_not() {
    let (one, other) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let study = short();
    let whole = played(&study, one.path());
    assert!(whole.contains_key("report.html") && whole.contains_key("trials/G02-006/trial.json"), "{:?}", whole.keys());
    let calls = Cell::new(0);
    loop {
        let mut folder = StudyFolder::open_dry(study.clone(), other.path(), "a test").unwrap();
        calls.set(calls.get() + 1);
        if folder.play_dry(&StopAfter(AtomicUsize::new(calls.get() % 3))).unwrap() {
            break;
        }
    }
    assert!(calls.get() > 5);
    let stopped = files(other.path());
    assert_eq!(whole.keys().collect::<Vec<_>>(), stopped.keys().collect::<Vec<_>>());
    for (name, bytes) in &whole {
        assert!(stopped[name] == *bytes, "{name}");
    }
    // A study in another place, or with people, is another study.
    let moved = Study { title: String::new(), text: study.text.replace("seed = 1", "seed = 2"), ..study.clone() };
    let refused = StudyFolder::open_dry(moved, other.path(), "a test").unwrap_err().to_string();
    assert!(refused.contains("the study file says something else"), "{refused}");
    let refused = StudyFolder::open(study, other.path(), "a test").unwrap_err().to_string();
    assert!(refused.contains("a dry run there, a study with people here"), "{refused}");
}

#[test]
fn answers_are_possible_ones_and_use_the_whole_scale() {
    let folder = tempfile::tempdir().unwrap();
    let study = short();
    let folder = StudyFolder::open_dry(study.clone(), folder.path(), "a test").unwrap();
    let mut session = Sequence::new(&study, GroupCode::of_index(0), 0);
    let mut seen = std::collections::BTreeSet::new();
    assert!(matches!(study.questions[0].kind, QuestionKind::Tlx));
    for group in 0..40 {
        session = Sequence::new(&study, GroupCode::of_index(group), 0);
        let answer = folder.drawn_answer(&session, 0, 0);
        assert!(answer.values.len() == 6 && answer.values.iter().all(|value| study.questions[0].accepts(*value)), "{answer:?}");
        seen.extend(answer.values);
    }
    assert_eq!(folder.drawn_answer(&session, 0, 0), folder.drawn_answer(&session, 0, 0));
    assert_eq!(seen.len(), 21, "{seen:?}");
}

/// With equal conditions the test finds a difference in at most 5 % of all studies. Each of the 24 runs has seven groups, for which p is a multiple of 1/64, and
/// the largest p below 0.05 is 3/64. Of 24 binomial tries with 3/64, 6 or more successes have a probability of 7·10⁻⁴.
#[test]
fn equal_conditions_are_rarely_found_to_differ() {
    let study = short();
    let equal = vec![study.conditions[0].clone(), study.conditions[0].clone()];
    let study = Study { groups: 7, trials: 1, practice: 0, conditions: equal, measures: vec!["internal_force_n".to_owned()], ..study };
    let found = (0..24).filter(|seed| {
        let analysis = power::analysis_of(&Study { seed: *seed, ..study.clone() }, &NoWatch).unwrap().unwrap();
        assert_eq!((analysis.units, analysis.measures[0].rows.len()), (7, 7));
        analysis.measures[0].differences[0].p < 0.05
    });
    let found = found.count();
    assert!(found < 6, "{found}");
}

#[test]
fn a_longer_delay_is_found_and_the_kept_runs_are_the_same_again() {
    let folder = tempfile::tempdir().unwrap();
    let study = Study { groups: 6, trials: 1, practice: 0, ..short() };
    let mut kept = StudyFolder::open_dry(study.clone(), folder.path(), "a test").unwrap();
    assert!(kept.play_dry(&NoWatch).unwrap());
    let power = kept.power(4, &NoWatch).unwrap().unwrap();
    assert_eq!((power.times, power.differences.len()), (4, 2));
    let time = &power.differences[0];
    assert_eq!((time.measure.as_str(), time.condition, time.alone.of), ("task_time_s", 1, 4));
    // The kept runs are read, and a further one is added to them.
    assert_eq!(kept.power(4, &StopAfter(AtomicUsize::new(0))).unwrap().as_ref(), Some(&power));
    assert_eq!(kept.power(5, &StopAfter(AtomicUsize::new(0))).unwrap(), None);
    assert_eq!(kept.power(5, &NoWatch).unwrap().unwrap().times, 5);
    fs::write(folder.path().join("dry-runs/00004.json"), "{\"differences\":[[null]],\"timed_out\":[]}").unwrap();
    let refused = kept.power(5, &NoWatch).unwrap_err().to_string();
    assert!(refused.contains("00004.json") && refused.contains("other measures"), "{refused}");
    // A file of a version that kept no timeouts is computed again, to the same bytes.
    let third = folder.path().join("dry-runs/00003.json");
    let text = fs::read_to_string(&third).unwrap();
    let (differences, _) = text.split_once(",\"timed_out\"").unwrap();
    fs::write(&third, format!("{differences}}}\n")).unwrap();
    assert_eq!(kept.power(4, &StopAfter(AtomicUsize::new(0))).unwrap(), None);
    assert_eq!(kept.power(4, &NoWatch).unwrap().as_ref(), Some(&power));
    assert_eq!(fs::read_to_string(&third).unwrap(), text);
    fs::write(&third, "{}\n").unwrap();
    let refused = kept.power(4, &NoWatch).unwrap_err().to_string();
    assert!(refused.contains("00003.json") && refused.contains("missing field"), "{refused}");
    let lines = power_lines(&study, &power);
    assert_eq!(lines.len(), 3);
    assert!(lines[1].starts_with("task_time_s  "), "{lines:?}");
    // Four runs of six groups with a trial of each condition.
    assert_eq!(power.timed_out.iter().flatten().map(|share| (share.count, share.of)).collect::<Vec<_>>(), [(0, 24), (0, 24)]);
    assert!(timed_out_lines(&study, &power).is_empty());
}

/// Within a second nobody visits three targets. Wilson's interval of six of six begins at 1/(1 + 1.96²/6) = 0.61.
#[test]
fn timeouts_are_counted_over_all_dry_runs() {
    let folder = tempfile::tempdir().unwrap();
    let study = Study { trials: 1, ..short() };
    let study = Study { scene_text: study.scene_text.replace("timeout = \"20s\"", "timeout = \"1s\""), limit: Duration::from_secs(1), ..study };
    let mut kept = StudyFolder::open_dry(study.clone(), folder.path(), "a test").unwrap();
    assert!(kept.play_dry(&NoWatch).unwrap());
    let power = kept.power(3, &NoWatch).unwrap().unwrap();
    let lines = timed_out_lines(&study, &power);
    assert_eq!(lines.len(), 3, "{lines:?}");
    assert!(lines[1..].iter().all(|line| line.ends_with("  6 of 6     100 % (61 to 100)")), "{lines:?}");
}

#[test]
fn a_study_of_a_moving_target_has_a_dry_run() {
    let (files, out) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
    let study = track_study(files.path());
    let mut folder = StudyFolder::open_dry(study.clone(), out.path(), "a test").unwrap();
    assert!(folder.play_dry(&NoWatch).unwrap());
    let analysis = folder.analysis().unwrap();
    assert_eq!((analysis.units, analysis.measures[0].name.as_str(), analysis.measures[0].rows.len()), (2, "peers.left.error_rms_m", 2));
    // A person who sees the target 100 ms later follows less exactly than a person who sees the target at once, and nobody stays away from the target.
    assert!(analysis.measures[0].means.iter().all(|mean| (1e-4..0.014).contains(&mean.mean)), "{:?}", analysis.measures[0].means);
    assert!(folder.verify().unwrap().differences.is_empty());
    assert_eq!(folder.power(2, &NoWatch).unwrap().unwrap().times, 2);
}

#[test]
fn a_person_whose_numbers_are_refused_leaves_no_folder() {
    let study = study();
    let out = tempfile::tempdir().unwrap();
    let path = out.path().join("dry");
    let study = Study { operator: Person { visual_delay: Duration::from_secs(100), ..study.operator }, ..study };
    let refused = StudyFolder::open_dry(study, &path, "a test").unwrap_err().to_string();
    assert!(refused.contains("operator.visual-delay") && refused.contains("expected"), "{refused}");
    assert!(!path.exists());
}
