//! Readers of `kind`, `silence`, `falcon`, `inverse3` and `pointer` of a peer: the place where the peer runs.

use cohaptic_linkfile::document::{Node, quote};
use cohaptic_linkfile::reading::{Context, TableReader, defaults, values};
use cohaptic_linkfile::schema::{Choices, Form, Table, number, usual, words};
use cohaptic_peer::DeviceConfig;

use super::device::read_origin;
use super::inverse3::read_inverse3;
use crate::model::{FalconDevice, FalconSpec, PeerKind, PointerSpec, Silence};
use crate::quantities::{DAMPING, POSITION, POSITIVE_COUNTS, POSITIVE_FORCE, STIFFNESS};

/// Model of a Falcon in Rakhsha & Constantinescu (2015): mass 0.1 kg, damping 5 N·s/m. For virtual time, for the device of a pointer, and for a simulated Inverse3 in
/// a live session.
pub(crate) const FALCON_DEVICE: DeviceConfig = DeviceConfig { mass: 0.1, damping: 5.0 };

/// Device of a peer elsewhere, if the scene gives no device. Nobody moves this device, and the device touches nothing.
pub(crate) const STILL_DEVICE: DeviceConfig = DeviceConfig { mass: 1.0, damping: 0.0 };

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Word {
    Simulated,
    Udp,
    Falcon,
    Inverse3,
    Pointer,
}

const KINDS: Choices<Word, 5> = [
    ("simulated", Word::Simulated, "simulated here"),
    ("udp", Word::Udp, "another program, which sends and receives samples"),
    ("falcon", Word::Falcon, "simulated here, with a Novint Falcon"),
    ("inverse3", Word::Inverse3, "simulated here, with a Haply Inverse3"),
    ("pointer", Word::Pointer, "simulated here, pulled by a mouse, a finger or a stick"),
];
pub(super) const KIND: Form = Form::Words(const { &words(&KINDS) });
pub(super) static SILENCE: Table = Table::of(&[&[
    usual("after", Form::PositiveDuration, "\"100ms\"", "Length of the silence after which the pull fades"),
    usual("fade", Form::PositiveDuration, "\"250ms\"", "Time in which the pull fades"),
]]);
/// Keys of a pointer. With the defaults the device of a Falcon follows nearly without overshoot, and the largest force is no greater than the force of an
/// adult's wrist.
pub(super) static POINTER: Table = Table::of(&[&[
    usual("stiffness", number(STIFFNESS), "400", "Stiffness of the arm between pointer and device"),
    usual("damping", number(DAMPING), "20", "Damping of the arm between pointer and device"),
    usual("force-limit", number(POSITIVE_FORCE), "20", "Largest force with which the arm pulls"),
    usual("held", Form::Boolean, "false", "Whether the pointer holds the device from the beginning"),
]]);
/// Keys of a Falcon. With 10,000 counts per newton metre, full scale is about the force in the maker's description. The limit of 4 N is half of the reported
/// force of the device. The origin is the middle of the workspace.
pub(super) static FALCON: Table = Table::of(&[&[
    usual(
        "device",
        Form::Like(&["first", "simulated"]),
        "\"first\"",
        "Device: the first that no other peer has, a simulated one, or the one with a serial number",
    ),
    usual("counts-per-newton-metre", number(POSITIVE_COUNTS), "10000", "Motor counts per torque at the joint of an arm"),
    usual("force-limit", number(POSITIVE_FORCE), "4", "Largest force that is sent to the motors"),
    usual("origin", Form::Triple(POSITION), "[0, 0, 0.125]", "Origin of the scene in the coordinates of the device"),
]]);

impl Default for Silence {
    fn default() -> Self {
        defaults(read_silence)
    }
}

impl Default for PointerSpec {
    fn default() -> Self {
        defaults(read_pointer)
    }
}

impl Default for FalconSpec {
    fn default() -> Self {
        defaults(read_falcon)
    }
}

/// Reads the five keys. All but `kind` may come from `[peer]`: they are checked for every peer, and have no effect on a peer of another kind.
pub(crate) fn read_kind(table: &mut TableReader<'_>) -> Option<PeerKind> {
    let word = table.choice("kind", &KINDS);
    let silence = table.table("silence", read_silence);
    let falcon = table.table("falcon", read_falcon);
    let inverse3 = table.table("inverse3", read_inverse3);
    let pointer = table.table("pointer", read_pointer);
    // All four are read before the first `?`, so that the faults of all tables are reported.
    let (silence, falcon, inverse3, pointer) = (silence?, falcon?, inverse3?, pointer?);
    Some(match word? {
        Word::Simulated => PeerKind::Simulated,
        Word::Udp => PeerKind::Udp(silence),
        Word::Falcon => PeerKind::Falcon(silence, falcon),
        Word::Inverse3 => PeerKind::Inverse3(silence, inverse3),
        Word::Pointer => PeerKind::Pointer(silence, pointer),
    })
}

fn read_silence(node: &Node, context: Context<'_>) -> Option<Silence> {
    let mut table = TableReader::new(node, context, &SILENCE, "a table such as { after = \"100ms\", fade = \"250ms\" }")?;
    let (after, fade) = (table.value("after"), table.value("fade"));
    table.finish();
    Some(Silence { after: after?, fade: fade? })
}

fn read_pointer(node: &Node, context: Context<'_>) -> Option<PointerSpec> {
    let mut table = TableReader::new(node, context, &POINTER, "a table such as { stiffness = 400.0, damping = 20.0 }")?;
    let (stiffness, damping) = (table.value("stiffness"), table.value("damping"));
    let (force_limit, held) = (table.value("force-limit"), table.value("held"));
    table.finish();
    Some(PointerSpec { stiffness: stiffness?, damping: damping?, force_limit: force_limit?, held: held? })
}

fn read_falcon(node: &Node, context: Context<'_>) -> Option<FalconSpec> {
    let mut table = TableReader::new(node, context, &FALCON, "a table such as { device = \"first\", force-limit = 4.0 }")?;
    let device = table.read("device", read_device);
    let (counts, force_limit) = (table.value("counts-per-newton-metre"), table.value("force-limit"));
    let origin = table.read("origin", read_origin);
    table.finish();
    Some(FalconSpec { device: device?, counts_per_newton_metre: counts?, force_limit: force_limit?, origin: origin? })
}

fn read_device(node: &Node, context: Context<'_>) -> Option<FalconDevice> {
    const EXPECTED: &str = "\"first\", \"simulated\", or the serial number of a device";
    let text = values::text(node, context, EXPECTED)?;
    match text {
        "first" => Some(FalconDevice::First),
        "simulated" => Some(FalconDevice::Simulated),
        // A serial number is printable ASCII without spaces.
        serial if !serial.is_empty() && serial.chars().all(|c| c.is_ascii_graphic()) => Some(FalconDevice::Serial(serial.to_owned())),
        other => {
            context.fault_at(node, format!("{} is not a serial number: expected {EXPECTED}", quote(other)));
            None
        }
    }
}
