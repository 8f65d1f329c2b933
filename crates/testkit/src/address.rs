//! Names and addresses of the hosts of a test bed.

use std::fmt::{self, Write as _};
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr};
use std::sync::Arc;

use cohaptic_wan::NodeId;

use crate::names::{Names, SHOWN};

/// Names and present addresses of all hosts.
///
/// Host number n, counted from 1, has the addresses 10.0.0.n and `fd00::n`. Beyond 255 the addresses go on with 10.0.1.0, as numbers of four bytes do.
/// Addresses given out later, by [`Host::change_addresses`](crate::Host::change_addresses), follow the addresses of all hosts.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct AddressPlan {
    names: Arc<Names>,
    /// Number of the present addresses of each host, indexed by host.
    current: Vec<u32>,
    /// Host that has the addresses of number `index + 1`; `None` after the host has got new addresses. Numbers beyond the end were never given.
    owners: Vec<Option<NodeId>>,
}

/// Addresses of one host.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Addresses {
    /// Address of IPv4.
    pub v4: Ipv4Addr,
    /// Address of IPv6.
    pub v6: Ipv6Addr,
}

/// Addresses of number 0, which no host has.
const FIRST: (u32, u128) = (Ipv4Addr::new(10, 0, 0, 0).to_bits(), 0xfd00 << 112);

impl Addresses {
    pub(crate) fn numbered(number: u32) -> Self {
        Self { v4: Ipv4Addr::from_bits(FIRST.0.wrapping_add(number)), v6: Ipv6Addr::from_bits(FIRST.1 + u128::from(number)) }
    }

    /// Returns the address in 32 bits: its distance to the address of number 0 of the same version. For the addresses of hosts this is their number, equal in
    /// both versions. In IPv6 the loopback address becomes 0, and every address that no host can have becomes `u32::MAX`.
    #[inline]
    pub(crate) const fn short(address: IpAddr) -> u32 {
        match address {
            IpAddr::V4(v4) => v4.to_bits().wrapping_sub(FIRST.0),
            IpAddr::V6(v6) => {
                let number = v6.to_bits().wrapping_sub(FIRST.1);
                #[expect(clippy::cast_possible_truncation, reason = "it is small enough")]
                if v6.is_loopback() {
                    0
                } else if number > 0 && number < u32::MAX as u128 {
                    number as u32
                } else {
                    u32::MAX
                }
            }
        }
    }

    /// Returns the address whose [short](Self::short) form is `short`. For `u32::MAX` in IPv6 the result is an address that no host has, not the original one.
    #[inline]
    pub(crate) fn long(short: u32, is_six: bool) -> IpAddr {
        match (is_six, short) {
            (false, _) => Ipv4Addr::from_bits(FIRST.0.wrapping_add(short)).into(),
            (true, 0) => Ipv6Addr::LOCALHOST.into(),
            (true, number) => Self::numbered(number).v6.into(),
        }
    }

    /// Returns whether the address with the short form `short` is a loopback address.
    #[inline]
    pub(crate) const fn is_loopback(short: u32, is_six: bool) -> bool {
        let bits = short.wrapping_add(FIRST.0);
        if is_six { short == 0 } else { bits >> 24 == 127 }
    }

    /// Returns the address of the same version as `other`.
    #[must_use]
    pub const fn like(&self, other: IpAddr) -> IpAddr {
        match other {
            IpAddr::V4(_) => IpAddr::V4(self.v4),
            IpAddr::V6(_) => IpAddr::V6(self.v6),
        }
    }

    /// Returns whether `address` is one of the two.
    #[must_use]
    pub fn has(&self, address: IpAddr) -> bool {
        self.like(address) == address
    }
}

impl AddressPlan {
    pub(crate) fn new(names: Arc<Names>) -> Self {
        let mut plan = Self { current: Vec::with_capacity(names.len()), names, owners: Vec::new() };
        for host in 0..plan.names.len() {
            let number = plan.fresh(NodeId::new(host));
            plan.current.push(number);
        }
        plan
    }

    fn fresh(&mut self, host: NodeId) -> u32 {
        self.owners.push(Some(host));
        u32::try_from(self.owners.len()).unwrap_or(u32::MAX)
    }

    /// Gives a host addresses that no host has had. Its former addresses belong to no host from now on.
    pub(crate) fn change(&mut self, host: NodeId) -> Addresses {
        let before = Self::place(self.number(host));
        self.owners.iter_mut().skip(before).take(1).for_each(|owner| *owner = None);
        self.current[host.index()] = self.fresh(host);
        self.of(host)
    }

    /// Returns the names of the hosts, in the order in which they were given.
    #[must_use]
    pub fn names(&self) -> &[String] {
        &self.names
    }

    pub(crate) const fn shared_names(&self) -> &Arc<Names> {
        &self.names
    }

    /// Returns the addresses of the host named `name`, or `None` if there is no such host.
    #[must_use]
    pub fn addresses(&self, name: &str) -> Option<Addresses> {
        self.names.find(name).map(|host| self.of(host))
    }

    /// Returns the name of the host that has this address now.
    #[must_use]
    pub fn owner(&self, address: IpAddr) -> Option<&str> {
        self.owner_node(address).map(|host| &*self.names[host.index()])
    }

    /// Returns whether any host has or had the address.
    pub(crate) fn was_given(&self, address: IpAddr) -> bool {
        Self::place(Addresses::short(address)) < self.owners.len()
    }

    /// Returns the message that no host has an address, with the addresses of the hosts.
    pub(crate) fn unknown(&self, address: IpAddr) -> String {
        let mut text = format!("no host has the address {address}; the hosts are\n");
        // Writing to a `String` cannot fail.
        let _ = self.write_lines(&mut text, SHOWN);
        if self.names.len() > SHOWN {
            let _ = writeln!(text, "and {} more", self.names.len() - SHOWN);
        }
        text
    }

    /// Writes a line for each of the first `count` hosts.
    fn write_lines(&self, to: &mut impl fmt::Write, count: usize) -> fmt::Result {
        self.names.iter().zip(&self.current).take(count).try_for_each(|(name, number)| {
            let Addresses { v4, v6 } = Addresses::numbered(*number);
            writeln!(to, "{name} {v4} {v6}")
        })
    }

    pub(crate) fn owner_node(&self, address: IpAddr) -> Option<NodeId> {
        self.owner_of(Addresses::short(address))
    }

    /// Returns the host that has the addresses of number `number`.
    #[inline]
    pub(crate) fn owner_of(&self, number: u32) -> Option<NodeId> {
        self.owners.get(Self::place(number)).copied().flatten()
    }

    /// Returns the index in `owners` of the addresses of number `number`. For number 0, which no host has, the index wraps beyond the end.
    #[inline]
    const fn place(number: u32) -> usize {
        number.wrapping_sub(1) as usize
    }

    /// Returns the number of the present addresses of a host.
    #[inline]
    pub(crate) fn number(&self, host: NodeId) -> u32 {
        self.current[host.index()]
    }

    #[inline]
    pub(crate) fn of(&self, host: NodeId) -> Addresses {
        Addresses::numbered(self.number(host))
    }
}

impl fmt::Display for AddressPlan {
    /// Writes a line per host, such as `server 10.0.0.2 fd00::2`.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        self.write_lines(f, usize::MAX)
    }
}
