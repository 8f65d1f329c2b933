//! How the FT232R serial chip of the device is set up, and what it puts before the bytes.

use core::time::Duration;

use crate::transport::{Request, Transport, TransportError};

/// Vendor of the chip.
pub const VENDOR: u16 = 0x0403;
/// Product number that Novint gave to the Falcon.
pub const PRODUCT: u16 = 0xCB48;
/// The interface that is claimed.
pub const INTERFACE: u8 = 0;
/// Bulk endpoint to the device.
pub const ENDPOINT_OUT: u8 = 0x02;
/// Bulk endpoint from the device.
pub const ENDPOINT_IN: u8 = 0x81;
/// A packet of the bulk endpoint \[bytes\].
pub const PACKET: usize = 64;
/// The status bytes at the beginning of every packet from the device.
pub const STATUS: usize = 2;
/// Payload of a full packet \[bytes\].
pub const PAYLOAD: usize = PACKET - STATUS;

/// Forgets what came from the device.
pub const PURGE_RX: u16 = 1;
/// Forgets what was to go to the device.
pub const PURGE_TX: u16 = 2;
/// DTR down.
pub const DTR_LOW: u16 = 0x0100;
/// DTR up.
pub const DTR_HIGH: u16 = 0x0101;
/// RTS down.
pub const RTS_LOW: u16 = 0x0200;
/// Eight bits, no parity, one stop bit.
pub const FORMAT_8N1: u16 = 0x0008;
/// No flow control.
pub const NO_FLOW_CONTROL: u16 = 0;
/// Divisor of 9,600 baud: the boot loader's handshake.
pub const BAUD_HANDSHAKE: u16 = 0x4138;
/// Divisor of 142,857 baud: the firmware goes over at this speed. Existing drivers ask for 140,000.
pub const BAUD_LOADING: u16 = 0x0015;
/// Divisor of 1.5 million baud: the running firmware.
pub const BAUD_RUNNING: u16 = 0x0002;

/// Sets the chip up for the running firmware: 1.5 million baud, and no byte waits longer than 1 ms.
///
/// # Errors
///
/// [`TransportError`].
pub fn set_up_running<T: Transport + ?Sized>(transport: &mut T) -> Result<(), TransportError> {
    transport.control(Request::LatencyTimer, 1)?;
    transport.control(Request::BaudRate, BAUD_RUNNING)?;
    transport.control(Request::Reset, PURGE_RX)?;
    transport.control(Request::Reset, PURGE_TX)
}

/// Sets the chip up for the boot loader, and wakes it with a pulse of DTR.
///
/// # Errors
///
/// [`TransportError`].
pub fn set_up_handshake<T: Transport + ?Sized>(transport: &mut T) -> Result<(), TransportError> {
    transport.control(Request::Reset, PURGE_RX)?;
    transport.control(Request::Reset, PURGE_TX)?;
    // With 1 ms, the echo of the firmware comes in pieces, and checks of existing drivers tend to fail.
    transport.control(Request::LatencyTimer, 16)?;
    transport.control(Request::BaudRate, BAUD_HANDSHAKE)?;
    transport.control(Request::DataFormat, FORMAT_8N1)?;
    transport.control(Request::FlowControl, NO_FLOW_CONTROL)?;
    transport.control(Request::ModemControl, RTS_LOW)?;
    transport.control(Request::ModemControl, DTR_LOW)?;
    transport.control(Request::ModemControl, DTR_HIGH)
}

/// Sets the chip up for the firmware itself, after the handshake.
///
/// # Errors
///
/// [`TransportError`].
pub fn set_up_loading<T: Transport + ?Sized>(transport: &mut T) -> Result<(), TransportError> {
    transport.control(Request::ModemControl, DTR_LOW)?;
    transport.control(Request::BaudRate, BAUD_LOADING)
}

/// How long a byte takes on the wire, with start and stop bit, at a divisor of the chip's 3 MHz. The upper two bits of the divisor are eighths; 2 stands for 1.5 million baud.
#[must_use]
pub const fn byte_time(divisor: u16) -> Duration {
    // Sub-divisor codes 0, 1, 2, 3 are 0, 1/2, 1/4, 1/8.
    let eighths = match divisor >> 14 {
        0 => 0,
        1 => 4,
        2 => 2,
        _ => 1,
    };
    let eighths = (divisor & 0x3FFF) as u64 * 8 + eighths;
    // Ten bits of eighths/8 periods of 3 MHz.
    Duration::from_nanos(eighths * 10 * 1_000_000 / (8 * 3_000))
}

/// Copies the payload of what a bulk transfer gave, packet by packet, without the two status bytes of each. Gives how many bytes that were; what does
/// not fit is left out.
pub fn strip_status(transfer: &[u8], into: &mut [u8]) -> usize {
    let mut count = 0;
    for packet in transfer.chunks(PACKET) {
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
        // 16 bytes take 107 us.
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
