//! Cutting and joining of segments without devices, for the fuzz target `offload`. Compiled with `--cfg fuzzing` only.

use std::sync::Arc;

use crate::packet::{self, Join, Packet, slices};

/// Returns the packets in the bytes of a device: a virtio header, and a packet or a segment.
#[must_use]
pub fn cut(bytes: &[u8]) -> Vec<Packet> {
    let mut packets = Vec::new();
    packet::cut(bytes, &mut packets);
    packets
}

/// Returns how many of the first packets go to a device together, and the bytes for the device.
#[must_use]
pub fn join(packets: &[Arc<Packet>]) -> (usize, Vec<u8>) {
    let mut head = Vec::new();
    let count = packet::join(packets, Join::TcpAndUdp, &mut head);
    let bytes = slices(&packets[..count], &head).iter().flat_map(|slice| slice.to_vec()).collect();
    (count, bytes)
}
