//! Reader of `[measure]`: the measures of a run and their settings.

use cohaptic_linkfile::document::{Node, Value, quote};
use cohaptic_linkfile::mesh::read_peer_name;
use cohaptic_linkfile::reading::{Context, TableReader, defaults, one_of, values};
use cohaptic_linkfile::schema::{Form, Table, number, optional, required, usual};
use cohaptic_peer::{Hand, Signal};

use crate::context::{AXIS, SceneContext, read_axis};
use crate::measures::{Measure, MeasureName, Scope};
use crate::model::{Axes, Change, ChangeKind, MeasureSettings, MeasureSpec, MeasureTravel, PeerKind, PeerSpec};
use crate::quantities::DISTANCE;

pub(crate) static MEASURE: Table = Table::of(&[&[
    usual("names", Form::AnyOf(const { &[Form::Words(&[("all", "every measure")]), Form::List(&MEASURE_NAME)] }), "\"all\"", "Names of the measures"),
    optional("travel", Form::Table(&TRAVEL), "Travel of which travel_s is the time"),
    usual("band", number(DISTANCE), "0.001", "Largest discrepancy of settled copies, for settling_s"),
    optional("probe", Form::Table(&PROBE), "Peer whose hand feels viscosity_n_s_m and effective_mass_kg, which have no value without this key"),
]]);
static TRAVEL: Table = Table::of(&[&[
    optional("peer", Form::Text, "Name of the peer whose copy travels; the first peer by default"),
    usual("distance", number(DISTANCE), "0.02", "Distance from the position at the beginning"),
    usual("axis", AXIS, "\"x\"", "Axis of the motion"),
]]);
static PROBE: Table = Table::of(&[&[
    required("peer", Form::Text, "Name of a peer whose hand is a sine from the beginning to the end").expecting("the name of a peer")
]]);
/// Words for the measures of the run as a whole, and an example for the measures of a peer.
pub(super) const MEASURE_NAME_FORM: Form = Form::AnyOf(&[Form::Words(&MEASURES), Form::Like(&["peers.left.energy_j"])]);
static MEASURE_NAME: Form = MEASURE_NAME_FORM;
const MEASURES_OF_RUN: usize = {
    let (mut place, mut count) = (0, 0);
    while place < Measure::ALL.len() {
        if matches!(Measure::ALL[place].scope(), Scope::Run) {
            count += 1;
        }
        place += 1;
    }
    count
};
const MEASURES: [(&str, &str); MEASURES_OF_RUN] = {
    let mut words = [("", ""); MEASURES_OF_RUN];
    let (mut place, mut count) = (0, 0);
    while place < Measure::ALL.len() {
        if matches!(Measure::ALL[place].scope(), Scope::Run) {
            words[count] = (Measure::ALL[place].name(), Measure::ALL[place].about());
            count += 1;
        }
        place += 1;
    }
    words
};

impl Default for MeasureSettings {
    /// Returns the settings of a scene without `[measure]`: the copy of the first peer, 20 mm along x; a band of 1 mm; no probe.
    fn default() -> Self {
        defaults(|node, file| {
            let context = SceneContext { file, axes: Some(Axes::One), live: false, turns: false, task: None };
            read_measure(node, Measured { peers: Some(&[]), timeline: None, offered: Offered::default() }, context).map(|measure| measure.settings)
        })
    }
}

/// Parts of the scene for checks of measures; a refused part is `None`.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Measured<'a> {
    pub(crate) peers: Option<&'a [PeerSpec]>,
    pub(crate) timeline: Option<&'a [Change]>,
    pub(crate) offered: Offered,
}

/// Parts of a scene that some measures and expectations need. A refused part counts as offered, so that no second fault is reported.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct Offered {
    /// The scene measures the impedance of a hand.
    pub(crate) probe: bool,
    /// The scene has a task.
    pub(crate) task: bool,
}

pub(crate) fn read_measure(node: &Node, of: Measured<'_>, context: SceneContext<'_>) -> Option<MeasureSpec> {
    let mut table = TableReader::new(node, *context, &MEASURE, "a table such as [measure]")?;
    let travel = table.table("travel", |node, _| read_travel(node, context));
    let band = table.value("band");
    let probe = table.maybe("probe", |node, _| read_probe(node, of, context));
    // A refused probe counts as a probe, so that a measure with a probe is not refused for a second reason.
    let names =
        table.read("names", |node, context| read_names(node, Offered { probe: probe.is_none_or(|probe| probe.is_some()), ..of.offered }, context));
    table.finish();
    let names = match names? {
        Some(names) => names,
        None => MeasureName::all(of.peers?.len(), of.offered.task),
    };
    Some(MeasureSpec { names, settings: MeasureSettings { travel: travel?, band: band?, probe: probe? } })
}

/// Reads the names of measures, sorted and without duplicates; `Some(None)` for all measures.
fn read_names(node: &Node, offered: Offered, context: Context<'_>) -> Option<Option<Vec<MeasureName>>> {
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
        values::list(node, context, EXPECTED)?.into_iter().map(|element| read_measure_name(element, offered, context)).collect();
    let mut names: Vec<MeasureName> = read.into_iter().collect::<Option<_>>()?;
    names.sort_unstable();
    names.dedup();
    Some(Some(names))
}

/// Reads the name of a measure of the scene. Some measures need a probe, and some a task.
pub(crate) fn read_measure_name(node: &Node, offered: Offered, context: Context<'_>) -> Option<MeasureName> {
    let text = values::text(node, context, "the name of a measure such as \"energy_j\"")?;
    let of_run = Measure::ALL.iter().find(|measure| measure.scope() == Scope::Run && measure.name() == text);
    if let Some(&measure) = of_run {
        if matches!(measure, Measure::Viscosity | Measure::EffectiveMass) && !offered.probe {
            let message =
                format!("{text} is that of a probe, and there is none: expected measure.probe = {{ peer = … }} with a peer whose hand is a sine");
            context.fault_at(node, message);
            return None;
        }
        return has_its_task(measure, node, offered, context).then_some(MeasureName { measure, peer: None });
    }
    let of_peer = text.strip_prefix("peers.").and_then(|rest| rest.rsplit_once('.'));
    // Split at the last point: the name of a measure has no point.
    let known = of_peer.and_then(|(peer, name)| {
        let measure = Measure::ALL.iter().find(|measure| measure.scope() == Scope::Peer && measure.name() == name)?;
        Some((peer, *measure))
    });
    let Some((peer, measure)) = known else {
        let names = Measure::ALL.iter().map(|measure| measure.pattern());
        context.fault_at(node, format!("unknown measure {}: expected {}", quote(text), one_of(names, text)));
        return None;
    };
    // No names: a fault of a name of a peer was reported already.
    let peers = context.names?;
    let place = peers.index(peer);
    if place.is_none() {
        let expected = one_of(peers.as_slice().iter().map(String::as_str), peer);
        context.fault_at(node, format!("there is no {} {}: expected {expected}", peers.noun(), quote(peer)));
    }
    has_its_task(measure, node, offered, context).then_some(MeasureName { measure, peer: Some(place?) })
}

/// Returns false after a fault if the measure is that of a task and the scene has none, otherwise true.
fn has_its_task(measure: Measure, node: &Node, offered: Offered, context: Context<'_>) -> bool {
    let has = offered.task || !measure.is_of_task();
    if !has {
        context.fault_at(node, format!("{} is a measure of a task, and the scene has none: expected a table [task] too", measure.name()));
    }
    has
}

fn read_travel(node: &Node, context: SceneContext<'_>) -> Option<MeasureTravel> {
    let mut table = TableReader::new(node, *context, &TRAVEL, "a table such as { peer = \"left\", distance = 0.02 }")?;
    let peer = table.maybe("peer", read_peer_name);
    let distance = table.value("distance");
    let axis = table.read("axis", |node, _| read_axis(node, context));
    table.finish();
    Some(MeasureTravel { peer: peer?.unwrap_or(0), distance: distance?, axis: axis? })
}

/// Reads a probe: a peer whose hand pushes with the same sine during the whole scene. Returns the index of the peer.
fn read_probe(node: &Node, of: Measured<'_>, context: SceneContext<'_>) -> Option<usize> {
    const EXPECTED: &str = "a peer with hand = { sine = { amplitude, frequency } } above 0 Hz";
    let mut table = TableReader::new(node, *context, &PROBE, "a table such as { peer = \"left\" }")?;
    let peer = table.read("peer", read_peer_name);
    let peer_node = table.get("peer");
    table.finish();
    let (peer, peer_node) = (peer?, peer_node?);
    let spec = of.peers?.get(peer)?;
    let changes = of.timeline?.iter().any(|change| matches!(&change.what, ChangeKind::Hand { peer: changed, .. } if *changed == peer));
    let refused = match &spec.hand {
        // First, because the hand of the beginning says nothing of a changing hand.
        _ if changes => Some("changes in the timeline"),
        Some(Hand::Force(Signal::Sine { amplitude, frequency, .. })) => {
            let pushes = frequency.0 > 0.0 && amplitude.iter().any(|amplitude| *amplitude != 0.0);
            (!pushes).then_some("is a sine that does not sway")
        }
        Some(Hand::Force(Signal::Constant(_) | Signal::Table(_)) | Hand::Arm { .. } | Hand::Operator { .. }) | None => Some("is not a sine"),
    };
    if let Some(refused) = refused {
        context.fault_at(peer_node, format!("the hand of peer {} {refused}: expected {EXPECTED}", quote(&spec.name)));
        return None;
    }
    // In virtual time every peer is simulated, whatever the kind.
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
