//! The Falcons of a scene: opened, made ready, and handed to the session as devices of its peers.
//!
//! A real one is found over USB, given its firmware if it has none, and joins the session when its user has homed it. A simulated one
//! (`falcon = { device = "simulated" }`) is a Falcon down to its bytes, in the time of the wall, in the hand that the scene gives its peer; that hand homes
//! it before the session begins.

mod attached;
mod hand;

use std::path::Path;
use std::time::Duration;

use cohaptic_falcon::boot::{self, BootError, BootOptions, Firmware, FirmwareError, Progress};
use cohaptic_falcon::calibration::{Calibration, CalibrationError};
use cohaptic_falcon::device::{Axes, Axis, DeviceConfig, FalconDevice, StartError, Stopper};
use cohaptic_falcon::driver::DriverConfig;
use cohaptic_falcon::safety::Limits;
use cohaptic_falcon::simulator::{MechanicsConfig, SimulatedTransport, Simulator, SimulatorConfig};
use cohaptic_falcon::transport::{Transport, TransportError};
use cohaptic_falcon::usb::{UsbError, UsbTransport};
use cohaptic_harness::live::LiveDevice;
use cohaptic_realtime::{Wishes, prepare_thread};
use cohaptic_scene::{FalconDevice as Which, FalconSpec, PeerKind, PeerSpec, Scene};

use attached::Attached;
use hand::{Beginning, SceneHand};

pub use attached::Readiness;

/// Why a Falcon of the scene cannot be had.
#[derive(Debug, thiserror::Error)]
#[error("the Falcon of {peer}: {fault}")]
pub struct FalconFault {
    /// The peer.
    pub peer: String,
    /// Why.
    pub fault: FaultKind,
}

/// Why a Falcon cannot be had.
#[derive(Debug, thiserror::Error)]
pub enum FaultKind {
    /// It is not there, or may not be opened.
    #[error(transparent)]
    Usb(#[from] UsbError),
    /// It was lost while it was made ready.
    #[error(transparent)]
    Transport(#[from] TransportError),
    /// Its numbers in the scene make no sense.
    #[error(transparent)]
    Calibration(#[from] CalibrationError),
    /// It runs no firmware, and none was given.
    #[error("it has no firmware yet: give the path of the one that came with it with --firmware FILE (docs/falcon.md)")]
    NoFirmware,
    /// The firmware cannot be read.
    #[error(transparent)]
    Firmware(#[from] FirmwareError),
    /// The firmware cannot be loaded.
    #[error(transparent)]
    Boot(#[from] BootError),
    /// It cannot be driven.
    #[error(transparent)]
    Start(#[from] StartError),
}

/// The Falcons of a scene, each driven by a thread of its own.
#[derive(Debug)]
pub struct Falcons {
    /// By the places of the peers.
    devices: Vec<Option<AnyAttached>>,
    stoppers: Vec<Stopper>,
}

/// A Falcon with as many axes as the scene has.
#[derive(Debug)]
enum AnyAttached {
    One(Attached<1>),
    Two(Attached<2>),
    Three(Attached<3>),
}

impl Falcons {
    /// Opens every Falcon of the scene. `firmware`: the file with which those are made ready that have none; `wishes`:
    /// what their threads ask of the system. `progress` is told what takes time.
    ///
    /// # Errors
    ///
    /// [`FalconFault`] of the first that cannot be had; those before it are stopped in good order.
    pub fn open(scene: &Scene, firmware: Option<&Path>, wishes: Wishes, mut progress: impl FnMut(&str, Progress)) -> Result<Self, FalconFault> {
        let mut falcons = Self { devices: Vec::new(), stoppers: Vec::new() };
        let mut taken = Vec::new();
        for (place, peer) in scene.peers.iter().enumerate() {
            let PeerKind::Falcon(_, spec) = &peer.kind else {
                falcons.devices.push(None);
                continue;
            };
            let seed = scene.seed.wrapping_add(place as u64);
            let opened = open(scene, peer, spec, seed, firmware, wishes, &mut taken, &mut |told| progress(&peer.name, told));
            let device = opened.map_err(|fault| FalconFault { peer: peer.name.clone(), fault })?;
            falcons.stoppers.push(device.stopper());
            falcons.devices.push(Some(device));
        }
        Ok(falcons)
    }

    /// Each Falcon by the place of its peer: whether it is ready.
    pub fn readiness(&self) -> impl Iterator<Item = (usize, Readiness)> + '_ {
        self.devices.iter().enumerate().filter_map(|(place, device)| device.as_ref().map(|device| (place, device.readiness())))
    }

    /// Whether every simulated one is ready: their hands home them within some seconds. Real ones may take their time, and join when they are ready.
    #[must_use]
    pub fn simulated_are_ready(&self) -> bool {
        self.readiness().all(|(_, readiness)| readiness.is_ready || !readiness.is_simulated)
    }

    /// Something that switches all forces off, from wherever it is called.
    #[must_use]
    pub fn stoppers(&self) -> Vec<Stopper> {
        self.stoppers.clone()
    }

    /// The device of a peer, for the session, which has it from then on.
    pub fn take(&mut self, peer: usize) -> Option<Box<dyn LiveDevice>> {
        Some(match self.devices.get_mut(peer)?.take()? {
            AnyAttached::One(device) => Box::new(device),
            AnyAttached::Two(device) => Box::new(device),
            AnyAttached::Three(device) => Box::new(device),
        })
    }
}

#[expect(clippy::too_many_arguments, reason = "what a Falcon is made of, each once")]
fn open(
    scene: &Scene,
    peer: &PeerSpec,
    spec: &FalconSpec,
    seed: u64,
    firmware: Option<&Path>,
    wishes: Wishes,
    taken: &mut Vec<String>,
    progress: &mut dyn FnMut(Progress),
) -> Result<AnyAttached, FaultKind> {
    let calibration = Calibration::new(spec.counts_per_newton_metre, spec.origin)?;
    let limits = Limits { force: spec.force_limit, ..Limits::DEFAULT };
    let driver = DriverConfig { calibration, limits, ..DriverConfig::DEFAULT };
    if spec.device == Which::Simulated {
        let beginning = Beginning::default();
        let hand = SceneHand::new(peer.hand.clone(), spec.origin, beginning.clone());
        let mechanics = MechanicsConfig { mass: peer.device.mass + hand.mass(), damping: peer.device.damping, ..MechanicsConfig::DEFAULT };
        let config = SimulatorConfig { seed, running: true, mechanics, ..SimulatorConfig::default() };
        let transport = SimulatedTransport::in_real_time(Simulator::new(config, hand));
        return start(scene, transport, driver, wishes, Some(beginning));
    }
    let serial = match &spec.device {
        Which::Serial(serial) => Some(serial.clone()),
        Which::First | Which::Simulated => first_free(taken)?,
    };
    let mut transport = UsbTransport::open(serial.as_deref())?;
    taken.extend(serial);
    let options = BootOptions::DEFAULT;
    match firmware {
        Some(path) => {
            boot::ensure_loaded(&mut transport, &Firmware::read(path)?, &options, progress)?;
        }
        None if boot::is_loaded(&mut transport, &options)? => {}
        None => return Err(FaultKind::NoFirmware),
    }
    start(scene, transport, driver, wishes, None)
}

/// The serial number of the first Falcon that no peer has yet; `None` if it tells none, or none is found: opening it says so.
fn first_free(taken: &[String]) -> Result<Option<String>, UsbError> {
    let listed = cohaptic_falcon::usb::list()?;
    Ok(listed.into_iter().filter_map(|falcon| falcon.serial).find(|serial| !taken.contains(serial)))
}

fn start<T: Transport + Send + 'static>(
    scene: &Scene,
    transport: T,
    driver: DriverConfig,
    wishes: Wishes,
    beginning: Option<Beginning>,
) -> Result<AnyAttached, FaultKind> {
    // The first axes of the scene and of the device are the same.
    let all = [Axis::X, Axis::Y, Axis::Z];
    match scene.axes {
        cohaptic_scene::Axes::One => attach(transport, [all[0]], driver, wishes, beginning).map(AnyAttached::One),
        cohaptic_scene::Axes::Two => attach(transport, [all[0], all[1]], driver, wishes, beginning).map(AnyAttached::Two),
        cohaptic_scene::Axes::Three => attach(transport, all, driver, wishes, beginning).map(AnyAttached::Three),
    }
}

fn attach<const A: usize, T: Transport + Send + 'static>(
    transport: T,
    axes: [Axis; A],
    driver: DriverConfig,
    wishes: Wishes,
    beginning: Option<Beginning>,
) -> Result<Attached<A>, FaultKind> {
    let axes = Axes::new(axes).expect("no axis is named twice");
    let device = FalconDevice::start_with(transport, DeviceConfig { driver, ..DeviceConfig::new(axes) }, move || {
        // A wish that is refused here is refused to the session's thread too, which says so.
        let _ = prepare_thread(&wishes);
    })?;
    Ok(Attached::new(device, beginning))
}

impl AnyAttached {
    fn readiness(&self) -> Readiness {
        match self {
            Self::One(device) => device.readiness(),
            Self::Two(device) => device.readiness(),
            Self::Three(device) => device.readiness(),
        }
    }

    fn stopper(&self) -> Stopper {
        match self {
            Self::One(device) => device.stopper(),
            Self::Two(device) => device.stopper(),
            Self::Three(device) => device.stopper(),
        }
    }
}

/// How long a simulated hand may take to home its device. It takes a second; a busy machine takes its time.
pub const SIMULATED_HOMING: Duration = Duration::from_secs(60);
