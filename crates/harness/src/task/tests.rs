//! Tests of the laws on positions that each test writes down, without a simulation.

use cohaptic_scene::{Scene, TaskOutcome};
use cohaptic_units::Instant;

use super::{Event, Failure, FailureReason, Judge, TaskResult, TaskRow};
use crate::TickRow;
use crate::rows::StateRow;

/// State of one copy at a tick: position, velocity and coupling force.
type Row = (f64, f64, f64);

/// Result and events of a task with the keys `task` in a scene of 10 ms with two peers, `left` and `right`, which both touch. `rows` has the states of both
/// copies at each millisecond.
fn judged(task: &str, rows: &[[Row; 2]]) -> (TaskResult, Vec<(u64, Event)>) {
    judged_until(task, rows, None, 10)
}

fn judged_until(task: &str, rows: &[[Row; 2]], otherwise: Option<TaskOutcome>, duration: u64) -> (TaskResult, Vec<(u64, Event)>) {
    let text = format!(
        "scene = {{ duration = \"10ms\" }}
         object = {{ mass = 0.45 }}
         coordination = {{ strategy = \"average-position\", stiffness = 1000.0, damping = 5.0, update = \"8ms\" }}
         peer = {{ device = {{ mass = 0.1 }}, coupling = {{ stiffness = 3500.0, damping = 5.0 }} }}
         peers = [{{ name = \"left\" }}, {{ name = \"right\" }}]
         task = {{ {task} }}"
    );
    let scene = Scene::parse(&text, "test.toml".as_ref(), &[]).unwrap_or_else(|error| panic!("{error}"));
    let mut judge = Judge::of(&scene).unwrap();
    let mut events = Vec::new();
    let mut note = |at: Instant, row: TaskRow| {
        if let TaskRow::Event(event) = row {
            events.push((at.as_nanos() / 1_000_000, event));
        }
    };
    for (tick, copies) in (0_u64..).zip(rows) {
        for (peer, &(position, velocity, force)) in copies.iter().enumerate() {
            let state = StateRow { position: &[position], velocity: &[velocity] };
            let row = TickRow {
                at: millis(tick),
                peer,
                device: state,
                object: state,
                target: state,
                coupling_force: &[force],
                coordination_force: &[0.0],
                turn: None,
            };
            judge.on_tick(&row, &mut note);
        }
    }
    let (result, _) = judge.finish(otherwise, millis(duration) - Instant::ZERO, &mut note);
    (result, events)
}

fn millis(count: u64) -> Instant {
    Instant::from_nanos(count * 1_000_000)
}

/// Returns rows with both copies at the same place, at rest and without force.
fn together(positions: &[f64]) -> Vec<[Row; 2]> {
    positions.iter().map(|&position| [(position, 0.0, 0.0); 2]).collect()
}

fn outcome(task: &str, rows: &[[Row; 2]]) -> (TaskOutcome, u64) {
    let (result, _) = judged(task, rows);
    (result.outcome, result.at.as_nanos() / 1_000_000)
}

fn reached(result: &TaskResult) -> Vec<u64> {
    result.reached.iter().map(|at| at.as_nanos() / 1_000_000).collect()
}

#[test]
fn targets_are_reached_one_after_the_other() {
    let rows = together(&[0.0, 0.3, 0.1, 0.2, 0.3, 0.1, 0.1, 0.1, 0.1, 0.1]);
    let (result, events) = judged(r#"kind = "reach", targets = [0.1, 0.3], radius = 0.01"#, &rows);
    // At 1 ms the second target is passed before the first was reached, which does not count.
    assert_eq!((result.outcome, reached(&result), result.time), (TaskOutcome::Done, vec![2, 4], std::time::Duration::from_millis(4)));
    let of_all = |goal| Event::Reached { peer: None, goal };
    let expected = [(2, of_all(0)), (4, of_all(1)), (4, Event::Ended { peer: None, outcome: TaskOutcome::Done, goal: 1 })];
    let seen: Vec<_> = events.into_iter().filter(|(_, event)| !matches!(event, Event::Entered { .. } | Event::Left { .. })).collect();
    assert_eq!(seen, expected);
}

#[test]
fn the_edge_of_a_target_belongs_to_the_target() {
    let task = r#"kind = "reach", targets = [0.5], radius = 0.25"#;
    assert_eq!(outcome(task, &together(&[0.0, 0.249, 0.25])), (TaskOutcome::Done, 2));
    assert_eq!(outcome(task, &together(&[1.0, 0.75])), (TaskOutcome::Done, 1));
}

#[test]
fn two_targets_at_one_place_are_reached_at_one_instant_without_a_dwell_time_only() {
    let rows = together(&[0.0, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1]);
    let (at_once, _) = judged(r#"kind = "reach", targets = [0.1, 0.1], radius = 0.01"#, &rows);
    assert_eq!(reached(&at_once), [1, 1]);
    let (dwelt, _) = judged(r#"kind = "reach", targets = [0.1, 0.1], radius = 0.01, dwell = "2ms""#, &rows);
    assert_eq!(reached(&dwelt), [3, 5]);
}

#[test]
fn a_dwell_time_begins_anew_after_each_instant_elsewhere_or_too_fast() {
    let task = r#"kind = "reach", targets = [0.1], radius = 0.01, speed = 0.5, dwell = "2ms""#;
    let mut rows = together(&[0.1, 0.1, 0.2, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1]);
    assert_eq!(outcome(task, &rows), (TaskOutcome::Done, 5));
    // Backwards counts too, and at most the speed is allowed.
    rows[5][1].1 = -0.51;
    rows[7][0].1 = 0.5;
    assert_eq!(outcome(task, &rows), (TaskOutcome::Done, 8));
}

#[test]
fn all_copies_together_or_one_alone() {
    // The left copy is at the first target, then at the second; the right copy the other way round.
    let places = [(0.0, 0.0), (0.1, 0.3), (0.3, 0.1), (0.0, 0.0), (0.1, 0.1), (0.0, 0.3), (0.3, 0.3)];
    let rows: Vec<[Row; 2]> = places.iter().map(|&(left, right)| [(left, 0.0, 0.0), (right, 0.0, 0.0)]).collect();
    let of = |who: &str| judged(&format!(r#"kind = "reach", targets = [0.1, 0.3], radius = 0.01, who = "{who}""#), &rows);
    assert_eq!(reached(&of("all").0), [4, 6]);
    assert_eq!(reached(&of("right").0), [2, 5]);
    let (any, events) = of("any");
    assert_eq!(reached(&any), [1, 2]);
    assert_eq!(events.last(), Some(&(2, Event::Ended { peer: Some(0), outcome: TaskOutcome::Done, goal: 1 })));
}

#[test]
fn the_time_ends_at_the_timeout_and_the_instant_of_the_timeout_still_counts() {
    let task = |timeout: &str| format!(r#"kind = "reach", targets = [0.1], radius = 0.01, start = "1ms", timeout = "{timeout}""#);
    // Before the start nothing counts.
    let rows = together(&[0.1, 0.0, 0.0, 0.0, 0.1, 0.1, 0.1, 0.1, 0.1, 0.1]);
    assert_eq!(outcome(&task("3ms"), &rows), (TaskOutcome::Done, 4));
    assert_eq!(outcome(&task("2ms"), &rows), (TaskOutcome::TimedOut, 3));
    // Between two instants.
    let (late, events) = judged(&task("2500us"), &rows);
    assert_eq!((late.outcome, late.time), (TaskOutcome::TimedOut, std::time::Duration::from_micros(2500)));
    assert_eq!(events.last(), Some(&(3, Event::Ended { peer: None, outcome: TaskOutcome::TimedOut, goal: 0 })));
    let never = together(&[0.0; 10]);
    // The end of the scene is the default, and has no tick.
    assert_eq!(outcome(r#"kind = "reach", targets = [0.1], radius = 0.01"#, &never), (TaskOutcome::TimedOut, 10));
    assert_eq!(outcome(&task("9ms"), &never), (TaskOutcome::TimedOut, 10));
    assert_eq!(outcome(&task("10ms"), &never), (TaskOutcome::Unfinished, 10));
}

#[test]
fn a_run_that_ends_early_leaves_the_task_unfinished_or_diverged() {
    let task = r#"kind = "hold", target = 0.0, radius = 0.01"#;
    let rows = together(&[0.0, 0.0, 0.0]);
    for (otherwise, expected) in
        [(Some(TaskOutcome::Unfinished), TaskOutcome::Unfinished), (Some(TaskOutcome::Diverged), TaskOutcome::Diverged), (None, TaskOutcome::Done)]
    {
        let (result, events) = judged_until(task, &rows, otherwise, 2);
        assert_eq!(result.outcome, expected);
        assert!(matches!(events.last(), Some((_, Event::Ended { outcome, .. })) if *outcome == expected), "{events:?}");
    }
}

#[test]
fn a_held_target_may_be_left_for_the_grace_time_at_once() {
    let task = r#"kind = "hold", target = 0.1, radius = 0.01, grace = "2ms""#;
    // Outside until 1 ms is no failure: the target was not entered yet. The pauses inside break the time outside.
    let outside = |count: usize| {
        let mut positions = vec![0.0, 0.0, 0.1];
        positions.extend(std::iter::repeat_n(0.0, count));
        positions.resize(10, 0.1);
        together(&positions)
    };
    assert_eq!(outcome(task, &outside(3)), (TaskOutcome::Done, 10));
    assert_eq!(outcome(task, &outside(4)), (TaskOutcome::Failed, 6));
    let (result, events) = judged(task, &outside(4));
    assert_eq!(result.failure, Some(Failure { peer: 0, reason: FailureReason::Left }));
    assert_eq!(events[0], (2, Event::Entered { peer: 0, goal: 0 }));
    assert_eq!(events[2], (3, Event::Left { peer: 0, goal: 0 }));
    assert_eq!(outcome(task, &together(&[0.0; 10])), (TaskOutcome::TimedOut, 10));
}

#[test]
fn who_pulls_too_hard_has_dropped_the_object() {
    let task = r#"kind = "track", sines = [{ amplitude = 0.01, frequency = 1.0 }], fail = { force = 8.0 }"#;
    let mut rows = together(&[0.0; 10]);
    rows[3][1].2 = 8.0;
    assert_eq!(outcome(task, &rows), (TaskOutcome::Done, 10));
    rows[5][1].2 = -8.1;
    let (result, events) = judged(task, &rows);
    assert_eq!((result.outcome, result.failure), (TaskOutcome::Failed, Some(Failure { peer: 1, reason: FailureReason::Dropped })));
    assert_eq!(events, [(5, Event::Ended { peer: Some(1), outcome: TaskOutcome::Failed, goal: 0 })]);
    // A peer that is not judged cannot fail.
    assert_eq!(outcome(&format!(r#"{task}, who = "left""#), &rows), (TaskOutcome::Done, 10));
}
