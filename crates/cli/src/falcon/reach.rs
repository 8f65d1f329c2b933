//! Selects a device by the arguments, opens the device, and loads its firmware.
//!
//! The result is an [`AnyTransport`] with running firmware, which [`Bench`](super::bench::Bench) takes.

use std::fmt;
use std::path::Path;
use std::time::Duration;

use cohaptic_falcon::boot::{self, BootOptions, Firmware, FirmwareError, Progress};
use cohaptic_falcon::simulator::{SimulatedTransport, Simulator, SimulatorConfig, Waypoints};
use cohaptic_falcon::transport::{Request, Transport, TransportError};
use cohaptic_falcon::usb::{self, Listed, UsbError, UsbTransport};
use cohaptic_units::Instant;

use super::loading;
use crate::arguments::WhichFalcon;
use crate::failure::Failure;
use crate::progress::Progress as Bar;
use crate::realtime::say;

/// Amplitudes \[m\] and frequency \[Hz\] of the swaying simulated hand.
pub(super) const SWAY: ([f64; 3], f64) = ([0.020, 0.015, 0.010], 0.5);

/// A selected device.
#[derive(Clone, Debug)]
pub(super) enum Target {
    Usb(Listed),
    Simulated {
        in_virtual_time: bool,
        /// `true` if the device begins without firmware, as a real device does after it is switched on.
        switched_on: bool,
    },
}

/// Origin of the firmware that runs in a device: running before the command, or loaded by the command.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum FirmwareState {
    Running,
    Loaded,
}

/// Returns the selected devices, at least one. No connected device, or no device with the serial number, is a failure.
pub(super) fn targets(which: &WhichFalcon) -> Result<Vec<Target>, Failure> {
    if which.simulated {
        // With a firmware file the simulated device begins without firmware, so that the command loads the file.
        return Ok(vec![Target::Simulated { in_virtual_time: which.virtual_time, switched_on: which.firmware.is_some() }]);
    }
    let all = usb::list().map_err(|error| of_usb(&error))?;
    Ok(meant(all, which.serial.as_deref()).map_err(|error| of_usb(&error))?.into_iter().map(Target::Usb).collect())
}

/// Returns the devices with the serial number `serial`, or all devices without `serial`. An empty result is an error.
fn meant(all: Vec<Listed>, serial: Option<&str>) -> Result<Vec<Listed>, UsbError> {
    let Some(serial) = serial else { return if all.is_empty() { Err(UsbError::NoDevice) } else { Ok(all) } };
    let meant: Vec<Listed> = all.iter().filter(|listed| listed.serial.as_deref() == Some(serial)).cloned().collect();
    // The error lists the connected devices, so that the user can choose another serial number.
    if meant.is_empty() { Err(UsbError::NoSuchSerial { serial: serial.to_owned(), others: all }) } else { Ok(meant) }
}

/// Returns the only selected device. Several devices are a failure with a list of the devices.
pub(super) fn target(which: &WhichFalcon) -> Result<Target, Failure> {
    let mut all = targets(which)?;
    if all.len() > 1 {
        // Several devices are USB devices: there is at most one simulated device.
        let listed = all.into_iter().filter_map(|target| if let Target::Usb(listed) = target { Some(listed) } else { None }).collect();
        return Err(of_usb(&UsbError::Several(listed)));
    }
    all.pop().ok_or_else(|| of_usb(&UsbError::NoDevice))
}

/// Converts an error of USB to a failure, with a hint about where to look next.
fn of_usb(error: &UsbError) -> Failure {
    let where_to_look = match error {
        UsbError::NoDevice => ". `lsusb -d 0403:cb48` shows whether the system sees it; docs/falcon.md says what else to look at",
        UsbError::System { .. } => ". `lsusb` shows whether this machine has USB at all",
        UsbError::NoSuchSerial { .. } | UsbError::Several(_) | _ => "",
    };
    Failure::System(format!("{error}{where_to_look}"))
}

impl Target {
    pub(super) const fn is_simulated(&self) -> bool {
        matches!(self, Self::Simulated { .. })
    }

    pub(super) const fn listed(&self) -> Option<&Listed> {
        match self {
            Self::Usb(listed) => Some(listed),
            Self::Simulated { .. } => None,
        }
    }

    /// Returns the name of the device in texts for people.
    pub(super) fn name(&self) -> String {
        self.listed().map_or_else(|| "simulated Falcon".to_owned(), Listed::to_string)
    }

    /// Opens the transport to the device: the USB device itself, or a new simulated device whose hand homes and then sways.
    pub(super) fn open(&self) -> Result<AnyTransport, UsbError> {
        match self {
            Self::Usb(listed) => UsbTransport::open(listed.serial.as_deref()).map(AnyTransport::new),
            Self::Simulated { in_virtual_time, switched_on } => {
                // A fixed seed gives the same simulated device on every run.
                let config = SimulatorConfig { running: !switched_on, seed: 1, ..SimulatorConfig::default() };
                let hand = Waypoints::homing(Duration::ZERO).swaying(SWAY.0, SWAY.1);
                let simulator = Simulator::new(config, hand);
                let transport =
                    if *in_virtual_time { SimulatedTransport::in_virtual_time(simulator) } else { SimulatedTransport::in_real_time(simulator) };
                Ok(AnyTransport::new(transport))
            }
        }
    }
}

/// Reads the firmware file of `--firmware`. Called before any device is opened, so that a wrong file leaves every device unchanged.
pub(super) fn read_firmware(path: Option<&Path>) -> Result<Option<Firmware>, Failure> {
    let Some(path) = path else { return Ok(None) };
    Firmware::read(path).map(Some).map_err(|error| match error {
        // An unreadable file and a wrong file have different exit statuses.
        FirmwareError::Read { path, error } => Failure::File { verb: "read", path, error },
        error @ (FirmwareError::Length { .. } | _) => Failure::Input(format!("{}: {error}", path.display())),
    })
}

/// Makes sure that the device runs firmware: checks a device without `firmware`, and loads `firmware` into a device without running firmware.
///
/// The error is the obstacle in words, for the user.
pub(super) fn make_ready(way: &mut AnyTransport, firmware: Option<&Firmware>) -> Result<FirmwareState, String> {
    let options = BootOptions::DEFAULT;
    // Without a firmware file the command can only ask the device for an answer.
    let Some(firmware) = firmware else {
        let runs = boot::is_loaded(way, &options).map_err(|error| error.to_string())?;
        let missing = "it does not answer: it has no firmware yet, or no power. Give the path of the firmware that came with it with --firmware FILE";
        return if runs { Ok(FirmwareState::Running) } else { Err(format!("{missing} (docs/falcon.md)")) };
    };
    let bar = Bar::new(firmware.bytes().len() as u64, "loading {bar:30} {percent:>3} %  {pos}/{len} bytes");
    let outcome = boot::ensure_loaded(way, firmware, &options, &mut |progress| {
        if let Progress::Loaded { done, .. } = progress {
            bar.reach_number(done as u64);
        }
        // Events other than single blocks of bytes are printed as lines above the bar.
        if let Some(said) = loading(progress) {
            bar.aside(|| say(&said));
        }
    });
    bar.clear();
    outcome.map(|loaded| if loaded { FirmwareState::Loaded } else { FirmwareState::Running }).map_err(|error| error.to_string())
}

/// A transport over USB or to a simulated device, boxed, so that the code after this module has one type for both.
pub(super) struct AnyTransport(Box<dyn Transport>);

impl AnyTransport {
    pub(super) fn new(transport: impl Transport + 'static) -> Self {
        Self(Box::new(transport))
    }
}

impl Transport for AnyTransport {
    fn now(&self) -> Instant {
        self.0.now()
    }

    fn sleep_until(&mut self, until: Instant) {
        self.0.sleep_until(until);
    }

    fn control(&mut self, request: Request, value: u16) -> Result<(), TransportError> {
        self.0.control(request, value)
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), TransportError> {
        self.0.write(bytes)
    }

    fn read(&mut self, into: &mut [u8], patience: Duration) -> Result<usize, TransportError> {
        self.0.read(into, patience)
    }
}

impl fmt::Debug for AnyTransport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("Way").field("now", &self.now()).finish_non_exhaustive()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn listed(serial: Option<&str>) -> Listed {
        Listed { serial: serial.map(str::to_owned), product: Some("FALCON HAPTIC".to_owned()), bus: "003".to_owned(), address: 4 }
    }

    fn said(error: &UsbError) -> String {
        let failure = of_usb(error);
        let Failure::System(said) = failure else { panic!("{failure:?}") };
        said
    }

    #[test]
    fn none_is_said_with_what_to_look_at() {
        let none = said(&meant(Vec::new(), None).unwrap_err());
        assert!(["no Novint Falcon", "0403:cb48", "power supply", "lsusb", "docs/falcon.md"].iter().all(|part| none.contains(part)), "{none}");
        let other = said(&meant(Vec::new(), Some("A1")).unwrap_err());
        assert!(other.contains("\"A1\"") && other.ends_with("there are: none"), "{other}");
    }

    #[test]
    fn all_are_meant_unless_one_is_named() {
        let all = vec![listed(Some("A1")), listed(None), listed(Some("B2"))];
        assert_eq!(meant(all.clone(), None).unwrap(), all);
        assert_eq!(meant(all.clone(), Some("B2")).unwrap(), [listed(Some("B2"))]);
        assert!(said(&meant(all, Some("C3")).unwrap_err()).contains("bus 003 address 4: FALCON HAPTIC, serial A1"));
    }
}
