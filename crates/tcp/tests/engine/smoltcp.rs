//! This engine against smoltcp, an independent implementation, over links of the emulator.

use std::collections::VecDeque;

use cohaptic_tcp::{Connection, Segment, TcpConfig};
use cohaptic_tests_common::properties;
use cohaptic_units::{Bytes, Instant};
use cohaptic_wan::{Fate, Link, LinkName};
use proptest::prelude::*;
use smoltcp::iface::{Config, Interface, SocketHandle, SocketSet};
use smoltcp::phy::{Device, DeviceCapabilities, Medium, RxToken, TxToken};
use smoltcp::socket::tcp;
use smoltcp::time::Instant as TheirInstant;
use smoltcp::wire::{HardwareAddress, IpAddress, IpCidr};

use crate::world::{link, octet};

/// Network device of smoltcp: queues of the packets that have arrived and of the packets that leave.
#[derive(Default)]
struct Packets {
    arrived: VecDeque<Vec<u8>>,
    leaving: VecDeque<Vec<u8>>,
}

struct Arrived(Vec<u8>);
struct Leaving<'a>(&'a mut VecDeque<Vec<u8>>);

impl RxToken for Arrived {
    fn consume<R, F: FnOnce(&[u8]) -> R>(self, take: F) -> R {
        take(&self.0)
    }
}

impl TxToken for Leaving<'_> {
    fn consume<R, F: FnOnce(&mut [u8]) -> R>(self, length: usize, fill: F) -> R {
        let mut packet = vec![0; length];
        let result = fill(&mut packet);
        self.0.push_back(packet);
        result
    }
}

impl Device for Packets {
    type RxToken<'a> = Arrived;
    type TxToken<'a> = Leaving<'a>;

    fn receive(&mut self, _: TheirInstant) -> Option<(Arrived, Leaving<'_>)> {
        Some((Arrived(self.arrived.pop_front()?), Leaving(&mut self.leaving)))
    }

    fn transmit(&mut self, _: TheirInstant) -> Option<Leaving<'_>> {
        Some(Leaving(&mut self.leaving))
    }

    fn capabilities(&self) -> DeviceCapabilities {
        let mut capabilities = DeviceCapabilities::default();
        (capabilities.medium, capabilities.max_transmission_unit) = (Medium::Ip, 1500);
        capabilities
    }
}

/// End of smoltcp: an interface with one listening socket.
struct Theirs {
    packets: Packets,
    interface: Interface,
    sockets: SocketSet<'static>,
    handle: SocketHandle,
    read: u64,
    written: u64,
}

/// Converts an instant to an instant of smoltcp, rounded down to a microsecond.
fn their_time(now: Instant) -> TheirInstant {
    TheirInstant::from_micros(i64::try_from(now.as_nanos() / 1000).unwrap())
}

impl Theirs {
    fn new() -> Self {
        let mut packets = Packets::default();
        let mut interface = Interface::new(Config::new(HardwareAddress::Ip), &mut packets, TheirInstant::ZERO);
        interface.update_ip_addrs(|addresses| addresses.push(IpCidr::new(IpAddress::v4(10, 0, 0, 2), 24)).unwrap());
        let buffer = || tcp::SocketBuffer::new(vec![0; 20_000]);
        let mut socket = tcp::Socket::new(buffer(), buffer());
        socket.listen(80).unwrap();
        let mut sockets = SocketSet::new(Vec::new());
        let handle = sockets.add(socket);
        Self { packets, interface, sockets, handle, read: 0, written: 0 }
    }

    fn act(&mut self, now: Instant, to_write: u64) {
        self.interface.poll(their_time(now), &mut self.packets, &mut self.sockets);
        let socket = self.sockets.get_mut::<tcp::Socket<'_>>(self.handle);
        let mut chunk = [0; 4096];
        while let Ok(count @ 1..) = socket.recv_slice(&mut chunk) {
            assert!(chunk[..count].iter().zip(self.read..).all(|(seen, at)| *seen == octet(at)), "they read wrong octets");
            self.read += count as u64;
        }
        while socket.can_send() && self.written < to_write {
            let data: Vec<u8> = (self.written..to_write.min(self.written + 4096)).map(octet).collect();
            let count = socket.send_slice(&data).unwrap();
            if count == 0 {
                break;
            }
            self.written += count as u64;
        }
        self.interface.poll(their_time(now), &mut self.packets, &mut self.sockets);
    }

    fn next_at(&mut self, now: Instant) -> Option<Instant> {
        let at = self.interface.poll_at(their_time(now), &self.sockets)?;
        let nanos = u64::try_from(at.total_micros()).unwrap() * 1000;
        // What is due at once is done a microsecond later, so that time goes on.
        Some(Instant::from_nanos(nanos.max(now.as_nanos() + 1000)))
    }
}

/// End of this engine, which connects, writes and reads.
struct Ours {
    end: Connection,
    read: u64,
    written: u64,
}

impl Ours {
    fn act(&mut self, to_write: u64) {
        while self.written < to_write {
            let data: Vec<u8> = (self.written..to_write.min(self.written + 4096)).map(octet).collect();
            let Ok(count) = self.end.write(&data) else { break };
            self.written += count as u64;
        }
        let mut chunk = [0; 4096];
        while let Ok(count @ 1..) = self.end.read(&mut chunk) {
            assert!(chunk[..count].iter().zip(self.read..).all(|(seen, at)| *seen == octet(at)), "we read wrong octets");
            self.read += count as u64;
        }
    }
}

/// Returns the instant at which both ends have read all octets, or `None` if an hour is not enough. `there` and `back` are the octets written by this engine
/// and by smoltcp.
fn dialogue(words: &str, seed: u64, config: TcpConfig, [there, back]: [u64; 2]) -> Option<Instant> {
    let mut now = Instant::ZERO;
    let mut links = [0, 1].map(|side| Link::new(seed, &LinkName::between("ours", if side == 0 { "there" } else { "back" }), link(words)));
    let end = Connection::connect(now, config, "10.0.0.1:5000".parse().unwrap(), "10.0.0.2:80".parse().unwrap(), 1).unwrap();
    let mut ours = Ours { end, read: 0, written: 0 };
    let mut theirs = Theirs::new();
    loop {
        ours.act(there);
        while let Some(segment) = ours.end.poll_transmit(now) {
            let packet = segment.to_packet();
            links[0].handle_packet(now, Bytes::new(packet.len() as u64), packet).unwrap();
        }
        theirs.act(now, back);
        for packet in theirs.packets.leaving.drain(..) {
            links[1].handle_packet(now, Bytes::new(packet.len() as u64), packet).unwrap();
        }
        if theirs.read == there && ours.read == back {
            return Some(now);
        }
        let timers = [ours.end.poll_timeout(), theirs.next_at(now)];
        now = links.iter().map(Link::poll_timeout).chain(timers).flatten().min()?;
        if now > Instant::from_nanos(3_600_000_000_000) {
            return None;
        }
        for (side, link) in links.iter_mut().enumerate() {
            link.handle_timeout(now).unwrap();
            while let Some(event) = link.poll_event() {
                match event.record.fate {
                    Fate::Delivered(_) if side == 0 => theirs.packets.arrived.push_back(event.payload),
                    Fate::Delivered(_) => ours.end.handle_segment(now, &Segment::parse(&event.payload).unwrap()),
                    Fate::Dropped(_) | Fate::Duplicated => {}
                }
            }
        }
        ours.end.handle_timeout(now);
    }
}

properties! {
    #![proptest_config(ProptestConfig { cases: 60, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn every_octet_arrives_both_ways(
        (delay, jitter, loss) in (0u32..60, 0u32..20, 0u32..8),
        seed in any::<u64>(),
        octets in (0u64..100_000, 0u64..100_000),
        is_textbook in any::<bool>(),
    ) {
        let words = format!("delay {delay}ms {}ms loss {loss}%", jitter.min(delay));
        let config = if is_textbook { TcpConfig::textbook() } else { TcpConfig::default() };
        prop_assert!(dialogue(&words, seed, config, [octets.0, octets.1]).is_some(), "{words}");
    }
}
