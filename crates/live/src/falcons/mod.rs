//! Falcons of a scene: opens the Falcons, makes the Falcons ready, and hands each Falcon to the session as the device of a peer.
//!
//! A real Falcon is found over USB, is given the firmware if the Falcon has no firmware, and joins the session when the user has homed the device. A simulated
//! Falcon (`falcon = { device = "simulated" }`) speaks the same bytes, runs in real time, and is held by the peer's hand of the scene. The hand homes the
//! device before the session begins.

mod attached;
mod hand;

use std::path::Path;
use std::time::Duration;

use cohaptic_device::{Device, Stopper};
use cohaptic_falcon::boot::{self, BootError, BootOptions, Firmware, FirmwareError, Progress};
use cohaptic_falcon::calibration::{Calibration, CalibrationError};
use cohaptic_falcon::device::{Axes, Axis, DeviceConfig, FalconDevice, StartError};
use cohaptic_falcon::driver::DriverConfig;
use cohaptic_falcon::safety::Limits;
use cohaptic_falcon::simulator::{MechanicsConfig, SimulatedTransport, Simulator, SimulatorConfig};
use cohaptic_falcon::transport::{Transport, TransportError};
use cohaptic_falcon::usb::{UsbError, UsbTransport};
use cohaptic_realtime::{Wishes, prepare_thread};
use cohaptic_scene::{FalconDevice as Which, FalconSpec, PeerKind, PeerSpec, Scene};

use crate::scene_hand::Beginning;
use attached::Attached;
use hand::SceneHand;

pub use attached::Readiness;

/// Reason why a Falcon of the scene cannot be used.
#[derive(Debug, thiserror::Error)]
#[error("the Falcon of {peer}: {fault}")]
pub struct FalconFault {
    /// Name of the peer with the Falcon.
    pub peer: String,
    /// Fault of the Falcon.
    pub fault: FaultKind,
}

/// Fault of an unusable Falcon.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FaultKind {
    /// The Falcon is not connected, or must not be opened.
    #[error(transparent)]
    Usb(#[from] UsbError),
    /// The connection to the Falcon broke while the Falcon was made ready.
    #[error(transparent)]
    Transport(#[from] TransportError),
    /// The calibration of the Falcon in the scene is not valid.
    #[error(transparent)]
    Calibration(#[from] CalibrationError),
    /// The Falcon runs no firmware, and no file with firmware was given.
    #[error("it has no firmware yet: give the path of the one that came with it with --firmware FILE (docs/falcon.md)")]
    NoFirmware,
    /// The file with the firmware cannot be read.
    #[error(transparent)]
    Firmware(#[from] FirmwareError),
    /// The firmware cannot be loaded into the Falcon.
    #[error(transparent)]
    Boot(#[from] BootError),
    /// The driver of the Falcon cannot be opened, or the driver's thread cannot be started.
    #[error(transparent)]
    Start(#[from] StartError),
}

/// Falcons of a scene, each driven by a thread of its own.
#[derive(Debug)]
pub struct Falcons {
    /// Falcons not taken by the session yet, indexed by peer. `None` for peers of other kinds and for taken Falcons.
    devices: Vec<Option<AnyAttached>>,
    /// Stoppers of all opened Falcons. A stopper stays valid after the session has taken the device.
    stoppers: Vec<Stopper>,
}

/// Falcon with as many axes as the scene.
#[derive(Debug)]
enum AnyAttached {
    One(Attached<1>),
    Two(Attached<2>),
    Three(Attached<3>),
}

impl Falcons {
    /// Opens every Falcon of the scene. `firmware`: file with the firmware for Falcons that run no firmware. `wishes`: requests to the system for the thread of
    /// each Falcon. `progress` is called with the name of the peer and with the step, for steps that take time.
    ///
    /// # Errors
    ///
    /// [`FalconFault`] of the first unusable Falcon. The Falcons opened before are stopped in good order.
    pub fn open(scene: &Scene, firmware: Option<&Path>, wishes: Wishes, mut progress: impl FnMut(&str, Progress)) -> Result<Self, FalconFault> {
        let mut falcons = Self { devices: Vec::new(), stoppers: Vec::new() };
        let mut taken = Vec::new();
        for (place, peer) in scene.peers.iter().enumerate() {
            let PeerKind::Falcon(_, spec) = &peer.kind else {
                falcons.devices.push(None);
                continue;
            };
            // Each simulated Falcon has random numbers of its own, the same in every run of the scene.
            let seed = scene.seed.wrapping_add(place as u64);
            let opened = open(scene, peer, spec, seed, firmware, wishes, &mut taken, &mut |told| progress(&peer.name, told));
            let device = opened.map_err(|fault| FalconFault { peer: peer.name.clone(), fault })?;
            falcons.stoppers.push(device.stopper());
            falcons.devices.push(Some(device));
        }
        Ok(falcons)
    }

    /// Returns the readiness of each Falcon not taken by the session yet, with the index of the peer.
    pub fn readiness(&self) -> impl Iterator<Item = (usize, Readiness)> + '_ {
        self.devices.iter().enumerate().filter_map(|(place, device)| device.as_ref().map(|device| (place, device.readiness())))
    }

    /// Returns whether every simulated Falcon is ready. The hands home simulated Falcons within seconds. Real Falcons are not waited for: a real Falcon joins
    /// the session when ready.
    #[must_use]
    pub fn simulated_are_ready(&self) -> bool {
        self.readiness().all(|(_, readiness)| readiness.is_ready || !readiness.is_simulated)
    }

    /// Returns a stopper for each opened Falcon. A stopper switches all forces of the Falcon off, and can be used from any thread.
    #[must_use]
    pub fn stoppers(&self) -> Vec<Stopper> {
        self.stoppers.clone()
    }

    /// Removes the Falcon of a peer and returns the Falcon as the session's device. Returns `None` if the peer has no Falcon, or the Falcon was taken before.
    pub fn take(&mut self, peer: usize) -> Option<Box<dyn Device>> {
        Some(match self.devices.get_mut(peer)?.take()? {
            AnyAttached::One(device) => Box::new(device),
            AnyAttached::Two(device) => Box::new(device),
            AnyAttached::Three(device) => Box::new(device),
        })
    }
}

/// Opens the Falcon of a peer and starts the driving thread. `taken`: serial numbers of the real Falcons opened so far; the serial number of this Falcon is
/// added.
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
        // The hand's arm moves with the grip, so that the mechanics have the mass of both together.
        let mechanics = MechanicsConfig { mass: peer.device.mass + hand.mass(), damping: peer.device.damping, ..MechanicsConfig::DEFAULT };
        let config = SimulatorConfig { seed, running: true, mechanics, ..SimulatorConfig::default() };
        let transport = SimulatedTransport::in_real_time(Simulator::new(config, hand));
        return start(scene, transport, driver, wishes, Some(beginning));
    }
    let serial = match &spec.device {
        Which::Serial(serial) => Some(serial.clone()),
        // A simulated Falcon has been returned above.
        Which::First | Which::Simulated => first_free(taken)?,
    };
    let mut transport = UsbTransport::open(serial.as_deref())?;
    // Added only after the Falcon has been opened, so that a failure reserves no serial number.
    taken.extend(serial);
    let options = BootOptions::DEFAULT;
    // A file is not loaded again into a Falcon that already runs firmware.
    match firmware {
        Some(path) => {
            boot::ensure_loaded(&mut transport, &Firmware::read(path)?, &options, progress)?;
        }
        // Without a file, a Falcon must run firmware already, from an earlier run.
        None if boot::is_loaded(&mut transport, &options)? => {}
        None => return Err(FaultKind::NoFirmware),
    }
    start(scene, transport, driver, wishes, None)
}

/// Returns the serial number of the first listed Falcon without a peer. Returns `None` if every listed Falcon is taken or tells no serial number. Opening
/// without a serial number then takes the only connected Falcon, or reports the fault.
fn first_free(taken: &[String]) -> Result<Option<String>, UsbError> {
    let listed = cohaptic_falcon::usb::list()?;
    Ok(listed.into_iter().filter_map(|falcon| falcon.serial).find(|serial| !taken.contains(serial)))
}

/// Starts the driving thread of a Falcon, with as many axes as the scene.
fn start<T: Transport + Send + 'static>(
    scene: &Scene,
    transport: T,
    driver: DriverConfig,
    wishes: Wishes,
    beginning: Option<Beginning>,
) -> Result<AnyAttached, FaultKind> {
    // The axes of the scene are the first axes of the device.
    let all = [Axis::X, Axis::Y, Axis::Z];
    match scene.axes {
        cohaptic_scene::Axes::One => attach(transport, [all[0]], driver, wishes, beginning).map(AnyAttached::One),
        cohaptic_scene::Axes::Two => attach(transport, [all[0], all[1]], driver, wishes, beginning).map(AnyAttached::Two),
        cohaptic_scene::Axes::Three => attach(transport, all, driver, wishes, beginning).map(AnyAttached::Three),
    }
}

/// Starts the driving thread of a Falcon with `A` axes.
fn attach<const A: usize, T: Transport + Send + 'static>(
    transport: T,
    axes: [Axis; A],
    driver: DriverConfig,
    wishes: Wishes,
    beginning: Option<Beginning>,
) -> Result<Attached<A>, FaultKind> {
    let axes = Axes::new(axes).expect("no axis is named twice");
    let device = FalconDevice::start_with(transport, DeviceConfig { driver, ..DeviceConfig::new(axes) }, move || {
        // The report is dropped: a wish refused to this thread is also refused to the session's thread, and the session reports the refusal.
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

/// Time limit for the homing of simulated Falcons. Homing takes about a second; the limit allows for a busy machine.
pub const SIMULATED_HOMING: Duration = Duration::from_secs(60);
