//! Rotation of a scene: the rotational keys of the object, of the coordination and of all peers together.

use cohaptic_linkfile::reading::Context;
use cohaptic_peer::Gains;
use cohaptic_peer::rotation::{Attitude, Triple};

use super::peers::PeerRead;
use super::rotation::{ObjectRotation, PeerRotationKeys};
use crate::{DeviceRotationSpec, PeerKind, PeerRotation, RotationSpec};

/// Returns the rotation of the object with the rotational parts of the peers; `Some(None)` without an inertia. `object` has the keys of `[object]`, `gains`
/// the keys of `[coordination]`.
pub(crate) fn rotation(
    object: Option<ObjectRotation>,
    gains: Gains<Option<Triple>>,
    steps: u32,
    peers: &[PeerRead],
    context: Context<'_>,
) -> Option<Option<Box<RotationSpec>>> {
    let Some(ObjectRotation { inertia, damping, attitude }) = object else { return Some(None) };
    let peers: Vec<Option<PeerRotation>> = peers.iter().map(|read| peer_rotation(read, attitude, context)).collect();
    let peers: Option<Vec<PeerRotation>> = peers.into_iter().collect();
    Some(Some(Box::new(RotationSpec { inertia, damping, gains, steps, peers: peers? })))
}

fn peer_rotation(read: &PeerRead, attitude: Attitude, context: Context<'_>) -> Option<PeerRotation> {
    let PeerRotationKeys { grasp, orientation, rate, device, coupling, torque } = &read.rotation;
    let name = &read.spec.name;
    let refuse = |message: String| {
        context.fault(read.place, "peers", message);
        None
    };
    let device = match device {
        Some(_) if read.spec.kind.is_in_hand() => {
            let device = match read.spec.kind {
                PeerKind::Falcon(..) => "a Falcon",
                PeerKind::Inverse3(..) => "an Inverse3",
                PeerKind::Simulated | PeerKind::Udp(_) | PeerKind::Pointer(..) => "a pointer",
            };
            return refuse(format!("peer \"{name}\": {device} turns nothing: expected a device without an inertia"));
        }
        Some(handle) => {
            let touches = read.spec.contact == cohaptic_peer::Contact::Grasp;
            // Without a grasp the device exerts no torque, so that the coupling may have no rotational gains.
            let Some(coupling) = coupling.or((!touches).then_some(Gains { stiffness: 0.0, damping: 0.0 })) else {
                return refuse(format!("peer \"{name}\": a device that turns needs a coupling that turns: expected coupling.rotational-stiffness"));
            };
            Some(DeviceRotationSpec { handle: *handle, coupling, torque: torque.clone() })
        }
        None if torque.is_some() => {
            return refuse(format!("peer \"{name}\": the torque of a hand needs a device that turns: expected device.inertia"));
        }
        None => None,
    };
    let own = Attitude { orientation: orientation.unwrap_or(attitude.orientation), rate: rate.unwrap_or(attitude.rate) };
    Some(PeerRotation { grasp: *grasp, attitude: own, device })
}
