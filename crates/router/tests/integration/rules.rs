//! Rules compared with a table of packets.

use cohaptic_linkfile::router::{Side, Target};
use cohaptic_router::{Decided, Framing, Headers, Packet, Rules};
use etherparse::{IpNumber, PacketBuilder};

use crate::support::{file, udp_bytes};

const RULES: &str = r#"
    router = { default = { left-to-right = "up", right-to-left = "down" } }
    links = { up = {}, down = {}, voice = {}, web = {} }
    rules = [
        { from = "right", protocol = "udp", source-port = "6000-6009", link = "voice" },
        { protocol = "tcp", port = 80, link = "web" },
        { source = "10.9.0.0/16", destination = "10.2.0.0/24", link = "drop" },
        { protocol = "icmpv6", link = "pass" },
        { protocol = "icmp", link = "pass" },
        { destination = "fd00::/64", destination-port = 53, link = "voice" },
        { protocol = 253, link = "drop" },
    ]
"#;

fn v4(source: [u8; 4], destination: [u8; 4], protocol: &str, ports: [u16; 2]) -> Vec<u8> {
    let builder = PacketBuilder::ipv4(source, destination, 64);
    let mut bytes = Vec::new();
    match protocol {
        "tcp" => builder.tcp(ports[0], ports[1], 0, 0).write(&mut bytes, &[]).unwrap(),
        "udp" => builder.udp(ports[0], ports[1]).write(&mut bytes, &[]).unwrap(),
        "icmp" => builder.icmpv4_echo_request(0, 0).write(&mut bytes, &[]).unwrap(),
        _ => builder.write(&mut bytes, IpNumber(253), &[]).unwrap(),
    }
    bytes
}

fn v6(destination: u8, port: u16) -> Vec<u8> {
    let mut bytes = Vec::new();
    let address = [0xfd, 0, 0, 0, 0, 0, 0, destination, 0, 0, 0, 0, 0, 0, 0, 1];
    PacketBuilder::ipv6([1; 16], address, 64).udp(1, port).write(&mut bytes, &[]).unwrap();
    bytes
}

#[test]
fn the_first_rule_that_applies_decides() {
    let rules = Rules::new(&file(RULES));
    assert_eq!((rules.len(), rules.is_empty()), (7, false));
    let (one, two, nine) = ([10, 1, 0, 1], [10, 2, 0, 1], [10, 9, 8, 7]);
    let [up, down, voice, web] = [0, 1, 2, 3].map(Target::Link);
    let rule = Decided::Rule;
    let mut icmpv6 = Vec::new();
    PacketBuilder::ipv6([1; 16], [2; 16], 64).icmpv6_echo_request(1, 1).write(&mut icmpv6, &[]).unwrap();
    let cases = [
        (Side::Right, udp_bytes([6000, 9], &[]), rule(0), voice),
        (Side::Right, udp_bytes([6009, 9], &[]), rule(0), voice),
        (Side::Right, udp_bytes([5999, 9], &[]), Decided::Default, down),
        (Side::Right, udp_bytes([6010, 9], &[]), Decided::Default, down),
        (Side::Left, udp_bytes([6000, 9], &[]), Decided::Default, up),
        (Side::Left, udp_bytes([9, 6000], &[]), Decided::Default, up),
        (Side::Left, v4(one, two, "tcp", [80, 9999]), rule(1), web),
        (Side::Right, v4(two, one, "tcp", [9999, 80]), rule(1), web),
        // Both of the next two rules apply, and the first one decides.
        (Side::Left, v4(nine, two, "tcp", [80, 1]), rule(1), web),
        (Side::Left, v4(nine, two, "tcp", [81, 1]), rule(2), Target::Drop),
        (Side::Left, v4(nine, [10, 2, 1, 1], "tcp", [81, 1]), Decided::Default, up),
        (Side::Left, v4(one, two, "udp", [80, 80]), Decided::Default, up),
        (Side::Left, v4(one, two, "icmp", [0, 0]), rule(4), Target::Pass),
        (Side::Left, v4(nine, two, "icmp", [0, 0]), rule(2), Target::Drop),
        (Side::Right, icmpv6, rule(3), Target::Pass),
        (Side::Left, v6(0, 53), rule(5), voice),
        (Side::Left, v6(1, 53), Decided::Default, up),
        (Side::Left, v6(0, 54), Decided::Default, up),
        (Side::Left, v4(one, two, "other", [0, 0]), rule(6), Target::Drop),
    ];
    for (place, (from, bytes, decided, target)) in cases.into_iter().enumerate() {
        let headers = Headers::read(Packet::new(bytes, Framing::Ip).bytes()).unwrap();
        assert_eq!(rules.choose(from, &headers), (decided, target), "case {place}");
    }
}

/// A rule that names a port does not apply to a packet without ports, for any range of ports.
#[test]
fn a_packet_without_ports_has_none_that_matches() {
    let rules = Rules::new(&file("router = { default = \"pass\" }\nrules = [{ port = \"0-65535\", link = \"drop\" }]"));
    let choose = |bytes: &[u8]| rules.choose(Side::Left, &Headers::read(bytes).unwrap()).1;
    assert_eq!(choose(&udp_bytes([1, 2], &[])), Target::Drop);
    let mut fragment = udp_bytes([1, 2], &[0; 8]);
    fragment[7] = 1;
    assert_eq!(choose(&fragment), Target::Pass);
    assert_eq!(choose(&v4([1; 4], [2; 4], "icmp", [0, 0])), Target::Pass);
}
