//! The keys of a peer, its own laid over those of `[peer]`.

use core::time::Duration;
use std::sync::Arc;

use cohaptic_linkfile::document::{Node, Value, quote};
use cohaptic_linkfile::link::read_link;
use cohaptic_linkfile::reading::values::ReadNumber as _;
use cohaptic_linkfile::reading::{Context, TableReader, values};
use cohaptic_peer::rotation::Spin;
use cohaptic_peer::{Clock, Contact, DeviceConfig, Direction, Drift, Gains, Hand};
use cohaptic_units::print::Span;
use cohaptic_wan::LinkModel;

use super::hand::{hand_is_sampled, read_hand};
use super::header::read_scaling;
use super::kind::{FALCON_DEVICE, STILL_DEVICE, read_kind};
use super::object::{read_position, read_velocity};
use super::rotation::{PeerRotationKeys, read_coupling_rotation, read_device_rotation, read_hand_torque, read_peer_rotation};
use crate::context::{SceneContext, check_axis};
use crate::model::{PeerKind, Scaling};
use crate::quantities::{DAMPING, MASS, STIFFNESS};

/// The keys whose tables are laid over each other key by key; every other key replaces the one below.
pub(crate) const NESTED: [&str; 8] = ["silence", "falcon", "pointer", "device", "coupling", "clock", "uplink", "downlink"];

const COUPLING: &str = "a table such as { stiffness = 3500.0, damping = 5.0 }";

/// What the keys of a peer say, without its name.
#[derive(Clone, Debug)]
pub(crate) struct PeerKeys {
    pub(crate) kind: PeerKind,
    pub(crate) clock: Clock,
    pub(crate) phase: u64,
    pub(crate) compute_delay: bool,
    pub(crate) contact: Contact,
    pub(crate) device: DeviceConfig,
    pub(crate) coupling: Option<(Gains, Scaling)>,
    pub(crate) hand: Option<Hand>,
    pub(crate) position: Option<[f64; 3]>,
    pub(crate) velocity: Option<[f64; 3]>,
    pub(crate) device_position: Option<[f64; 3]>,
    pub(crate) device_velocity: Option<[f64; 3]>,
    pub(crate) rotation: PeerRotationKeys,
    pub(crate) uplink: Option<Arc<LinkModel>>,
    pub(crate) downlink: Option<Arc<LinkModel>>,
}

/// Reads the keys of a peer. `beside`: keys of the same table that somebody else reads. `update`: the period of sending and where it is written.
pub(crate) fn read_peer(node: &Node, context: SceneContext<'_>, beside: &[&'static str], update: Option<(Duration, &Node)>) -> Option<PeerKeys> {
    const DEVICE: &str = "a table such as { mass = 0.1, damping = 5.0 }";
    const UDP_DEVICE: &str = "a table such as { mass = 0.1, damping = 5.0 }, from which this peer of kind \"udp\", another process, can be simulated; \
        `cohaptic live` runs the scene without it, with the process itself";
    let mut table = TableReader::new(node, *context, "a table of keys of a peer")?;
    table.know(beside);
    let kind = read_kind(&mut table, *context);
    let elsewhere = matches!(kind, Some(PeerKind::Udp(_)));
    let tick_node = table.get("tick");
    let tick = table.optional("tick", Duration::from_millis(1), values::positive_duration);
    let compute_delay = table.optional("compute-delay", 0, |node, context| values::integer(node, context, 0..=1, "a number of ticks, 0 or 1"));
    let phase_node = table.get("phase");
    let phase = table.optional("phase", 0, |node, context| {
        values::integer(node, context, 0..=i64::MAX.unsigned_abs(), "a number of ticks, an integer from 0 to below coordination.update / tick")
    });
    let contact = table.optional("contact", Contact::Grasp, |node, _| read_contact(node, context));
    let device = table.maybe("device", |node, context| read_device(node, context, DEVICE));
    let absent = match &kind {
        None => None,
        Some(PeerKind::Simulated) => {
            table.require("device", DEVICE);
            None
        }
        Some(PeerKind::Udp(_)) => {
            if !context.live {
                table.require("device", UDP_DEVICE);
            }
            Some(STILL_DEVICE)
        }
        Some(PeerKind::Falcon(..) | PeerKind::Pointer(..)) => Some(FALCON_DEVICE),
    };
    // What lives elsewhere and has no device here touches nothing here.
    let contact = if elsewhere && table.get("device").is_none() { Some(Contact::None) } else { contact };
    let coupling = table.maybe("coupling", read_coupling);
    let needs_coupling = contact.is_some_and(|contact| contact != Contact::None) && !(elsewhere && context.live);
    if table.get("coupling").is_none() && needs_coupling {
        table.miss("coupling", COUPLING);
    }
    let hand_node = table.get("hand");
    let hand = table.optional("hand", None, |node, _| read_hand(node, context));
    let torque = table.get("hand").map_or(Some(None), |node| read_hand_torque(node, context));
    let clock = table.optional("clock", (Duration::ZERO, Drift::default()), read_clock);
    let position = table.maybe("position", |node, _| read_position(node, context));
    let velocity = table.maybe("velocity", |node, _| read_velocity(node, context));
    let device_position = table.maybe("device-position", |node, _| read_position(node, context));
    let device_velocity = table.maybe("device-velocity", |node, _| read_velocity(node, context));
    let turned = read_peer_rotation(&mut table);
    let uplink = table.maybe("uplink", |node, context| read_link(node, context).map(Arc::new));
    let downlink = table.maybe("downlink", |node, context| read_link(node, context).map(Arc::new));
    table.finish();

    if let (Some(tick), Some((update, update_node)), false) = (tick, update, context.partial) {
        let Some(frame) = whole_multiple(update, tick) else {
            let message = format!("coordination.update, {}, is not a whole multiple of the tick, {}: expected one that is", Span(update), Span(tick));
            context.fault_at(tick_node.unwrap_or(update_node), message);
            return None;
        };
        if let (Some(phase), Some(node)) = (phase, phase_node)
            && phase >= frame
        {
            context.fault_at(node, format!("{phase} is out of range: expected a number of ticks below coordination.update / tick, which is {frame}"));
            return None;
        }
    }
    if let (Some(Some(hand)), Some(tick), Some(node)) = (&hand, tick, hand_node)
        && !hand_is_sampled(Some(hand), tick, node, *context)
    {
        return None;
    }
    let (offset, drift) = clock?;
    let (device, coupling) = (device?, coupling?);
    let rotation = PeerRotationKeys {
        device: device.and_then(|(_, turned)| turned),
        coupling: coupling.and_then(|(_, _, turned)| turned),
        torque: torque?,
        ..turned?
    };
    Some(PeerKeys {
        kind: kind?,
        clock: Clock { tick: tick?, offset, drift },
        phase: phase?,
        compute_delay: compute_delay? == 1,
        contact: contact?,
        device: device.map(|(device, _)| device).or(absent).unwrap_or(STILL_DEVICE),
        coupling: coupling.map(|(gains, scaling, _)| (gains, scaling)),
        hand: hand?,
        position: position?,
        velocity: velocity?,
        device_position: device_position?,
        device_velocity: device_velocity?,
        rotation,
        uplink: uplink?,
        downlink: downlink?,
    })
}

/// How many times `part` goes into `whole`, if it does without a rest and at least once.
fn whole_multiple(whole: Duration, part: Duration) -> Option<u64> {
    let (whole, part) = (whole.as_nanos(), part.as_nanos());
    if part == 0 || whole % part != 0 {
        return None;
    }
    u64::try_from(whole / part).ok().filter(|times| *times > 0)
}

/// A contact.
pub(crate) fn read_contact(node: &Node, context: SceneContext<'_>) -> Option<Contact> {
    const EXPECTED: &str = "\"grasp\", \"none\" or { push = \"+x\" }";
    if let Some(text) = node.as_text() {
        return match text {
            "grasp" => Some(Contact::Grasp),
            "none" => Some(Contact::None),
            other => {
                context.fault_at(node, format!("unknown contact {}: expected {EXPECTED}", quote(other)));
                None
            }
        };
    }
    let mut table = TableReader::new(node, *context, EXPECTED)?;
    let direction = table.required("push", "a direction such as \"+x\"", |node, _| read_direction(node, context));
    table.finish();
    direction.map(Contact::Push)
}

fn read_direction(node: &Node, context: SceneContext<'_>) -> Option<Direction> {
    let along = |axis, positive| Direction { axis, positive };
    let directions = [
        ("+x", along(0, true)),
        ("-x", along(0, false)),
        ("+y", along(1, true)),
        ("-y", along(1, false)),
        ("+z", along(2, true)),
        ("-z", along(2, false)),
    ];
    let direction = values::choice(node, *context, &directions)?;
    check_axis(node, context, direction.axis)?;
    Some(direction)
}

/// A device, and how it turns if it does.
fn read_device(node: &Node, context: Context<'_>, expected: &str) -> Option<(DeviceConfig, Option<Spin>)> {
    let mut table = TableReader::new(node, context, expected)?;
    let mass = table.required("mass", &MASS.expected(), |node, context| MASS.read(node, context));
    let damping = table.optional("damping", 0.0, |node, context| DAMPING.read(node, context));
    let turned = read_device_rotation(&mut table);
    table.finish();
    Some((DeviceConfig { mass: mass?, damping: damping? }, turned?))
}

/// A coupling, how it is scaled, and how it turns if it does.
fn read_coupling(node: &Node, context: Context<'_>) -> Option<(Gains, Scaling, Option<Gains>)> {
    let mut table = TableReader::new(node, context, COUPLING)?;
    let stiffness = table.required("stiffness", &STIFFNESS.expected(), |node, context| STIFFNESS.read(node, context));
    let damping = table.optional("damping", 0.0, |node, context| DAMPING.read(node, context));
    let scaling = table.optional("scaling", Scaling::None, read_scaling);
    let turned = read_coupling_rotation(&mut table);
    table.finish();
    Some((Gains { stiffness: stiffness?, damping: damping? }, scaling?, turned?))
}

fn read_clock(node: &Node, context: Context<'_>) -> Option<(Duration, Drift)> {
    let mut table = TableReader::new(node, context, "a table such as { offset = \"300us\", drift = \"20ppm\" }")?;
    let offset = table.optional("offset", Duration::ZERO, values::duration);
    let drift = table.optional("drift", Drift::default(), read_drift);
    table.finish();
    Some((offset?, drift?))
}

/// A drift: a number, or text in parts per million.
fn read_drift(node: &Node, context: Context<'_>) -> Option<Drift> {
    const EXPECTED: &str = "a drift such as \"20ppm\" or \"-20ppm\", or a number, seconds gained in a second";
    let fraction = match &node.value {
        Value::Text(text) => {
            let fraction = parts_per_million(text);
            if fraction.is_none() {
                context.fault_at(node, format!("{} is no drift: expected {EXPECTED}", quote(text)));
            }
            fraction?
        }
        Value::Integer(_) | Value::Float(_) | Value::Boolean(_) | Value::Date | Value::List(_) | Value::Table(_) => {
            values::number(node, context, EXPECTED)?
        }
    };
    Drift::from_fraction(fraction).map_err(|error| context.fault_at(node, error.to_string())).ok()
}

fn parts_per_million(text: &str) -> Option<f64> {
    let number = text.trim().strip_suffix("ppm")?.trim_end();
    let digits = number.strip_prefix(['+', '-']).unwrap_or(number);
    let plain = digits.starts_with(|c: char| c.is_ascii_digit()) && digits.bytes().all(|byte| byte.is_ascii_digit() || byte == b'.');
    // Divided, not multiplied: 20 / 1e6 is the double nearest to 0.00002.
    plain.then(|| number.parse::<f64>().ok()).flatten().map(|millionths| millionths / 1e6)
}
