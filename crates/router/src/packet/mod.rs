//! Packets: as much of their headers as it takes to choose a link, and what a link may do to their bytes.
//!
//! ```text
//!   frame  │ Ethernet, VLAN tags │ IPv4 or IPv6 header, extensions │ ports … │ data │ padding │
//!          0                     ip                                transport        end
//! ```
//!
//! Nothing here believes what a packet says of itself: any bytes are read without a panic, and what makes no sense is [`Content::Malformed`].

mod checksum;
mod damage;
mod frame;
mod headers;

use cohaptic_units::Bytes;
use cohaptic_wan::{Damage, PacketInfo};

pub use headers::{Ecn, Headers, Malformed};

/// How the bytes of a device are framed.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Framing {
    /// Packets of IP, as from a TUN device.
    Ip,
    /// Frames of Ethernet.
    Ethernet,
}

/// A packet on its way, with all its bytes.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Packet {
    bytes: Vec<u8>,
    content: Content,
}

/// What a packet is.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Content {
    /// A packet of IP that begins at this byte.
    Ip {
        /// Its first byte.
        at: usize,
        /// What its headers say.
        headers: Headers,
    },
    /// A frame of Ethernet that carries something else, such as ARP.
    NotIp,
    /// It says that it is a packet of IP and is none.
    Malformed(Malformed),
}

impl Packet {
    /// Reads the headers of what a device gave. A checksum that the sender left to its network device, as Linux does on virtual devices, is computed.
    #[must_use]
    pub fn new(mut bytes: Vec<u8>, framing: Framing) -> Self {
        let at = match framing {
            Framing::Ip => Some(0),
            Framing::Ethernet => frame::network_layer(&bytes),
        };
        let Some(at) = at else { return Self { bytes, content: Content::NotIp } };
        let content = match Headers::read(&bytes[at..]) {
            Ok(headers) => {
                checksum::complete(&mut bytes[at..], &headers);
                Content::Ip { at, headers }
            }
            Err(malformed) => Content::Malformed(malformed),
        };
        Self { bytes, content }
    }

    /// What it is.
    #[must_use]
    pub const fn content(&self) -> &Content {
        &self.content
    }

    /// All its bytes, as they go to a device.
    #[must_use]
    pub fn bytes(&self) -> &[u8] {
        &self.bytes
    }

    /// What a link needs to know of it: the length of the packet of IP, without frame and padding, and whether its ends understand ECN.
    #[must_use]
    pub fn info(&self) -> PacketInfo {
        match &self.content {
            Content::Ip { headers, .. } => PacketInfo { size: Bytes::new(headers.length() as u64), ecn_capable: headers.ecn().is_capable() },
            Content::NotIp | Content::Malformed(_) => Bytes::new(self.bytes.len() as u64).into(),
        }
    }

    /// Says in its header that there was congestion (RFC 3168).
    pub fn mark_congestion(&mut self) {
        if let Content::Ip { at, headers } = &mut self.content {
            headers.mark_congestion(&mut self.bytes[*at..]);
        }
    }

    /// Flips bits of the packet of IP, counted from its first, and sets right the checksums that cover them, so that the damage is not found: see
    /// [`cohaptic_wan::Checksum::Passes`]. Bits beyond the end of the packet are left out.
    pub fn damage(&mut self, damage: &Damage) {
        if let Content::Ip { at, headers } = &self.content {
            let end = at + headers.length();
            damage::apply(&mut self.bytes[*at..end], headers, damage);
        }
    }
}
