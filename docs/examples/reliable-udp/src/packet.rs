//! What travels.

/// A message, on its way for the first time or again: `D`, transmission, message, bytes.
pub(crate) struct Data<'a> {
    pub(crate) transmission: u32,
    pub(crate) message: u32,
    pub(crate) bytes: &'a [u8],
}

/// That a transmission arrived: `A`, transmission.
pub(crate) struct Acknowledgement {
    pub(crate) transmission: u32,
}

impl<'a> Data<'a> {
    pub(crate) fn encode(&self) -> Vec<u8> {
        [b"D", &self.transmission.to_be_bytes()[..], &self.message.to_be_bytes(), self.bytes].concat()
    }

    pub(crate) fn decode(packet: &'a [u8]) -> Option<Self> {
        let (transmission, rest) = packet.strip_prefix(b"D")?.split_first_chunk()?;
        let (message, bytes) = rest.split_first_chunk()?;
        Some(Self { transmission: u32::from_be_bytes(*transmission), message: u32::from_be_bytes(*message), bytes })
    }
}

impl Acknowledgement {
    pub(crate) fn encode(&self) -> Vec<u8> {
        [b"A", &self.transmission.to_be_bytes()[..]].concat()
    }

    pub(crate) fn decode(packet: &[u8]) -> Option<Self> {
        let transmission = packet.strip_prefix(b"A")?.try_into().ok()?;
        Some(Self { transmission: u32::from_be_bytes(transmission) })
    }
}
