//! Addresses of this machine, by which a program recognises that it would send to itself.

use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, UdpSocket};

/// Returns whether data sent to `to` arrives at a socket of this machine that is bound to `own`. `takes_both` says that a socket at the unspecified address of
/// IPv6 takes IPv4 too. The port 0 is not chosen yet, and reaches nothing.
///
/// ```
/// use cohaptic_realtime::own::reaches;
///
/// assert!(reaches("127.0.0.1:7000".parse()?, "0.0.0.0:7000".parse()?, false));
/// assert!(!reaches("127.0.0.1:9000".parse()?, "0.0.0.0:7000".parse()?, false));
/// # Ok::<(), std::net::AddrParseError>(())
/// ```
#[must_use]
pub fn reaches(to: SocketAddr, own: SocketAddr, takes_both: bool) -> bool {
    // The kernel delivers data for an unspecified address to the loopback address of the same family.
    let target = match (to.ip().to_canonical(), to.ip().is_ipv4()) {
        (target, _) if !target.is_unspecified() => target,
        (_, true) => IpAddr::V4(Ipv4Addr::LOCALHOST),
        (_, false) => IpAddr::V6(Ipv6Addr::LOCALHOST),
    };
    let ip = own.ip().to_canonical();
    let is_of_family = ip.is_ipv4() == target.is_ipv4() || (takes_both && ip.is_ipv6());
    let is_here = || if ip.is_unspecified() { is_of_family && is_of_this_machine(target) } else { ip == target };
    to.port() == own.port() && own.port() != 0 && is_here()
}

/// Returns whether `ip` is an address of this machine: the system lets a socket be bound to the machine's own addresses alone.
fn is_of_this_machine(ip: IpAddr) -> bool {
    ip.is_loopback() || UdpSocket::bind((ip, 0)).is_ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// 192.0.2.1 is reserved for documentation (RFC 5737), so no machine has this address.
    #[test]
    fn a_port_is_known_by_each_of_its_names() {
        let address = |text: &str| text.parse::<SocketAddr>().unwrap();
        for (to, own) in [
            ("127.0.0.1:7000", "127.0.0.1:7000"),
            ("127.0.0.1:7000", "0.0.0.0:7000"),
            ("127.0.0.2:7000", "0.0.0.0:7000"),
            ("0.0.0.0:7000", "127.0.0.1:7000"),
            ("0.0.0.0:7000", "0.0.0.0:7000"),
            ("[::1]:7000", "[::]:7000"),
            ("[::]:7000", "[::1]:7000"),
            ("[::ffff:127.0.0.1]:7000", "127.0.0.1:7000"),
        ] {
            assert!([false, true].iter().all(|both| reaches(address(to), address(own), *both)), "{to} {own}");
        }
        for (to, own) in [
            ("127.0.0.1:7001", "127.0.0.1:7000"),
            ("127.0.0.2:7000", "127.0.0.1:7000"),
            ("[::1]:7000", "0.0.0.0:7000"),
            ("192.0.2.1:7000", "0.0.0.0:7000"),
            ("192.0.2.1:7000", "[::]:7000"),
            ("127.0.0.1:0", "127.0.0.1:0"),
        ] {
            assert!([false, true].iter().all(|both| !reaches(address(to), address(own), *both)), "{to} {own}");
        }
        assert!(reaches(address("127.0.0.1:7000"), address("[::]:7000"), true));
        assert!(!reaches(address("127.0.0.1:7000"), address("[::]:7000"), false));
    }
}
