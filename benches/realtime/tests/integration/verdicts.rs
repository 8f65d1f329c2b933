//! Every rule is broken by what breaks it, and by nothing less.

use std::time::Duration;

use cohaptic_benches_realtime::soak::{Account, Lag, MEMORY_BOUND, Outcome, Row, Verdict, judge};
use cohaptic_benches_realtime::visitor::Visits;
use cohaptic_realtime::LatenessSummary;

const TICK: i128 = 1_000_000;

fn row(minute: u64) -> Row {
    let lateness = (LatenessSummary::default(), Duration::ZERO);
    let at = Duration::from_secs(60 * minute);
    Row {
        at,
        memory: 10_000,
        files: 12,
        logical: at,
        lag: Lag { looks: 1000, least_at_most: 60_000, least_at_least: 10_000, most: 3 * TICK, behind: 2 },
        ticks: lateness,
        releases: lateness,
        relay: lateness,
        held: [30, 24],
        offered: [0; 2],
        dropped: [0; 2],
    }
}

fn account(first: u64, second: u64, open: Option<&'static str>) -> Account {
    Account { what: "apples and pears", first, second, open }
}

fn good() -> Outcome {
    Outcome {
        elapsed: Duration::from_secs(3600),
        interrupted: false,
        rows: (1..=60).map(row).collect(),
        accounts: vec![account(5, 5, None)],
        unbalanced: Vec::new(),
        at_end: [Duration::ZERO; 2],
        unknown: Duration::from_micros(50),
        fault: None,
        visits: Visits { visits: 18, joinings: 18, newest: 1_000_000, ..Visits::default() },
        refused: Vec::new(),
    }
}

/// The rules that an outcome does not keep, by their first words.
fn not_kept(change: impl FnOnce(&mut Outcome)) -> Vec<(&'static str, Verdict)> {
    let mut outcome = good();
    change(&mut outcome);
    let judgements = judge(&outcome).into_iter().filter(|judgement| judgement.verdict != Verdict::Kept);
    judgements.map(|judgement| (judgement.rule, judgement.verdict)).collect()
}

fn breaks(rule: &str, change: impl FnOnce(&mut Outcome)) {
    let found = not_kept(change);
    assert!(found.len() == 1 && found[0].0.starts_with(rule) && found[0].1 == Verdict::Broken, "{rule}: {found:?}");
}

fn breaks_nothing(change: impl FnOnce(&mut Outcome)) {
    assert_eq!(not_kept(change), []);
}

#[test]
fn memory_that_grows_slowly_is_found() {
    breaks_nothing(|_| ());
    // From the middle of the first quarter to that of the last there are 45 looks.
    breaks("memory", |outcome| outcome.rows.iter_mut().zip(0..).for_each(|(row, place)| row.memory += place * (MEMORY_BOUND / 45 + 1)));
    breaks_nothing(|outcome| outcome.rows.iter_mut().zip(0..).for_each(|(row, place)| row.memory += place * (MEMORY_BOUND / 45)));
    // One look that found more, such as while something was printed, is no growth.
    breaks_nothing(|outcome| outcome.rows[59].memory *= 2);
    // Nothing known is not nothing grown.
    breaks("memory", |outcome| outcome.rows.iter_mut().for_each(|row| row.memory = 0));
}

#[test]
fn one_open_file_more_is_found_if_it_stays_open() {
    breaks("open files", |outcome| outcome.rows[45..].iter_mut().for_each(|row| row.files += 1));
    breaks_nothing(|outcome| outcome.rows[46..].iter_mut().for_each(|row| row.files += 1));
}

#[test]
fn drift_is_found_and_lateness_is_none() {
    breaks("logical time is never ahead", |outcome| outcome.rows[30].lag.least_at_most = -1);
    breaks("logical time is never ahead", |outcome| outcome.at_end[0] = Duration::from_nanos(1));
    breaks("logical time does not fall behind", |outcome| outcome.rows[30].lag.least_at_least = TICK);
    breaks("logical time does not fall behind", |outcome| outcome.at_end[1] = Duration::from_nanos(1));
    breaks_nothing(|outcome| outcome.rows[30].lag.least_at_least = TICK - 1);
    breaks_nothing(|outcome| outcome.rows[30].lag.most = 1000 * TICK);
    // Who does not know when time began cannot tell whether it is a tick behind, but can tell if it is behind for certain.
    let unknown = Duration::from_millis(1);
    let found = not_kept(|outcome| outcome.unknown = unknown);
    assert!(found.len() == 1 && found[0].1 == Verdict::Skipped, "{found:?}");
    breaks("logical time does not fall behind", |outcome| {
        outcome.unknown = unknown;
        outcome.rows[30].lag.least_at_least = TICK;
    });
}

#[test]
fn an_account_that_does_not_balance_is_found_at_any_look() {
    breaks("counts of one thing", |outcome| outcome.accounts.push(account(5, 4, None)));
    breaks("counts of one thing", |outcome| outcome.unbalanced.push((Duration::from_secs(60), account(5, 6, None))));
    breaks_nothing(|outcome| outcome.accounts.push(account(5, 4, Some("not told"))));
    // To have counted nothing is not to have lost nothing.
    breaks("counts of one thing", |outcome| outcome.accounts.clear());
    assert_eq!(account(5, 4, None).to_string(), "apples and pears: 5 ≠ 4");
}

#[test]
fn who_ends_by_himself_or_is_not_let_in_is_found() {
    breaks("nothing ends", |outcome| outcome.fault = Some("the scene diverged at 3 s".to_owned()));
    breaks("the visitor", |outcome| outcome.visits.joinings = 0);
    breaks("the visitor", |outcome| outcome.visits.newest = 0);
}

#[test]
fn too_few_looks_are_no_verdict() {
    let found = not_kept(|outcome| outcome.rows.truncate(3));
    assert_eq!(found.iter().map(|(_, verdict)| verdict.clone()).collect::<Vec<_>>(), [Verdict::Skipped, Verdict::Skipped]);
    let found = not_kept(|outcome| outcome.rows.clear());
    assert!(found.iter().all(|(_, verdict)| *verdict == Verdict::Skipped) && found.len() == 4, "{found:?}");
}
