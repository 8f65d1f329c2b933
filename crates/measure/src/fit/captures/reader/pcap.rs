//! Reads pcap files (draft-ietf-opsawg-pcap), also in the older forms read by libpcap.

use std::io::Read;

use super::{CaptureProblem, Ending, Frame, LONGEST_BLOCK, Order, Source, without_check};

/// Form of a file, recognised by its first four octets.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) struct Format {
    order: Order,
    /// Nanoseconds per unit of the second number of a timestamp.
    unit_nanos: i128,
    /// Length of a frame's header \[byte\].
    header: usize,
}

impl Format {
    /// Recognises the form of a file by its first four octets; `None` for another kind of file.
    pub(super) const fn of(magic: [u8; 4]) -> Option<Self> {
        let big = u32::from_be_bytes(magic);
        let order = match big {
            0xA1B2_C3D4 | 0xA1B2_3C4D | 0xA1B2_CD34 => Order::Big,
            _ => Order::Little,
        };
        match if matches!(order, Order::Big) { big } else { big.swap_bytes() } {
            0xA1B2_C3D4 => Some(Self { order, unit_nanos: 1_000, header: 16 }),
            0xA1B2_3C4D => Some(Self { order, unit_nanos: 1, header: 16 }),
            // The "modified" format of an old libpcap patch: the lengths are followed by index, protocol and type of the packet.
            0xA1B2_CD34 => Some(Self { order, unit_nanos: 1_000, header: 24 }),
            _ => None,
        }
    }
}

/// Reads the file after its first four octets.
pub(super) fn read(mut source: Source<impl Read>, format: Format, mut each: impl FnMut(Frame<'_>)) -> Result<Ending, CaptureProblem> {
    let order = format.order;
    let Some(rest) = source.array::<20>()? else { return Err(CaptureProblem::CutOff) };
    let (major, minor) = (order.half(&rest, 0).unwrap_or(0), order.half(&rest, 2).unwrap_or(0));
    let network = order.word(&rest, 16).unwrap_or(0);
    // The link type has 16 bits. The upper bits have a flag for a frame check sequence, and its length in units of 16 bits.
    let check = if network & 0x0400_0000 == 0 { 0 } else { 2 * usize::try_from(network >> 28).unwrap_or(0) };
    let link_type = u16::try_from(network & 0xFFFF).unwrap_or(0);
    let (mut header, mut data) = (Vec::new(), Vec::new());
    loop {
        if !source.fill(&mut header, format.header)? {
            return Ok(if header.is_empty() { Ending::Whole } else { Ending::CutOff });
        }
        let number = |at| order.word(&header, at).unwrap_or(0);
        let (mut captured, mut length) = (number(8), number(12));
        // As in libpcap: before version 2.3 the two lengths had the other order, and some programs kept that order in version 2.3.
        if (major, minor) < (2, 3) || major == 543 || ((major, minor) == (2, 3) && captured > length) {
            (captured, length) = (length, captured);
        }
        if captured > LONGEST_BLOCK {
            return Err(CaptureProblem::Malformed);
        }
        if !source.fill(&mut data, usize::try_from(captured).unwrap_or(usize::MAX))? {
            return Ok(Ending::CutOff);
        }
        let nanos = i128::from(number(0)) * 1_000_000_000 + i128::from(number(4)) * format.unit_nanos;
        let (data, length) = without_check(&data, length, check);
        each(Frame { nanos: Some(nanos), link_type, interface: 0, data, length });
    }
}
