//! A short soak. What a loaded machine can break is not asserted: how late anything was, and whether logical time was up to date at any look.

use std::sync::atomic::AtomicBool;
use std::sync::{Mutex, PoisonError};
use std::time::Duration;

use cohaptic_benches_realtime::soak::{Judgement, Outcome, SoakPlan, Verdict, judge, run};
use cohaptic_realtime::Wishes;

/// For a few seconds, in which buffers are touched for the first time \[kB\].
const MEMORY: u64 = 32_768;

/// Open files and memory are those of the process: one soak at a time.
static ALONE: Mutex<()> = Mutex::new(());

fn find<'a>(judgements: &'a [Judgement], rule: &str) -> &'a Judgement {
    judgements.iter().find(|judgement| judgement.rule.starts_with(rule)).unwrap()
}

#[test]
fn eight_seconds_lose_nothing_and_keep_nothing() {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    // Without priority: a test does not push others aside.
    let plan = SoakPlan { wishes: Wishes::NONE, ..SoakPlan::new(Duration::from_secs(8), Duration::from_millis(500)) };
    let mut shown = 0;
    let outcome: Outcome = run(&plan, &AtomicBool::new(false), |_| shown += 1).unwrap();
    let judgements = judge(&outcome);
    assert_eq!(outcome.rows.len(), shown);
    assert_eq!(outcome.fault, None);
    assert!(outcome.elapsed >= plan.duration && !outcome.interrupted);
    assert!(outcome.rows.len() > 16, "one every half second and one at the end");

    for rule in ["counts of one thing in two places", "logical time is never ahead", "open files do not grow"] {
        let judgement = find(&judgements, rule);
        assert_eq!(judgement.verdict, Verdict::Kept, "{judgement:?}");
    }
    assert_eq!(outcome.accounts.len(), 12);
    // However late it was in between, at its end it has caught up with the moment at which it was asked to stop, and is not beyond the wall.
    assert_eq!(outcome.at_end, [Duration::ZERO; 2]);
    let (first, last) = (outcome.rows.first().unwrap(), outcome.rows.last().unwrap());
    assert!(first.memory > 0 && last.memory < first.memory + MEMORY, "{} kB, then {} kB", first.memory, last.memory);
    // A tick every millisecond of logical time, whatever the wall did.
    assert_eq!(u128::from(last.ticks.0.count), last.logical.as_nanos().div_ceil(1_000_000));
    assert!(outcome.rows.is_sorted_by(|before, after| before.logical < after.logical && before.offered[0] <= after.offered[0]));

    let drift = find(&judgements, "logical time does not fall behind");
    eprintln!("not asserted, since a busy machine decides it: {} ({:?}): {}", drift.rule, drift.verdict, drift.why);
    if outcome.visits.joinings == 0 {
        eprintln!("skipped: the visitor did not get round to joining on this machine, so its accounts are nearly empty");
    } else {
        assert!(outcome.visits.sent >= 2 * outcome.visits.joinings, "{:?}", outcome.visits);
    }
}

#[test]
fn it_ends_when_it_is_asked_to() {
    let _alone = ALONE.lock().unwrap_or_else(PoisonError::into_inner);
    let plan = SoakPlan { wishes: Wishes::NONE, ..SoakPlan::new(Duration::from_secs(3600), Duration::from_secs(60)) };
    let outcome = run(&plan, &AtomicBool::new(true), |_| ()).unwrap();
    assert!(outcome.interrupted);
    assert_eq!(outcome.rows.len(), 1, "that at the end");
    let judgements = judge(&outcome);
    assert_eq!(find(&judgements, "memory").verdict, Verdict::Skipped);
    assert_eq!(find(&judgements, "open files").verdict, Verdict::Skipped);
    assert_eq!(find(&judgements, "counts of one thing").verdict, Verdict::Kept);
}
