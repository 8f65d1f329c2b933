//! Where a peer lives: `kind`, `silence`, `falcon` and `pointer` of a peer.

use cohaptic_linkfile::document::{Node, quote};
use cohaptic_linkfile::reading::values::ReadNumber as _;
use cohaptic_linkfile::reading::{Context, TableReader, values};
use cohaptic_peer::DeviceConfig;
use cohaptic_units::print::Counted;

use crate::model::{FalconDevice, FalconSpec, PeerKind, PointerSpec, Silence};
use crate::quantities::{DAMPING, POSITION, POSITIVE_COUNTS, POSITIVE_FORCE, STIFFNESS};

/// The model of a Falcon in Rakhsha & Constantinescu (2015): for virtual time, and for the device that a pointer pulls.
pub(crate) const FALCON_DEVICE: DeviceConfig = DeviceConfig { mass: 0.1, damping: 5.0 };

/// What a peer has that lives elsewhere and was given no device: something that nobody moves and that touches nothing.
pub(crate) const STILL_DEVICE: DeviceConfig = DeviceConfig { mass: 1.0, damping: 0.0 };

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Word {
    Simulated,
    Udp,
    Falcon,
    Pointer,
}

/// Reads the four keys. All but `kind` may come from `[peer]` and say nothing to a peer of another kind; they are checked all the same.
pub(crate) fn read_kind(table: &mut TableReader<'_>, context: Context<'_>) -> Option<PeerKind> {
    let words = [("simulated", Word::Simulated), ("udp", Word::Udp), ("falcon", Word::Falcon), ("pointer", Word::Pointer)];
    let word = table.optional("kind", Word::Simulated, |node, context| values::choice(node, context, &words));
    let silence = table.optional("silence", Silence::default(), read_silence);
    let falcon = table.optional("falcon", FalconSpec::default(), |node, _| read_falcon(node, context));
    let pointer = table.optional("pointer", PointerSpec::default(), read_pointer);
    let (silence, falcon, pointer) = (silence?, falcon?, pointer?);
    Some(match word? {
        Word::Simulated => PeerKind::Simulated,
        Word::Udp => PeerKind::Udp(silence),
        Word::Falcon => PeerKind::Falcon(silence, falcon),
        Word::Pointer => PeerKind::Pointer(silence, pointer),
    })
}

fn read_silence(node: &Node, context: Context<'_>) -> Option<Silence> {
    let mut table = TableReader::new(node, context, "a table such as { after = \"100ms\", fade = \"250ms\" }")?;
    let usual = Silence::default();
    let after = table.optional("after", usual.after, values::positive_duration);
    let fade = table.optional("fade", usual.fade, values::positive_duration);
    table.finish();
    Some(Silence { after: after?, fade: fade? })
}

fn read_pointer(node: &Node, context: Context<'_>) -> Option<PointerSpec> {
    let mut table = TableReader::new(node, context, "a table such as { stiffness = 400.0, damping = 20.0 }")?;
    let usual = PointerSpec::default();
    let stiffness = table.optional("stiffness", usual.stiffness, |node, context| STIFFNESS.read(node, context));
    let damping = table.optional("damping", usual.damping, |node, context| DAMPING.read(node, context));
    let force_limit = table.optional("force-limit", usual.force_limit, |node, context| POSITIVE_FORCE.read(node, context));
    let held = table.optional("held", usual.held, values::boolean);
    table.finish();
    Some(PointerSpec { stiffness: stiffness?, damping: damping?, force_limit: force_limit?, held: held? })
}

fn read_falcon(node: &Node, context: Context<'_>) -> Option<FalconSpec> {
    let mut table = TableReader::new(node, context, "a table such as { device = \"first\", force-limit = 4.0 }")?;
    let usual = FalconSpec::default();
    let device = table.optional("device", usual.device, read_device);
    let counts = table.optional("counts-per-newton-metre", usual.counts_per_newton_metre, |node, context| POSITIVE_COUNTS.read(node, context));
    let force_limit = table.optional("force-limit", usual.force_limit, |node, context| POSITIVE_FORCE.read(node, context));
    let origin = table.optional("origin", usual.origin, read_origin);
    table.finish();
    Some(FalconSpec { device: device?, counts_per_newton_metre: counts?, force_limit: force_limit?, origin: origin? })
}

fn read_device(node: &Node, context: Context<'_>) -> Option<FalconDevice> {
    const EXPECTED: &str = "\"first\", \"simulated\", or the serial number of a device";
    let text = values::text(node, context, EXPECTED)?;
    match text {
        "first" => Some(FalconDevice::First),
        "simulated" => Some(FalconDevice::Simulated),
        serial if !serial.is_empty() && serial.chars().all(|c| c.is_ascii_graphic()) => Some(FalconDevice::Serial(serial.to_owned())),
        other => {
            context.fault_at(node, format!("{} is no serial number: expected {EXPECTED}", quote(other)));
            None
        }
    }
}

/// A device has three axes, however many the scene has.
fn read_origin(node: &Node, context: Context<'_>) -> Option<[f64; 3]> {
    const EXPECTED: &str = "a list of three numbers [m], a place in the coordinates of the device";
    let elements = values::list(node, context, EXPECTED)?;
    let [x, y, z] = elements.as_slice() else {
        context.fault_at(node, format!("found a list of {}: expected {EXPECTED}", Counted(elements.len(), "number")));
        return None;
    };
    let read = |node| POSITION.read(node, context);
    let (x, y, z) = (read(x), read(y), read(z));
    Some([x?, y?, z?])
}
