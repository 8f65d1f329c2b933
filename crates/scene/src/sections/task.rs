//! Reader of `[task]`: what the users of a scene are asked to do.

use core::time::Duration;

use cohaptic_linkfile::document::{Node, Value};
use cohaptic_linkfile::mesh::read_peer_name;
use cohaptic_linkfile::reading::{Context, TableReader, values};
use cohaptic_linkfile::schema::{Choices, Form, Table, number, optional, required, usual, vector, words};
use cohaptic_peer::Enclosure;

use super::hand::{MOTION_SINE, read_sine};
use super::timeline::read_instant;
use crate::context::SceneContext;
use crate::quantities::{DISTANCE, POSITION, POSITIVE_FORCE, SPEED_LIMIT, Spread, read_vector, vector_of};
use crate::task::{Hold, Judged, Reach, TaskKind, TaskSpec, Track};

pub(crate) static TASK: Table = Table::of(&[&[
    required("kind", Form::Words(const { &words(&KINDS) }), "What the users are asked to do").expecting("\"reach\", \"track\" or \"hold\""),
    usual("start", Form::Duration, "\"0s\"", "First instant that is judged, since the beginning of the scene"),
    optional("timeout", Form::Duration, "Longest duration from start to the outcome; the rest of the scene by default"),
    usual(
        "who",
        Form::AnyOf(const { &[Form::Words(&words(&WHO)), Form::Like(&["left"])] }),
        "\"all\"",
        "Peers whose copies are judged: words, or the name of a peer",
    ),
    optional("fail", Form::Table(&FAIL), "Failures beside those of the kind"),
    optional("targets", Form::List(&vector(POSITION)), "Targets of reach, in the order of reaching"),
    optional("target", vector(POSITION), "Place at which hold keeps the copies"),
    optional("radius", number(DISTANCE), "Largest distance from a target of reach or hold that counts as at the target"),
    optional("speed", number(SPEED_LIMIT), "Largest speed at a target of reach; any speed by default"),
    usual("dwell", Form::Duration, "\"0s\"", "Duration for which the copies stay at a target of reach before the target is reached"),
    usual("grace", Form::Duration, "\"0s\"", "Longest duration outside of the target of hold at once, after the first entry, without a failure"),
    usual("position", vector(POSITION), "0", "Centre of the motion of the target of track"),
    optional("sines", Form::List(&Form::Table(&MOTION_SINE)), "Sines whose sum the target of track adds to its centre, from start on"),
    usual("warm-up", Form::Duration, "\"5s\"", "Time from start for which the error of track is not measured"),
]]);
static FAIL: Table =
    Table::of(&[&[optional("force", number(POSITIVE_FORCE), "Norm of the coupling force of a judged peer above which the task has failed")]]);
const KINDS: Choices<Kind, 3> = [
    ("reach", Kind::Reach, "the object is moved to one target after the other"),
    ("track", Kind::Track, "the object follows a moving target until the timeout"),
    ("hold", Kind::Hold, "the object is kept at a target until the timeout"),
];
const WHO: Choices<Judged, 2> = [
    ("all", Judged::All, "all peers whose devices touch the object, together"),
    ("any", Judged::Any, "the same peers, each alone: the first one that is done ends the task"),
];
/// Keys that only some kinds take, each with these kinds.
const OF_KINDS: [(&str, &[Kind], &str); 8] = [
    ("targets", &[Kind::Reach], "reach"),
    ("target", &[Kind::Hold], "hold"),
    ("radius", &[Kind::Reach, Kind::Hold], "reach or hold"),
    ("speed", &[Kind::Reach], "reach"),
    ("dwell", &[Kind::Reach], "reach"),
    ("grace", &[Kind::Hold], "hold"),
    ("sines", &[Kind::Track], "track"),
    ("warm-up", &[Kind::Track], "track"),
];

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Kind {
    Reach,
    Track,
    Hold,
}

/// Reads a task. `duration` and `walls` are `None` if the part of the scene was refused; `walls` is `Some(None)` without walls.
pub(crate) fn read_task(node: &Node, duration: Option<Duration>, walls: Option<Option<Enclosure>>, context: SceneContext<'_>) -> Option<TaskSpec> {
    let mut table = TableReader::new(node, *context, &TASK, "a table such as [task]")?;
    let kind = table.choice("kind", &KINDS);
    let start = table.read("start", |node, context| read_instant(node, duration, context));
    let timeout = table.maybe("timeout", values::positive_duration);
    let who = table.read("who", read_who);
    let fail_force = table.maybe("fail", read_fail);
    // After a refused kind all keys are read, so that none of them counts as unknown.
    let takes = |kinds: &[Kind]| kind.is_none_or(|kind| kinds.contains(&kind));
    let mut fits = true;
    for (key, kinds, names) in OF_KINDS {
        let message = format!("only a task of kind {names} takes this key");
        fits &= table.only_if(takes(kinds), key, &message).is_some();
    }
    fits &= table.only_if(takes(&[Kind::Track]), "position", "only a task of kind track takes this key: expected target or targets").is_some();
    let what = match kind {
        Some(Kind::Reach) => read_reach(&mut table, walls, context).map(TaskKind::Reach),
        Some(Kind::Track) => read_track(&mut table, context).map(TaskKind::Track),
        Some(Kind::Hold) => read_hold(&mut table, walls, context).map(TaskKind::Hold),
        None => None,
    };
    table.finish();
    fits.then_some(())?;
    Some(TaskSpec { kind: what?, start: start?, timeout: timeout?, who: who?, fail_force: fail_force?.flatten() })
}

fn read_reach(table: &mut TableReader<'_>, walls: Option<Option<Enclosure>>, context: SceneContext<'_>) -> Option<Reach> {
    table.require("targets", "a list of targets such as [0.1, 0.0]");
    table.require("radius", RADIUS);
    let targets = table.maybe("targets", |node, _| read_targets(node, walls, context));
    let (radius, speed) = (table.maybe_value("radius"), table.maybe_value("speed"));
    let dwell = table.value("dwell");
    Some(Reach { targets: targets??, radius: radius??, speed: speed?, dwell: dwell? })
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
