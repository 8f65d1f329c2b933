//! Addresses of this machine for programs on other machines.

use std::net::{IpAddr, SocketAddr, UdpSocket};

use crate::failure::Failure;

/// Returns this machine's address for other machines, for a socket on all addresses such as 0.0.0.0. `None` if the socket listens on a single address, and if
/// the machine has no network.
pub(crate) fn own_address(listening: SocketAddr) -> Option<SocketAddr> {
    if !listening.ip().is_unspecified() {
        return None;
    }
    // Connecting a UDP socket sends nothing, but makes the system choose the network card, and so the address within reach of other machines.
    let chosen = |from: &str, to: &str| {
        let socket = UdpSocket::bind((from, 0)).ok()?;
        socket.connect((to, 9)).ok()?;
        socket.local_addr().ok().map(|own| own.ip())
    };
    // A socket on [::] takes IPv4 too, and IPv4 is more widely reachable.
    let of_ipv4 = || chosen("0.0.0.0", "192.0.2.1");
    let own: Option<IpAddr> = if listening.is_ipv4() { of_ipv4() } else { of_ipv4().or_else(|| chosen("::", "2001:db8::1")) };
    own.map(|ip| SocketAddr::new(ip, listening.port()))
}

/// Returns `url` with this machine's own address in place of the loopback address, if the server listens on all addresses; otherwise `url` itself.
pub(crate) fn reached_from_elsewhere(listening: SocketAddr, url: String) -> String {
    let loopback = if listening.is_ipv4() { "127.0.0.1" } else { "[::1]" };
    match own_address(listening) {
        Some(own) => url.replacen(&format!("{loopback}:{}", listening.port()), &own.to_string(), 1),
        None => url,
    }
}

/// Refuses an address outside this machine's loopback interface.
pub(crate) fn local(option: &str, address: SocketAddr) -> Result<(), Failure> {
    if address.ip().is_loopback() {
        return Ok(());
    }
    Err(Failure::Input(format!(
        "{option} {address} is not on loopback: expected an address such as 127.0.0.1 or ::1, or --allow-remote as well. The relay authenticates nobody: \
         anybody who reaches its ports can speak through it"
    )))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_link_for_others_has_an_address_that_they_can_ask_for() {
        let url = "http://127.0.0.1:80/join?token=x".to_owned();
        assert_eq!(reached_from_elsewhere("127.0.0.1:80".parse().unwrap(), url.clone()), url);
        let elsewhere = reached_from_elsewhere("0.0.0.0:80".parse().unwrap(), url);
        assert!(elsewhere.starts_with("http://") && elsewhere.ends_with(":80/join?token=x"), "{elsewhere}");
    }

    #[test]
    fn all_addresses_are_no_address_to_send_to() {
        assert_eq!(own_address("127.0.0.1:80".parse().unwrap()), None);
        // A machine without a network has none, and any other has one that is not 0.0.0.0, with the port.
        for listening in ["0.0.0.0:80", "[::]:80"] {
            let own = own_address(listening.parse().unwrap());
            assert!(own.is_none_or(|own| !own.ip().is_unspecified() && own.port() == 80), "{own:?}");
        }
    }
}
