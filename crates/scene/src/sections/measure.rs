//! `[measure]`: what a run is summed up by.

use cohaptic_linkfile::document::{Node, Value, quote};
use cohaptic_linkfile::mesh::read_peer_name;
use cohaptic_linkfile::reading::values::{self, ReadNumber as _};
use cohaptic_linkfile::reading::{Context, TableReader, one_of};
use cohaptic_peer::{Hand, Signal};

use crate::context::{SceneContext, read_axis};
use crate::measures::{Measure, MeasureName, Scope};
use crate::model::{Change, ChangeKind, MeasureSettings, MeasureSpec, MeasureTravel, PeerKind, PeerSpec};
use crate::quantities::DISTANCE;

/// The parts of the scene that measures are about. Each is `None` if it was refused.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Measured<'a> {
    pub(crate) peers: Option<&'a [PeerSpec]>,
    pub(crate) timeline: Option<&'a [Change]>,
}

pub(crate) fn read_measure(node: &Node, of: Measured<'_>, context: SceneContext<'_>) -> Option<MeasureSpec> {
    let mut table = TableReader::new(node, *context, "a table such as [measure]")?;
    let usual = MeasureSettings::default();
    let travel = table.optional("travel", usual.travel, |node, _| read_travel(node, context));
    let band = table.optional("band", usual.band, |node, context| DISTANCE.read(node, context));
    let probe = table.maybe("probe", |node, _| read_probe(node, of, context));
    let names_node = table.get("names");
    let names = names_node.map_or(Some(None), |node| read_names(node, probe.is_none_or(|probe| probe.is_some()), *context));
    table.finish();
    let names = match names? {
        Some(names) => names,
        None => MeasureName::all(of.peers?.len()),
    };
    Some(MeasureSpec { names, settings: MeasureSettings { travel: travel?, band: band?, probe: probe? } })
}

/// `Some(None)`: all.
fn read_names(node: &Node, has_probe: bool, context: Context<'_>) -> Option<Option<Vec<MeasureName>>> {
    const EXPECTED: &str = "\"all\" or a list of names such as [\"energy_j\", \"travel_s\"]";
    match &node.value {
        Value::Text(word) if word == "all" => return Some(None),
        Value::Text(word) => {
            context.fault_at(node, format!("found {}: expected {EXPECTED}", quote(word)));
            return None;
        }
        Value::List(elements) if elements.is_empty() => {
            context.fault_at(node, format!("no name is given: expected {EXPECTED}"));
            return None;
        }
        Value::List(_) | Value::Integer(_) | Value::Float(_) | Value::Boolean(_) | Value::Date | Value::Table(_) => {}
    }
    let read: Vec<Option<MeasureName>> =
        values::list(node, context, EXPECTED)?.into_iter().map(|element| read_measure_name(element, has_probe, context)).collect();
    let mut names: Vec<MeasureName> = read.into_iter().collect::<Option<_>>()?;
    names.sort_unstable();
    names.dedup();
    Some(Some(names))
}

/// A measure that the scene has.
pub(crate) fn read_measure_name(node: &Node, has_probe: bool, context: Context<'_>) -> Option<MeasureName> {
    let text = values::text(node, context, "the name of a measure such as \"energy_j\"")?;
    let of_run = Measure::ALL.iter().find(|measure| measure.scope() == Scope::Run && measure.name() == text);
    if let Some(&measure) = of_run {
        if matches!(measure, Measure::Viscosity | Measure::EffectiveMass) && !has_probe {
            let message =
                format!("{text} is that of a probe, and there is none: expected measure.probe = {{ peer = … }} with a peer whose hand is a sine");
            context.fault_at(node, message);
            return None;
        }
        return Some(MeasureName { measure, peer: None });
    }
    let of_peer = text.strip_prefix("peers.").and_then(|rest| rest.rsplit_once('.'));
    let known = of_peer.and_then(|(peer, name)| {
        let measure = Measure::ALL.iter().find(|measure| measure.scope() == Scope::Peer && measure.name() == name)?;
        Some((peer, *measure))
    });
    let Some((peer, measure)) = known else {
        let names = Measure::ALL.iter().map(|measure| measure.pattern());
        context.fault_at(node, format!("unknown measure {}: expected {}", quote(text), one_of(names, text)));
        return None;
    };
    // Without the list of peers, the fault is there.
    let peers = context.names?;
    let place = peers.index(peer);
    if place.is_none() {
        let expected = one_of(peers.as_slice().iter().map(String::as_str), peer);
        context.fault_at(node, format!("there is no {} {}: expected {expected}", peers.noun(), quote(peer)));
    }
    Some(MeasureName { measure, peer: Some(place?) })
}

fn read_travel(node: &Node, context: SceneContext<'_>) -> Option<MeasureTravel> {
    let usual = MeasureSettings::default().travel;
    let mut table = TableReader::new(node, *context, "a table such as { peer = \"left\", distance = 0.02 }")?;
    let peer = table.optional("peer", usual.peer, read_peer_name);
    let distance = table.optional("distance", usual.distance, |node, context| DISTANCE.read(node, context));
    let axis = table.optional("axis", usual.axis, |node, _| read_axis(node, context));
    table.finish();
    Some(MeasureTravel { peer: peer?, distance: distance?, axis: axis? })
}

/// A peer whose hand pushes with one sine from the beginning to the end.
fn read_probe(node: &Node, of: Measured<'_>, context: SceneContext<'_>) -> Option<usize> {
    const EXPECTED: &str = "a peer with hand = { sine = { amplitude, frequency } } above 0 Hz";
    let mut table = TableReader::new(node, *context, "a table such as { peer = \"left\" }")?;
    let peer = table.required("peer", "the name of a peer", read_peer_name);
    let peer_node = table.get("peer");
    table.finish();
    let (peer, peer_node) = (peer?, peer_node?);
    let spec = of.peers?.get(peer)?;
    let changes = of.timeline?.iter().any(|change| matches!(&change.what, ChangeKind::Hand { peer: changed, .. } if *changed == peer));
    let refused = match &spec.hand {
        _ if changes => Some("changes in the timeline"),
        Some(Hand::Force(Signal::Sine { amplitude, frequency, .. })) => {
            let pushes = frequency.0 > 0.0 && amplitude.iter().any(|amplitude| *amplitude != 0.0);
            (!pushes).then_some("is a sine that does not sway")
        }
        Some(Hand::Force(Signal::Constant(_) | Signal::Table(_)) | Hand::Arm { .. }) | None => Some("is not a sine"),
    };
    if let Some(refused) = refused {
        context.fault_at(peer_node, format!("the hand of peer {} {refused}: expected {EXPECTED}", quote(&spec.name)));
        return None;
    }
    if context.live && spec.kind != PeerKind::Simulated {
        let kind = spec.kind.name();
        context.fault_at(
            peer_node,
            format!("peer {} is of kind {kind}, whose hand is not simulated in a session: expected {EXPECTED}", quote(&spec.name)),
        );
        return None;
    }
    Some(peer)
}
