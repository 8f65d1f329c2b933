//! Frames of Ethernet (IEEE 802.3), with or without VLAN tags (IEEE 802.1Q).

const TAGGED: [u16; 2] = [0x8100, 0x88a8];
const IPV4: u16 = 0x0800;
const IPV6: u16 = 0x86dd;

/// Two addresses of six bytes.
const ADDRESSES: usize = 12;

/// A tag within a tag is what providers use; more are not in use.
const MOST_TAGS: usize = 2;

/// Where the packet of IP begins; `None` if the frame carries something else.
pub(super) fn network_layer(frame: &[u8]) -> Option<usize> {
    let mut at = ADDRESSES;
    for _ in 0..=MOST_TAGS {
        let kind = u16::from_be_bytes([*frame.get(at)?, *frame.get(at + 1)?]);
        at += 2;
        match kind {
            IPV4 | IPV6 => return Some(at),
            // The tag itself, and then the kind again.
            kind if TAGGED.contains(&kind) => at += 2,
            _ => return None,
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use etherparse::{EtherType, PacketBuilder, VlanId};

    use super::*;

    fn frame(tags: u8) -> Vec<u8> {
        let builder = PacketBuilder::ethernet2([2, 0, 0, 0, 0, 1], [2, 0, 0, 0, 0, 2]);
        let mut frame = Vec::new();
        let vlan = VlanId::try_new(7).unwrap();
        match tags {
            0 => builder.ipv4([10, 0, 0, 1], [10, 0, 0, 2], 64).udp(1, 2).write(&mut frame, &[]).unwrap(),
            1 => builder.single_vlan(vlan).ipv6([1; 16], [2; 16], 64).udp(1, 2).write(&mut frame, &[]).unwrap(),
            _ => builder.double_vlan(vlan, vlan).ipv4([10, 0, 0, 1], [10, 0, 0, 2], 64).udp(1, 2).write(&mut frame, &[]).unwrap(),
        }
        frame
    }

    #[test]
    fn packets_are_found_behind_tags() {
        assert_eq!([0, 1, 2].map(|tags| network_layer(&frame(tags))), [Some(14), Some(18), Some(22)]);
    }

    #[test]
    fn what_carries_no_packet_is_told() {
        let mut arp = frame(0);
        arp[12..14].copy_from_slice(&EtherType::ARP.0.to_be_bytes());
        assert_eq!(network_layer(&arp), None);
        for length in 0..14 {
            assert_eq!(network_layer(&frame(0)[..length]), None);
        }
        let mut tags = vec![0; 12];
        tags.extend([0x81, 0x00, 0, 7].repeat(9));
        assert_eq!(network_layer(&tags), None);
    }
}
