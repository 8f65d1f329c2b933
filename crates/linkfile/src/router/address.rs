//! Networks: addresses with the length of a prefix, such as `10.1.0.1/24` and `fd00::/64`.

use core::fmt;
use core::net::{IpAddr, Ipv4Addr, Ipv6Addr};
use core::str::FromStr;

/// Address with the length of a prefix. The leading bits up to this length identify the network.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Debug)]
pub struct Network {
    /// Address as given, including the bits after the prefix.
    address: IpAddr,
    /// Length of the prefix \[bits\], at most the length of the address.
    prefix: u8,
}

impl Network {
    /// Returns an address with the length of its prefix, or `None` for a prefix that is longer than the address.
    #[must_use]
    pub const fn new(address: IpAddr, prefix: u8) -> Option<Self> {
        let most = if address.is_ipv4() { 32 } else { 128 };
        if prefix > most { None } else { Some(Self { address, prefix }) }
    }

    /// Returns the address as given, including the bits after the prefix.
    #[must_use]
    pub const fn address(self) -> IpAddr {
        self.address
    }

    /// Returns the length of the prefix \[bits\].
    #[must_use]
    pub const fn prefix(self) -> u8 {
        self.prefix
    }

    /// Returns whether an address lies in this network. An address of the other family never does.
    #[must_use]
    pub fn contains(self, address: IpAddr) -> bool {
        match (self.address, address) {
            (IpAddr::V4(own), IpAddr::V4(other)) => {
                // A prefix of 0 bits shifts by the whole width. `checked_shl` returns `None` then, and the mask is 0.
                let mask = u32::MAX.checked_shl(32 - u32::from(self.prefix)).unwrap_or(0);
                // Addresses of the same network differ only outside the mask.
                (Ipv4Addr::to_bits(own) ^ Ipv4Addr::to_bits(other)) & mask == 0
            }
            (IpAddr::V6(own), IpAddr::V6(other)) => {
                let mask = u128::MAX.checked_shl(128 - u32::from(self.prefix)).unwrap_or(0);
                (Ipv6Addr::to_bits(own) ^ Ipv6Addr::to_bits(other)) & mask == 0
            }
            (IpAddr::V4(_), IpAddr::V6(_)) | (IpAddr::V6(_), IpAddr::V4(_)) => false,
        }
    }
}

impl fmt::Display for Network {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.address, self.prefix)
    }
}

/// Error: a text is no address, or the prefix is no number or too long.
#[derive(Clone, Copy, PartialEq, Eq, Debug, thiserror::Error)]
#[error("no address: expected one with a prefix such as \"10.1.0.1/24\" or \"fd00::1/64\"")]
pub struct NoNetwork;

impl FromStr for Network {
    type Err = NoNetwork;

    /// Parses an address with or without a prefix. Without a prefix, all bits of the address are the prefix.
    fn from_str(text: &str) -> Result<Self, NoNetwork> {
        let (address, prefix) = match text.split_once('/') {
            Some((address, prefix)) => (address, Some(prefix)),
            None => (text, None),
        };
        let address: IpAddr = address.parse().map_err(|_| NoNetwork)?;
        let prefix = match prefix {
            // `parse` also takes a sign, so the digits are checked here.
            Some(digits) if digits.bytes().all(|byte| byte.is_ascii_digit()) => digits.parse().map_err(|_| NoNetwork)?,
            Some(_) => return Err(NoNetwork),
            None if address.is_ipv4() => 32,
            None => 128,
        };
        Self::new(address, prefix).ok_or(NoNetwork)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn contains(network: &str, address: &str) -> bool {
        network.parse::<Network>().unwrap().contains(address.parse().unwrap())
    }

    #[test]
    fn a_prefix_decides_and_the_rest_does_not() {
        assert!(contains("10.1.0.1/24", "10.1.0.255"));
        assert!(!contains("10.1.0.1/24", "10.1.1.0"));
        assert!(contains("10.1.0.1", "10.1.0.1"));
        assert!(!contains("10.1.0.1", "10.1.0.0"));
        assert!(contains("0.0.0.0/0", "255.255.255.255"));
        assert!(contains("128.0.0.0/1", "200.0.0.1") && !contains("128.0.0.0/1", "127.0.0.1"));
        assert!(contains("fd00::/64", "fd00::ffff:ffff:ffff:ffff"));
        assert!(!contains("fd00::/64", "fd00:0:0:1::"));
        assert!(contains("::/0", "::1") && contains("::1", "::1") && !contains("::1/128", "::"));
        assert!(!contains("0.0.0.0/0", "::1") && !contains("::/0", "1.2.3.4"));
    }

    #[test]
    fn what_is_no_network_is_refused() {
        for text in
            ["", "/", "10.1.0.1/33", "::/129", "10.1.0/24", "10.1.0.1/", "10.1.0.1/+8", "10.1.0.1/24/1", "10.1.0.1/999", "host/24", " 10.1.0.1"]
        {
            assert_eq!(text.parse::<Network>(), Err(NoNetwork), "{text}");
        }
    }
}
