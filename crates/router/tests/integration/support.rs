//! Packets and files for several tests.

use std::path::Path;

use cohaptic_linkfile::router::RouterFile;
use cohaptic_router::{Framing, Packet};
use etherparse::PacketBuilder;

/// Returns the configuration with the given links, rules and default, between two TUN devices.
pub(crate) fn file(text: &str) -> RouterFile {
    let sides = "left = { tun = \"a\" }\nright = { tun = \"b\" }\n";
    RouterFile::parse(&format!("{sides}{text}"), Path::new("router.toml"), &[]).unwrap_or_else(|error| panic!("{error}"))
}

/// Returns a UDP packet from 10.1.0.1 to 10.2.0.1 with `data` bytes of data.
pub(crate) fn udp(ports: [u16; 2], data: usize) -> Packet {
    Packet::new(udp_bytes(ports, &vec![7; data]), Framing::Ip)
}

pub(crate) fn udp_bytes(ports: [u16; 2], data: &[u8]) -> Vec<u8> {
    let mut bytes = Vec::new();
    PacketBuilder::ipv4([10, 1, 0, 1], [10, 2, 0, 1], 64).udp(ports[0], ports[1]).write(&mut bytes, data).unwrap();
    bytes
}
