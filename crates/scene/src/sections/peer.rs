//! Reader of the keys of a peer. The keys of an entry are laid over the keys of `[peer]` before the reader is called.

use core::time::Duration;

use cohaptic_linkfile::document::Node;
use cohaptic_linkfile::reading::TableReader;
use cohaptic_linkfile::schema::{Form, Key, Table, optional, required, somewhere, usual, vector};
use cohaptic_peer::{Clock, Contact, DeviceConfig, Exchange, Gains, Hand};
use cohaptic_units::print::Span;

use super::MOST;
use super::access::{ACCESS, Access, read_access};
use super::device::{
    A_COUPLING, CLOCK, CONTACT, COUPLING, DEVICE, ExchangeLimits, check_exchange, read_clock, read_contact, read_coupling, read_device,
};
use super::hand::{HAND, hand_is_sampled, read_hand, read_hand_torque};
use super::inverse3::INVERSE3;
use super::kind::{FALCON, FALCON_DEVICE, KIND, POINTER, SILENCE, STILL_DEVICE, read_kind};
use super::rotation::{PeerRotationKeys, QUATERNION, read_peer_rotation};
use crate::context::SceneContext;
use crate::model::{PeerKind, Scaling};
use crate::quantities::{POSITION, RATE, Spread, VELOCITY, maybe_vector_of};

/// Keys of `[peer]`: the defaults of all peers.
pub(crate) static PEER: Table = Table::of(&[&KEYS, &ACCESS]);
/// Keys of an entry `[[peers]]`.
pub(crate) static PEERS: Table = Table::over(&[
    &[required("name", Form::Text, "Name of the peer: unique, not all, without space and without . > / , and quotes")],
    &KEYS,
    &ACCESS,
]);
const KEYS: [Key; 20] = [
    somewhere("device", Form::Table(&DEVICE), "Haptic device of the peer"),
    somewhere("coupling", Form::Table(&COUPLING), "Spring and damper between device and copy; not needed where contact is none"),
    usual("contact", CONTACT, "\"grasp\"", "Contact between the device and the object"),
    usual("hand", HAND, "\"none\"", "Action of the user: a constant force, a sine, a recorded file, an arm that follows a motion, or an operator"),
    usual("tick", Form::PositiveDuration, "\"1ms\"", "Period of the control loop"),
    usual("compute-delay", Form::Integer(0, 1), "0", "Ticks between the computation of a force and its application")
        .expecting("a number of ticks, 0 or 1"),
    usual("phase", Form::Integer(0, MOST), "0", "Number of the tick at which the first sample is sent, below coordination.update / tick")
        .expecting("a number of ticks, an integer from 0 to below coordination.update / tick"),
    optional("clock", Form::Table(&CLOCK), "Difference between the peer's clock and the time of the scene"),
    optional("position", vector(POSITION), "Position of the peer's copy and device at the beginning; that of the object by default"),
    optional("velocity", vector(VELOCITY), "Velocity of the peer's copy and device at the beginning; that of the object by default"),
    optional("device-position", vector(POSITION), "Position of the peer's device at the beginning; that of its copy by default"),
    optional("device-velocity", vector(VELOCITY), "Velocity of the peer's device at the beginning; that of its copy by default"),
    usual("grasp", vector(POSITION), "0", "Point at which the device grasps an object that turns, from the centre of the object in its own axes"),
    optional("orientation", QUATERNION, "As the key of [object], for this peer"),
    optional("angular-velocity", vector(RATE), "As the key of [object], for this peer"),
    usual("kind", KIND, "\"simulated\"", "Location of the peer in a live session"),
    optional("silence", Form::Table(&SILENCE), "Fading of the pull of a silent peer in another program"),
    optional("falcon", Form::Table(&FALCON), "Falcon of a peer of kind falcon, or of kind udp for cohaptic join, and the meaning of its numbers"),
    optional("inverse3", Form::Table(&INVERSE3), "Inverse3 of a peer of kind inverse3, or of kind udp for cohaptic join, and its service"),
    optional("pointer", Form::Table(&POINTER), "Arm through which a pointer pulls the device of a peer of kind pointer"),
];

/// Returns the keys with tables. These tables are laid over each other key by key. Every other key replaces the key below as a whole.
pub(crate) fn nested() -> Vec<&'static str> {
    KEYS.iter().chain(&ACCESS).filter(|key| matches!(key.form, Form::Table(_))).map(|key| key.name).collect()
}

/// Values of the keys of a peer, without the name.
#[derive(Clone, Debug)]
pub(crate) struct PeerKeys {
    pub(crate) kind: PeerKind,
    pub(crate) clock: Clock,
    pub(crate) phase: u64,
    pub(crate) compute_delay: bool,
    pub(crate) contact: Contact,
    pub(crate) device: DeviceConfig,
    pub(crate) exchange: Exchange,
    pub(crate) coupling: Option<(Gains, Scaling)>,
    pub(crate) hand: Option<Hand>,
    pub(crate) position: Option<[f64; 3]>,
    pub(crate) velocity: Option<[f64; 3]>,
    pub(crate) device_position: Option<[f64; 3]>,
    pub(crate) device_velocity: Option<[f64; 3]>,
    pub(crate) rotation: PeerRotationKeys,
    pub(crate) access: Access,
}

/// Reads the keys of a peer. `declaration` is [`PEER`], or [`PEERS`] for a node with a name, which the module `peers` reads. `update` is the period of
/// sending and the node of the period.
pub(crate) fn read_peer(node: &Node, context: SceneContext<'_>, declaration: &'static Table, update: Option<(Duration, &Node)>) -> Option<PeerKeys> {
    const A_DEVICE: &str = "a table such as { mass = 0.1, damping = 5.0 }";
    const UDP_DEVICE: &str = "a table such as { mass = 0.1, damping = 5.0 }, from which this peer of kind \"udp\", another process, can be simulated; \
        `cohaptic live` runs the scene without it, with the process itself";
    const INVERSE3_DEVICE: &str = "a table such as { mass = 0.1, damping = 5.0 }, from which this peer of kind \"inverse3\" can be simulated: no mass of the device \
        is published; `cohaptic live` runs the scene without it, with the device itself";
    let mut table = TableReader::new(node, *context, declaration, "a table of keys of a peer")?;
    if declaration.key("name").is_some() {
        // Marks the key as known. The module `peers` reads the name.
        table.get("name");
    }
    let kind = read_kind(&mut table);
    let elsewhere = matches!(kind, Some(PeerKind::Udp(_)));
    let tick_node = table.get("tick");
    let (tick, compute_delay): (_, Option<u64>) = (table.value("tick"), table.value("compute-delay"));
    let phase_node = table.get("phase");
    let phase = table.value("phase");
    let contact = table.read("contact", |node, _| read_contact(node, context));
    // An entry may replace tick and compute-delay of `[peer]`, so that both are not known while `[peer]` is read alone.
    let limits = ExchangeLimits {
        tick: tick.filter(|_| !context.partial),
        compute_delay: compute_delay == Some(1) && !context.partial,
        turns: context.turns,
        // A service replies with the state before the force of the message takes effect: a reading is used an exchange later.
        late: matches!(kind, Some(PeerKind::Inverse3(..))) && !context.partial,
    };
    let device = table.maybe("device", |node, context| read_device(node, context, limits, A_DEVICE));
    // Device of a peer without a given device. A simulated peer needs a device, and so does another process in virtual time, where the peer is simulated.
    let absent = match &kind {
        None => None,
        Some(PeerKind::Simulated) => {
            table.require("device", A_DEVICE);
            None
        }
        Some(PeerKind::Udp(_)) => {
            if !context.live {
                table.require("device", UDP_DEVICE);
            }
            Some(STILL_DEVICE)
        }
        Some(PeerKind::Inverse3(..)) => {
            if !context.live {
                table.require("device", INVERSE3_DEVICE);
            }
            Some(FALCON_DEVICE)
        }
        Some(PeerKind::Falcon(..) | PeerKind::Pointer(..)) => Some(FALCON_DEVICE),
    };
    // A peer elsewhere without a device here touches nothing here.
    let contact = if elsewhere && table.get("device").is_none() { Some(Contact::None) } else { contact };
    let coupling = table.maybe("coupling", read_coupling);
    // In a live session a process elsewhere computes the coupling itself.
    let needs_coupling = contact.is_some_and(|contact| contact != Contact::None) && !(elsewhere && context.live);
    if needs_coupling {
        table.require("coupling", A_COUPLING);
    }
    let hand_node = table.get("hand");
    let hand = table.read("hand", |node, _| read_hand(node, context));
    let torque = hand_node.map_or(Some(None), |node| read_hand_torque(node, context));
    let clock = table.table("clock", read_clock);
    let [position, velocity, device_position, device_velocity] =
        ["position", "velocity", "device-position", "device-velocity"].map(|key| maybe_vector_of(&mut table, key, context, Spread::EveryAxis));
    let turned = read_peer_rotation(&mut table);
    let access = read_access(&mut table, *context);
    table.finish();

    // Not checked for `[peer]` alone: an entry may replace tick or phase.
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
    // Checked against the tick of this peer, from `[peer]` or from the entry.
    if let (Some(Some(hand)), Some(tick), Some(node)) = (&hand, tick, hand_node)
        && !hand_is_sampled(Some(hand), tick, node, *context)
    {
        return None;
    }
    let (offset, drift) = clock?;
    let (device, coupling) = (device?, coupling?);
    let (exchange, turned_device) = match &device {
        Some(device) => (device.exchange, device.turned),
        // A peer without a device in the file has the exchanges of its kind.
        None => (check_exchange(Exchange { late: limits.late, ..Exchange::EACH_TICK }, node, *context, limits)?, None),
    };
    let rotation = PeerRotationKeys { device: turned_device, coupling: coupling.and_then(|(_, _, turned)| turned), torque: torque?, ..turned? };
    Some(PeerKeys {
        kind: kind?,
        clock: Clock { tick: tick?, offset, drift },
        phase: phase?,
        compute_delay: compute_delay? == 1,
        contact: contact?,
        device: device.map(|device| device.config).or(absent).unwrap_or(STILL_DEVICE),
        exchange,
        coupling: coupling.map(|(gains, scaling, _)| (gains, scaling)),
        hand: hand?,
        position: position?,
        velocity: velocity?,
        device_position: device_position?,
        device_velocity: device_velocity?,
        rotation,
        access: access?,
    })
}

/// Returns `whole` / `part` if the quotient is a whole number above zero.
fn whole_multiple(whole: Duration, part: Duration) -> Option<u64> {
    let (whole, part) = (whole.as_nanos(), part.as_nanos());
    if part == 0 || whole % part != 0 {
        return None;
    }
    u64::try_from(whole / part).ok().filter(|times| *times > 0)
}
