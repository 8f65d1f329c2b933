//! Addresses of nodes, equal to those of the hosts of a test bed.

use std::net::{IpAddr, SocketAddr};

use crate::address::Addresses;

/// Returns the IPv4 address of the node with the index `place`, from 0: 10.0.0.1 is the address of the first node. The node is also reached over IPv6, at
/// `fd00::1`.
///
/// # Panics
///
/// Beyond 16,777,214 nodes.
#[must_use]
pub fn address(place: usize, port: u16) -> SocketAddr {
    SocketAddr::new(addresses(place).v4.into(), port)
}

/// Returns the addresses of the node with the index `place`.
pub(super) fn addresses(place: usize) -> Addresses {
    let number = u32::try_from(place).ok().filter(|place| *place < LAST).expect("a run has at most 16,777,214 nodes");
    Addresses::numbered(number + 1)
}

/// Number of addresses of hosts in 10.0.0.0/8.
const LAST: u32 = (1 << 24) - 2;

/// Returns the index of the node with the address, or `None` if no node can have the address. Whether a node of this index exists is not checked.
#[must_use]
pub fn place_of(address: IpAddr) -> Option<usize> {
    let number = match address {
        IpAddr::V4(v4) => v4.to_bits().checked_sub(10 << 24)?,
        IpAddr::V6(v6) => u32::try_from(v6.to_bits().checked_sub(0xfd00 << 112)?).ok()?,
    };
    (1..=LAST).contains(&number).then(|| number as usize - 1)
}

#[cfg(test)]
mod tests {
    use cohaptic_wan::NodeId;

    use super::*;
    use crate::address::AddressPlan;

    #[test]
    fn places_have_the_addresses_that_the_hosts_of_a_test_bed_have() {
        let plan = AddressPlan::new(std::sync::Arc::new((0..300).map(|place| format!("host-{place}")).collect()), &std::collections::BTreeMap::new());
        for place in [0, 1, 254, 255, 299] {
            assert_eq!(addresses(place), plan.of(NodeId::new(place)));
            assert_eq!(place_of(addresses(place).v4.into()), Some(place));
            assert_eq!(place_of(addresses(place).v6.into()), Some(place));
        }
        for text in ["10.0.0.0", "9.255.255.255", "11.0.0.0", "10.255.255.255", "fd00::", "fd00::1:0:0", "::1", "127.0.0.1"] {
            assert_eq!(place_of(text.parse().unwrap()), None, "{text}");
        }
        assert_eq!(address(2, 80), "10.0.0.3:80".parse().unwrap());
    }
}
