//! A connection of TCP over a network that loses, repeats, reorders and forges: what is read is what was written, in order, and both ends always come to rest.

use std::sync::OnceLock;
use std::time::Duration;

use cohaptic_tcp::{CongestionControl, Connection, Ecn, Error, Flags, Keepalive, Segment, TcpConfig};
use cohaptic_units::Instant;

use crate::Input;

/// Segments on their way in one direction. What comes when there are more of them is lost.
const MOST_IN_FLIGHT: usize = 64;
/// More segments than an end has reason to send at one instant, and more timers than pass in a step.
const MOST_AT_ONCE: usize = 20_000;

/// The octets from a place of any stream on, so that one that is lost, repeated or invented is seen. Before the stream there are zeros.
fn octets(from: i64, length: usize) -> Vec<u8> {
    /// A prime, so that octets that are a segment apart differ.
    const PERIOD: usize = 8191;
    static PATTERN: OnceLock<Vec<u8>> = OnceLock::new();
    let pattern = PATTERN.get_or_init(|| (0..PERIOD * 4).map(|at| (at % PERIOD * 31 + at % PERIOD / 251) as u8).collect());
    let before = usize::try_from(-from.min(0)).unwrap_or(0).min(length);
    let start = usize::try_from(from.max(0)).unwrap_or(0) % PERIOD;
    [&vec![0; before], &pattern[start..start + length - before]].concat()
}

/// An end of the connection, the program on it, and the segments that the end has sent.
struct Side {
    end: Connection,
    /// The number of the first octet of its stream.
    first: u32,
    written: u64,
    read: u64,
    /// Octets of the peer's stream that it may know: those written, and those that were forged.
    known: u64,
    /// Whether a FIN has been sent or forged, for the one number that it takes.
    heard_end: bool,
    sent: Vec<Segment<'static>>,
}

impl Side {
    fn new(end: Connection) -> Self {
        let first = end.initial_sequences().0.wrapping_add(1);
        Self { end, first, written: 0, read: 0, known: 0, heard_end: false, sent: Vec::new() }
    }
}

struct World {
    now: Instant,
    sides: [Side; 2],
}

fn config(setup: u8) -> TcpConfig {
    let base = if setup & 1 == 0 { TcpConfig::default() } else { TcpConfig::textbook() };
    let keepalive = (setup & 2 == 2).then(Keepalive::default);
    let receive_buffer = [None, Some(5000), Some(100_000), Some(1)][usize::from(setup >> 2 & 3)];
    let congestion = if setup & 128 == 128 { CongestionControl::Dctcp } else { base.congestion };
    let mtu = if setup & 64 == 64 { 300 } else { 1500 };
    TcpConfig { keepalive, receive_buffer, ecn: setup & 16 == 16, nodelay: setup & 32 == 32, mtu, congestion, ..base }
}

/// The first two bytes choose the configuration of the ends, and the rest are what happens to them.
pub fn run(data: &[u8]) {
    let mut input = Input::new(data);
    let [here, there] = [input.byte(), input.byte()].map(config);
    let (client, server) = (([10, 0, 0, 1], 50_000).into(), ([10, 0, 0, 2], 80).into());
    let now = Instant::from_nanos(1_000_000);
    let mut end = Connection::connect(now, here, client, server, 0xffff_fff0).unwrap();
    let syn = end.poll_transmit(now).unwrap();
    let accepted = Connection::accept(now, there, &syn, 0x7fff_ff00).unwrap();
    let mut world = World { now, sides: [Side::new(end), Side::new(accepted)] };
    world.drain();
    while !input.is_empty() {
        let action = input.byte();
        world.act(action & 15, usize::from(action >> 7), &mut input);
        world.drain();
    }
    // Nothing that was sent any more arrives: both ends give up.
    world.pass(Instant::from_nanos(1 << 60));
    for Side { end, .. } in &mut world.sides {
        assert!(end.poll_timeout().is_none_or(|at| at > world.now));
    }
}

impl World {
    fn act(&mut self, action: u8, side: usize, input: &mut Input<'_>) {
        match action {
            0 => self.write(side, usize::from(input.byte()) * 24),
            1 => self.read(side, usize::from(input.byte()) * 32 + 1),
            2 => {
                if let Some(segment) = self.chosen(side, input, true) {
                    self.deliver(side, &segment);
                }
            }
            3 => {
                if let Some(segment) = self.chosen(side, input, false) {
                    self.deliver(side, &segment);
                }
            }
            4 => drop(self.chosen(side, input, true)),
            5 => self.pass(self.now.saturating_add(Duration::from_nanos(1 << (input.byte() % 43)))),
            6 => {
                let next = self.sides.iter().filter_map(|side| side.end.poll_timeout()).min();
                self.pass(next.map_or(self.now, |next| next.max(self.now)));
            }
            7 => self.sides[side].end.shutdown(),
            8 => match input.byte() % 3 {
                0 => self.sides[side].end.abort(),
                _ => self.sides[side].end.close(self.now),
            },
            9 | 10 => self.forge(side, input),
            11 => self.set(side, input),
            12 => {
                if let Some(mut segment) = self.chosen(side, input, true) {
                    segment.ecn = Ecn::Congestion;
                    self.deliver(side, &segment);
                }
            }
            // All that is on its way, in order.
            _ => {
                for segment in std::mem::take(&mut self.sides[1 - side].sent) {
                    self.deliver(side, &segment);
                }
            }
        }
    }

    fn write(&mut self, side: usize, length: usize) {
        let Side { end, written, .. } = &mut self.sides[side];
        let chunk = octets(i64::try_from(*written).unwrap(), length);
        match end.write(&chunk) {
            Ok(count) => {
                assert!(count <= length);
                *written += count as u64;
                let written = *written;
                self.sides[1 - side].known = self.sides[1 - side].known.max(written);
            }
            Err(error) => assert!(may_end_with(error)),
        }
    }

    fn read(&mut self, side: usize, length: usize) {
        let mut chunk = vec![0; length];
        let Side { end, read, known, .. } = &mut self.sides[side];
        match end.read(&mut chunk) {
            Ok(count) => {
                assert!(chunk[..count] == octets(i64::try_from(*read).unwrap(), count), "octets that were never sent");
                *read += count as u64;
                assert!(*read <= *known);
            }
            Err(error) => assert!(may_end_with(error)),
        }
    }

    /// A segment on its way to `side`.
    fn chosen(&mut self, side: usize, input: &mut Input<'_>, is_taken: bool) -> Option<Segment<'static>> {
        let sent = &mut self.sides[1 - side].sent;
        let place = usize::from(input.byte()).checked_rem(sent.len())?;
        if is_taken { Some(sent.remove(place)) } else { sent.get(place).cloned() }
    }

    fn deliver(&mut self, side: usize, segment: &Segment<'_>) {
        self.sides[side].heard_end |= segment.flags.has(Flags::FIN);
        self.sides[side].end.handle_segment(self.now, segment);
        self.drain();
    }

    /// A segment that is like one on its way but for its numbers, its flags or its options. Its octets are those of the stream, so that nothing wrong may be read.
    fn forge(&mut self, side: usize, input: &mut Input<'_>) {
        let Some(mut segment) = self.chosen(side, input, false) else { return };
        if segment.flags.has(Flags::SYN) {
            return;
        }
        let what = input.byte();
        let near = |input: &mut Input<'_>| i32::from(input.word().cast_signed()) << (what & 3);
        if what & 4 != 0 {
            segment.sequence = segment.sequence.wrapping_add_signed(near(input));
        }
        if what & 8 != 0 {
            segment.acknowledgement = segment.acknowledgement.wrapping_add_signed(near(input));
        }
        if what & 16 != 0 {
            // A SYN would begin another stream.
            segment.flags = Flags::from_bits(input.byte() & !Flags::SYN.bits());
        }
        if what & 32 != 0 {
            segment.window = input.word();
        }
        if what & 64 != 0 {
            let start = segment.acknowledgement.wrapping_add_signed(near(input));
            segment.options.sack.push(start, start.wrapping_add(input.word().into()));
        }
        if what & 128 != 0 {
            segment.options.timestamps = segment.options.timestamps.map(|(value, echo)| (value.wrapping_add_signed(near(input)), echo));
        }
        let from = i64::from(segment.sequence.wrapping_sub(self.sides[1 - side].first).cast_signed());
        let length = if what & 4 != 0 { usize::from(input.byte()) * 8 } else { segment.payload.len() };
        segment.payload = octets(from, length).into();
        let known = &mut self.sides[side].known;
        *known = (*known).max(u64::try_from(from + i64::try_from(length).unwrap()).unwrap_or(0));
        self.deliver(side, &segment);
    }

    fn set(&mut self, side: usize, input: &mut Input<'_>) {
        let (end, value) = (&mut self.sides[side].end, input.byte());
        match value & 3 {
            0 => end.set_nodelay(value & 4 != 0),
            1 => end.set_quickack(value & 4 != 0),
            2 => {
                let keepalive =
                    Keepalive { idle: Duration::from_secs(1), interval: Duration::from_millis(1 + u64::from(value)), probes: u32::from(value >> 4) };
                end.set_keepalive(self.now, (value & 4 != 0).then_some(keepalive));
            }
            _ => end.set_user_timeout((value & 4 != 0).then_some(Duration::from_millis(u64::from(value) * 100))),
        }
    }

    /// Lets time pass, from one timer to the next.
    fn pass(&mut self, until: Instant) {
        for step in 0.. {
            assert!(step < MOST_AT_ONCE, "timers without end");
            let next = (0..2).filter_map(|side| Some((self.sides[side].end.poll_timeout()?, side))).min().filter(|(at, _)| *at <= until);
            let Some((at, side)) = next else { break };
            self.now = self.now.max(at);
            self.sides[side].end.handle_timeout(self.now);
            self.drain();
        }
        self.now = self.now.max(until);
        for side in 0..2 {
            self.sides[side].end.handle_timeout(self.now);
        }
        self.drain();
    }

    /// Takes the segments that leave, and looks at each.
    fn drain(&mut self) {
        for side in 0..2 {
            for count in 0.. {
                assert!(count < MOST_AT_ONCE, "segments without end");
                let Some(segment) = self.sides[side].end.poll_transmit(self.now) else { break };
                self.check(side, &segment);
                if self.sides[side].sent.len() < MOST_IN_FLIGHT {
                    self.sides[side].sent.push(segment);
                }
            }
        }
    }

    fn check(&self, side: usize, segment: &Segment<'static>) {
        let packet = segment.to_packet();
        assert_eq!(Segment::parse(&packet).unwrap().payload, segment.payload);
        let Side { end, first, written, known, heard_end, .. } = &self.sides[side];
        assert!(packet.len() <= end.config().mtu.max(128));
        if !segment.payload.is_empty() {
            let (from, length) = (segment.sequence.wrapping_sub(*first), segment.payload.len());
            assert!(u64::from(from) + length as u64 <= *written, "octets beyond those written");
            assert!(*segment.payload == octets(i64::from(from), length), "octets that were never written");
        }
        if segment.flags.has(Flags::ACK) && !segment.flags.has(Flags::RST) {
            let acknowledged = segment.acknowledgement.wrapping_sub(self.sides[1 - side].first);
            assert!(acknowledged > 1 << 31 || u64::from(acknowledged) <= known + u64::from(*heard_end), "octets acknowledged that have not come");
        }
        let info = end.info();
        assert!(
            info.unread <= end.config().receive_buffer.unwrap_or(end.config().greatest_receive_buffer).max(65_535),
            "more unread than the receive buffer holds"
        );
    }
}

/// Returns whether the program may be told this.
fn may_end_with(error: Error) -> bool {
    matches!(error, Error::WouldBlock | Error::ConnectionRefused | Error::ConnectionReset | Error::TimedOut | Error::BrokenPipe)
}
