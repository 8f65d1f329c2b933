//! The soak under floods: its rules, and a short one where the program is built. Whether a run is valid, and how much memory a busy machine needs, is not asserted.

use std::path::{Path, PathBuf};
use std::sync::atomic::AtomicBool;
use std::time::Duration;

use cohaptic_benches_realtime::datagrams::Sent;
use cohaptic_benches_realtime::soak::flooded::{Connected, FloodedPlan, Outcome, Row, Sample, is_flat, judge, run, section};
use cohaptic_benches_realtime::soak::{Judgement, Verdict};
use cohaptic_benches_realtime::visitor::Visits;

fn good() -> Outcome {
    let sample = Sample { memory: 10_000, files: 12 };
    let live = serde_json::json!({
        "valid": true, "ending": "complete", "peers": [{}, {}, { "seat": { "taken": 100 } }], "door": { "handled": 1000, "welcomed": 300 }
    });
    let relay = serde_json::json!({ "valid": true, "ending": "complete" });
    Outcome {
        rows: (1..=60).map(|second| Row { at: Duration::from_secs(second), processes: [sample; 3] }).collect(),
        documents: [live, relay],
        visits: Visits { visits: 3, joinings: 3, sent: 120, newest: 200, ..Visits::default() },
        floods: vec![("hellos, to the session".to_owned(), Sent { datagrams: 500, elapsed: Duration::from_secs(1) })],
        connections: Connected { made: 10, answered: 8, let_in: 0, elapsed: Duration::from_secs(1) },
    }
}

/// The first words of the rules that are not kept.
fn not_kept(change: impl FnOnce(&mut Outcome)) -> Vec<String> {
    let mut outcome = good();
    change(&mut outcome);
    let broken = judge(&outcome).into_iter().filter(|judgement| judgement.verdict != Verdict::Kept);
    broken.map(|Judgement { rule, .. }| rule.split(' ').next().unwrap().to_owned()).collect()
}

#[test]
fn each_rule_is_broken_by_what_breaks_it() {
    assert!(not_kept(|_| ()).is_empty());
    assert_eq!(not_kept(|outcome| outcome.documents[0]["valid"] = false.into()), ["both"]);
    assert_eq!(not_kept(|outcome| outcome.documents[1]["ending"] = "interrupted".into()), ["both"]);
    // Of each process.
    for process in 0..3 {
        assert_eq!(not_kept(|outcome| outcome.rows[40..].iter_mut().for_each(|row| row.processes[process].memory += 1300)), ["memory"]);
        assert_eq!(not_kept(|outcome| outcome.rows[40..].iter_mut().for_each(|row| row.processes[process].files += 3)), ["open"]);
    }
    assert_eq!(not_kept(|outcome| outcome.visits.joinings = 2), ["the"]);
    assert_eq!(not_kept(|outcome| outcome.floods.clear()), ["each"]);
    assert_eq!(not_kept(|outcome| outcome.connections.let_in = 1), ["live"]);
    assert_eq!(not_kept(|outcome| outcome.rows.truncate(2)), ["memory", "open"]);
}

/// Two of a hundred, and 1 MiB. Memory that is touched for the first time in the first third is no growth.
#[test]
fn flat_is_what_it_says() {
    assert!(is_flat(10_000, 11_224) && !is_flat(10_000, 11_225) && !is_flat(0, 0));
    assert!(not_kept(|outcome| outcome.rows[..20].iter_mut().for_each(|row| row.processes[0].memory = 5_000)).is_empty());
}

/// The program lies two folders above the tests, if it is built.
fn program() -> Option<PathBuf> {
    let program = std::env::current_exe().unwrap().ancestors().nth(2).map(|folder| folder.join("cohaptic"))?;
    program.exists().then_some(program)
}

#[test]
fn a_short_one_runs_the_programs_and_keeps_nobody_out() {
    let Some(program) = program() else {
        eprintln!("skipped: cohaptic is not built: cargo build -p cohaptic-cli");
        return;
    };
    let plan = FloodedPlan { duration: Duration::from_secs(6), every: Duration::from_millis(200), program, rate: 2_000, priority: false };
    let mut shown = 0;
    let outcome = run(&plan, &AtomicBool::new(false), |_| shown += 1).unwrap();
    assert_eq!(outcome.rows.len(), shown);
    let judgements = judge(&outcome);
    // How late anything was, and what was touched late, is the machine's business.
    for judgement in judgements.iter().filter(|judgement| !judgement.rule.starts_with("both") && !judgement.rule.starts_with("memory")) {
        assert_eq!(judgement.verdict, Verdict::Kept, "{judgement:?}");
    }
    let text = section(&plan, &outcome, &[], "soak", "today").unwrap();
    assert!(text.contains("\n| 0:01 | ") && text.contains("to the session | "), "{text}");
    assert!(!Path::new(&std::env::temp_dir().join(format!("cohaptic-soak-{}", std::process::id()))).exists(), "nothing is left behind");
}
