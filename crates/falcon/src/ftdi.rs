//! Setup of the device's FT232R serial chip, and removal of the chip's status bytes.

use core::time::Duration;

use crate::transport::{Request, Transport, TransportError};

/// USB vendor number of the chip.
pub(crate) const VENDOR: u16 = 0x0403;
/// USB product number that Novint gave to the Falcon.
pub(crate) const PRODUCT: u16 = 0xCB48;
/// Number of the USB interface to claim.
pub(crate) const INTERFACE: u8 = 0;
/// Bulk endpoint to the device.
pub(crate) const ENDPOINT_OUT: u8 = 0x02;
/// Bulk endpoint from the device.
pub(crate) const ENDPOINT_IN: u8 = 0x81;
/// Length of a packet of the bulk endpoint \[bytes\].
pub const PACKET: usize = 64;
/// Number of status bytes at the beginning of every packet from the device.
pub const STATUS: usize = 2;
/// Payload of a full packet \[bytes\].
pub(crate) const PAYLOAD: usize = PACKET - STATUS;

/// Value of a reset that discards bytes from the device.
pub(crate) const PURGE_RX: u16 = 1;
/// Value of a reset that discards bytes to the device.
pub(crate) const PURGE_TX: u16 = 2;
/// Value that lowers DTR.
pub(crate) const DTR_LOW: u16 = 0x0100;
/// Value that raises DTR.
pub(crate) const DTR_HIGH: u16 = 0x0101;
/// Value that lowers RTS.
pub(crate) const RTS_LOW: u16 = 0x0200;
/// Eight bits, no parity, one stop bit.
pub(crate) const FORMAT_8N1: u16 = 0x0008;
/// No flow control.
pub(crate) const NO_FLOW_CONTROL: u16 = 0;
/// Divisor of 9,600 baud, for the greeting of the boot loader.
pub(crate) const BAUD_HANDSHAKE: u16 = 0x4138;
/// Divisor of 142,857 baud, for the transfer of the firmware. Existing drivers ask for 140,000.
pub const BAUD_LOADING: u16 = 0x0015;
/// Divisor of 1.5 million baud, for the running firmware.
pub const BAUD_RUNNING: u16 = 0x0002;

/// Sets up the chip for the running firmware: 1.5 million baud, and a latency timer of 1 ms.
///
/// # Errors
///
/// [`TransportError`] of a control transfer.
pub(crate) fn set_up_running<T: Transport + ?Sized>(transport: &mut T) -> Result<(), TransportError> {
    transport.control(Request::LatencyTimer, 1)?;
    transport.control(Request::BaudRate, BAUD_RUNNING)?;
    transport.control(Request::Reset, PURGE_RX)?;
    transport.control(Request::Reset, PURGE_TX)
}

/// Sets up the chip for the boot loader, and wakes the boot loader with a pulse of DTR.
///
/// # Errors
///
/// [`TransportError`] of a control transfer.
pub(crate) fn set_up_handshake<T: Transport + ?Sized>(transport: &mut T) -> Result<(), TransportError> {
    transport.control(Request::Reset, PURGE_RX)?;
    transport.control(Request::Reset, PURGE_TX)?;
    // With a latency timer of 1 ms the echo of the firmware comes in pieces, and checks of existing drivers tend to fail.
    transport.control(Request::LatencyTimer, 16)?;
    transport.control(Request::BaudRate, BAUD_HANDSHAKE)?;
    transport.control(Request::DataFormat, FORMAT_8N1)?;
    transport.control(Request::FlowControl, NO_FLOW_CONTROL)?;
    transport.control(Request::ModemControl, RTS_LOW)?;
    transport.control(Request::ModemControl, DTR_LOW)?;
    transport.control(Request::ModemControl, DTR_HIGH)
}

/// Sets up the chip for the transfer of the firmware, after the greeting.
///
/// # Errors
///
/// [`TransportError`] of a control transfer.
pub(crate) fn set_up_loading<T: Transport + ?Sized>(transport: &mut T) -> Result<(), TransportError> {
    transport.control(Request::ModemControl, DTR_LOW)?;
    transport.control(Request::BaudRate, BAUD_LOADING)
}

/// Returns the time of a byte on the wire, with start and stop bit, at a divisor of the chip's 3 MHz. The upper two bits of the divisor are eighths; the
/// divisor 2 means 1.5 million baud.
#[must_use]
pub(crate) const fn byte_time(divisor: u16) -> Duration {
    // The sub-divisor codes 0, 1, 2, 3 mean 0, 1/2, 1/4, 1/8.
    let eighths = match divisor >> 14 {
        0 => 0,
        1 => 4,
        2 => 2,
        _ => 1,
    };
    let eighths = (divisor & 0x3FFF) as u64 * 8 + eighths;
    // A byte has ten bits, and a bit lasts eighths/8 periods of 3 MHz.
    Duration::from_nanos(eighths * 10 * 1_000_000 / (8 * 3_000))
}

/// Copies the payload of a bulk transfer into `into`, packet by packet, without the two status bytes of each packet. Returns the number of copied bytes.
/// Payload beyond the room in `into` is lost.
pub(crate) fn strip_status(transfer: &[u8], into: &mut [u8]) -> usize {
    let mut count = 0;
    for packet in transfer.chunks(PACKET) {
        // A packet shorter than its status bytes has no payload.
        for byte in packet.iter().skip(STATUS) {
            if let Some(place) = into.get_mut(count) {
                *place = *byte;
                count += 1;
            }
        }
    }
    count
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn speeds_of_the_design_page() {
        assert_eq!(byte_time(BAUD_HANDSHAKE), Duration::from_nanos(1_041_666));
        assert_eq!(byte_time(BAUD_LOADING), Duration::from_micros(70));
        // A packet of 16 bytes takes 107 us.
        assert_eq!(byte_time(BAUD_RUNNING) * 16, Duration::from_nanos(106_656));
    }

    #[test]
    fn status_bytes_go_from_every_packet() {
        let mut into = [0; 124];
        assert_eq!(strip_status(&[1, 96], &mut into), 0);
        assert_eq!(strip_status(&[1, 96, 7, 8], &mut into), 2);
        assert_eq!(into[..2], [7, 8]);
        let two: Vec<u8> = [vec![1, 96], vec![5; 62], vec![1, 96, 6]].concat();
        assert_eq!(strip_status(&two, &mut into), 63);
        assert_eq!(into[..63], [vec![5; 62], vec![6]].concat());
        assert_eq!(strip_status(&[9], &mut into), 0);
        assert_eq!(strip_status(&[], &mut into), 0);
    }
}
