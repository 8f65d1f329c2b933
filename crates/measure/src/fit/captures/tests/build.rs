//! Builds captures octet by octet by the specifications: draft-ietf-opsawg-pcap, draft-ietf-opsawg-pcapng, RFC 768, 791, 894, 8200.

/// A frame: time of capture \[ns since 1970\], captured octets, and length on the wire \[byte\].
#[derive(Clone)]
pub(super) struct Shot {
    pub(super) nanos: u64,
    pub(super) octets: Vec<u8>,
    pub(super) length: usize,
}

/// Makes a frame captured whole.
pub(super) fn shot(nanos: u64, octets: Vec<u8>) -> Shot {
    Shot { nanos, length: octets.len(), octets }
}

/// Cuts a frame after a number of octets.
pub(super) fn cut(shot: &Shot, octets: usize) -> Shot {
    Shot { octets: shot.octets[..octets.min(shot.octets.len())].to_vec(), ..shot.clone() }
}

pub(super) fn udp(port: u16, payload: &[u8]) -> Vec<u8> {
    let length = u16::try_from(8 + payload.len()).unwrap();
    [&9_u16.to_be_bytes()[..], &port.to_be_bytes(), &length.to_be_bytes(), &[0, 0], payload].concat()
}

pub(super) fn ipv4(identification: u16, protocol: u8, carried: &[u8]) -> Vec<u8> {
    let total = u16::try_from(20 + carried.len()).unwrap().to_be_bytes();
    let number = identification.to_be_bytes();
    [&[0x45, 0, total[0], total[1], number[0], number[1], 0, 0, 64, protocol, 0, 0][..], &[10, 0, 0, 1], &[10, 0, 0, 2], carried].concat()
}

pub(super) fn ipv6(next: u8, carried: &[u8]) -> Vec<u8> {
    let length = u16::try_from(carried.len()).unwrap().to_be_bytes();
    [&[0x60, 0, 0, 0, length[0], length[1], next, 64][..], &[0xfd; 16], &[0xfe; 16], carried].concat()
}

pub(super) fn ethernet(ether_type: u16, carried: &[u8]) -> Vec<u8> {
    [&[2, 0, 0, 0, 0, 1, 2, 0, 0, 0, 0, 2][..], &ether_type.to_be_bytes(), carried].concat()
}

/// Makes an Ethernet frame with a datagram to port 5000.
pub(super) fn packet(nanos: u64, identification: u16, payload: &[u8]) -> Shot {
    shot(nanos, ethernet(0x0800, &ipv4(identification, 17, &udp(5000, payload))))
}

/// Writer of numbers in a byte order.
#[derive(Clone, Copy, PartialEq)]
pub(super) enum Octets {
    Big,
    Little,
}

impl Octets {
    pub(super) fn word(self, number: u32) -> [u8; 4] {
        if self == Self::Big { number.to_be_bytes() } else { number.to_le_bytes() }
    }

    pub(super) fn half(self, number: u16) -> [u8; 2] {
        if self == Self::Big { number.to_be_bytes() } else { number.to_le_bytes() }
    }
}

fn word(number: usize) -> u32 {
    u32::try_from(number).unwrap()
}

/// Makes a pcap file. `magic` decides whether fractions of a second are nanoseconds, and whether the header of a frame has 8 octets more.
pub(super) fn pcap(order: Octets, magic: u32, network: u32, shots: &[Shot]) -> Vec<u8> {
    let mut file = [&order.word(magic)[..], &order.half(2), &order.half(4), &[0; 8], &order.word(65_535), &order.word(network)].concat();
    for shot in shots {
        let (seconds, nanos) = (shot.nanos / 1_000_000_000, shot.nanos % 1_000_000_000);
        let fraction = if magic == 0xA1B2_3C4D { nanos } else { nanos / 1_000 };
        let numbers = [u32::try_from(seconds).unwrap(), u32::try_from(fraction).unwrap(), word(shot.octets.len()), word(shot.length)];
        file.extend(numbers.map(|number| order.word(number)).concat());
        file.extend(if magic == 0xA1B2_CD34 { &[7; 8][..] } else { &[] });
        file.extend(&shot.octets);
    }
    file
}

/// Makes a pcap file of Ethernet frames with nanoseconds.
pub(super) fn file(shots: &[Shot]) -> Vec<u8> {
    pcap(Octets::Little, 0xA1B2_3C4D, 1, shots)
}

/// Makes a pcapng block.
pub(super) fn block(order: Octets, kind: u32, body: &[u8]) -> Vec<u8> {
    let padded = [body, &vec![0; body.len().next_multiple_of(4) - body.len()]].concat();
    let length = order.word(word(12 + padded.len()));
    [&order.word(kind)[..], &length, &padded, &length].concat()
}

pub(super) fn section(order: Octets) -> Vec<u8> {
    block(order, 0x0A0D_0D0A, &[&order.word(0x1A2B_3C4D)[..], &order.half(1), &order.half(0), &[0xFF; 8]].concat())
}

/// Makes the options of a block, with their end.
pub(super) fn options(order: Octets, options: &[(u16, &[u8])]) -> Vec<u8> {
    let one = |&(code, value): &(u16, &[u8])| {
        let padding = vec![0; value.len().next_multiple_of(4) - value.len()];
        [&order.half(code)[..], &order.half(u16::try_from(value.len()).unwrap()), value, &padding].concat()
    };
    if options.is_empty() { Vec::new() } else { [options.iter().map(one).collect::<Vec<_>>().concat(), vec![0; 4]].concat() }
}

pub(super) fn interface(order: Octets, link_type: u16, snap_length: u32, list: &[(u16, &[u8])]) -> Vec<u8> {
    block(order, 1, &[&order.half(link_type)[..], &[0, 0], &order.word(snap_length), &options(order, list)].concat())
}

/// Makes an enhanced packet block, with the time in units of its interface.
pub(super) fn enhanced(order: Octets, interface: u32, units: u64, shot: &Shot, list: &[(u16, &[u8])]) -> Vec<u8> {
    let numbers = [interface, high(units), low(units), word(shot.octets.len()), word(shot.length)].map(|number| order.word(number)).concat();
    let padding = vec![0; shot.octets.len().next_multiple_of(4) - shot.octets.len()];
    block(order, 6, &[numbers, shot.octets.clone(), padding, options(order, list)].concat())
}

/// Makes an obsolete packet block: 16 bits of interface, 16 bits of lost packets.
pub(super) fn obsolete(order: Octets, interface: u16, units: u64, shot: &Shot) -> Vec<u8> {
    let numbers = [high(units), low(units), word(shot.octets.len()), word(shot.length)].map(|number| order.word(number)).concat();
    block(order, 2, &[&order.half(interface)[..], &order.half(0xFFFF), &numbers, &shot.octets].concat())
}

pub(super) fn simple(order: Octets, shot: &Shot) -> Vec<u8> {
    block(order, 3, &[&order.word(word(shot.length))[..], &shot.octets].concat())
}

fn high(units: u64) -> u32 {
    u32::try_from(units >> 32).unwrap()
}

fn low(units: u64) -> u32 {
    u32::try_from(units & u64::from(u32::MAX)).unwrap()
}
