//! Frames of each link type, headers before UDP, and counts of other frames.

use super::super::End;
use super::super::contents::Capture;
use super::build::{Octets, Shot, cut, ethernet, file, ipv4, ipv6, packet, pcap, shot, udp};

/// Returns the kinds of frames in a capture with these frames after a single datagram.
fn kinds(link_type: u32, frames: &[Vec<u8>]) -> Vec<(String, usize)> {
    let shots: Vec<Shot> = frames.iter().map(|octets| shot(0, octets.clone())).collect();
    let error = Capture::read(End::Receiver, pcap(Octets::Little, 0xA1B2_C3D4, link_type, &shots).as_slice(), None).unwrap_err();
    let super::super::CaptureError::NoDatagrams { contents, .. } = error else { panic!("{error}") };
    contents.kinds.iter().map(|(kind, count)| (kind.to_string(), *count)).collect()
}

fn reads(link_type: u32, octets: &[u8]) {
    // Ethernet pads short frames, and a check sequence may follow.
    let padded = [octets, &[0; 9]].concat();
    let file = pcap(Octets::Big, 0xA1B2_C3D4, link_type, &[shot(0, padded)]);
    let capture = Capture::read(End::Sender, file.as_slice(), Some(5000)).unwrap_or_else(|error| panic!("{link_type}: {error}"));
    assert_eq!((capture.datagrams[0].length, capture.payload(&capture.datagrams[0])), (2, &b"hi"[..]), "{link_type}");
}

#[test]
fn frames_of_each_link_type_are_read() {
    let (v4, v6) = (ipv4(0, 17, &udp(5000, b"hi")), ipv6(17, &udp(5000, b"hi")));
    let of = |begin: &[u8], packet: &[u8]| [begin, packet].concat();
    // RFC 2516: version and type 1, a session, a length; then PPP, whose protocol 0x0021 is IPv4 and 0x0057 IPv6.
    let pppoe = |protocol: u8, packet: &[u8]| of(&[0x11, 0, 0, 7, 0, 40, 0, protocol], packet);
    let snap = |packet: &[u8]| of(&[0xAA, 0xAA, 3, 0, 0, 0, 8, 0], packet);
    // IEEE 802.11: data (0x08) with three addresses; with quality of service (0x88); with four addresses; with HT control.
    let address = |count: usize| vec![9; count];
    for (link_type, octets) in [
        (0, of(&[2, 0, 0, 0], &v4)),
        (0, of(&[0, 0, 0, 30], &v6)),
        (108, of(&[0, 0, 0, 2], &v4)),
        (1, ethernet(0x0800, &v4)),
        (1, ethernet(0x86DD, &v6)),
        (1, ethernet(0x88A8, &of(&[0, 5, 0x81, 0, 0, 6, 8, 0], &v4))),
        (1, ethernet(0x8864, &pppoe(0x21, &v4))),
        (1, ethernet(0x8847, &of(&[0, 1, 0, 9, 0, 1, 1, 9], &v6))),
        (1, ethernet(40, &snap(&v4))),
        (9, of(&[0xFF, 3, 0, 0x21], &v4)),
        (9, of(&[0, 0x57], &v6)),
        (9, of(&[0x21], &v4)),
        (50, of(&[0xFF, 3, 0, 0x57], &v6)),
        (50, of(&[0x0F, 0, 8, 0], &v4)),
        (104, of(&[0x8F, 0, 0x86, 0xDD], &v6)),
        (51, pppoe(0x57, &v6)),
        (166, of(&[1, 3, 0, 0x21], &v4)),
        (204, of(&[1, 0xFF, 3, 0, 0x21], &v4)),
        (12, v4.clone()),
        (14, v6.clone()),
        (101, v4.clone()),
        (228, v4.clone()),
        (229, v6.clone()),
        (113, of(&[&[0, 0, 0, 1, 0, 6][..], &address(8), &[8, 0]].concat(), &v4)),
        (276, of(&[&[0x86, 0xDD, 0, 0, 0, 0, 0, 2, 0, 1, 0, 6][..], &address(8)].concat(), &v6)),
        (105, of(&[&[0x08, 0x01, 0, 0][..], &address(20)].concat(), &snap(&v4))),
        (105, of(&[&[0x88, 0x02, 0, 0][..], &address(20), &[0, 0]].concat(), &snap(&v4))),
        (105, of(&[&[0x08, 0x03, 0, 0][..], &address(26)].concat(), &snap(&v4))),
        (105, of(&[&[0x88, 0x82, 0, 0][..], &address(20), &[0, 0, 1, 1, 1, 1]].concat(), &snap(&v4))),
        // Radiotap with 8 octets and no field.
        (127, of(&[&[0, 0, 8, 0, 0, 0, 0, 0, 0x08, 0x01, 0, 0][..], &address(20)].concat(), &snap(&v4))),
        // Two words of flags, a time at octet 16, then flags with "padded": the header of 26 octets takes 28.
        (
            127,
            of(
                &[&[0, 0, 25, 0, 3, 0, 0, 0x80, 0, 0, 0, 0, 0, 0, 0, 0][..], &[1; 8], &[0x20], &[0x88, 0x02, 0, 0], &address(20), &[0, 0, 0, 0]]
                    .concat(),
                &snap(&v4),
            ),
        ),
    ] {
        reads(link_type, &octets);
    }
}

/// RFC 8200, section 4: each header names the next header and, except for fragments, its own length.
#[test]
fn extension_headers_of_ipv6_are_passed() {
    let header = |next: u8, octets: usize| [&[next, u8::try_from(octets / 8 - 1).unwrap()][..], &vec![1; octets - 2]].concat();
    let datagram = udp(5000, b"hi");
    // Hop by hop, destination, routing, authentication (with a length in units of four octets), mobility, and a fragment header of a whole packet.
    let authentication = [&[135_u8, 4][..], &[1; 22]].concat();
    let whole_fragment = [17, 0, 0, 0, 0, 0, 0, 9];
    let all = [header(60, 8), header(43, 24), header(51, 16), authentication, header(44, 8), whole_fragment.to_vec(), datagram.clone()].concat();
    reads(101, &ipv6(0, &all));
    reads(101, &ipv4(1, 51, &[&[17_u8, 4][..], &[1; 22], &datagram].concat()));
    // The first fragment of several, and a later fragment.
    for field in [[0, 1], [0, 8]] {
        let fragment = [&[17, 0, field[0], field[1], 0, 0, 0, 9][..], &datagram].concat();
        assert_eq!(kinds(101, &[ipv6(0, &[header(44, 8), fragment].concat())]), [("fragments of IPv6".into(), 1)]);
    }
}

#[test]
fn what_is_no_datagram_is_counted_by_name() {
    let fragment = |high: u8, low: u8| {
        let mut packet = ipv4(3, 17, &udp(5000, b"hi"));
        (packet[6], packet[7]) = (high, low);
        ethernet(0x0800, &packet)
    };
    let carried = |protocol: u8| ethernet(0x0800, &ipv4(1, protocol, &[0; 30]));
    let frames = [
        fragment(0x20, 0),
        fragment(0, 1),
        carried(1),
        carried(6),
        carried(6),
        carried(4),
        carried(41),
        carried(47),
        carried(50),
        carried(200),
        ethernet(0x86DD, &ipv6(58, &[0; 8])),
        ethernet(0x0806, &[0; 28]),
        ethernet(0x1234, &[0; 28]),
        ethernet(0x8863, &[0; 28]),
        ethernet(0x8864, &[0x11, 0, 0, 7, 0, 40, 0xC0, 0x21, 1]),
        ethernet(0x8847, &[0, 1, 1, 9, 0, 0, 0]),
        ethernet(38, &[0x42, 0x42, 3, 0, 0]),
        ethernet(0x0800, &[0x45, 0]),
        ethernet(0x0800, &[0; 30]),
        // The length of a datagram is at least 8.
        ethernet(0x0800, &ipv4(1, 17, &[0, 1, 0, 2, 0, 7, 0, 0])),
    ];
    let expected = [
        ("802.2", 1),
        ("ARP", 1),
        ("ESP", 1),
        ("Ethernet type 0x1234", 1),
        ("GRE", 1),
        ("ICMP", 1),
        ("ICMPv6", 1),
        ("IP protocol 200", 1),
        ("IPv4 in IP", 1),
        ("IPv6 in IP", 1),
        ("MPLS without IP", 1),
        ("PPP protocol 0xc021", 1),
        ("PPPoE discovery", 1),
        ("TCP", 2),
        ("cut within the headers", 1),
        ("fragments of IPv4", 2),
        ("malformed UDP", 1),
        ("no IP", 1),
    ];
    assert_eq!(kinds(1, &frames), expected.map(|(kind, count)| (kind.to_owned(), count)));
    let wireless = [[0x80, 0], [0xB4, 0], [0x48, 0], [0x08, 0x40], [0x01, 0]].map(|control| [&control[..], &[0; 40]].concat());
    let expected = ["802.11 control", "802.11 encrypted", "802.11 management", "802.11 of another version", "802.11 without data"];
    assert_eq!(kinds(105, &wireless), expected.map(|kind| (kind.to_owned(), 1)));
    assert_eq!(kinds(147, &[vec![0; 40]]), [("link type 147".to_owned(), 1)]);
}

#[test]
fn a_capture_without_datagrams_says_what_it_holds() {
    let said = |file: &[u8], port| Capture::read(End::Receiver, file, port).unwrap_err().to_string();
    let tcp = shot(0, ethernet(0x0800, &ipv4(1, 6, &[0; 20])));
    let arp = shot(0, ethernet(0x0806, &[0; 28]));
    assert_eq!(
        said(&file(&[arp.clone(), tcp.clone(), tcp, packet(0, 1, b"hi")])[..], Some(5001)),
        "the capture of the receiver has no UDP datagrams to port 5001 that can be read: expected those of the link, found 4 frames: TCP 2, ARP 1, UDP to other ports 1"
    );
    assert_eq!(said(&file(&[]), None), "the capture of the receiver holds no frame: expected UDP datagrams of the link");
    assert_eq!(
        said(&file(&[arp.clone(), arp.clone()])[..40], None),
        "the capture of the receiver holds no frame, then the file ends within a block: expected UDP datagrams of the link"
    );
    // A datagram without an identification and without captured payload cannot be distinguished from others.
    let short = cut(&packet(0, 0, b"hi"), 42);
    assert_eq!(
        said(&file(&[arp, short]), None),
        "the capture of the receiver has no UDP datagrams that can be read: expected those of the link, found 2 frames: ARP 1, UDP cut before its payload 1"
    );
}
