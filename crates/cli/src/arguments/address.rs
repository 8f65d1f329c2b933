//! Addresses on the command line: in numbers, or by a name that is looked up.

use std::net::{SocketAddr, ToSocketAddrs as _};

use cohaptic_linkfile::{AddressError, address};

/// An address with a port. Of several that a name has, the first of IPv4 is taken, or else the first: both ends of a relay are then of one kind.
pub(crate) fn looked_up(text: &str) -> Result<SocketAddr, String> {
    const EXPECTED: &str = "expected an address with a port, such as 127.0.0.1:7000, [::1]:7000 or localhost:7000";
    match address(text) {
        Ok(address) => Ok(address),
        Err(AddressError::Name) => {
            let found: Vec<SocketAddr> = text.to_socket_addrs().map_err(|error| format!("the name is not known ({error}): {EXPECTED}"))?.collect();
            let first = found.iter().find(|address| address.is_ipv4()).or_else(|| found.first());
            first.copied().ok_or_else(|| format!("the name has no address: {EXPECTED}"))
        }
        Err(other) => Err(format!("{other}: {EXPECTED}")),
    }
}
