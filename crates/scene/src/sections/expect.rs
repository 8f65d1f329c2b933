//! `[expect]`: what must come out.

use core::time::Duration;

use cohaptic_linkfile::LinkSelector;
use cohaptic_linkfile::document::Node;
use cohaptic_linkfile::mesh::{read_link_or_line, read_peer_name};
use cohaptic_linkfile::reading::values::{self, Quantity, ReadNumber as _};
use cohaptic_linkfile::reading::{Context, TableReader};
use cohaptic_units::{Instant, Probability};
use cohaptic_wan::DropCause;

use super::rotation::read_orientation;
use crate::context::{SceneContext, read_axis};
use crate::model::{Bounds, Expect, ExpectDelay, ExpectLoss, ExpectMeasure, ExpectOrientation, ExpectPosition, ExpectTravel, PeerSpec};
use crate::quantities::{ANGLE_BOUND, DISTANCE, POSITION};
use crate::sections::read_measure_name;

/// Reads the expectations. `duration` and `peers` are `None` where they were refused; `has_probe` says whether the impedance of a hand is measured.
pub(crate) fn read_expect(
    node: &Node,
    duration: Option<Duration>,
    has_probe: bool,
    peers: Option<&[PeerSpec]>,
    context: SceneContext<'_>,
) -> Option<Expect> {
    let mut table = TableReader::new(node, *context, "a table such as [expect]")?;
    let stable = table.maybe("stable", values::boolean);
    let discrepancy = table.maybe("discrepancy", |node, context| read_discrepancy(node, context, POSITION));
    let turned = table.maybe("rotation-discrepancy", |node, context| read_discrepancy(node, context, ANGLE_BOUND));
    let orientations =
        table.optional("orientation", Vec::new(), |node, file| each(node, file, |entry| read_expected_orientation(entry, duration, context)));
    let positions = table.optional("position", Vec::new(), |node, file| each(node, file, |entry| read_position(entry, duration, context)));
    let travel = table.optional("travel", Vec::new(), |node, file| each(node, file, |entry| read_travel(entry, context)));
    let loss = table.optional("loss", Vec::new(), |node, context| each(node, context, |entry| read_loss(entry, peers, context)));
    let delay = table.optional("delay", Vec::new(), |node, context| each(node, context, |entry| read_delay(entry, peers, context)));
    let measures = table.optional("measures", Vec::new(), |node, file| each(node, file, |entry| read_measure(entry, has_probe, file)));
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
    })
}

/// Reads every table of a list, also after one that was refused.
fn each<T>(node: &Node, context: Context<'_>, read: impl Fn(&Node) -> Option<T>) -> Option<Vec<T>> {
    let read: Vec<Option<T>> = values::list(node, context, "a list of tables")?.into_iter().map(read).collect();
    read.into_iter().collect()
}

fn read_discrepancy(node: &Node, context: Context<'_>, quantity: Quantity) -> Option<Bounds> {
    let mut table = TableReader::new(node, context, "a table such as { max = 0.001 }")?;
    let bounds = read_bounds(&mut table, node, context, quantity);
    table.finish();
    bounds
}

fn read_position(node: &Node, duration: Option<Duration>, context: SceneContext<'_>) -> Option<ExpectPosition> {
    let mut table = TableReader::new(node, *context, "a table such as { peer = \"left\", at = \"1s\", min = 0.1 }")?;
    let peer = table.required("peer", "the name of a peer", read_peer_name);
    let at = read_at(&mut table, duration);
    let axis = table.optional("axis", 0, |node, _| read_axis(node, context));
    let bounds = read_bounds(&mut table, node, *context, POSITION);
    table.finish();
    Some(ExpectPosition { peer: peer?, axis: axis?, at: at?, bounds: bounds? })
}

/// `at`: a time within the scene.
fn read_at(table: &mut TableReader<'_>, duration: Option<Duration>) -> Option<Instant> {
    table.required("at", "a time such as \"1s\"", |node, context| {
        let at = values::instant(node, context)?;
        let last = Instant::ZERO.saturating_add(duration?);
        if at > last {
            context.fault_at(node, format!("{at} is after the end of the scene: expected at most scene.duration, {last}"));
            return None;
        }
        Some(at)
    })
}

fn read_expected_orientation(node: &Node, duration: Option<Duration>, context: SceneContext<'_>) -> Option<ExpectOrientation> {
    let mut table = TableReader::new(node, *context, "a table such as { peer = \"left\", at = \"1s\", of = [1, 0, 0, 0], max = 0.01 }")?;
    let peer = table.required("peer", "the name of a peer", read_peer_name);
    let at = read_at(&mut table, duration);
    let of = table.required("of", "a quaternion, a list of four numbers w, x, y, z", read_orientation);
    let max = table.required("max", &ANGLE_BOUND.expected(), |node, context| ANGLE_BOUND.read(node, context));
    table.finish();
    Some(ExpectOrientation { peer: peer?, at: at?, of: of?, max: max? })
}

fn read_travel(node: &Node, context: SceneContext<'_>) -> Option<ExpectTravel> {
    let mut table = TableReader::new(node, *context, "a table such as { peer = \"left\", distance = 0.1, max = \"1.2s\" }")?;
    let peer = table.required("peer", "the name of a peer", read_peer_name);
    let distance = table.required("distance", &DISTANCE.expected(), |node, context| DISTANCE.read(node, context));
    let axis = table.optional("axis", 0, |node, _| read_axis(node, context));
    let ends = read_ends(&mut table, node, *context, values::duration);
    table.finish();
    let (min, max) = ends?;
    let seconds = |end: Option<Duration>| end.map(|end| end.as_secs_f64());
    Some(ExpectTravel { peer: peer?, axis: axis?, distance: distance?, bounds: Bounds { min: seconds(min), max: seconds(max) } })
}

fn read_loss(node: &Node, peers: Option<&[PeerSpec]>, context: Context<'_>) -> Option<ExpectLoss> {
    let mut table = TableReader::new(node, context, "a table such as { link = \"all\", max = 0.02 }")?;
    let link = table.optional("link", LinkSelector::All, |node, context| read_existing_link(node, peers, context));
    let causes = DropCause::ALL.map(|cause| (cause.name(), cause));
    let cause = table.maybe("cause", |node, context| values::choice(node, context, &causes));
    let ends = read_ends(&mut table, node, context, values::probability);
    table.finish();
    let (min, max): (Option<Probability>, Option<Probability>) = ends?;
    Some(ExpectLoss { link: link?, cause: cause?, min, max })
}

fn read_delay(node: &Node, peers: Option<&[PeerSpec]>, context: Context<'_>) -> Option<ExpectDelay> {
    let mut table = TableReader::new(node, context, "a table such as { link = \"all\", max = \"25ms\" }")?;
    let link = table.optional("link", LinkSelector::All, |node, context| read_existing_link(node, peers, context));
    let ends = read_ends(&mut table, node, context, values::duration);
    table.finish();
    let (min, max) = ends?;
    Some(ExpectDelay { link: link?, min, max })
}

fn read_measure(node: &Node, has_probe: bool, context: Context<'_>) -> Option<ExpectMeasure> {
    let mut table = TableReader::new(node, context, "a table such as { name = \"energy_j\", max = 0.01 }")?;
    let name = table.required("name", "the name of a measure such as \"energy_j\"", |node, context| read_measure_name(node, has_probe, context));
    let unit = name.map_or("", |name| name.measure.unit());
    let bounds = read_bounds(&mut table, node, context, Quantity::any(unit));
    table.finish();
    Some(ExpectMeasure { name: name?, bounds: bounds? })
}

/// A link or an access line that the scene has: nothing can be expected of a line that is not there.
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

fn read_bounds(table: &mut TableReader<'_>, node: &Node, context: Context<'_>, quantity: Quantity) -> Option<Bounds> {
    let (min, max) = read_ends(table, node, context, |node, context| quantity.read(node, context))?;
    Some(Bounds { min, max })
}

/// `min` and `max`: at least one of them, and not the wrong way round.
fn read_ends<T: PartialOrd>(
    table: &mut TableReader<'_>,
    node: &Node,
    context: Context<'_>,
    read: impl Fn(&Node, Context<'_>) -> Option<T>,
) -> Option<(Option<T>, Option<T>)> {
    let (min_node, max_node) = (table.get("min"), table.get("max"));
    if min_node.is_none() && max_node.is_none() {
        context.fault_at(node, "neither min nor max is given: expected at least one of them");
        return None;
    }
    let (min, max) = (table.maybe("min", &read), table.maybe("max", &read));
    let (min, max) = (min?, max?);
    if let (Some(least), Some(most)) = (&min, &max)
        && least > most
    {
        context.fault_at(max_node?, "max is below min: expected at least min");
        return None;
    }
    Some((min, max))
}
