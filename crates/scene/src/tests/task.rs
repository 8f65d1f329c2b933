//! Tests of `[task]` and of what is expected of a task.

use std::time::Duration;

use super::{SCENE, parse, refused};
use crate::{Gap, Judged, Leave, Measure, Reach, Scope, Target, TargetOrder, TaskEnd, TaskKind, TaskOutcome};

const REACH: &str = "\n[task]\nkind = \"reach\"\ntargets = [0.1, 0.2]\nradius = 0.01\n";

#[test]
fn a_task_has_the_keys_of_its_kind() {
    let of = |text: &str| *parse(&format!("{SCENE}{text}"), &[]).unwrap_or_else(|error| panic!("{error}")).task.unwrap();
    let reach = of(REACH);
    let TaskKind::Reach(kind) = &reach.kind else { panic!("{reach:?}") };
    let targets = [[0.1, 0.0, 0.0], [0.2, 0.0, 0.0]].map(Target::at);
    assert_eq!((kind.targets.as_slice(), kind.speed, kind.dwell), (targets.as_slice(), None, Duration::ZERO));
    assert_eq!((reach.who, reach.timeout, reach.fail_force, reach.end), (Judged::All, None, None, TaskEnd::Continue));
    let hold = of("\n[task]\nkind = \"hold\"\ntarget = 0.1\nradius = 0.01\nwho = \"right\"\ntimeout = \"1s\"\nfail = { force = 3.0 }\n");
    assert_eq!((hold.who, hold.timeout, hold.fail_force), (Judged::Peer(1), Some(Duration::from_secs(1)), Some(3.0)));
    let track = of("\n[task]\nkind = \"track\"\nsines = [{ amplitude = 0.02, frequency = 0.25 }, { amplitude = 0.01, frequency = 0.5 }]\n");
    let TaskKind::Track(kind) = &track.kind else { panic!("{track:?}") };
    assert_eq!(kind.warm_up, Duration::from_secs(5));
    // After a second: 0.02·sin(π/2) + 0.01·sin(π).
    assert!((kind.target(Duration::from_secs(1))[0] - 0.02).abs() < 1e-15);
}

#[test]
fn a_wrong_task_is_refused_where_it_stands() {
    let carry = |keys: &str| format!("{}{keys}\n", REACH.replace("reach", "carry"));
    let beginning = |message: &str| message.split_once(": ").map(|(_, rest)| rest.to_owned()).unwrap_or_default();
    for (text, expected) in [
        ("\n[task]\nkind = \"reech\"\n", "task.kind: unknown"),
        ("\n[task]\nradius = 0.1\n", "task.kind: missing key: expected \"reach\", \"track\", \"hold\", \"path\" or \"carry\""),
        (&format!("{REACH}grace = \"1s\"\n"), "task.grace: only a task of kind hold takes this key"),
        (&format!("{REACH}angle = 0.1\n"), "task.angle: the targets have no orientations: expected orientations too"),
        (&format!("{REACH}orientations = [[1, 0, 0, 0], [1, 0, 0, 0]]\n"), "task.orientations: this is about an object that turns"),
        (&format!("{REACH}end = \"never\"\n"), "task.end: unknown"),
        ("\n[task]\nkind = \"hold\"\norder = \"given\"\n", "task.order: only a task of kind reach or carry takes this key"),
        (&format!("{REACH}width = 0.1\n"), "task.width: only a task of kind path takes this key"),
        ("\n[task]\nkind = \"path\"\npoints = [0.1, 0.1]\nwidth = 0.1\n", "task.points: no line: expected a list of at least two points"),
        ("\n[task]\nkind = \"path\"\npoints = [0.1]\nwidth = 0.1\n", "task.points: no line"),
        ("\n[task]\nkind = \"path\"\npoints = [0.1, 0.0]\n", "task.width: missing key"),
        (&carry(""), "task.gap: missing key: expected a table such as { peers = [\"left\", \"right\"], max = 0.1 }, or level"),
        (&carry("level = 0.1"), "task.level: this is about an object that turns: expected object.inertia"),
        (&carry("gap = { peers = [\"left\", \"left\"], max = 0.1 }"), "task.gap.peers: not two peers"),
        (&carry("gap = { peers = [\"left\", \"right\"], min = 0.2, max = 0.1 }"), "task.gap: min 0.2 is not below max 0.1"),
        (&carry("gap = { peers = [\"left\", \"right\"], min = 0.1, max = 0.1 }"), "task.gap: min 0.1 is not below max 0.1"),
        (&format!("{REACH}position = 0.1\n"), "task.position: only a task of kind track takes this key: expected target, targets or points"),
        ("\n[task]\nkind = \"reach\"\nradius = 0.1\n", "task.targets: missing key: expected a list of targets such as [0.1, 0.0]"),
        ("\n[task]\nkind = \"hold\"\ntarget = 0.1\n", "task.radius: missing key: expected a distance [m] above zero"),
        ("\n[task]\nkind = \"reach\"\ntargets = []\nradius = 0.1\n", "task.targets: the list is empty: expected a list of targets"),
        ("\n[task]\nkind = \"reach\"\ntargets = [0.1]\nradius = 0.0\n", "task.radius: 0.0"),
        (&format!("{REACH}who = \"nobody\"\n"), "task.who: there is no peer \"nobody\""),
        (&format!("{REACH}start = \"1h\"\n"), "task.start: 3600s is after the end of the scene"),
        ("\n[expect]\ntask = { outcome = \"done\" }\n", "expect.task: the scene has no task: expected a table [task] too"),
        (
            "\n[measure]\nnames = [\"task_time_s\"]\n",
            "measure.names.0: task_time_s is a measure of a task, and the scene has none: expected a table [task] too",
        ),
        ("\n[expect]\nmeasures = [{ name = \"peers.left.sparc\", max = 0 }]\n", "expect.measures.0.name: sparc is a measure of a task"),
        (&format!("{REACH}[expect]\ntask = {{}}\n"), "expect.task: neither outcome nor time is given"),
    ] {
        let message = refused(&format!("{SCENE}{text}"), &[]).to_string();
        assert!(beginning(&message).starts_with(expected), "{text}: {message}");
    }
    let walls = format!("{SCENE}{REACH}").replace("[object]", "[object]\nenclosure = { min = 0.0, max = 0.15, stiffness = 1000.0, damping = 1.0 }");
    for (walls, expected) in [(walls.clone(), "task.targets.1: 0.2"), (walls.replace("[0.1, 0.2]", "[-0.1, 0.1]"), "task.targets.0: -0.1")] {
        let message = refused(&walls, &[]).to_string();
        assert!(beginning(&message).starts_with(&format!("{expected} is outside of object.enclosure")), "{message}");
    }
    let message = refused(&format!("{SCENE}{REACH}"), &["peer.contact=none"]).to_string();
    assert!(beginning(&message).starts_with("task: no device touches the object"), "{message}");
}

#[test]
fn a_path_and_an_object_to_be_carried() {
    let kind = |text: &str| parse(&format!("{SCENE}{text}"), &[]).unwrap_or_else(|error| panic!("{error}")).task.unwrap().kind;
    let TaskKind::Path(path) = kind("\n[task]\nkind = \"path\"\npoints = [0.0, 0.1, -0.1]\nwidth = 0.02\nleave = \"fail\"\n") else {
        panic!("a path")
    };
    assert_eq!((path.points.len(), path.width, path.leave), (3, 0.02, Leave::Fail));
    let text = format!("{}gap = {{ peers = [\"right\", \"left\"], max = 0.2 }}\n", REACH.replace("reach", "carry"));
    let TaskKind::Carry(carry) = kind(&text) else { panic!("carried") };
    assert_eq!((carry.gap, carry.level, carry.reach.targets.len()), (Some(Gap { peers: [1, 0], min: 0.0, max: 0.2 }), None, 2));
}

/// A target of a turning object has an orientation, if the task has an angle.
#[test]
fn a_target_may_have_an_orientation() {
    let turning = SCENE.replace("[object]", "[object]\ninertia = 0.001").replace("[scene]", "[scene]\naxes = 3");
    let of = |keys: &str| format!("{turning}\n[task]\nkind = \"reach\"\nradius = 0.01\ntargets = [[0, 0, 0], [0.1, 0, 0]]\n{keys}\n");
    let scene = parse(&of("orientations = [[2, 0, 0, 0], [0, 0, 0, 1]]\nangle = 0.25"), &[]).unwrap_or_else(|error| panic!("{error}"));
    let TaskKind::Reach(reach) = scene.task.unwrap().kind else { panic!("a reach") };
    let orientations: Vec<_> = reach.targets.iter().map(|target| target.orientation).collect();
    assert_eq!((orientations, reach.angle), (vec![Some([1.0, 0.0, 0.0, 0.0]), Some([0.0, 0.0, 0.0, 1.0])], 0.25));
    for (keys, expected) in [
        ("orientations = [[2, 0, 0, 0]]\nangle = 0.25", "1 orientation for 2 targets: expected one orientation for each target"),
        ("orientations = [[2, 0, 0, 0], [0, 0, 0, 1]]", "task.angle: missing key: expected an angle [rad] above zero"),
        ("orientations = [[2, 0, 0, 0], [0, 0, 0, 1]]\nangle = 0", "task.angle: 0"),
        ("orientations = [[2, 0, 0, 0], [0, 0, 0, 0]]\nangle = 1", "task.orientations.1: "),
    ] {
        let message = refused(&of(keys), &[]).to_string();
        assert!(message.contains(expected), "{keys}: {message}");
    }
}

/// Every order of three targets comes equally often, and depends on the seed alone.
#[test]
fn a_shuffled_order_follows_from_the_seed() {
    let text = format!("{SCENE}{REACH}order = \"shuffled\"\n").replace("[0.1, 0.2]", "[0.1, 0.2, 0.3]");
    let TaskKind::Reach(reach) = parse(&text, &[]).unwrap().task.unwrap().kind else { panic!("a reach") };
    let order = |seed: u64| reach.in_order(seed).iter().map(|target| target.position[0].to_string()).collect::<Vec<_>>().join(" ");
    let mut counts = std::collections::BTreeMap::new();
    for seed in 0..6_000 {
        *counts.entry(order(seed)).or_insert(0_i32) += 1;
    }
    assert_eq!(counts.len(), 6);
    // Five standard deviations of a count: √(6000·1/6·5/6) = 29.
    assert!(counts.values().all(|count| (count - 1_000).abs() < 145), "{counts:?}");
    assert_eq!(order(7), order(7));
    let given = Reach { order: TargetOrder::Given, ..reach.clone() };
    assert_eq!(given.in_order(7), given.targets);
}

/// Without a task a scene has the measures of before, so columns and documents stay.
#[test]
fn measures_of_a_task_are_there_where_a_task_is() {
    let count = |text: &str| parse(&format!("{SCENE}{text}\n[measure]\n"), &[]).unwrap().measure.unwrap().names.len();
    let of_task = |per: Scope| Measure::ALL.iter().filter(|measure| measure.is_of_task() && measure.scope() == per).count();
    assert_eq!(count(REACH), count("") + of_task(Scope::Run) + 2 * of_task(Scope::Peer));
}

#[test]
fn expectations_of_a_task() {
    let scene = parse(&format!("{SCENE}{REACH}[expect]\ntask = {{ outcome = \"timed-out\", time = {{ max = \"2s\" }} }}\n"), &[]).unwrap();
    let expected = scene.expect.unwrap().task.unwrap();
    assert_eq!(expected.outcome, Some(TaskOutcome::TimedOut));
    assert_eq!(expected.time.map(|time| (time.min, time.max)), Some((None, Some(2.0))));
}

/// Fingerprints of records are made of the debug text of a scene, so a scene without a task prints as before.
#[test]
fn a_scene_without_a_task_prints_none() {
    assert!(!format!("{:?}", parse(SCENE, &[]).unwrap()).contains("task"));
    assert!(format!("{:?}", parse(&format!("{SCENE}{REACH}"), &[]).unwrap()).contains("task: TaskSpec"));
}
