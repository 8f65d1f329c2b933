//! Reader of `[\[timeline\]]`: the changes during the run.

use core::time::Duration;

use cohaptic_linkfile::LinkSelector;
use cohaptic_linkfile::document::Node;
use cohaptic_linkfile::link::is_empty;
use cohaptic_linkfile::mesh::{LinkClasses, OnLinks, read_key_changes, read_links_between, read_peer_name};
use cohaptic_linkfile::reading::{Context, TableReader, only_one, values};
use cohaptic_linkfile::schema::link::{LINK, LINKS_BETWEEN};
use cohaptic_linkfile::schema::{Form, Key, Table, joined, optional, required};
use cohaptic_peer::{Contact, Gains, Hand, Signal};
use cohaptic_units::Instant;

use super::coordination::{CHANGES, CoordinationChanges, read_coordination_changes};
use super::device::{CONTACT, read_contact};
use super::hand::{HAND, hand_is_sampled, read_hand, read_hand_torque};
use crate::context::SceneContext;
use crate::model::{Change, ChangeKind, CoordinationSpec, PeerSpec};

pub(crate) static TIMELINE: Table = Table::of(&[&[
    required("at", Form::Duration, "Time since the beginning of the scene").expecting("a time such as \"3s\""),
    optional("link", LINKS_BETWEEN, "Links that change: all, or one by its ends"),
    optional("peer", Form::Text, "Name of the peer that changes"),
    optional("set", Form::Table(&SET), "Keys that change: those of the link, or contact and hand of the peer"),
    optional("coordination", Form::Table(&CHANGES), "Keys that change at every peer, in place of link or peer, and without set"),
]]);
/// Keys under `set`, of a link or of a peer. The key `link` or `peer` beside `set` tells which of the two.
static SET: Table = Table::over(&joined::<18>(&[LINK.as_slice(), &[&OF_PEER]]));
static SET_OF_PEER: Table = Table::over(&[&OF_PEER]);
const OF_PEER: [Key; 2] =
    [optional("contact", CONTACT, "Contact between the device of the peer and the object"), optional("hand", HAND, "Action of the user of the peer")];

/// An entry read alone, before the entries are sorted by time. The effect of an entry depends on the entries before.
#[derive(Debug)]
struct Planned<'a> {
    at: Instant,
    what: PlannedKind<'a>,
}

#[derive(Debug)]
enum PlannedKind<'a> {
    Links { selector: LinkSelector, set: &'a Node },
    Peer { peer: usize, contact: Option<(Contact, &'a Node)>, hand: Option<(Option<Hand>, &'a Node)>, torque: Option<Signal> },
    Coordination(CoordinationChanges),
}

/// Reads the changes and returns the changes in order of time. `links`, `peers` and `coordination` are the state at the beginning, `None` if refused. Calls
/// `on_links` for each change of links.
pub(crate) fn read_timeline(
    node: Option<&Node>,
    duration: Option<Duration>,
    links: Option<&LinkClasses>,
    peers: Option<&[PeerSpec]>,
    coordination: Option<&CoordinationSpec>,
    on_links: OnLinks<'_>,
    context: SceneContext<'_>,
) -> Option<Vec<Change>> {
    let Some(node) = node else { return Some(Vec::new()) };
    let entries = values::list(node, *context, "entries [[timeline]]")?;
    let planned: Vec<_> = entries.iter().map(|entry| read_entry(entry, duration, context)).collect();
    let mut planned: Vec<Planned<'_>> = planned.into_iter().collect::<Option<_>>()?;
    // A stable sort: changes at the same instant stay in the order of the file.
    planned.sort_by_key(|entry| entry.at);

    // The state of links, gains and parameters is carried along, because each change is laid over the state after the change before.
    let (mut links, CoordinationSpec { mut gains, mut settings, .. }) = (links?.clone(), *coordination?);
    let mut changes = Vec::with_capacity(planned.len());
    let mut complete = true;
    for Planned { at, what } in planned {
        match what {
            PlannedKind::Links { selector, set } => {
                let what = if let LinkSelector::Between { from, to } = selector {
                    ChangeKind::Link(links.change((from, to), set, *context)?)
                } else {
                    ChangeKind::AllLinks(links.change_all(set, *context)?)
                };
                on_links(at, selector, &links);
                changes.push(Change { at, what });
            }
            PlannedKind::Peer { peer, contact, hand, torque } => {
                let spec = peers?.get(peer)?;
                complete &= contact.is_none_or(|(contact, node)| contact_is_possible(spec, contact, node, *context));
                complete &= hand.as_ref().is_none_or(|(hand, node)| {
                    let hand = hand.as_ref();
                    hand_is_possible(spec, hand, node, *context) && hand_is_sampled(hand, spec.clock.tick, node, *context)
                });
                changes.extend(contact.map(|(contact, _)| Change { at, what: ChangeKind::Contact { peer, contact } }));
                if let Some((hand, _)) = hand {
                    changes.push(Change { at, what: ChangeKind::Hand { peer, hand } });
                    // With each hand, also without a torque: the torque of the hand before must end.
                    changes.push(Change { at, what: ChangeKind::HandTorque { peer, torque } });
                }
            }
            PlannedKind::Coordination(CoordinationChanges { gains: Gains { stiffness, damping }, of_turns, send_when, parameters }) => {
                if stiffness.is_some() || damping.is_some() {
                    // A change holds both gains. A gain absent from the entry keeps the value of the change before.
                    gains = Gains { stiffness: stiffness.unwrap_or(gains.stiffness), damping: damping.unwrap_or(gains.damping) };
                    changes.push(Change { at, what: ChangeKind::Coordination(gains) });
                }
                if of_turns.stiffness.is_some() || of_turns.damping.is_some() {
                    changes.push(Change { at, what: ChangeKind::RotationalGains(of_turns) });
                }
                changes.extend(send_when.map(|send_when| Change { at, what: ChangeKind::SendWhen(send_when) }));
                if !parameters.is_empty() {
                    for (strategy, place, value) in parameters {
                        settings.of_mut(strategy).set(place, value);
                    }
                    changes.push(Change { at, what: ChangeKind::Parameters(Box::new(settings)) });
                }
            }
        }
    }
    complete.then_some(changes)
}

/// Reads an instant within the scene. `None` after a fault, or if the duration was refused.
pub(super) fn read_instant(node: &Node, duration: Option<Duration>, context: Context<'_>) -> Option<Instant> {
    let at = values::instant(node, context)?;
    let last = Instant::ZERO.saturating_add(duration?);
    if at > last {
        context.fault_at(node, format!("{at} is after the end of the scene: expected at most scene.duration, {last}"));
        return None;
    }
    Some(at)
}

fn read_entry<'a>(node: &'a Node, duration: Option<Duration>, context: SceneContext<'a>) -> Option<Planned<'a>> {
    const TARGETS: &str = "link, peer or coordination";
    const EXPECTED: &str = "a table with at, set and one of link and peer, or with at and coordination";
    let mut table = TableReader::new(node, *context, &TIMELINE, EXPECTED)?;
    let at = table.read("at", |node, context| read_instant(node, duration, context));
    let (link, peer, coordination) = (table.entry("link"), table.entry("peer"), table.entry("coordination"));
    let set = table.entry("set");
    // `coordination` holds keys directly and takes no `set`.
    if set.is_none() && coordination.is_none() {
        table.miss("set", "a table of the keys that change");
    }
    table.finish();
    let target = only_one(node, *context, &[link, peer, coordination], TARGETS)?;
    if target.name == "coordination" {
        if let Some(set) = set {
            context.fault(set.key, &set.node.path, "coordination holds its own keys: expected no key set with it");
            return None;
        }
        let what = read_coordination_changes(&target.node, *context);
        return Some(Planned { at: at?, what: PlannedKind::Coordination(what?) });
    }
    let what = if target.name == "link" {
        let selector = read_links_between(&target.node, *context);
        let set = &*set?.node;
        read_key_changes(set, *context)?;
        PlannedKind::Links { selector: selector?, set }
    } else {
        let peer = read_peer_name(&target.node, *context);
        let set = &*set?.node;
        let (contact, hand) = read_peer_changes(set, context)?;
        let torque = set.as_table().and_then(|set| set.get("hand")).map_or(Some(None), |hand| read_hand_torque(&hand.node, context));
        PlannedKind::Peer { peer: peer?, contact, hand, torque: torque? }
    };
    Some(Planned { at: at?, what })
}

#[expect(clippy::type_complexity, reason = "used once, above")]
fn read_peer_changes<'a>(node: &'a Node, context: SceneContext<'a>) -> Option<(Option<(Contact, &'a Node)>, Option<(Option<Hand>, &'a Node)>)> {
    let mut table = TableReader::new(node, *context, &SET_OF_PEER, "a table with contact, hand or both")?;
    let contact = table.maybe("contact", |node, _| read_contact(node, context).map(|contact| (contact, node)));
    let hand = table.maybe("hand", |node, _| read_hand(node, context).map(|hand| (hand, node)));
    table.finish();
    if is_empty(node) {
        context.fault_at(node, "nothing changes: expected contact, hand or both");
        return None;
    }
    Some((contact?, hand?))
}

/// Returns true if the peer can have this contact, otherwise false after a fault. A peer without a coupling cannot begin to touch: the peer would touch without
/// a force.
fn contact_is_possible(peer: &PeerSpec, contact: Contact, node: &Node, context: Context<'_>) -> bool {
    let touches = contact != Contact::None;
    // The reader of peers has checked the coupling of a peer in contact at the beginning.
    let coupled = peer.contact != Contact::None || peer.coupling.stiffness > 0.0 || peer.coupling.damping > 0.0;
    if touches && !coupled {
        context.fault_at(node, format!("peer \"{}\" has no coupling to touch with: expected \"none\", or a key coupling of this peer", peer.name));
    }
    !touches || coupled
}

/// Returns true if the peer can have this hand, otherwise false after a fault. An arm adds mass to the device, so that an arm cannot appear, vanish or change
/// during the run. A person would begin the task in the middle.
fn hand_is_possible(peer: &PeerSpec, hand: Option<&Hand>, node: &Node, context: Context<'_>) -> bool {
    if [hand, peer.hand.as_ref()].into_iter().flatten().any(|hand| hand.operator().is_some()) {
        let message = format!(
            "an operator cannot appear, vanish or change while the scene runs: expected a peer without one, and \"{}\" with its hand",
            peer.name
        );
        context.fault_at(node, message);
        return false;
    }
    // Compared with the hand of the beginning: no earlier change can have another arm.
    let arm = peer.hand.as_ref().and_then(Hand::arm);
    let same = arm == hand.and_then(Hand::arm);
    if !same {
        let expected = if arm.is_some() { "a hand with the same arm" } else { "a hand without an arm" };
        let message = format!("an arm cannot appear, vanish or change while the scene runs: expected {expected} for peer \"{}\"", peer.name);
        context.fault_at(node, message);
    }
    same
}
