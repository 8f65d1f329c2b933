//! Tests of the laws on positions that each test writes down, without a simulation.

use cohaptic_peer::rotation::Attitude;
use cohaptic_scene::{Scene, TaskOutcome};
use cohaptic_units::Instant;

use super::rows::OnRow;
use super::{Event, Failure, FailureReason, Judge, Movement, Seen, TaskResult, TaskRow, task_words};
use crate::TickRow;
use crate::rows::{StateRow, TurnRow};

/// State of one copy at a tick: position, velocity and coupling force.
type Row = (f64, f64, f64);

/// Result and events of a task with the keys `task` in a scene of 10 ms with two peers, `left` and `right`, which both touch. `rows` has the states of both
/// copies at each millisecond.
fn judged(task: &str, rows: &[[Row; 2]]) -> (TaskResult, Vec<(u64, Event)>) {
    judged_until(task, rows, false, 10)
}

fn judged_until(task: &str, rows: &[[Row; 2]], has_diverged: bool, duration: u64) -> (TaskResult, Vec<(u64, Event)>) {
    let (result, _, events) = judge_of(&scene(task), rows, &[], has_diverged, duration);
    (result, events)
}

fn scene(task: &str) -> Scene {
    scene_with(task, "", "", &[])
}

/// Scene with an object that turns.
fn turning(task: &str) -> Scene {
    scene_with(task, ", axes = 3", ", inertia = 0.001", &[])
}

/// Scene with a third peer.
fn scene_of_three(task: &str, third: &str) -> Scene {
    scene_with(task, "", "", &[format!("peers=[{{ name = \"left\" }}, {{ name = \"right\" }}, {third}]")])
}

fn scene_with(task: &str, of_scene: &str, of_object: &str, overrides: &[String]) -> Scene {
    let text = format!(
        "scene = {{ duration = \"10ms\"{of_scene} }}
         object = {{ mass = 0.45{of_object} }}
         coordination = {{ strategy = \"average-position\", stiffness = 1000.0, damping = 5.0, update = \"8ms\" }}
         peer = {{ device = {{ mass = 0.1 }}, coupling = {{ stiffness = 3500.0, damping = 5.0 }} }}
         peers = [{{ name = \"left\" }}, {{ name = \"right\" }}]
         task = {{ {task} }}"
    );
    Scene::parse(&text, "test.toml".as_ref(), overrides).unwrap_or_else(|error| panic!("{error}"))
}

/// Shows a judge the tick of a peer.
fn tick(judge: &mut Judge, at: Instant, peer: usize, (position, velocity, force): Row, attitude: Option<&Attitude>, on_row: OnRow<'_>) {
    // An object that turns moves along three axes.
    let axes = if attitude.is_some() { 3 } else { 1 };
    let (position, velocity) = ([position, 0.0, 0.0], [velocity, 0.0, 0.0]);
    let state = StateRow { position: &position[..axes], velocity: &velocity[..axes] };
    let row = TickRow {
        at,
        peer,
        device: state,
        object: state,
        target: state,
        coupling_force: &[force],
        coordination_force: &[0.0],
        turn: attitude.map(|object| TurnRow { object, device: None, coupling_torque: &[0.0; 3], coordination_torque: &[0.0; 3] }),
    };
    judge.on_tick(&row, on_row);
}

/// Result, judge and events of the task of a scene. `attitudes`: attitude of both copies at each millisecond; empty for an object that does not turn.
fn judge_of(scene: &Scene, rows: &[[Row; 2]], attitudes: &[Attitude], has_diverged: bool, duration: u64) -> (TaskResult, Judge, Vec<(u64, Event)>) {
    let mut judge = Judge::of(scene).unwrap();
    let mut events = Vec::new();
    let mut note = |at: Instant, row: TaskRow| {
        if let TaskRow::Event(event) = row {
            events.push((at.as_nanos() / 1_000_000, event));
        }
    };
    for (place, copies) in rows.iter().enumerate() {
        for (peer, row) in copies.iter().enumerate() {
            tick(&mut judge, millis(place as u64), peer, *row, attitudes.get(place), &mut note);
        }
    }
    let (result, judge) = judge.finish(has_diverged, millis(duration) - Instant::ZERO, &mut note);
    (result, judge, events)
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
    let (at_once, events) = judged(r#"kind = "reach", targets = [0.1, 0.1], radius = 0.01"#, &rows);
    assert_eq!(reached(&at_once), [1, 1]);
    // Each of the two copies enters each of the two targets.
    assert_eq!(events.iter().filter(|(at, event)| *at == 1 && matches!(event, Event::Entered { .. })).count(), 4);
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
    // The second peer may be first.
    let swapped: Vec<[Row; 2]> = rows.iter().map(|&[left, right]| [right, left]).collect();
    let (any, events) = judged(r#"kind = "reach", targets = [0.1, 0.3], radius = 0.01, who = "any""#, &swapped);
    assert_eq!(reached(&any), [1, 2]);
    assert_eq!(events.last(), Some(&(2, Event::Ended { peer: Some(1), outcome: TaskOutcome::Done, goal: 1 })));
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
fn words_about_a_run_that_was_ended_have_whole_milliseconds() {
    let scene = scene(r#"kind = "hold", target = 0.0, radius = 0.01"#);
    let time = std::time::Duration::from_nanos(507_011_033);
    let result = |outcome| TaskResult { outcome, at: Instant::ZERO + time, time, reached: Vec::new(), movements: Vec::new(), failure: None };
    assert_eq!(task_words(&result(TaskOutcome::Unfinished), &scene), "unfinished: the run ended 507ms after the start of the task");
    // The instant of an outcome is exact.
    assert_eq!(task_words(&result(TaskOutcome::Done), &scene), "done after 507.011033ms");
}

#[test]
fn a_run_that_ends_early_leaves_the_task_unfinished_or_diverged() {
    let task = r#"kind = "hold", target = 0.0, radius = 0.01"#;
    let rows = together(&[0.0, 0.0, 0.0]);
    for (has_diverged, duration, expected) in [(false, 2, TaskOutcome::Unfinished), (true, 2, TaskOutcome::Diverged), (false, 10, TaskOutcome::Done)]
    {
        let (result, events) = judged_until(task, &rows, has_diverged, duration);
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
    // Twice outside for the grace time.
    let twice = [0.1, 0.0, 0.0, 0.0, 0.1, 0.0, 0.0, 0.0, 0.1, 0.1];
    assert_eq!(outcome(task, &together(&twice)), (TaskOutcome::Done, 10));
    // The target is entered when both copies are there.
    let apart: Vec<[Row; 2]> = twice.iter().map(|&left| [(left, 0.0, 0.0), (0.0, 0.0, 0.0)]).collect();
    assert_eq!(outcome(task, &apart), (TaskOutcome::TimedOut, 10));
}

#[test]
fn time_outside_counts_after_the_first_entry() {
    let outside = |task: &str| judge_of(&scene(task), &together(&[0.0, 0.0, 0.1, 0.0, 0.0, 0.1]), &[], false, 6).1.outside(1);
    let expected = std::time::Duration::from_millis(2);
    assert_eq!(outside(r#"kind = "hold", target = 0.1, radius = 0.01, grace = "5ms""#), Some(expected));
    assert_eq!(outside(r#"kind = "reach", targets = [0.2], radius = 0.01"#), None);
}

/// A copy that has not ticked yet is nowhere, and not at zero.
#[test]
fn nothing_is_judged_before_each_judged_peer_has_ticked() {
    let mut judge = Judge::of(&scene(r#"kind = "reach", targets = [0.0], radius = 0.01"#)).unwrap();
    for (at, peer) in [(0, 0), (1, 0), (1, 1), (2, 0)] {
        tick(&mut judge, millis(at), peer, (0.0, 0.0, 0.0), None, &mut |_, _| ());
    }
    assert_eq!(judge.ended(), Some(millis(1)));
}

#[test]
fn a_task_is_under_way_from_its_start_to_its_deadline() {
    let mut judge = Judge::of(&scene(r#"kind = "reach", targets = [0.1], radius = 0.01, start = "2ms", timeout = "2500us""#)).unwrap();
    let mut is_under_way = |at: u64| {
        (0..2).for_each(|peer| tick(&mut judge, millis(at), peer, (0.0, 0.0, 0.0), None, &mut |_, _| ()));
        judge.is_under_way(millis(at))
    };
    assert_eq!([1, 2, 4, 5].map(&mut is_under_way), [false, true, true, false]);
}

/// On a path, an operator is asked for the point w/(4c) ahead of the progress of all copies that are judged together.
#[test]
fn a_path_asks_for_a_point_ahead() {
    let asks = |who: &str, noise: f64| {
        let scene = scene(&format!("kind = \"path\", points = [0.0, 0.1], width = 0.02, who = \"{who}\""));
        let mut judge = Judge::of_targets(&scene).unwrap();
        for (at, left, right) in [(0, 0.0, 0.0), (1, 0.01, 0.02), (2, 0.02, 0.03)] {
            tick(&mut judge, millis(at), 0, (left, 0.0, 0.0), None, &mut |_, _| ());
            tick(&mut judge, millis(at), 1, (right, 0.0, 0.0), None, &mut |_, _| ());
        }
        judge.settle(&mut |_, _| ());
        [0, 1].map(|peer| {
            let (position, radius) = judge.asks(peer, millis(3), noise);
            ((position[0] * 1e6).round(), radius)
        })
    };
    assert_eq!(asks("all", 0.1), [(70_000.0, 0.0); 2]);
    assert_eq!(asks("any", 0.1), [(70_000.0, 0.0), (80_000.0, 0.0)]);
    assert_eq!(asks("all", 0.2), [(45_000.0, 0.0); 2]);
    // Without noise a single movement leads to the end.
    assert_eq!(asks("all", 0.0), [(100_000.0, 0.0); 2]);
    let scene = scene(r#"kind = "path", points = [0.0, 0.1], width = 0.02"#);
    // The page of a session draws the lane as the tolerance: half the width to each side.
    assert_eq!(Judge::of(&scene).unwrap().view(millis(0)).radius, Some(0.01));
}

#[test]
fn a_peer_that_is_not_judged_is_asked_for_the_target_of_the_leading_peer() {
    let scene = scene_of_three(r#"kind = "reach", targets = [0.1, 0.3], radius = 0.01, who = "any""#, r#"{ name = "third", contact = "none" }"#);
    let mut judge = Judge::of_targets(&scene).unwrap();
    for (peer, position) in [(0, 0.0), (1, 0.1), (2, 0.0)] {
        tick(&mut judge, millis(0), peer, (position, 0.0, 0.0), None, &mut |_, _| ());
    }
    judge.settle(&mut |_, _| ());
    assert_eq!([0, 1, 2].map(|peer| judge.asks(peer, millis(1), 0.1).0[0].to_bits()), [0.1_f64, 0.3, 0.3].map(f64::to_bits));
}

#[test]
fn a_judged_instant_shows_the_copy_that_is_farthest_away() {
    let seen = |scene: &Scene, [left, right]: [f64; 2], attitudes: [Option<&Attitude>; 2]| {
        let mut judge = Judge::of(scene).unwrap();
        let mut shown = None;
        let mut note = |_: Instant, row: TaskRow| {
            if let TaskRow::Judged(seen) = row {
                shown = Some(seen);
            }
        };
        tick(&mut judge, millis(0), 0, (left, 0.0, 0.0), attitudes[0], &mut note);
        tick(&mut judge, millis(0), 1, (right, 0.0, 0.0), attitudes[1], &mut note);
        judge.settle(&mut note);
        let Seen { error, turn, is_inside, .. } = shown.unwrap();
        ((error * 1e6).round(), turn.map(|turn| (turn * 1e6).round()), is_inside)
    };
    let plain = scene(r#"kind = "reach", targets = [0.1], radius = 0.02"#);
    assert_eq!(seen(&plain, [0.1, 0.13], [None; 2]), (30_000.0, None, Some(false)));
    assert_eq!(seen(&plain, [0.11, 0.1], [None; 2]), (10_000.0, None, Some(true)));
    let turning = turning(r#"kind = "reach", targets = [[0, 0, 0]], orientations = [[1, 0, 0, 0]], angle = 0.25, radius = 0.02"#);
    let [near, far] = [0.2, 0.3].map(turned);
    assert_eq!(seen(&turning, [0.0, 0.01], [Some(&near), Some(&far)]), (10_000.0, Some(300_000.0), Some(false)));
    assert_eq!(seen(&turning, [0.0, 0.01], [Some(&near); 2]), (10_000.0, Some(200_000.0), Some(true)));
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

/// Attitude after a turn about the z axis \[rad\].
fn turned(angle: f64) -> Attitude {
    Attitude { orientation: [(0.5 * angle).cos(), 0.0, 0.0, (0.5 * angle).sin()], rate: [0.0; 3] }
}

#[test]
fn a_target_with_an_orientation_is_reached_by_a_turned_copy() {
    let orientations = "orientations = [[1, 0, 0, 0], [1, 0, 0, 1]], angle = 0.25";
    let scene = turning(&format!("kind = \"reach\", targets = [[0, 0, 0], [0, 0, 0]], {orientations}, radius = 0.01, dwell = \"1ms\""));
    // The second orientation is a quarter of a turn about z. At one instant each, the copies are 0.3 and 0.26 rad away, which is too much.
    let quarter = std::f64::consts::FRAC_PI_2;
    let angles = [0.3, 0.2, 0.3, -0.2, -0.24, quarter - 0.24, quarter + 0.26, quarter + 0.2, quarter, quarter];
    let attitudes = angles.map(turned);
    let (result, _, events) = judge_of(&scene, &together(&[0.0; 10]), &attitudes, false, 10);
    assert_eq!((result.outcome, reached(&result)), (TaskOutcome::Done, vec![4, 8]));
    let entered: Vec<u64> = events.iter().filter(|(_, event)| matches!(event, Event::Entered { peer: 0, .. })).map(|(at, _)| *at).collect();
    assert_eq!(entered, [1, 3, 5, 7]);
}

#[test]
fn a_copy_beyond_the_target_is_too_far_along_the_line_from_the_target_before() {
    let overshoot = |positions: &[f64], task: &str| {
        let (_, judge, _) = judge_of(&scene(task), &together(positions), &[], false, 10);
        [0, 1].map(|peer| judge.overshoot(peer))
    };
    let task = r#"kind = "reach", targets = [0.1, 0.0], radius = 0.01, dwell = "1ms""#;
    // 3 mm too far at the first target. On the way back 99 mm lie before the second target, and then 4 mm beyond it.
    assert_eq!(overshoot(&[0.05, 0.102, 0.103, 0.099, -0.004, 0.0], task).map(|m| m.map(|m| (m * 1e6).round())), [Some(4000.0); 2]);
    assert_eq!(overshoot(&[0.05, 0.102, 0.103, 0.099, 0.004, 0.0], task).map(|m| m.map(|m| (m * 1e6).round())), [Some(3000.0); 2]);
    assert_eq!(overshoot(&[0.05, 0.095, 0.095], task), [Some(0.0); 2]);
    // The line to the second target begins at the first target, and not where the copy began.
    assert_eq!(overshoot(&[0.3, 0.1, 0.1, 0.15, 0.204, 0.2], &task.replace("0.0]", "0.2]")).map(|m| m.map(|m| (m * 1e6).round())), [Some(4000.0); 2]);
    // From the other side, too far is the other way.
    assert_eq!(overshoot(&[0.2, 0.1, 0.098, 0.102], task).map(|m| m.map(|m| (m * 1e6).round())), [Some(2000.0); 2]);
    assert_eq!(overshoot(&[0.2, 0.1], r#"kind = "hold", target = 0.1, radius = 0.01"#), [None; 2]);
}

#[test]
fn a_movement_goes_from_where_the_one_before_ended() {
    let task = r#"kind = "reach", targets = [0.1, 0.1, 0.0], radius = 0.01, start = "1ms""#;
    let (result, _) = judged(task, &together(&[0.5, 0.02, 0.05, 0.104, 0.05, -0.003]));
    let rounded: Vec<_> = result
        .movements
        .iter()
        .map(|Movement { distance, deviation, time }| ((distance * 1e6).round(), (deviation * 1e6).round(), time.as_millis()))
        .collect();
    // The second target is at the place of the first: no movement leads there. Distances go from 20 to 104 mm, and from there to −3 mm.
    assert_eq!(rounded, [(84_000.0, 4_000.0, 2), (107_000.0, 3_000.0, 2)]);
}

#[test]
fn the_view_of_a_task_fills_with_the_dwell_time() {
    let scene = scene(r#"kind = "reach", targets = [0.1, 0.0], radius = 0.01, start = "2ms", timeout = "6ms", dwell = "4ms""#);
    let mut judge = Judge::of(&scene).unwrap();
    let mut see = |at: u64, position: f64| {
        for peer in 0..2 {
            tick(&mut judge, millis(at), peer, (position, 0.0, 0.0), None, &mut |_, _| ());
        }
        judge.settle(&mut |_, _| ());
        let view = judge.view(millis(at));
        (view.target.position[0], view.reached, view.dwelt, view.until_start.as_millis(), view.left.as_millis(), view.outcome)
    };
    assert_eq!(see(0, 0.1), (0.1, 0, 0.0, 2, 6, None));
    assert_eq!(see(2, 0.1), (0.1, 0, 0.0, 0, 6, None));
    assert_eq!(see(5, 0.1), (0.1, 0, 0.75, 0, 3, None));
    assert_eq!(see(6, 0.1), (0.0, 1, 0.0, 0, 2, None));
    assert_eq!(see(8, 0.0), (0.0, 1, 0.0, 0, 0, Some(TaskOutcome::TimedOut)));
}

#[test]
fn a_path_is_done_at_its_end_and_not_by_a_short_cut() {
    let task = |leave: &str| format!(r#"kind = "path", points = [0.0, 0.1, 0.0], width = 0.04, leave = "{leave}""#);
    // To 0.1 m and back. At 1 ms both copies are at the end of the path already, but only 0.04 m further than they were.
    let there_and_back = [0.0, 0.0, 0.04, 0.08, 0.1, 0.07, 0.03, 0.0, 0.0, 0.0];
    assert_eq!(outcome(&task("fail"), &together(&there_and_back)), (TaskOutcome::Done, 7));
    assert_eq!(outcome(&task("count"), &together(&[0.0, 0.1, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0])), (TaskOutcome::TimedOut, 10));
    // Copies that come to rest before the last point are at the end within a hundredth of the width, 0.4 mm.
    let resting = |before: f64| outcome(&task("count"), &together(&[0.0, 0.0, 0.04, 0.08, 0.1, 0.07, 0.03, before, before, before]));
    assert_eq!((resting(0.00039), resting(0.00041)), ((TaskOutcome::Done, 7), (TaskOutcome::TimedOut, 10)));
    // 21 mm beyond the turning point is outside, for 2 ms.
    let wide = [0.0, 0.0, 0.04, 0.08, 0.121, 0.121, 0.1, 0.07, 0.03, 0.0];
    let (result, judge, events) = judge_of(&scene(&task("count")), &together(&wide), &[], false, 10);
    assert_eq!((result.outcome, judge.outside(1)), (TaskOutcome::Done, Some(std::time::Duration::from_millis(2))));
    assert!(events.contains(&(4, Event::Left { peer: 1, goal: 0 })) && events.contains(&(6, Event::Entered { peer: 1, goal: 0 })), "{events:?}");
    let (result, _) = judged(&task("fail"), &together(&wide));
    assert_eq!((result.outcome, result.failure), (TaskOutcome::Failed, Some(Failure { peer: 0, reason: FailureReason::Left })));
    // A copy that begins beside the lane has not left the lane, but the time outside counts from the start.
    let (result, judge, _) = judge_of(&scene(&task("fail")), &together(&[-0.03, 0.0, 0.04, 0.08, 0.1, 0.07, 0.03, 0.0]), &[], false, 10);
    assert_eq!((result.outcome, judge.outside(0)), (TaskOutcome::Done, Some(std::time::Duration::from_millis(1))));
    // The progress of each copy counts alone: the second copy goes there only.
    let apart: Vec<[Row; 2]> = there_and_back.iter().map(|&left| [(left, 0.0, 0.0), (left.min(0.04), 0.0, 0.0)]).collect();
    assert_eq!(outcome(&task("count"), &apart), (TaskOutcome::TimedOut, 10));
    assert_eq!(outcome(&format!("{}, who = \"any\"", task("count")), &apart), (TaskOutcome::Done, 7));
}

/// The rows have the devices at the copies.
#[test]
fn devices_that_are_too_far_apart_have_dropped_what_they_carry() {
    let task = r#"kind = "carry", targets = [0.1], radius = 0.02, gap = { peers = ["right", "left"], min = 0.01, max = 0.03 }"#;
    let rows = |right: &[f64]| right.iter().map(|&right| [(0.0, 0.0, 0.0), (right, 0.0, 0.0)]).collect::<Vec<[Row; 2]>>();
    assert_eq!(outcome(task, &rows(&[0.011, 0.029, 0.02, 0.02])), (TaskOutcome::TimedOut, 10));
    assert_eq!(outcome(task, &rows(&[0.02, 0.02, 0.031])), (TaskOutcome::Failed, 2));
    assert_eq!(outcome(task, &rows(&[0.02, 0.009, 0.02])), (TaskOutcome::Failed, 1));
    let (result, _) = judged(task, &rows(&[0.04]));
    assert_eq!(result.failure, Some(Failure { peer: 0, reason: FailureReason::Gap }));
    // The peer that fails is one of the two.
    let scene = scene_of_three(&task.replace("[\"right\", \"left\"]", "[\"third\", \"right\"]"), r#"{ name = "third" }"#);
    let mut judge = Judge::of(&scene).unwrap();
    for (peer, position) in [(0, 0.0), (1, 0.0), (2, 0.04)] {
        tick(&mut judge, millis(0), peer, (position, 0.0, 0.0), None, &mut |_, _| ());
    }
    let (result, _) = judge.finish(false, millis(10) - Instant::ZERO, &mut |_, _| ());
    assert_eq!(result.failure, Some(Failure { peer: 1, reason: FailureReason::Gap }));
    let near = [(0.1, 0.0, 0.0), (0.115, 0.0, 0.0)];
    assert_eq!(outcome(task, &[near]), (TaskOutcome::Done, 0));
}

#[test]
fn an_object_that_is_tilted_is_spilt() {
    let scene = turning(r#"kind = "carry", targets = [[0.1, 0, 0]], radius = 0.01, level = 0.2"#);
    let about = |axis: usize, angle: f64| {
        let mut attitude = turned(0.0);
        (attitude.orientation[0], attitude.orientation[1 + axis]) = ((0.5 * angle).cos(), (0.5 * angle).sin());
        attitude
    };
    let result = |attitude: Attitude| judge_of(&scene, &together(&[0.0, 0.0, 0.0]), &[turned(0.0), about(0, -0.19), attitude], false, 10).0;
    // A turn about the vertical axis tilts nothing.
    assert_eq!(result(about(2, 1.0)).outcome, TaskOutcome::TimedOut);
    assert_eq!(result(about(1, 0.19)).outcome, TaskOutcome::TimedOut);
    let tilted = result(about(1, 0.21));
    assert_eq!((tilted.outcome, tilted.at.as_nanos()), (TaskOutcome::Failed, 2_000_000));
    assert_eq!(tilted.failure, Some(Failure { peer: 0, reason: FailureReason::Tilted }));
}
