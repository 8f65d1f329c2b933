//! A flight has the segments that leave one by one, and a segment with nothing but the next data is handled like any other segment.

use std::fmt::Debug;
use std::iter::from_fn;
use std::mem::take;
use std::time::Duration;

use cohaptic_tcp::{CongestionControl, Connection, Ecn, Flags, Flight, Segment, TcpConfig};
use cohaptic_tests_common::properties;
use cohaptic_units::Instant;
use proptest::prelude::*;

use crate::world::octet;

/// One end of a connection twice. Segments of `alone` leave one by one, and no segment that arrives is expected. Segments of `together` leave in a flight.
struct Twins {
    alone: Connection,
    together: Connection,
    flight: Flight,
    /// Segments that have left `alone` since the last [`depart`](Self::depart).
    left: Vec<Segment<'static>>,
    written: u64,
}

impl Twins {
    fn new(connection: Connection) -> Self {
        Self { alone: connection.clone(), together: connection, flight: Flight::default(), left: Vec::new(), written: 0 }
    }

    /// Calls both connections, and lets segments leave.
    fn call<T: PartialEq + Debug>(&mut self, now: Instant, call: impl Fn(&mut Connection) -> T) -> T {
        let answer = call(&mut self.alone);
        assert_eq!(answer, call(&mut self.together));
        self.transmit(now);
        answer
    }

    fn transmit(&mut self, now: Instant) {
        self.left.extend(from_fn(|| self.alone.poll_transmit(now)));
        self.together.transmit(now, &mut self.flight);
    }

    fn hear(&mut self, now: Instant, segment: Segment<'static>) {
        // The connection ignores the flag URG, but expects no segment that has the flag.
        self.alone.handle_segment(now, &Segment { flags: segment.flags | Flags::URG, ..segment.clone() });
        let mut arriving = Flight::default();
        arriving.push(segment);
        assert!(self.together.handle_next(now, &mut arriving) && arriving.is_empty());
        self.transmit(now);
    }

    /// Returns the segments that have left.
    fn depart(&mut self) -> Vec<Segment<'static>> {
        let lengths = self.left.iter().map(Segment::packet_length).sum::<usize>();
        assert_eq!((self.flight.len(), self.flight.packet_lengths()), (self.left.len(), lengths));
        let taken: Vec<_> = from_fn(|| self.flight.pop_front()).collect();
        self.flight.clear();
        assert_eq!(taken, self.left);
        assert_eq!((self.alone.info(), self.alone.poll_timeout()), (self.together.info(), self.together.poll_timeout()));
        take(&mut self.left)
    }
}

/// Returns all state but the pieces in which unread octets are kept: neighbours in memory are one piece.
fn kept(connection: &Connection) -> String {
    let text = format!("{connection:?}");
    let [pieces, rest] = ["assembler: ", "tuning: "].map(|field| text.find(field).expect("fields of a connection"));
    format!("{}{}", &text[..pieces], &text[rest..])
}

#[derive(Clone, Copy, Debug)]
enum Step {
    Write(usize),
    Read(usize),
    /// Segments arrive after a millisecond, at both ends.
    Pass,
    /// Time passes, and no segment arrives \[ms\].
    Wait(u64),
    Shutdown,
}

fn step() -> impl Strategy<Value = (usize, Step)> {
    let step = prop_oneof![
        4 => (1usize..40_000).prop_map(Step::Write),
        4 => (1usize..100_000).prop_map(Step::Read),
        8 => Just(Step::Pass),
        1 => (1u64..400).prop_map(Step::Wait),
        1 => prop_oneof![9 => Just(Step::Pass), 1 => Just(Step::Shutdown)],
    ];
    (prop_oneof![3 => Just(0usize), 1 => Just(1usize)], step)
}

fn config() -> impl Strategy<Value = TcpConfig> {
    let base = prop_oneof![3 => Just(TcpConfig::default()), 1 => Just(TcpConfig::textbook())];
    let receive_buffer = prop_oneof![3 => Just(None), 1 => (2000usize..60_000).prop_map(Some)];
    (base, receive_buffer, 300usize..1500, any::<bool>(), 0..4, any::<u32>()).prop_map(|(base, receive_buffer, mtu, nodelay, kind, sequence)| {
        TcpConfig {
            receive_buffer: receive_buffer.or(base.receive_buffer),
            mtu: if nodelay { mtu } else { base.mtu },
            nodelay,
            ecn: kind < 2,
            congestion: if kind == 0 { CongestionControl::Dctcp } else { base.congestion },
            initial_sequence: (kind == 3).then_some(sequence),
            ..base
        }
    })
}

/// Returns whether the next event happens, once for each `every` draws on average. Zero stands for never.
fn draws(state: &mut u64, every: u64) -> bool {
    *state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
    every > 0 && (*state >> 33).is_multiple_of(every)
}

properties! {
    #![proptest_config(ProptestConfig { cases: 300, failure_persistence: None, ..ProptestConfig::default() })]

    #[test]
    fn a_flight_has_the_segments_that_leave_one_by_one(
        steps in prop::collection::vec(step(), 1..80),
        config in config(),
        lost_every in prop_oneof![Just(0), 5u64..100],
        marked_every in prop_oneof![Just(0), 5u64..50],
        mut state in any::<u64>(),
    ) {
        let mut now = Instant::ZERO;
        let (client, server) = ("10.0.0.1:50000".parse().unwrap(), "10.0.0.2:80".parse().unwrap());
        let mut client = Twins::new(Connection::connect(now, config.clone(), client, server, 1).unwrap());
        client.transmit(now);
        let syn = client.depart();
        let mut server = Twins::new(Connection::accept(now, config, &syn[0], 2).unwrap());
        server.transmit(now);
        let mut queues = [server.depart(), Vec::new()];
        let mut ends = [client, server];
        for (end, step) in steps.into_iter().chain([(0, Step::Pass), (1, Step::Read(1 << 20)), (0, Step::Pass), (0, Step::Wait(300))].repeat(5)) {
            match step {
                Step::Write(count) => {
                    let from = ends[end].written;
                    let data: Vec<u8> = (from..from + count as u64).map(octet).collect();
                    let written = ends[end].call(now, |connection| connection.write(&data)).unwrap_or(0);
                    ends[end].written += written as u64;
                }
                Step::Read(count) => {
                    let _ = ends[end].call(now, |connection| {
                        let mut data = vec![0; count];
                        (connection.read(&mut data), data)
                    });
                }
                Step::Shutdown => ends[end].call(now, Connection::shutdown),
                Step::Wait(span) => {
                    now += Duration::from_millis(span);
                    ends.iter_mut().for_each(|end| end.call(now, |connection| connection.handle_timeout(now)));
                }
                Step::Pass => {
                    now += Duration::from_millis(1);
                    for (end, arriving) in ends.iter_mut().zip(&mut queues) {
                        for mut segment in take(arriving) {
                            if draws(&mut state, marked_every) && segment.ecn != Ecn::NotCapable {
                                segment.ecn = Ecn::Congestion;
                            }
                            if !draws(&mut state, lost_every) {
                                end.hear(now, segment);
                            }
                        }
                    }
                }
            }
            for (end, other) in [(0, 1), (1, 0)] {
                queues[other].extend(ends[end].depart());
            }
        }
        for end in ends {
            prop_assert_eq!(kept(&end.alone), kept(&end.together));
        }
    }
}
