//! Where a peer lives: `kind`, `silence` and `falcon` of a peer.

use cohaptic_linkfile::document::{Node, quote};
use cohaptic_linkfile::reading::values::ReadNumber as _;
use cohaptic_linkfile::reading::{Context, TableReader, values};
use cohaptic_peer::DeviceConfig;
use cohaptic_units::print::Counted;

use crate::model::{FalconDevice, FalconSpec, PeerKind, Silence};
use crate::quantities::{POSITION, POSITIVE_COUNTS, POSITIVE_FORCE};

/// The model of a Falcon in Rakhsha & Constantinescu (2015), for virtual time.
pub(crate) const FALCON_DEVICE: DeviceConfig = DeviceConfig { mass: 0.1, damping: 5.0 };

/// What a peer has that lives elsewhere and was given no device: something that nobody moves and that touches nothing.
pub(crate) const STILL_DEVICE: DeviceConfig = DeviceConfig { mass: 1.0, damping: 0.0 };

#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Word {
    Simulated,
    Udp,
    Falcon,
}

/// Reads the three keys. `silence` and `falcon` may come from `[peer]` and say nothing to a peer of another kind; they are checked all the same.
pub(crate) fn read_kind(table: &mut TableReader<'_>, context: Context<'_>) -> Option<PeerKind> {
    let words = [("simulated", Word::Simulated), ("udp", Word::Udp), ("falcon", Word::Falcon)];
    let word = table.optional("kind", Word::Simulated, |node, context| values::choice(node, context, &words));
    let silence = table.optional("silence", Silence::default(), read_silence);
    let falcon = table.optional("falcon", FalconSpec::default(), |node, _| read_falcon(node, context));
    let (silence, falcon) = (silence?, falcon?);
    Some(match word? {
        Word::Simulated => PeerKind::Simulated,
        Word::Udp => PeerKind::Udp(silence),
        Word::Falcon => PeerKind::Falcon(silence, falcon),
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
