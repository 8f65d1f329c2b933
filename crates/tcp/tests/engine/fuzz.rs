//! Connections under arbitrary segments: no panic, no octet lost or invented, and no acknowledgement of data that has not arrived.

use std::time::Duration;

use cohaptic_tcp::{CongestionControl, Connection, Ecn, Error, Flags, Options, SackBlocks, Segment, TcpConfig};
use cohaptic_tests_common::properties;
use cohaptic_units::Instant;
use proptest::prelude::*;

use crate::world::{Program, World, octet};

fn any_options() -> impl Strategy<Value = Options> {
    let blocks = prop::collection::vec((any::<u32>(), 0u32..5000), 0..5);
    (prop::option::of(any::<u16>()), prop::option::of(any::<u8>()), any::<bool>(), prop::option::of((any::<u32>(), any::<u32>())), blocks).prop_map(
        |(mss, window_scale, sack_permitted, timestamps, blocks)| {
            let mut sack = SackBlocks::default();
            blocks.iter().for_each(|(start, length)| sack.push(*start, start.wrapping_add(*length)));
            Options { mss, window_scale, sack_permitted, timestamps, sack }
        },
    )
}

/// Random segment. `sequence` and `acknowledgement` are offsets from the numbers that the end expects, so that many segments are close to valid. The payload
/// has the octets of its place in the stream.
#[derive(Clone, Debug)]
struct Shot {
    sequence: i32,
    acknowledgement: i32,
    flags: u8,
    window: u16,
    length: u16,
    options: Options,
    blocks: Vec<(i32, u16)>,
    after: u32,
    ecn: bool,
}

fn any_shot() -> impl Strategy<Value = Shot> {
    let near = || prop_oneof![4 => -10i32..10, 4 => -6000i32..6000, 1 => any::<i32>()];
    let flags = prop_oneof![8 => Just(Flags::ACK.bits()), 2 => Just((Flags::ACK | Flags::FIN).bits()), 1 => any::<u8>()];
    let blocks = prop::collection::vec((-6000i32..6000, any::<u16>()), 0..4);
    let after = prop_oneof![0u32..1000, any::<u32>()];
    (near(), near(), flags, any::<u16>(), prop_oneof![Just(0u16), 0u16..3000], any_options(), blocks, after, any::<bool>()).prop_map(
        |(sequence, acknowledgement, flags, window, length, options, blocks, after, ecn)| Shot {
            sequence,
            acknowledgement,
            flags,
            window,
            length,
            options,
            blocks,
            after,
            ecn,
        },
    )
}

/// Knowledge of a peer that sees every segment of the end.
struct Observer {
    now: Instant,
    /// Sequence number of the first octet from the peer, as its SYN tells. `ours` is the sequence number of the first octet from the end.
    theirs: u32,
    ours: u32,
    expected: u32,
    next: u32,
    read: u64,
    written: u64,
}

impl Observer {
    fn see(&mut self, segment: &Segment<'static>, most_known: u64, fin_was_sent: bool) {
        if segment.flags.has(Flags::RST) {
            return;
        }
        if segment.flags.has(Flags::ACK) {
            let acked = segment.acknowledgement.wrapping_sub(self.theirs);
            if acked < 1 << 31 {
                assert!(u64::from(acked) <= most_known + u64::from(fin_was_sent), "{acked} acknowledged, {most_known} sent");
                self.expected = segment.acknowledgement;
            }
        }
        if !segment.payload.is_empty() {
            let from = u64::from(segment.sequence.wrapping_sub(self.ours));
            let right = segment.payload.iter().zip(from..).all(|(seen, at)| *seen == octet(at));
            assert!(right && from + segment.payload.len() as u64 <= self.written, "octets that were never written");
        }
        self.next = segment.sequence.wrapping_add(u32::try_from(segment.sequence_length()).unwrap());
    }
}

fn fire(config: TcpConfig, shots: Vec<Shot>) {
    let (us, them) = ("10.0.0.1:1".parse().unwrap(), "10.0.0.2:2".parse().unwrap());
    let mut end = Connection::connect(Instant::ZERO, config.clone(), us, them, 0xffff_f000).unwrap();
    let mut peer = Connection::accept(Instant::ZERO, config, &end.poll_transmit(Instant::ZERO).unwrap(), 0xffff_ff00).unwrap();
    let answer = peer.poll_transmit(Instant::ZERO).unwrap();
    end.handle_segment(Instant::ZERO, &answer);
    let mut seen =
        Observer { now: Instant::ZERO, theirs: 0xffff_ff01, ours: 0xffff_f001, expected: 0xffff_ff01, next: 0xffff_f001, read: 0, written: 0 };
    let (mut most_known, mut fin_was_sent) = (0, false);
    for shot in shots {
        let chunk: Vec<u8> = (seen.written..seen.written + 5000).map(octet).collect();
        if let Ok(count) = end.write(&chunk) {
            seen.written += count as u64;
        }
        let sequence = seen.expected.wrapping_add_signed(shot.sequence);
        // Places before the beginning of the stream have no octet, so any value will do.
        let from = i64::from(sequence.wrapping_sub(seen.theirs).cast_signed());
        let end_at = from + i64::from(shot.length);
        let payload: Vec<u8> = (from..end_at).map(|at| u64::try_from(at).map_or(0, octet)).collect();
        let mut options = Options { mss: None, window_scale: None, ..shot.options };
        for (start, length) in &shot.blocks {
            let start = seen.next.wrapping_add_signed(*start);
            options.sack.push(start, start.wrapping_add(u32::from(*length)));
        }
        let segment = Segment {
            source: them,
            destination: us,
            sequence,
            acknowledgement: seen.next.wrapping_add_signed(shot.acknowledgement),
            flags: Flags::from_bits(shot.flags),
            window: shot.window,
            options,
            ecn: if shot.ecn { Ecn::Congestion } else { Ecn::NotCapable },
            ttl: 64,
            payload: payload.into(),
        };
        most_known = most_known.max(u64::try_from(end_at).unwrap_or(0));
        fin_was_sent |= segment.flags.has(Flags::FIN);
        seen.now = seen.now.saturating_add(Duration::from_micros(u64::from(shot.after)));
        if let Some(at) = end.poll_timeout().filter(|at| *at <= seen.now) {
            end.handle_timeout(at);
        }
        end.handle_timeout(seen.now);
        end.handle_segment(seen.now, &segment);
        let mut count = 0;
        while let Some(segment) = end.poll_transmit(seen.now) {
            seen.see(&segment, most_known, fin_was_sent);
            count += 1;
            assert!(count < 20_000, "it sends without end");
        }
        let mut chunk = [0; 5000];
        match end.read(&mut chunk) {
            Ok(count) => {
                assert!(chunk[..count].iter().zip(seen.read..).all(|(seen, at)| *seen == octet(at)), "octets that were never sent");
                seen.read += count as u64;
                assert!(seen.read <= most_known);
            }
            Err(error) => assert!(matches!(error, Error::WouldBlock | Error::ConnectionReset | Error::TimedOut | Error::BrokenPipe)),
        }
    }
}

impl World {
    /// Returns the error with which an end has failed. The connection is asked too, because a program that has read the end of the stream gets no later error.
    fn failure(&self, side: usize) -> Option<Error> {
        self.programs[side].error.map(|(_, error)| error).or_else(|| self.ends[side].as_ref()?.error())
    }

    /// Returns whether an end may fail with `error`. A time-out needs at least 63 s without a segment, the time for which an end repeats its SYN
    /// with ACK and the least of all limits. A reset needs a peer that was over before.
    fn is_legitimate(&self, side: usize, error: Error) -> bool {
        let silence = self.closed_at[side].map(|at| at.saturating_duration_since(self.heard_at[side]));
        let is_peer_over = self.closed_at[1 - side].is_some_and(|over| self.closed_at[side].is_some_and(|at| over <= at));
        if error == Error::TimedOut { silence.is_some_and(|silence| silence >= Duration::from_secs(63)) } else { is_peer_over }
    }
}

properties! {
    #![proptest_config(ProptestConfig { failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_segment_is_the_same_after_the_wire(
        (ports, numbers, flags, window) in (any::<(u16, u16)>(), any::<(u32, u32)>(), any::<u8>(), any::<u16>()),
        (options, payload, is_v6, ttl) in (any_options(), prop::collection::vec(any::<u8>(), 0..1400), any::<bool>(), 1u8..),
        flip in any::<prop::sample::Index>(),
    ) {
        let [a, b] = if is_v6 { ["fd00::1", "fd00::2"] } else { ["10.1.2.3", "10.3.2.1"] };
        let mut options = options;
        options.sack.truncate(if options.timestamps.is_some() || options.mss.is_some() { 2 } else { 3 });
        let segment = Segment {
            source: std::net::SocketAddr::new(a.parse().unwrap(), ports.0),
            destination: std::net::SocketAddr::new(b.parse().unwrap(), ports.1),
            sequence: numbers.0,
            acknowledgement: numbers.1,
            flags: Flags::from_bits(flags),
            window,
            options,
            ecn: Ecn::Capable0,
            ttl,
            payload: payload.into(),
        };
        let packet = segment.to_packet();
        prop_assert_eq!(packet.len(), segment.packet_length());
        let read = Segment::parse(&packet);
        prop_assert_eq!(read.as_ref(), Ok(&segment));
        // One bit that is flipped is seen, but in the hop limit and the flow label of IPv6, which no checksum covers.
        let mut damaged = packet.clone();
        let bit = flip.index(packet.len() * 8);
        damaged[bit / 8] ^= 1 << (bit % 8);
        prop_assert!(Segment::parse(&damaged).is_err() || (is_v6 && (bit / 8 < 4 || bit / 8 == 7)), "bit {bit} was not seen");
        prop_assert!(Segment::parse(&packet[..flip.index(packet.len())]).is_err());
    }

    #[test]
    fn any_octets_are_read_or_refused(octets in prop::collection::vec(any::<u8>(), 0..200), version in prop_oneof![Just(0x45u8), Just(0x60), any::<u8>()]) {
        let mut octets = octets;
        if let Some(first) = octets.first_mut() {
            *first = version;
        }
        let _ = Segment::parse(&octets);
    }

    #[test]
    fn any_segments_do_no_harm(shots in prop::collection::vec(any_shot(), 1..60), kind in 0usize..5) {
        let configs = [
            TcpConfig::default(),
            TcpConfig::textbook(),
            TcpConfig { ecn: true, rack: false, receive_buffer: Some(5000), ..TcpConfig::default() },
            TcpConfig { receive_buffer: Some(100_000), timestamps: false, keepalive: Some(Default::default()), ..TcpConfig::default() },
            TcpConfig { congestion: CongestionControl::Dctcp, ..TcpConfig::default() },
        ];
        fire(configs[kind].clone(), shots);
    }

    #[test]
    fn any_links_deliver_or_tell(
        (delay, jitter, loss, duplicate) in (0u32..80, 0u32..30, 0u32..25, 0u32..20),
        seed in any::<u64>(),
        (there, back) in (0u64..60_000, 0u64..60_000),
        kind in 0usize..5,
    ) {
        let jitter = jitter.min(delay);
        let words = format!("delay {delay}ms {jitter}ms loss {loss}% duplicate {duplicate}%");
        let configs = [
            TcpConfig::default(),
            TcpConfig::textbook(),
            TcpConfig { rack: false, receive_buffer: Some(8000), nodelay: true, ..TcpConfig::default() },
            TcpConfig { sack: false, ecn: true, ..TcpConfig::default() },
            TcpConfig { congestion: CongestionControl::Dctcp, ..TcpConfig::default() },
        ];
        let mut world = World::new(&words, seed)
            .config(&configs[kind])
            .programs(Program::writes(there).and_shuts(), Program::writes(back).and_shuts());
        // Marks at random places, by a generator that needs no state but a number.
        let mut state = seed;
        world.marks = Box::new(move |_, _| {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            state >> 62 == 0
        });
        let mut world = world.connect();
        world.run_until(Instant::from_nanos(1_000_000_000_000_000));
        let failures: Vec<(usize, Error)> = (0..2).filter_map(|side| Some((side, world.failure(side)?))).collect();
        for (side, error) in &failures {
            prop_assert!(world.is_legitimate(*side, *error), "{error:?} of end {side} {:?}", world);
        }
        if failures.is_empty() {
            prop_assert_eq!([world.programs[1].read, world.programs[0].read], [there, back], "{:?}", world);
            prop_assert!(world.ends.iter().flatten().all(Connection::is_finished), "{:?}", world);
        }
    }
}
