//! Simulated FT232R chip: bytes take their time on the wire, and go to the host in packets, when a packet is full or the latency timer ends.

use core::time::Duration;
use std::collections::VecDeque;

use cohaptic_units::Instant;

use crate::ftdi::{BAUD_RUNNING, PACKET, PAYLOAD, STATUS, byte_time};

/// Status bytes of a chip without errors, at the beginning of every packet.
const STATUS_BYTES: [u8; STATUS] = [0x01, 0x60];
/// Initial capacity of the queues \[bytes\], enough for ordinary use, so that no allocation happens later.
const ROOM: usize = 4096;

#[derive(Clone, Debug)]
pub(super) struct Chip {
    divisor: u16,
    latency: Duration,
    /// Bytes on the way to the device, each with the time of its arrival.
    to_device: VecDeque<(Instant, u8)>,
    /// Bytes on the way to the host, each with the time of its arrival at the chip.
    to_host: VecDeque<(Instant, u8)>,
    /// Arrival of the last byte sent to the device.
    last_to_device: Instant,
    /// Arrival of the last byte sent to the host.
    last_to_host: Instant,
    /// Time of the last restart of the latency timer, which every packet restarts.
    timer: Instant,
}

impl Chip {
    pub(super) fn new() -> Self {
        Self {
            divisor: BAUD_RUNNING,
            latency: Duration::from_millis(16),
            to_device: VecDeque::with_capacity(ROOM),
            to_host: VecDeque::with_capacity(ROOM),
            last_to_device: Instant::ZERO,
            last_to_host: Instant::ZERO,
            timer: Instant::ZERO,
        }
    }

    pub(super) const fn divisor(&self) -> u16 {
        self.divisor
    }

    pub(super) const fn set_divisor(&mut self, divisor: u16) {
        self.divisor = divisor;
    }

    pub(super) const fn set_latency(&mut self, latency: Duration) {
        self.latency = latency;
    }

    pub(super) fn send_to_device(&mut self, now: Instant, byte: u8) {
        // The wire carries one byte at a time, so a byte starts after the byte before it.
        self.last_to_device = self.last_to_device.max(now) + byte_time(self.divisor);
        self.to_device.push_back((self.last_to_device, byte));
    }

    pub(super) fn send_to_host(&mut self, at: Instant, byte: u8) {
        self.last_to_host = self.last_to_host.max(at) + byte_time(self.divisor);
        self.to_host.push_back((self.last_to_host, byte));
    }

    pub(super) fn next_heard(&self) -> Option<Instant> {
        self.to_device.front().map(|(at, _)| *at)
    }

    pub(super) fn next_for_device(&mut self, until: Instant) -> Option<(Instant, u8)> {
        if self.next_heard()? <= until { self.to_device.pop_front() } else { None }
    }

    pub(super) fn next_packet(&self) -> Instant {
        let timer = self.timer.saturating_add(self.latency);
        // The packet is full with the last byte of its payload; an earlier end of the timer sends it as it is.
        self.to_host.get(PAYLOAD - 1).map_or(timer, |(full, _)| timer.min(*full))
    }

    /// Fills a packet with the arrived bytes, at most `most` bytes for a fragment, and returns the length of the packet with its status bytes.
    pub(super) fn take_packet(&mut self, now: Instant, into: &mut [u8; PACKET], most: Option<usize>) -> usize {
        // Every packet restarts the latency timer, also an empty one.
        self.timer = now;
        into[..STATUS].copy_from_slice(&STATUS_BYTES);
        // Status bytes are part of every packet, also of a fragment.
        let room = most.unwrap_or(PAYLOAD).min(PAYLOAD);
        let mut length = STATUS;
        while length < STATUS + room
            && let Some((at, byte)) = self.to_host.front().copied()
            && at <= now
        {
            into[length] = byte;
            length += 1;
            self.to_host.pop_front();
        }
        length
    }

    pub(super) fn purge_to_host(&mut self, now: Instant) {
        // Bytes that are still on the wire have not reached the chip's buffer.
        self.to_host.retain(|(at, _)| *at > now);
    }

    pub(super) fn purge_to_device(&mut self) {
        self.to_device.clear();
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ftdi::BAUD_HANDSHAKE;

    fn micros(micros: u64) -> Instant {
        Instant::ZERO + Duration::from_micros(micros)
    }

    #[test]
    fn the_timer_decides_when_few_bytes_go() {
        let mut chip = Chip::new();
        chip.set_latency(Duration::from_millis(1));
        for byte in 0..16 {
            chip.send_to_host(micros(300), byte);
        }
        assert_eq!(chip.next_packet(), micros(1000));
        let mut packet = [0; PACKET];
        assert_eq!(chip.take_packet(micros(1000), &mut packet, None), 18);
        assert_eq!(packet[..18], [1, 0x60, 0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15]);
        // Without further bytes, an empty packet follows at the next end of the timer.
        assert_eq!(chip.next_packet(), micros(2000));
        assert_eq!(chip.take_packet(micros(2000), &mut packet, None), 2);
    }

    #[test]
    fn a_full_packet_goes_at_once() {
        let mut chip = Chip::new();
        for _ in 0..100 {
            chip.send_to_host(Instant::ZERO, b'x');
        }
        let full = Instant::ZERO + byte_time(BAUD_RUNNING) * 62;
        assert_eq!(chip.next_packet(), full);
        assert_eq!(chip.take_packet(full, &mut [0; PACKET], None), 64);
        assert_eq!(chip.next_packet(), full + Duration::from_millis(16));
    }

    #[test]
    fn bytes_take_the_time_of_their_speed() {
        let mut chip = Chip::new();
        chip.set_divisor(BAUD_HANDSHAKE);
        chip.send_to_device(Instant::ZERO, 1);
        chip.send_to_device(Instant::ZERO, 2);
        assert_eq!(chip.next_for_device(micros(1041)), None);
        assert_eq!(chip.next_for_device(micros(2084)).map(|(_, byte)| byte), Some(1));
        assert_eq!(chip.next_for_device(micros(2084)).map(|(_, byte)| byte), Some(2));
    }
}
