//! Segments of devices without devices, for the fuzz target `offload`. Compiled with `--cfg fuzzing` alone.

use std::sync::Arc;

use crate::packet::{self, Join, Packet, slices};

/// The packets of what a device gave: a header of virtio, and a packet or a segment.
#[must_use]
pub fn cut(bytes: &[u8]) -> Vec<Packet> {
    let mut packets = Vec::new();
    packet::cut(bytes, &mut packets);
    packets
}

/// The number of the first packets that go to a device together, and the bytes that the device gets.
#[must_use]
pub fn join(packets: &[Arc<Packet>]) -> (usize, Vec<u8>) {
    let mut head = Vec::new();
    let count = packet::join(packets, Join::TcpAndUdp, &mut head);
    let bytes = slices(&packets[..count], &head).iter().flat_map(|slice| slice.to_vec()).collect();
    (count, bytes)
}
