//! Addresses of the hosts of a test bed, as the test chooses them.

use std::net::IpAddr;

use super::Testbed;
use crate::address::Addresses;

impl Testbed {
    /// Chooses an address of a host, in place of 10.0.0.n or `fd00::n`: see [`AddressPlan`](crate::AddressPlan). Call this once for each version of IP. Hosts
    /// without a chosen address get the other addresses in turn. An address of another network than 10.0.0.0/8 can be reached as well, but its neighbours
    /// cannot. After [`Host::change_addresses`](crate::Host::change_addresses) the host has addresses given in turn.
    ///
    /// # Panics
    ///
    /// If there is no such host, if another host has the address, or if no host can have the address: addresses of IPv6 are from `fd00::1` to
    /// `fd00::ffff:fffe`.
    #[expect(clippy::panic, reason = "a misuse, and the way out")]
    pub fn address(mut self, host: &str, address: impl Into<IpAddr>) -> Self {
        let (node, address) = (self.setup.names.node(host), address.into());
        let short = Addresses::choose(address).unwrap_or_else(|fault| panic!("{fault}"));
        let addresses = &mut self.setup.settings.addresses;
        let key = (node, address.is_ipv6());
        if let Some((other, _)) = addresses.iter().find(|((of, is_six), chosen)| (*is_six, **chosen) == (key.1, short) && *of != node) {
            panic!("{address} is the address of host `{}` already", self.setup.names[other.0.index()]);
        }
        addresses.insert(key, short);
        self
    }

    /// Puts the address of IPv6 first when the name of a host is looked up. By default the address of IPv4 comes first. Programs that try each address in turn
    /// use the second address only after a failure of the first address.
    pub const fn ipv6_first(mut self) -> Self {
        self.setup.settings.six_first = true;
        self
    }

    /// Returns the calls of [`Testbed::address`] and [`Testbed::ipv6_first`] that choose the addresses of this test bed.
    pub(super) fn address_calls(&self) -> impl Iterator<Item = String> {
        let settings = &self.setup.settings;
        let chosen = settings.addresses.iter().map(|((host, is_six), short)| {
            let octets = match Addresses::long(*short, *is_six) {
                IpAddr::V4(v4) => format!("{:?}", v4.octets()),
                IpAddr::V6(v6) => format!("{:?}", v6.segments()),
            };
            format!(".address({:?}, {octets})", self.setup.names[host.index()])
        });
        chosen.chain(settings.six_first.then(|| ".ipv6_first()".to_owned()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_printed_test_has_the_addresses() {
        let bed = Testbed::new(["a", "b"]).address("b", [192, 168, 1, 10]).address("a", [0xfd00, 0, 0, 0, 0, 0, 7, 1]).ipv6_first();
        let calls: Vec<String> = bed.address_calls().collect();
        assert_eq!(calls, [".address(\"a\", [64768, 0, 0, 0, 0, 0, 7, 1])", ".address(\"b\", [192, 168, 1, 10])", ".ipv6_first()"]);
    }
}
