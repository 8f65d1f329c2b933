//! Connection to a real device by `nusb`.
//!
//! This module was never tried on a Falcon, because no Falcon was available. It implements the interface with which the [driver](crate::driver) was tested on
//! the [simulator](crate::simulator).

use core::fmt;
use core::time::Duration;

use cohaptic_units::Instant;
use nusb::transfer::{Buffer, Bulk, Completion, ControlOut, ControlType, In, Out, Recipient, TransferError};
use nusb::{DeviceInfo, Endpoint, Interface, MaybeFuture};
use thiserror::Error;

use crate::clock::WallClock;
use crate::ftdi::{ENDPOINT_IN, ENDPOINT_OUT, INTERFACE, PACKET, PAYLOAD, PRODUCT, VENDOR, strip_status};
use crate::transport::{Fault, Operation, Request, Transport, TransportError};

/// Time after which a control transfer has failed.
const CONTROL_PATIENCE: Duration = Duration::from_millis(500);
/// Time after which a bulk transfer to the device has failed. Sixteen bytes take a tenth of a millisecond.
const WRITE_PATIENCE: Duration = Duration::from_millis(100);
/// Time for which a cancelled transfer may still be in progress.
const CANCEL_PATIENCE: Duration = Duration::from_secs(1);

/// A connected Falcon.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Listed {
    /// Serial number, if the system reports one.
    pub serial: Option<String>,
    /// Product name: `FALCON HAPTIC`, by published drivers.
    pub product: Option<String>,
    /// Name of the bus, as given by the system.
    pub bus: String,
    /// Address on the bus.
    pub address: u8,
}

impl fmt::Display for Listed {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { serial, product, bus, address } = self;
        let text = |text: &Option<String>| text.clone().unwrap_or_else(|| "unknown".to_owned());
        write!(f, "bus {bus} address {address}: {}, serial {}", text(product), text(serial))
    }
}

/// Returns the connected Falcons in the order of the system, without opening a device.
///
/// # Errors
///
/// [`UsbError::System`] if the system does not list its devices.
pub fn list() -> Result<Vec<Listed>, UsbError> {
    Ok(falcons()?.iter().map(listed).collect())
}

fn falcons() -> Result<Vec<DeviceInfo>, UsbError> {
    let devices = nusb::list_devices().wait().map_err(|error| UsbError::system("listing USB devices", error))?;
    Ok(devices.filter(|device| device.vendor_id() == VENDOR && device.product_id() == PRODUCT).collect())
}

fn listed(info: &DeviceInfo) -> Listed {
    Listed {
        serial: info.serial_number().map(str::to_owned),
        product: info.product_string().map(str::to_owned),
        bus: info.bus_id().to_owned(),
        address: info.device_address(),
    }
}

/// An opened device.
#[derive(Debug)]
pub struct UsbTransport {
    clock: WallClock,
    interface: Interface,
    output: Endpoint<Bulk, Out>,
    input: Endpoint<Bulk, In>,
    /// Buffer for writes; `None` while a write is in progress.
    written: Option<Buffer>,
    /// Payload of the newest packet, of which bytes `taken..count` are not read yet.
    payload: [u8; PAYLOAD],
    taken: usize,
    count: usize,
}

impl UsbTransport {
    /// Opens the Falcon with the serial number `serial`, or the only connected Falcon, and claims its interface.
    ///
    /// # Errors
    ///
    /// [`UsbError`] with a list of the connected Falcons, or with advice if the system refuses access.
    pub fn open(serial: Option<&str>) -> Result<Self, UsbError> {
        let mut found = falcons()?;
        if let Some(serial) = serial {
            // The list for the error message contains all Falcons, so it is made before the filter.
            let others = found.iter().map(listed).collect();
            found.retain(|info| info.serial_number() == Some(serial));
            if found.is_empty() {
                return Err(UsbError::NoSuchSerial { serial: serial.to_owned(), others });
            }
        }
        match found.as_slice() {
            [] => Err(UsbError::NoDevice),
            [info] => Self::of(info),
            several => Err(UsbError::Several(several.iter().map(listed).collect())),
        }
    }

    fn of(info: &DeviceInfo) -> Result<Self, UsbError> {
        let device = info.open().wait().map_err(|error| UsbError::system("opening the device", error))?;
        let interface = device.detach_and_claim_interface(INTERFACE).wait().map_err(|error| UsbError::system("claiming the interface", error))?;
        let output = interface.endpoint(ENDPOINT_OUT).map_err(|error| UsbError::system("opening the endpoint out", error))?;
        let mut input: Endpoint<Bulk, In> = interface.endpoint(ENDPOINT_IN).map_err(|error| UsbError::system("opening the endpoint in", error))?;
        // One transfer from the device is always submitted. The chip buffers bytes that arrive between two transfers.
        input.submit(Buffer::new(PACKET));
        let written = Some(Buffer::new(PACKET));
        Ok(Self { clock: WallClock::new(), interface, output, input, written, payload: [0; PAYLOAD], taken: 0, count: 0 })
    }

    /// Takes in a packet, and submits the next transfer.
    fn take_in(&mut self, completion: Completion) -> Result<(), TransportError> {
        let Completion { mut buffer, actual_len, status } = completion;
        let outcome = status.map_err(|error| transport_error(Operation::Read, error));
        if outcome.is_ok() {
            let arrived = buffer.get(..actual_len.min(buffer.len())).unwrap_or(&[]);
            // A bulk transfer has the length of one packet, so its payload fits.
            self.count = strip_status(arrived, &mut self.payload);
            self.taken = 0;
        }
        // After a failed transfer the next one may succeed; only an unplugged device needs no new transfer.
        if outcome != Err(TransportError::Unplugged) {
            buffer.clear();
            buffer.set_requested_len(PACKET);
            self.input.submit(buffer);
        }
        outcome
    }
}

impl Transport for UsbTransport {
    fn now(&self) -> Instant {
        self.clock.now()
    }

    fn sleep_until(&mut self, until: Instant) {
        self.clock.sleep_until(until);
    }

    fn control(&mut self, request: Request, value: u16) -> Result<(), TransportError> {
        if request == Request::Reset {
            // Payload buffered here would otherwise survive the purge of the chip.
            (self.taken, self.count) = (0, 0);
        }
        let setup =
            ControlOut { control_type: ControlType::Vendor, recipient: Recipient::Device, request: request.number(), value, index: 0, data: &[] };
        self.interface.control_out(setup, CONTROL_PATIENCE).wait().map_err(|error| transport_error(Operation::Control, error))
    }

    fn write(&mut self, bytes: &[u8]) -> Result<(), TransportError> {
        for piece in bytes.chunks(PACKET) {
            let mut buffer = self.written.take().unwrap_or_else(|| Buffer::new(PACKET));
            buffer.clear();
            buffer.extend_from_slice(piece);
            self.output.submit(buffer);
            let mut timed_out = false;
            // A cancelled transfer still completes, and only its completion returns the buffer.
            let completion = self.output.wait_next_complete(WRITE_PATIENCE).or_else(|| {
                timed_out = true;
                self.output.cancel_all();
                self.output.wait_next_complete(CANCEL_PATIENCE)
            });
            let failed = |fault| TransportError::Io { during: Operation::Write, fault };
            let Some(Completion { buffer, actual_len, status }) = completion else {
                return Err(failed(Fault::TimedOut));
            };
            self.written = Some(buffer);
            status.map_err(|error| transport_error(Operation::Write, error))?;
            // A cancelled transfer may have sent a part. The driver counts this as a fault and sends a new packet.
            if timed_out || actual_len != piece.len() {
                return Err(failed(Fault::TimedOut));
            }
        }
        Ok(())
    }

    fn read(&mut self, into: &mut [u8], patience: Duration) -> Result<usize, TransportError> {
        // Buffered payload is returned first; only an empty buffer waits for a packet.
        if self.taken == self.count {
            match self.input.wait_next_complete(patience) {
                Some(completion) => self.take_in(completion)?,
                None => return Ok(0),
            }
        }
        let rest = &self.payload[self.taken..self.count];
        let count = rest.len().min(into.len());
        into[..count].copy_from_slice(&rest[..count]);
        self.taken += count;
        Ok(count)
    }
}

fn transport_error(during: Operation, error: TransferError) -> TransportError {
    let fault = match error {
        TransferError::Disconnected => return TransportError::Unplugged,
        TransferError::Cancelled => Fault::TimedOut,
        TransferError::Stall => Fault::Stalled,
        TransferError::Fault => Fault::Wire,
        TransferError::InvalidArgument => Fault::Refused,
        TransferError::Unknown(code) => Fault::Other(code),
    };
    TransportError::Io { during, fault }
}

/// Reason why no device could be opened.
#[derive(Clone, Debug, Error)]
#[expect(missing_docs, reason = "the messages describe the variants")]
#[non_exhaustive]
pub enum UsbError {
    #[error("no Novint Falcon (USB 0403:cb48) is plugged in: check the cable and the power supply")]
    NoDevice,
    #[error("no Falcon has the serial number {serial:?}; there are: {}", names(others))]
    NoSuchSerial { serial: String, others: Vec<Listed> },
    #[error("several Falcons are plugged in: name one by its serial number. There are: {}", names(.0))]
    Several(Vec<Listed>),
    #[error("{doing} failed: {error}{}", advice(error.kind()))]
    System { doing: &'static str, error: nusb::Error },
}

impl UsbError {
    const fn system(doing: &'static str, error: nusb::Error) -> Self {
        Self::System { doing, error }
    }
}

fn names(listed: &[Listed]) -> String {
    if listed.is_empty() {
        return "none".to_owned();
    }
    listed.iter().map(Listed::to_string).collect::<Vec<_>>().join("; ")
}

const fn advice(kind: nusb::ErrorKind) -> &'static str {
    match kind {
        nusb::ErrorKind::PermissionDenied => ": a udev rule must give you the right to it, see docs/falcon.md",
        nusb::ErrorKind::Busy => ": another program has it, close that first",
        nusb::ErrorKind::Disconnected => ": it was unplugged",
        nusb::ErrorKind::NotFound | nusb::ErrorKind::Unsupported | nusb::ErrorKind::Other | _ => "",
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_unplugged_device_is_told_from_a_failed_transfer() {
        assert_eq!(transport_error(Operation::Read, TransferError::Disconnected), TransportError::Unplugged);
        for error in
            [TransferError::Cancelled, TransferError::Stall, TransferError::Fault, TransferError::InvalidArgument, TransferError::Unknown(71)]
        {
            assert!(matches!(transport_error(Operation::Write, error), TransportError::Io { during: Operation::Write, .. }));
        }
    }

    #[test]
    fn errors_name_what_there_is() {
        let one = Listed { serial: Some("AB12".to_owned()), product: None, bus: "001".to_owned(), address: 7 };
        // The message lists the connected device, so that the user can copy its serial number.
        let text = UsbError::NoSuchSerial { serial: "XY".to_owned(), others: vec![one.clone()] }.to_string();
        assert!(text.contains("\"XY\"") && text.contains("bus 001 address 7: unknown, serial AB12"), "{text}");
        assert!(UsbError::Several(vec![one.clone(), one]).to_string().contains("serial number"));
    }
}
