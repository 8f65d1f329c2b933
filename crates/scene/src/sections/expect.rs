//! Reader of `[expect]`: the required results of a run.

use core::time::Duration;

use cohaptic_linkfile::LinkSelector;
use cohaptic_linkfile::document::Node;
use cohaptic_linkfile::mesh::{read_link_or_line, read_peer_name};
use cohaptic_linkfile::reading::values::{self, Quantity, ReadNumber as _};
use cohaptic_linkfile::reading::{Context, TableReader};
use cohaptic_linkfile::schema::link::{ALL_LINKS, LINK_OR_LINE};
use cohaptic_linkfile::schema::{Choices, Form, Key, Table, number, optional, required, usual, words};
use cohaptic_units::Probability;
use cohaptic_wan::DropCause;

use super::measure::{MEASURE_NAME_FORM, Offered};
use super::rotation::{QUATERNION, read_orientation};
use super::timeline::read_instant;
use crate::context::{AXIS, SceneContext, read_axis};
use crate::expect::{Bounds, Expect, ExpectDelay, ExpectLoss, ExpectMeasure, ExpectOrientation, ExpectPosition, ExpectTask, ExpectTravel};
use crate::model::PeerSpec;
use crate::quantities::{ANGLE_BOUND, DISTANCE, POSITION};
use crate::sections::read_measure_name;
use crate::task::TaskOutcome;

pub(crate) static EXPECT: Table = Table::of(&[&[
    optional("stable", Form::Boolean, "Whether a small disturbance dies out"),
    optional("discrepancy", Form::Table(&METRES), "Largest distance along an axis between two copies"),
    optional("position", Form::List(&Form::Table(&POSITIONS)), "Positions of copies at given times"),
    optional("travel", Form::List(&Form::Table(&TRAVEL)), "Times at which copies have first moved by a distance"),
    optional("loss", Form::List(&Form::Table(&LOSS)), "Fraction of the offered packets that is dropped"),
    optional("delay", Form::List(&Form::Table(&DELAY)), "Mean delay of the delivered packets"),
    optional("measures", Form::List(&Form::Table(&MEASURE)), "Values of measures"),
    optional("rotation-discrepancy", Form::Table(&RADIANS), "Largest angle between two copies"),
    optional("task", Form::Table(&TASK), "Outcome of the task"),
    optional("orientation", Form::List(&Form::Table(&ORIENTATION)), "Orientations of copies at given times"),
]]);
static RADIANS: Table = Table::of(&[&[optional("min", number(ANGLE_BOUND), "At least"), optional("max", number(ANGLE_BOUND), "At most")]]);
static ORIENTATION: Table = Table::of(&[&[
    PEER,
    AT,
    required("of", QUATERNION, "Expected orientation, as a quaternion w, x, y, z of any length")
        .expecting("a quaternion, a list of four numbers w, x, y, z"),
    required("max", number(ANGLE_BOUND), "Largest angle between both orientations"),
]]);
static METRES: Table = Table::of(&[&METRE_BOUNDS]);
const METRE_BOUNDS: [Key; 2] = [optional("min", number(POSITION), "At least"), optional("max", number(POSITION), "At most")];
const TIME_BOUNDS: [Key; 2] = [optional("min", Form::Duration, "At least"), optional("max", Form::Duration, "At most")];
const FRACTION_BOUNDS: [Key; 2] = [optional("min", Form::Probability, "At least"), optional("max", Form::Probability, "At most")];
const PEER: Key = required("peer", Form::Text, "Name of the peer").expecting("the name of a peer");
const AT: Key = required("at", Form::Duration, "Time since the beginning of the scene").expecting("a time such as \"1s\"");
const ALONG: Key = usual("axis", AXIS, "\"x\"", "Axis of the motion");
static POSITIONS: Table = Table::of(&[&[PEER, ALONG, AT], &METRE_BOUNDS]);
static TRAVEL: Table =
    Table::of(&[&[PEER, ALONG, required("distance", number(DISTANCE), "Distance from the position at the beginning")], &TIME_BOUNDS]);
const LINK: Key = usual(
    "link",
    Form::AnyOf(const { &[Form::Words(ALL_LINKS), Form::Table(&LINK_OR_LINE)] }),
    "\"all\"",
    "Link: all links, one by its ends, or an access line",
);
static LOSS: Table = Table::of(&[
    &[LINK, optional("cause", Form::Words(const { &words(&CAUSES) }), "Cause of the drops that count; all causes by default")],
    &FRACTION_BOUNDS,
]);
static DELAY: Table = Table::of(&[&[LINK], &TIME_BOUNDS]);
static MEASURE: Table = Table::of(&[&[
    required("name", MEASURE_NAME_FORM, "Name of the measure, which ends in its unit").expecting("the name of a measure such as \"energy_j\""),
    optional("min", Form::Number(Quantity::any("")), "At least"),
    optional("max", Form::Number(Quantity::any("")), "At most"),
]]);
static TASK: Table = Table::of(&[&[
    optional("outcome", Form::Words(const { &words(&TaskOutcome::ALL) }), "Outcome of the task"),
    optional("time", Form::Table(&TIME), "Time from the start of the task to its outcome"),
]]);
static TIME: Table = Table::of(&[&TIME_BOUNDS]);
const CAUSES: Choices<DropCause, { DropCause::ALL.len() }> = {
    let mut causes = [("", DropCause::ALL[0], "dropped for this cause"); DropCause::ALL.len()];
    let mut place = 0;
    while place < causes.len() {
        (causes[place].0, causes[place].1) = (DropCause::ALL[place].name(), DropCause::ALL[place]);
        place += 1;
    }
    causes
};

/// Reads the expectations. `duration` and `peers` are `None` if refused.
pub(crate) fn read_expect(
    node: &Node,
    duration: Option<Duration>,
    offered: Offered,
    peers: Option<&[PeerSpec]>,
    context: SceneContext<'_>,
) -> Option<Expect> {
    let file = *context;
    let mut table = TableReader::new(node, file, &EXPECT, "a table such as [expect]")?;
    let stable = table.maybe_value("stable");
    let discrepancy = table.maybe("discrepancy", |node, context| read_discrepancy(node, context, &METRES));
    let turned = table.maybe("rotation-discrepancy", |node, context| read_discrepancy(node, context, &RADIANS));
    let orientations = each(&mut table, "orientation", |entry| read_expected_orientation(entry, duration, context));
    let positions = each(&mut table, "position", |entry| read_position(entry, duration, context));
    let travel = each(&mut table, "travel", |entry| read_travel(entry, context));
    let loss = each(&mut table, "loss", |entry| read_loss(entry, peers, file));
    let delay = each(&mut table, "delay", |entry| read_delay(entry, peers, file));
    let measures = each(&mut table, "measures", |entry| read_measure(entry, offered, file));
    let task = table.maybe("task", |node, context| read_task(node, offered.task, context));
    table.finish();
    Some(Expect {
        stable: stable?,
        discrepancy: discrepancy?,
        positions: positions?,
        travel: travel?,
        loss: loss?,
        delay: delay?,
        measures: measures?,
        rotation_discrepancy: turned?,
        orientations: orientations?,
        task: task?,
    })
}

/// Reads every table of a list, also after a refused table, so that every fault is reported. The vector is empty without the list.
fn each<T>(table: &mut TableReader<'_>, key: &'static str, read: impl Fn(&Node) -> Option<T>) -> Option<Vec<T>> {
    let entries = table.maybe(key, |node, context| values::list(node, context, "a list of tables"))?.unwrap_or_default();
    // Two steps: collecting into an `Option` directly would stop at the first `None`.
    let read: Vec<Option<T>> = entries.into_iter().map(read).collect();
    read.into_iter().collect()
}

fn read_discrepancy(node: &Node, context: Context<'_>, declaration: &'static Table) -> Option<Bounds> {
    let mut table = TableReader::new(node, context, declaration, "a table such as { max = 0.001 }")?;
    let ends = read_ends(&mut table, node, context, TableReader::maybe_value);
    table.finish();
    bounds(ends)
}

fn read_position(node: &Node, duration: Option<Duration>, context: SceneContext<'_>) -> Option<ExpectPosition> {
    const EXPECTED: &str = "a table such as { peer = \"left\", at = \"1s\", min = 0.1 }";
    let mut table = TableReader::new(node, *context, &POSITIONS, EXPECTED)?;
    let peer = table.read("peer", read_peer_name);
    let at = table.read("at", |node, context| read_instant(node, duration, context));
    let axis = table.read("axis", |node, _| read_axis(node, context));
    let ends = read_ends(&mut table, node, *context, TableReader::maybe_value);
    table.finish();
    Some(ExpectPosition { peer: peer?, axis: axis?, at: at?, bounds: bounds(ends)? })
}

fn read_expected_orientation(node: &Node, duration: Option<Duration>, context: SceneContext<'_>) -> Option<ExpectOrientation> {
    const EXPECTED: &str = "a table such as { peer = \"left\", at = \"1s\", of = [1, 0, 0, 0], max = 0.01 }";
    let mut table = TableReader::new(node, *context, &ORIENTATION, EXPECTED)?;
    let peer = table.read("peer", read_peer_name);
    let at = table.read("at", |node, context| read_instant(node, duration, context));
    let of = table.read("of", read_orientation);
    let max = table.value("max");
    table.finish();
    Some(ExpectOrientation { peer: peer?, at: at?, of: of?, max: max? })
}

fn read_travel(node: &Node, context: SceneContext<'_>) -> Option<ExpectTravel> {
    const EXPECTED: &str = "a table such as { peer = \"left\", distance = 0.1, max = \"1.2s\" }";
    let mut table = TableReader::new(node, *context, &TRAVEL, EXPECTED)?;
    let peer = table.read("peer", read_peer_name);
    let distance = table.value("distance");
    let axis = table.read("axis", |node, _| read_axis(node, context));
    let ends = read_ends(&mut table, node, *context, TableReader::maybe_value);
    table.finish();
    let (min, max) = ends?;
    let seconds = |end: Option<Duration>| end.map(|end| end.as_secs_f64());
    Some(ExpectTravel { peer: peer?, axis: axis?, distance: distance?, bounds: Bounds { min: seconds(min), max: seconds(max) } })
}

fn read_loss(node: &Node, peers: Option<&[PeerSpec]>, context: Context<'_>) -> Option<ExpectLoss> {
    let mut table = TableReader::new(node, context, &LOSS, "a table such as { link = \"all\", max = 0.02 }")?;
    let link = table.read("link", |node, context| read_existing_link(node, peers, context));
    let cause = table.maybe("cause", |node, context| values::word(node, context, &CAUSES));
    let ends = read_ends(&mut table, node, context, TableReader::maybe_value);
    table.finish();
    let (min, max): (Option<Probability>, Option<Probability>) = ends?;
    Some(ExpectLoss { link: link?, cause: cause?, min, max })
}

fn read_delay(node: &Node, peers: Option<&[PeerSpec]>, context: Context<'_>) -> Option<ExpectDelay> {
    let mut table = TableReader::new(node, context, &DELAY, "a table such as { link = \"all\", max = \"25ms\" }")?;
    let link = table.read("link", |node, context| read_existing_link(node, peers, context));
    let ends = read_ends(&mut table, node, context, TableReader::maybe_value);
    table.finish();
    let (min, max) = ends?;
    Some(ExpectDelay { link: link?, min, max })
}

fn read_measure(node: &Node, offered: Offered, context: Context<'_>) -> Option<ExpectMeasure> {
    let mut table = TableReader::new(node, context, &MEASURE, "a table such as { name = \"energy_j\", max = 0.01 }")?;
    let name = table.read("name", |node, context| read_measure_name(node, offered, context));
    // Bounds have the unit of the measure. After a fault in the name the unit does not matter.
    let quantity = Quantity::any(name.map_or("", |name| name.measure.unit()));
    let ends = read_ends(&mut table, node, context, |table, key| table.maybe(key, |node, context| quantity.read(node, context)));
    table.finish();
    Some(ExpectMeasure { name: name?, bounds: bounds(ends)? })
}

fn read_task(node: &Node, has_task: bool, context: Context<'_>) -> Option<ExpectTask> {
    let mut table = TableReader::new(node, context, &TASK, "a table such as { outcome = \"done\", time = { max = \"8s\" } }")?;
    let outcome = table.maybe("outcome", |node, context| values::word(node, context, &TaskOutcome::ALL));
    let time = table.maybe("time", |node, context| {
        let mut table = TableReader::new(node, context, &TIME, "a table such as { max = \"8s\" }")?;
        let ends = read_ends(&mut table, node, context, TableReader::maybe_value);
        table.finish();
        let (min, max): (Option<Duration>, Option<Duration>) = ends?;
        Some(Bounds { min: min.map(|min| min.as_secs_f64()), max: max.map(|max| max.as_secs_f64()) })
    });
    table.finish();
    // Both keys are read before a missing task is reported, so that faults in the keys are reported with it.
    if !has_task {
        context.fault_at(node, "the scene has no task: expected a table [task] too");
        return None;
    }
    let expected = ExpectTask { outcome: outcome?, time: time? };
    if expected == ExpectTask::default() {
        context.fault_at(node, "neither outcome nor time is given: expected at least one of them");
        return None;
    }
    Some(expected)
}

/// Reads a link or an access line of the scene. An absent line is a fault, because no packet passes an absent line.
fn read_existing_link(node: &Node, peers: Option<&[PeerSpec]>, context: Context<'_>) -> Option<LinkSelector> {
    let link = read_link_or_line(node, context)?;
    let (peer, line, there) = match link {
        LinkSelector::All | LinkSelector::Between { .. } => return Some(link),
        LinkSelector::Uplink(peer) => (peers?.get(peer)?, "uplink", peers?.get(peer)?.uplink.is_some()),
        LinkSelector::Downlink(peer) => (peers?.get(peer)?, "downlink", peers?.get(peer)?.downlink.is_some()),
    };
    if !there {
        context.fault_at(node, format!("peer \"{}\" has no {line}: expected one that has, or a link between peers", peer.name));
        return None;
    }
    Some(link)
}

fn bounds(ends: Option<(Option<f64>, Option<f64>)>) -> Option<Bounds> {
    ends.map(|(min, max)| Bounds { min, max })
}

/// Reads `min` and `max`. A fault if both are absent, or if `max` is below `min`.
fn read_ends<'a, T: PartialOrd>(
    table: &mut TableReader<'a>,
    node: &Node,
    context: Context<'_>,
    read: impl Fn(&mut TableReader<'a>, &'static str) -> Option<Option<T>>,
) -> Option<(Option<T>, Option<T>)> {
    // The nodes decide, not the values: a refused value is given.
    let (min_node, max_node) = (table.get("min"), table.get("max"));
    if min_node.is_none() && max_node.is_none() {
        context.fault_at(node, "neither min nor max is given: expected at least one of them");
        return None;
    }
    // Both are read before the first `?`, so that the faults of both are reported.
    let (min, max) = (read(table, "min"), read(table, "max"));
    let (min, max) = (min?, max?);
    if let (Some(least), Some(most)) = (&min, &max)
        && least > most
    {
        context.fault_at(max_node?, "max is below min: expected at least min");
        return None;
    }
    Some((min, max))
}
