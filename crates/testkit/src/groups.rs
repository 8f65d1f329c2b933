//! Multicast groups of IPv4 and IPv6 in the form that fits on a packet.

use std::io;
use std::net::{IpAddr, Ipv6Addr};
use std::num::NonZeroU8;

use crate::address::Addresses;

/// Multicast group.
///
/// A group of IPv6 has 112 bits after its flags and scope, of which RFC 3307 (section 4) gives 32 to the identifier of the group. These 32 bits are also the
/// bits that Ethernet carries (RFC 2464, section 7). Groups with other bits, such as those with the prefix of a network (RFC 3306), have no short form.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(crate) struct Group {
    /// Address of a group of IPv4 as [`Addresses::short`]; identifier of a group of IPv6, above 0.
    pub(crate) short: u32,
    /// Flags and scope of a group of IPv6: the second byte of its address (RFC 4291, section 2.7). `None` for a group of IPv4.
    pub(crate) scope: Option<NonZeroU8>,
}

/// Scope of groups that never leave their host (RFC 4291, section 2.7).
const OF_INTERFACE: u8 = 1;
/// Scope of groups of one link (RFC 4291, section 2.7).
const OF_LINK: u8 = 2;
/// 224.0.0.1, the group of all hosts (RFC 1112, section 4).
const ALL_HOSTS: u32 = 0xe000_0001;

impl Group {
    /// Returns the group with the address `ip`, or `None` for an address that is no group, or a group without a short form.
    pub(crate) fn of(ip: IpAddr) -> Option<Self> {
        match ip {
            IpAddr::V4(v4) => v4.is_multicast().then(|| Self { short: Addresses::short(ip), scope: None }),
            IpAddr::V6(v6) => {
                let [0xff, scope, 0, 0, 0, 0, 0, 0, 0, 0, 0, 0, id @ ..] = v6.octets() else { return None };
                // Scope 0 and identifier 0 are reserved (RFC 4291, section 2.7).
                let (scope, short) = (NonZeroU8::new(scope)?, u32::from_be_bytes(id));
                (scope.get() & 0xf != 0 && short != 0).then_some(Self { short, scope: Some(scope) })
            }
        }
    }

    /// Returns the group with the address `ip`.
    ///
    /// # Errors
    ///
    /// `EINVAL` for an address that is no group, as with Linux. [`io::ErrorKind::Unsupported`] for a group without a short form.
    pub(crate) fn parse(ip: IpAddr) -> io::Result<Self> {
        if !ip.is_multicast() {
            return crate::errno::Errno::InvalidInput.fail();
        }
        Self::of(ip).ok_or_else(|| {
            let text = format!(
                "{ip} is a group with an identifier of more than 32 bits, which a test bed does not have; use a group such as ff02::fb or ff15::1234:5678"
            );
            io::Error::new(io::ErrorKind::Unsupported, text)
        })
    }

    /// Returns the address of the group.
    pub(crate) fn address(self) -> IpAddr {
        match self.scope {
            None => Addresses::long(self.short, false),
            Some(scope) => Ipv6Addr::from_bits(0xff << 120 | u128::from(scope.get()) << 112 | u128::from(self.short)).into(),
        }
    }

    /// Returns the scope of a group of IPv6, without the flags.
    fn extent(self) -> Option<u8> {
        self.scope.map(|scope| scope.get() & 0xf)
    }

    /// Returns whether datagrams to the group never leave their host.
    pub(crate) fn stays_on_host(self) -> bool {
        self.extent() == Some(OF_INTERFACE)
    }

    /// Returns whether the address is ambiguous without an interface, because every interface has a group of its own with this address.
    pub(crate) fn needs_interface(self) -> bool {
        self.extent().is_some_and(|scope| scope <= OF_LINK)
    }

    /// Returns whether every host is a member without joining: 224.0.0.1, `ff01::1` and `ff02::1`.
    pub(crate) fn is_of_all_hosts(self) -> bool {
        match self.scope {
            None => self.address() == IpAddr::from(ALL_HOSTS.to_be_bytes()),
            Some(scope) => self.short == 1 && matches!(scope.get(), OF_INTERFACE | OF_LINK),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn group(text: &str) -> Option<Group> {
        Group::of(text.parse().unwrap())
    }

    #[test]
    fn groups_come_back_as_they_were() {
        for text in ["224.0.0.1", "239.255.255.255", "ff02::1", "ff02::fb", "ff05::1:3", "ff15::7079:7068", "ff1e::ffff:ffff"] {
            assert_eq!(group(text).unwrap().address().to_string(), text);
        }
        for text in ["10.0.0.1", "255.255.255.255", "fd00::1", "ff00::1", "ff10::1", "ff02::", "ff02::1:0:1", "ff3e:20:2001:db8::1"] {
            assert_eq!(group(text), None, "{text}");
        }
    }

    #[test]
    fn the_scope_says_how_far_a_group_reaches() {
        let told = |text: &str| {
            let group = group(text).unwrap();
            (group.stays_on_host(), group.needs_interface(), group.is_of_all_hosts())
        };
        assert_eq!(told("ff01::1"), (true, true, true));
        assert_eq!(told("ff11::1"), (true, true, false));
        assert_eq!(told("ff02::1"), (false, true, true));
        assert_eq!(told("ff12::fb"), (false, true, false));
        assert_eq!(told("ff05::1"), (false, false, false));
        assert_eq!(told("224.0.0.1"), (false, false, true));
        assert_eq!(told("224.0.0.2"), (false, false, false));
    }
}
