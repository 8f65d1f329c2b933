//! Codepoints of explicit congestion notification.

/// Value of the two ECN bits of an IP header (RFC 3168, section 5).
#[derive(Clone, Copy, PartialEq, Eq, Hash, Default, Debug)]
pub enum Ecn {
    /// The transport does not use ECN (Not-ECT).
    #[default]
    NotCapable,
    /// The transport uses ECN, with the codepoint ECT(1): the sender answers to marks by a scalable congestion control (RFC 9331).
    Capable1,
    /// The transport uses ECN, with the codepoint ECT(0).
    Capable0,
    /// A router marked the packet instead of dropping the packet (CE).
    Congestion,
}

impl Ecn {
    /// Returns the two bits, 0 to 3.
    #[must_use]
    pub const fn bits(self) -> u8 {
        match self {
            Self::NotCapable => 0,
            Self::Capable1 => 1,
            Self::Capable0 => 2,
            Self::Congestion => 3,
        }
    }

    /// Returns the value of the low two bits. The other bits (the DSCP) are ignored.
    #[must_use]
    pub const fn from_bits(bits: u8) -> Self {
        match bits & 3 {
            1 => Self::Capable1,
            2 => Self::Capable0,
            3 => Self::Congestion,
            _ => Self::NotCapable,
        }
    }

    /// Returns whether a router may mark the packet in place of a drop: any codepoint but Not-ECT.
    #[must_use]
    pub const fn is_capable(self) -> bool {
        !matches!(self, Self::NotCapable)
    }
}
