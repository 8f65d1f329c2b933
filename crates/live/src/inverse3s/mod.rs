//! Inverse3s of a scene: starts the drivers, and passes each Inverse3 to the session as the device of a peer.
//!
//! A real Inverse3 is behind Haply's service, which need not run yet: the device joins the session when its user has armed the device. A simulated Inverse3
//! (`inverse3 = { device = "simulated" }`) has a service of its own at a free port of this machine, speaks the same messages, and is held by the peer's hand of
//! the scene. The hand arms the device before the session begins.

mod attached;
mod hand;

use std::net::{Ipv4Addr, SocketAddr};

use cohaptic_device::{Device, Stopper};
use cohaptic_inverse3::client::{ClientConfig, Phase, Which};
use cohaptic_inverse3::service::{Service, ServiceConfig};
use cohaptic_inverse3::socket::{Inverse3, ServiceThread, StartError};
use cohaptic_realtime::{Wishes, prepare_thread};
use cohaptic_scene::{Inverse3Device, Inverse3Spec, PeerKind, PeerSpec, Scene};

pub use cohaptic_inverse3::socket::Facts;

use crate::scene_hand::Beginning;
use attached::Attached;
use hand::ArmingHand;

/// Reason why an Inverse3 of the scene cannot be used.
#[derive(Debug, thiserror::Error)]
#[error("the Inverse3 of {peer}: {fault}")]
pub struct Inverse3Fault {
    /// Name of the peer with the Inverse3.
    pub peer: String,
    /// Fault of the Inverse3.
    pub fault: StartError,
}

/// Readiness of an Inverse3 for a session.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Readiness {
    /// Phase of the device.
    pub phase: Phase,
    /// `true` if the device is simulated.
    pub is_simulated: bool,
}

/// Inverse3s of a scene, each driven by a thread of its own.
#[derive(Debug)]
pub struct Inverse3s {
    /// Devices not taken by the session yet, indexed by peer. `None` for peers of other kinds and for taken devices.
    devices: Vec<Option<Attached>>,
    /// Stoppers and facts of all devices, with the index of the peer. Both stay valid after the session has taken a device.
    handles: Vec<(usize, Stopper, Facts)>,
}

impl Inverse3s {
    /// Starts the driver of every Inverse3 of the scene. `wishes`: requests to the system for the thread of each driver.
    ///
    /// # Errors
    ///
    /// [`Inverse3Fault`] of the first driver that cannot be started. Drivers started before are stopped in good order.
    pub fn open(scene: &Scene, wishes: Wishes) -> Result<Self, Inverse3Fault> {
        let mut all = Self { devices: Vec::new(), handles: Vec::new() };
        for (place, peer) in scene.peers.iter().enumerate() {
            let PeerKind::Inverse3(_, spec) = &peer.kind else {
                all.devices.push(None);
                continue;
            };
            let device = open(scene, place, peer, spec, wishes).map_err(|fault| Inverse3Fault { peer: peer.name.clone(), fault })?;
            all.handles.push((place, device.stopper(), device.facts()));
            all.devices.push(Some(device));
        }
        Ok(all)
    }

    /// Returns the readiness of each Inverse3 not taken by the session yet, with the index of the peer.
    pub fn readiness(&self) -> impl Iterator<Item = (usize, Readiness)> + '_ {
        self.devices.iter().enumerate().filter_map(|(place, device)| device.as_ref().map(|device| (place, device.readiness())))
    }

    /// Returns whether every simulated Inverse3 is armed. Real devices are not waited for: a real device joins the session when armed.
    #[must_use]
    pub fn simulated_are_ready(&self) -> bool {
        self.readiness().all(|(_, readiness)| readiness.phase == Phase::Active || !readiness.is_simulated)
    }

    /// Returns a stopper for each device, which can be used from any thread.
    pub fn stoppers(&self) -> impl Iterator<Item = Stopper> + '_ {
        self.handles.iter().map(|(_, stopper, _)| stopper.clone())
    }

    /// Returns a handle to the facts about each device, with the index of the peer.
    #[must_use]
    pub fn facts(&self) -> Vec<(usize, Facts)> {
        self.handles.iter().map(|(place, _, facts)| (*place, facts.clone())).collect()
    }

    /// Removes the Inverse3 of a peer and returns the session's device. Returns `None` if the peer has no Inverse3, or the Inverse3 was taken before.
    pub fn take(&mut self, peer: usize) -> Option<Box<dyn Device>> {
        Some(Box::new(self.devices.get_mut(peer)?.take()?))
    }
}

fn open(scene: &Scene, place: usize, peer: &PeerSpec, spec: &Inverse3Spec, wishes: Wishes) -> Result<Attached, StartError> {
    let exchange = peer.clock.tick.saturating_mul(peer.exchange.every.max(1));
    let default = ClientConfig::DEFAULT;
    let limits = cohaptic_device::Limits { force: spec.force_limit, ..default.limits };
    let config = ClientConfig { which: which(scene, place, spec), origin: spec.origin, limits, ..default }.exchanging(exchange, spec.reading_age);
    let first = move || {
        // The report is dropped: a wish refused to this thread is also refused to the session's thread, and the session reports the refusal.
        let _ = prepare_thread(&wishes);
    };
    if spec.device != Inverse3Device::Simulated {
        return Ok(Attached::real(Inverse3::start(spec.service, config, exchange, first)?));
    }
    let beginning = Beginning::default();
    let hand = ArmingHand::new(peer.hand.clone(), beginning.clone());
    // Each simulated device has random numbers of its own, the same in every run of the scene. The hand's arm moves with the grip.
    let seed = scene.seed.wrapping_add(place as u64);
    let service = ServiceConfig { seed, mass: peer.device.mass + hand.mass(), damping: peer.device.damping, ..ServiceConfig::default() };
    let service = ServiceThread::start(Service::new(service, hand), SocketAddr::from((Ipv4Addr::LOCALHOST, 0)))?;
    // A simulated device has its origin in the middle, as a service of 3.5 puts it.
    let config = ClientConfig { which: Which::FIRST, origin: None, ..config };
    let device = Inverse3::start(service.address(), config, exchange, first)?;
    Ok(Attached::simulated(device, service, beginning))
}

/// Returns the device of a peer in the list of the service. Peers with `first` take devices in the order of the scene, without the devices that have a name.
fn which(scene: &Scene, place: usize, spec: &Inverse3Spec) -> Which {
    if let Inverse3Device::Id(id) = &spec.device {
        return Which::Id(id.clone());
    }
    let others = |peers: &[PeerSpec]| -> Vec<Inverse3Spec> {
        let here = peers.iter().filter_map(|peer| if let PeerKind::Inverse3(_, other) = &peer.kind { Some(other) } else { None });
        here.filter(|other| other.service == spec.service).cloned().collect()
    };
    let besides =
        others(&scene.peers).into_iter().filter_map(|other| if let Inverse3Device::Id(id) = other.device { Some(id) } else { None }).collect();
    let before = others(&scene.peers[..place]).into_iter().filter(|other| other.device == Inverse3Device::First).count();
    Which::Place { place: before, besides }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn peers_with_the_first_device_take_one_after_the_other() {
        let text = r#"
            scene = { duration = "1s" }
            object = { mass = 1 }
            coordination = { strategy = "average-position", stiffness = 1, update = "8ms" }
            peer = { kind = "inverse3", coupling = { stiffness = 1 } }
            peers = [{ name = "a" }, { name = "b", inverse3 = { device = "04C3" } }, { name = "c" }, { name = "d", inverse3 = { service = "ws://[::1]:10001" } }]
            link = {}
        "#;
        let scene = Scene::parse_live(text, std::path::Path::new("scene.toml"), &[]).unwrap();
        let found: Vec<Which> = (0..4)
            .map(|place| {
                let PeerKind::Inverse3(_, spec) = &scene.peers[place].kind else { panic!("{scene:?}") };
                which(&scene, place, spec)
            })
            .collect();
        let besides = || vec!["04C3".to_owned()];
        let expected = [
            Which::Place { place: 0, besides: besides() },
            Which::Id("04C3".to_owned()),
            Which::Place { place: 1, besides: besides() },
            Which::FIRST,
        ];
        assert_eq!(found, expected);
    }
}
