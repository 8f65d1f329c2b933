//! Addresses in the view of a program, and the corresponding real addresses.

use core::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr};

/// Returns the addresses of a host by its index, below 200: IPv4, then IPv6.
#[must_use]
pub const fn host(index: u8) -> [IpAddr; 2] {
    [v4(15 + index), v6(15 + index as u16)]
}

/// Addresses of the first host.
pub(super) const HOST: [IpAddr; 2] = host(0);
/// Addresses of the gateway, in place of the loopback interface of the real machine.
pub const GATEWAY: [IpAddr; 2] = [v4(2), v6(2)];
/// Addresses of the name server, in place of the name server of the real machine.
pub const NAMES: [IpAddr; 2] = [v4(3), v6(3)];
/// Bits of the network in the addresses above, as \[IPv4, IPv6\].
pub const PREFIX: [u8; 2] = [24, 64];

/// Port of name servers.
pub const DNS: u16 = 53;

/// Returns an address of the network 10.0.2.0/24, as `slirp` gives to virtual machines too.
const fn v4(last: u8) -> IpAddr {
    IpAddr::V4(Ipv4Addr::new(10, 0, 2, last))
}

/// Returns an address of the network fd00:10:0:2::/64, of the addresses for local use (RFC 4193).
const fn v6(last: u16) -> IpAddr {
    IpAddr::V6(Ipv6Addr::new(0xfd00, 0x10, 0, 2, 0, 0, 0, last))
}

/// Returns the real address for which `address` stands: for the gateway the loopback interface, for the name server `names`, and every other address for
/// itself. Returns `None` for a name server where the machine has none, and for other ports of the name server.
pub(super) fn real(address: SocketAddr, names: Option<SocketAddr>) -> Option<SocketAddr> {
    if GATEWAY.contains(&address.ip()) {
        let loopback = if address.is_ipv4() { IpAddr::V4(Ipv4Addr::LOCALHOST) } else { IpAddr::V6(Ipv6Addr::LOCALHOST) };
        return Some(SocketAddr::new(loopback, address.port()));
    }
    if NAMES.contains(&address.ip()) {
        return names.filter(|_| address.port() == DNS);
    }
    Some(address)
}

/// Returns the address of the gateway in the version of `of`.
pub(super) const fn gateway(of: IpAddr) -> IpAddr {
    GATEWAY[of.is_ipv6() as usize]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_gateway_stands_for_the_loopback_interface_and_the_name_server_for_that_of_the_machine() {
        let names = Some("192.0.2.53:5353".parse().unwrap());
        let seen = ["10.0.2.2:80", "[fd00:10:0:2::2]:80", "10.0.2.3:53", "192.0.2.9:443"]
            .map(|text| real(text.parse().unwrap(), names).unwrap().to_string());
        assert_eq!(seen, ["127.0.0.1:80", "[::1]:80", "192.0.2.53:5353", "192.0.2.9:443"]);
        assert_eq!(real("10.0.2.3:80".parse().unwrap(), names), None);
        assert_eq!(real("10.0.2.3:53".parse().unwrap(), None), None);
    }
}
