//! Reader of `[task]`: what the users of a scene are asked to do.

use core::time::Duration;

use cohaptic_linkfile::document::{Node, Value};
use cohaptic_linkfile::mesh::read_peer_name;
use cohaptic_linkfile::reading::{Context, TableReader, values};
use cohaptic_linkfile::schema::{Choices, Form, Table, number, optional, required, usual, vector, words};
use cohaptic_peer::Enclosure;
use cohaptic_units::print::Counted;

use super::hand::{MOTION_SINE, read_sine};
use super::rotation::{QUATERNION, read_orientation};
use super::timeline::read_instant;
use crate::context::SceneContext;
use crate::path::{Leave, PathTask};
use crate::quantities::{DISTANCE, DISTANCE_BOUND, POSITION, POSITIVE_ANGLE, POSITIVE_FORCE, SPEED_LIMIT, Spread, read_vector, vector_of};
use crate::task::{Carry, Gap, Hold, Judged, Reach, Target, TargetOrder, TaskEnd, TaskKind, TaskSpec, Track};

pub(crate) static TASK: Table = Table::of(&[&[
    required("kind", Form::Words(const { &words(&KINDS) }), "What the users are asked to do")
        .expecting("\"reach\", \"track\", \"hold\", \"path\" or \"carry\""),
    usual("start", Form::Duration, "\"0s\"", "First instant that is judged, since the beginning of the scene"),
    optional("timeout", Form::Duration, "Longest duration from start to the outcome; the rest of the scene by default"),
    usual(
        "who",
        Form::AnyOf(const { &[Form::Words(&words(&WHO)), Form::Like(&["left"])] }),
        "\"all\"",
        "Peers whose copies are judged: words, or the name of a peer",
    ),
    usual("end", Form::Words(const { &words(&ENDS) }), "\"continue\"", "What follows after the outcome"),
    optional("fail", Form::Table(&FAIL), "Failures beside those of the kind"),
    optional("targets", Form::List(&vector(POSITION)), "Targets of reach and carry"),
    usual("order", Form::Words(const { &words(&ORDERS) }), "\"given\"", "Order in which the targets of reach and carry are reached"),
    optional(
        "orientations",
        Form::List(&QUATERNION),
        "Orientations at the targets of reach and carry, one for each target, as quaternions w, x, y, z of any length",
    ),
    optional(
        "angle",
        number(POSITIVE_ANGLE),
        "Largest angle between a copy and the orientation at a target of reach or carry that counts as at the target",
    ),
    optional("target", vector(POSITION), "Place at which hold keeps the copies"),
    optional("radius", number(DISTANCE), "Largest distance from a target of reach, hold or carry that counts as at the target"),
    optional("speed", number(SPEED_LIMIT), "Largest speed at a target of reach or carry; any speed by default"),
    usual("dwell", Form::Duration, "\"0s\"", "Duration for which the copies stay at a target of reach or carry before the target is reached"),
    usual("grace", Form::Duration, "\"0s\"", "Longest duration outside of the target of hold at once, after the first entry, without a failure"),
    usual("position", vector(POSITION), "0", "Centre of the motion of the target of track"),
    optional("sines", Form::List(&Form::Table(&MOTION_SINE)), "Sines whose sum the target of track adds to its centre, from start on"),
    optional("points", Form::List(&vector(POSITION)), "Corners of the line of path, at least two"),
    optional("width", number(DISTANCE), "Width of the lane around the line of path"),
    usual("leave", Form::Words(const { &words(&LEAVES) }), "\"count\"", "What follows when a copy leaves the lane of path"),
    optional("level", number(POSITIVE_ANGLE), "Largest angle between the z axis of a copy and that of the world above which carry has failed"),
    optional("gap", Form::Table(&GAP), "Limits of the distance between two devices beyond which carry has failed"),
    usual("warm-up", Form::Duration, "\"5s\"", "Time from start for which the error of track is not measured"),
]]);
static FAIL: Table =
    Table::of(&[&[optional("force", number(POSITIVE_FORCE), "Norm of the coupling force of a judged peer above which the task has failed")]]);
static GAP: Table = Table::of(&[&[
    required("peers", Form::List(&Form::Like(&["left"])), "The two peers").expecting("two names of peers such as [\"left\", \"right\"]"),
    usual("min", number(DISTANCE_BOUND), "0", "Least distance of their devices"),
    required("max", number(DISTANCE), "Largest distance of their devices").expecting("a distance [m] above min"),
]]);
const LEAVES: Choices<Leave, 2> = [("count", Leave::Count, "the time outside is measured"), ("fail", Leave::Fail, "the task fails")];
const KINDS: Choices<Kind, 5> = [
    ("reach", Kind::Reach, "the object is moved to one target after the other"),
    ("track", Kind::Track, "the object follows a moving target until the timeout"),
    ("hold", Kind::Hold, "the object is kept at a target until the timeout"),
    ("path", Kind::Path, "the object is moved along a line"),
    ("carry", Kind::Carry, "the object is moved to one target after the other, level or between two devices"),
];
const ENDS: Choices<TaskEnd, 2> =
    [("continue", TaskEnd::Continue, "the scene goes on to its end"), ("stop", TaskEnd::Stop, "the run ends: no peer ticks after the outcome")];
const ORDERS: Choices<TargetOrder, 2> =
    [("given", TargetOrder::Given, "the order of the list"), ("shuffled", TargetOrder::Shuffled, "a random order, which follows from scene.seed")];
const WHO: Choices<Judged, 2> = [
    ("all", Judged::All, "all peers whose devices touch the object, together"),
    ("any", Judged::Any, "the same peers, each alone: the first one that is done ends the task"),
];
/// Keys that only some kinds of tasks have, each with these kinds and with their names for messages.
const OF_KINDS: [(&str, &[Kind], &str); 16] = [
    ("targets", REACHING, "reach or carry"),
    ("order", REACHING, "reach or carry"),
    ("orientations", REACHING, "reach or carry"),
    ("angle", REACHING, "reach or carry"),
    ("target", &[Kind::Hold], "hold"),
    ("radius", &[Kind::Reach, Kind::Hold, Kind::Carry], "reach, hold or carry"),
    ("speed", REACHING, "reach or carry"),
    ("dwell", REACHING, "reach or carry"),
    ("points", &[Kind::Path], "path"),
    ("width", &[Kind::Path], "path"),
    ("leave", &[Kind::Path], "path"),
    ("level", &[Kind::Carry], "carry"),
    ("gap", &[Kind::Carry], "carry"),
    ("grace", &[Kind::Hold], "hold"),
    ("sines", &[Kind::Track], "track"),
    ("warm-up", &[Kind::Track], "track"),
];

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Kind {
    Reach,
    Track,
    Hold,
    Path,
    Carry,
}

/// Kinds that reach targets.
const REACHING: &[Kind] = &[Kind::Reach, Kind::Carry];

/// Reads a task. `duration` and `walls` are `None` if the part of the scene was refused; `walls` is `Some(None)` without walls.
pub(crate) fn read_task(node: &Node, duration: Option<Duration>, walls: Option<Option<Enclosure>>, context: SceneContext<'_>) -> Option<TaskSpec> {
    let mut table = TableReader::new(node, *context, &TASK, "a table such as [task]")?;
    let kind = table.choice("kind", &KINDS);
    let start = table.read("start", |node, context| read_instant(node, duration, context));
    let timeout = table.maybe("timeout", values::positive_duration);
    let who = table.read("who", read_who);
    let fail_force = table.maybe("fail", read_fail);
    let end = table.choice("end", &ENDS);
    // After a refused kind all keys are read, so that none of them counts as unknown.
    let takes = |kinds: &[Kind]| kind.is_none_or(|kind| kinds.contains(&kind));
    let mut fits = true;
    for (key, kinds, names) in OF_KINDS {
        let message = format!("only a task of kind {names} takes this key");
        fits &= table.only_if(takes(kinds), key, &message).is_some();
    }
    fits &=
        table.only_if(takes(&[Kind::Track]), "position", "only a task of kind track takes this key: expected target, targets or points").is_some();
    let what = match kind {
        Some(Kind::Reach) => read_reach(&mut table, walls, context).map(TaskKind::Reach),
        Some(Kind::Track) => read_track(&mut table, context).map(TaskKind::Track),
        Some(Kind::Hold) => read_hold(&mut table, walls, context).map(TaskKind::Hold),
        Some(Kind::Path) => read_path(&mut table, walls, context).map(TaskKind::Path),
        Some(Kind::Carry) => read_carry(&mut table, walls, context).map(TaskKind::Carry),
        None => None,
    };
    table.finish();
    fits.then_some(())?;
    Some(TaskSpec { kind: what?, start: start?, timeout: timeout?, who: who?, fail_force: fail_force?.flatten(), end: end? })
}

fn read_reach(table: &mut TableReader<'_>, walls: Option<Option<Enclosure>>, context: SceneContext<'_>) -> Option<Reach> {
    table.require("targets", "a list of targets such as [0.1, 0.0]");
    table.require("radius", RADIUS);
    let positions = table.maybe("targets", |node, _| read_targets(node, walls, context));
    let orientations_node = table.get("orientations");
    let orientations = table.maybe("orientations", read_orientations);
    let turns = orientations_node.is_some();
    let paired = table.only_if(turns, "angle", "the targets have no orientations: expected orientations too");
    if turns {
        table.require("angle", "an angle [rad] above zero, for the orientations");
    }
    let angle = table.maybe_value("angle");
    let order = table.choice("order", &ORDERS);
    let (radius, speed) = (table.maybe_value("radius"), table.maybe_value("speed"));
    let dwell = table.value("dwell");
    let (positions, orientations) = (positions??, orientations?);
    if let (Some(node), Some(orientations)) = (orientations_node, &orientations)
        && orientations.len() != positions.len()
    {
        let (targets, found) = (Counted(positions.len(), "target"), Counted(orientations.len(), "orientation"));
        context.fault_at(node, format!("{found} for {targets}: expected one orientation for each target"));
        return None;
    }
    paired?;
    let target = |(place, position)| Target { position, orientation: orientations.as_ref().map(|orientations| orientations[place]) };
    let targets = positions.into_iter().enumerate().map(target).collect();
    Some(Reach { targets, order: order?, radius: radius??, speed: speed?, angle: angle?.unwrap_or(f64::INFINITY), dwell: dwell? })
}

fn read_track(table: &mut TableReader<'_>, context: SceneContext<'_>) -> Option<Track> {
    table.require("sines", "a list of sines such as [{ amplitude = 0.02, frequency = 0.1 }]");
    let position = vector_of(table, "position", context, Spread::EveryAxis);
    let sines = table.maybe("sines", |node, context_of_key| {
        let elements = listed(node, context_of_key, "a list of sines such as [{ amplitude = 0.02, frequency = 0.1 }]")?;
        let read: Vec<_> = elements.into_iter().map(|element| read_sine(element, context, &MOTION_SINE)).collect();
        read.into_iter().collect::<Option<Vec<_>>>()
    });
    let warm_up = table.value("warm-up");
    Some(Track { position: position?, sines: sines??, warm_up: warm_up? })
}

fn read_hold(table: &mut TableReader<'_>, walls: Option<Option<Enclosure>>, context: SceneContext<'_>) -> Option<Hold> {
    table.require("target", "a position such as 0.1");
    table.require("radius", RADIUS);
    let target = table.maybe("target", |node, _| read_target(node, walls, context));
    let radius = table.maybe_value("radius");
    let grace = table.value("grace");
    Some(Hold { target: target??, radius: radius??, grace: grace? })
}

fn read_path(table: &mut TableReader<'_>, walls: Option<Option<Enclosure>>, context: SceneContext<'_>) -> Option<PathTask> {
    const POINTS: &str = "a list of at least two points such as [0.0, 0.1], each at another place than the one before";
    table.require("points", POINTS);
    table.require("width", RADIUS);
    let points = table.maybe("points", |node, file| {
        let points = read_targets(node, walls, context)?;
        if !PathTask::is_line(&points) {
            file.fault_at(node, format!("no line: expected {POINTS}"));
            return None;
        }
        Some(points)
    });
    let width = table.maybe_value("width");
    let leave = table.choice("leave", &LEAVES);
    Some(PathTask { points: points??, width: width??, leave: leave? })
}

fn read_carry(table: &mut TableReader<'_>, walls: Option<Option<Enclosure>>, context: SceneContext<'_>) -> Option<Carry> {
    let reach = read_reach(table, walls, context);
    let (has_level, has_gap) = (table.get("level").is_some(), table.get("gap").is_some());
    if !(has_level || has_gap) {
        table.miss("gap", "a table such as { peers = [\"left\", \"right\"], max = 0.1 }, or level, an angle [rad]");
    }
    let turns = table.only_if(context.turns, "level", "this is about an object that turns: expected object.inertia, or no such key");
    let level = table.maybe_value("level");
    let gap = table.maybe("gap", read_gap);
    turns?;
    Some(Carry { reach: reach?, level: level?, gap: gap? })
}

fn read_gap(node: &Node, context: Context<'_>) -> Option<Gap> {
    let mut table = TableReader::new(node, context, &GAP, "a table such as { peers = [\"left\", \"right\"], max = 0.1 }")?;
    let peers = table.read("peers", |node, context| {
        let elements = listed(node, context, "two names of peers such as [\"left\", \"right\"]")?;
        let names: Vec<Option<usize>> = elements.into_iter().map(|element| read_peer_name(element, context)).collect();
        let names: Vec<usize> = names.into_iter().collect::<Option<_>>()?;
        let two = <[usize; 2]>::try_from(names).ok().filter(|[one, other]| one != other);
        if two.is_none() {
            context.fault_at(node, "not two peers: expected two names of peers such as [\"left\", \"right\"]");
        }
        two
    });
    let (min, max): (Option<f64>, Option<f64>) = (table.value("min"), table.value("max"));
    table.finish();
    let gap = Gap { peers: peers?, min: min?, max: max? };
    if gap.min >= gap.max {
        context.fault_at(node, format!("min {} is not below max {}: expected a range of distances", gap.min, gap.max));
        return None;
    }
    Some(gap)
}

const RADIUS: &str = "a distance [m] above zero";

fn read_who(node: &Node, context: Context<'_>) -> Option<Judged> {
    // A name of a peer is looked up only if the text is none of the words.
    match WHO.iter().find(|(word, _, _)| matches!(&node.value, Value::Text(text) if text == word)) {
        Some((_, who, _)) => Some(*who),
        None => read_peer_name(node, context).map(Judged::Peer),
    }
}

/// Reads `fail`. Returns `Some(None)` without a limit of the force.
fn read_fail(node: &Node, context: Context<'_>) -> Option<Option<f64>> {
    let mut table = TableReader::new(node, context, &FAIL, "a table such as { force = 8.0 }")?;
    let force = table.maybe_value("force");
    table.finish();
    force
}

fn read_targets(node: &Node, walls: Option<Option<Enclosure>>, context: SceneContext<'_>) -> Option<Vec<[f64; 3]>> {
    let elements = listed(node, *context, "a list of targets such as [0.1, 0.0]")?;
    // Two steps, so that every wrong target is reported.
    let read: Vec<_> = elements.into_iter().map(|element| read_target(element, walls, context)).collect();
    read.into_iter().collect()
}

fn read_orientations(node: &Node, context: Context<'_>) -> Option<Vec<[f64; 4]>> {
    let elements = listed(node, context, "a list of quaternions such as [[1, 0, 0, 0], [1, 0, 0, 0.1]]")?;
    let read: Vec<_> = elements.into_iter().map(|element| read_orientation(element, context)).collect();
    read.into_iter().collect()
}

/// Returns the elements of a list with at least one element.
fn listed<'a>(node: &'a Node, context: Context<'_>, expected: &str) -> Option<Vec<&'a Node>> {
    let elements = values::list(node, context, expected)?;
    if elements.is_empty() {
        context.fault_at(node, format!("the list is empty: expected {expected}"));
        return None;
    }
    Some(elements)
}

/// Reads a target. A target outside of the walls of the scene is a fault, because no copy stays there.
fn read_target(node: &Node, walls: Option<Option<Enclosure>>, context: SceneContext<'_>) -> Option<[f64; 3]> {
    let target = read_vector(POSITION, node, context, Spread::Refused)?;
    let walls = walls?;
    let count = context.axes?.count();
    let outside = walls.is_some_and(|walls| (0..count).any(|axis| target[axis] < walls.min[axis] || target[axis] > walls.max[axis]));
    if outside {
        context.fault_at(node, format!("{} is outside of object.enclosure: expected a target between the walls", values::written(node)));
        return None;
    }
    Some(target)
}
