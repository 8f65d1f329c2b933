//! World of the tests: two ends with programs that write and read, two links between the ends, and a virtual time.

use std::time::Duration;

use cohaptic_tcp::{Connection, Ecn, Error, Flags, Segment, State, TcpConfig};
use cohaptic_units::{Bytes, Instant};
use cohaptic_wan::netem::Netem;
use cohaptic_wan::{Fate, Link, LinkConfig, LinkName};

/// Program on one end, and its progress. Once connected, the program writes `to_write` octets, shuts its half if `shuts` is set, and reads all data if `reads`
/// is set.
#[derive(Clone, Debug)]
pub(crate) struct Program {
    pub(crate) to_write: u64,
    pub(crate) shuts: bool,
    pub(crate) reads: bool,
    pub(crate) written: u64,
    pub(crate) read: u64,
    /// Instant at which the connection was established. The next two are the instants of the last octet read, and of the end of the stream.
    pub(crate) connected_at: Option<Instant>,
    pub(crate) last_read_at: Option<Instant>,
    pub(crate) end_at: Option<Instant>,
    pub(crate) error: Option<(Instant, Error)>,
}

impl Default for Program {
    fn default() -> Self {
        Self { to_write: 0, shuts: false, reads: true, written: 0, read: 0, connected_at: None, last_read_at: None, end_at: None, error: None }
    }
}

impl Program {
    pub(crate) fn writes(octets: u64) -> Self {
        Self { to_write: octets, ..Self::default() }
    }

    pub(crate) fn and_shuts(self) -> Self {
        Self { shuts: true, ..self }
    }

    pub(crate) fn but_does_not_read(self) -> Self {
        Self { reads: false, ..self }
    }
}

/// Returns the octet at the place `at` of every stream. Neighbouring places differ, so that a lost, doubled or invented octet is noticed.
pub(crate) fn octet(at: u64) -> u8 {
    u8::try_from((at * 31 + at / 251) % 251).unwrap()
}

/// Segment that an end has sent.
#[derive(Clone, Debug)]
pub(crate) struct Left {
    pub(crate) at: Instant,
    pub(crate) from: usize,
    pub(crate) segment: Segment<'static>,
}

type Filter = Box<dyn FnMut(usize, &Segment<'static>) -> bool>;

/// Both ends of a connection, their programs and links. Arrays are indexed by end: 0 is the client, 1 the server.
pub(crate) struct World {
    pub(crate) now: Instant,
    pub(crate) ends: [Option<Connection>; 2],
    pub(crate) programs: [Program; 2],
    pub(crate) configs: [TcpConfig; 2],
    pub(crate) is_listening: bool,
    /// Instant at which a segment last arrived at each end. `closed_at` is the instant at which the end was over.
    pub(crate) heard_at: [Instant; 2],
    pub(crate) closed_at: [Option<Instant>; 2],
    /// Every segment sent by either end, in order; `None` if segments are not logged.
    pub(crate) log: Option<Vec<Left>>,
    /// Returns `true` for a segment that is lost on the way, given its sending end.
    pub(crate) drops: Filter,
    /// `true` if packets cross the links as octets; `false` if they cross as segments, which is faster.
    pub(crate) is_encoded: bool,
    /// `true` if every octet read is compared with [`octet`], and every packet with its parsed segment.
    pub(crate) is_checked: bool,
    /// Returns `true` for a segment with ECN that is marked on the way, given its sending end.
    pub(crate) marks: Filter,
    links: [Link<Packet>; 2],
    chunk: Vec<u8>,
}

#[derive(Clone)]
enum Packet {
    Octets(Vec<u8>),
    Whole(Box<Segment<'static>>),
}

pub(crate) fn link(words: &str) -> LinkConfig {
    if words.is_empty() {
        return LinkConfig::default();
    }
    Netem::parse(words).unwrap().to_link_config(&mut |_| None).unwrap()
}

impl World {
    /// Creates a world whose links are equal in both directions. `words` are options of netem.
    pub(crate) fn new(words: &str, seed: u64) -> Self {
        Self::with_links([link(words), link(words)], seed)
    }

    pub(crate) fn with_links([there, back]: [LinkConfig; 2], seed: u64) -> Self {
        Self {
            now: Instant::ZERO,
            ends: [None, None],
            programs: [Program::default(), Program::default()],
            configs: [TcpConfig::default(), TcpConfig::default()],
            is_listening: true,
            heard_at: [Instant::ZERO; 2],
            closed_at: [None; 2],
            log: None,
            drops: Box::new(|_, _| false),
            is_encoded: true,
            is_checked: true,
            marks: Box::new(|_, _| false),
            chunk: vec![0; 16_384],
            links: [Link::new(seed, &LinkName::between("client", "server"), there), Link::new(seed, &LinkName::between("server", "client"), back)],
        }
    }

    pub(crate) fn config(mut self, config: &TcpConfig) -> Self {
        self.configs = [config.clone(), config.clone()];
        self
    }

    pub(crate) fn programs(mut self, client: Program, server: Program) -> Self {
        self.programs = [client, server];
        self
    }

    pub(crate) fn logged(mut self) -> Self {
        self.log = Some(Vec::new());
        self
    }

    pub(crate) fn dropping(mut self, drops: impl FnMut(usize, &Segment<'static>) -> bool + 'static) -> Self {
        self.drops = Box::new(drops);
        self
    }

    pub(crate) fn connect(mut self) -> Self {
        let config = self.configs[0].clone();
        self.ends[0] =
            Some(Connection::connect(self.now, config, "10.0.0.1:50000".parse().unwrap(), "10.0.0.2:80".parse().unwrap(), 77_000).unwrap());
        self.flush();
        self
    }

    /// Lets both programs act, and sends every segment that may leave now.
    pub(crate) fn flush(&mut self) {
        for side in 0..2 {
            self.flush_one(side);
        }
    }

    fn flush_one(&mut self, side: usize) {
        self.transmit(side);
        self.run_program(side);
        self.transmit(side);
        if self.ends[side].as_ref().is_some_and(|end| end.state() == State::Closed) {
            self.closed_at[side].get_or_insert(self.now);
        }
    }

    fn transmit(&mut self, side: usize) {
        while let Some(segment) = self.ends[side].as_mut().and_then(|end| end.poll_transmit(self.now)) {
            self.send(side, segment);
        }
    }

    pub(crate) fn send(&mut self, side: usize, mut segment: Segment<'static>) {
        if let Some(log) = &mut self.log {
            log.push(Left { at: self.now, from: side, segment: segment.clone() });
        }
        if (self.drops)(side, &segment) {
            return;
        }
        if segment.ecn.is_capable() && (self.marks)(side, &segment) {
            segment.ecn = Ecn::Congestion;
        }
        let size = segment.packet_length();
        let packet = if self.is_encoded {
            let packet = segment.to_packet();
            assert!(
                !self.is_checked || packet.len() == size && Segment::parse(&packet).as_ref() == Ok(&segment),
                "{:?} became {:?}",
                segment.options,
                Segment::parse(&packet).map(|parsed| parsed.options)
            );
            Packet::Octets(packet)
        } else {
            Packet::Whole(Box::new(segment))
        };
        self.links[side].handle_packet(self.now, Bytes::new(size as u64), packet).unwrap();
    }

    fn run_program(&mut self, side: usize) {
        let (Some(end), program) = (self.ends[side].as_mut(), &mut self.programs[side]) else { return };
        if program.connected_at.is_none() && end.state().is_synchronised() {
            program.connected_at = Some(self.now);
        }
        if end.state().is_synchronised() {
            let chunk = &mut self.chunk;
            while program.written < program.to_write {
                let count = usize::try_from(program.to_write - program.written).unwrap().min(chunk.len());
                if self.is_checked {
                    chunk[..count].iter_mut().zip(program.written..).for_each(|(to, at)| *to = octet(at));
                }
                match end.write(&chunk[..count]) {
                    Ok(count) => program.written += count as u64,
                    Err(Error::WouldBlock) => break,
                    Err(error) => {
                        program.error = Some((self.now, error));
                        program.to_write = program.written;
                    }
                }
            }
            if program.shuts && program.written == program.to_write {
                end.shutdown();
            }
        }
        if !program.reads {
            return;
        }
        let chunk = &mut self.chunk;
        loop {
            match end.read(chunk) {
                Ok(0) => {
                    program.end_at.get_or_insert(self.now);
                    return;
                }
                Ok(count) => {
                    if self.is_checked {
                        assert!(
                            chunk[..count].iter().zip(program.read..).all(|(seen, at)| *seen == octet(at)),
                            "wrong octets behind {}",
                            program.read
                        );
                    }
                    program.read += count as u64;
                    program.last_read_at = Some(self.now);
                }
                Err(Error::WouldBlock) => return,
                Err(error) => program.error = Some((self.now, error)),
            }
        }
    }

    pub(crate) fn next_at(&self) -> Option<Instant> {
        let links = self.links.iter().filter_map(Link::poll_timeout);
        links.chain(self.ends.iter().flatten().filter_map(Connection::poll_timeout)).min()
    }

    /// Goes to the next instant at which something happens, and handles its events. Returns `false` if nothing will ever happen.
    pub(crate) fn step(&mut self) -> bool {
        let Some(at) = self.next_at() else { return false };
        assert!(at >= self.now, "time went back from {} to {at}", self.now);
        self.now = at;
        for side in 0..2 {
            self.links[side].handle_timeout(at).unwrap();
            while let Some(event) = self.links[side].poll_event() {
                if matches!(event.record.fate, Fate::Delivered(_)) {
                    self.arrive(1 - side, &event.payload);
                }
            }
        }
        for side in 0..2 {
            if let Some(end) = self.ends[side].as_mut().filter(|end| end.poll_timeout() == Some(at)) {
                end.handle_timeout(at);
                self.flush_one(side);
            }
        }
        true
    }

    fn arrive(&mut self, side: usize, packet: &Packet) {
        let parsed;
        let segment = match packet {
            Packet::Octets(octets) => {
                parsed = Segment::parse(octets).unwrap();
                &parsed
            }
            Packet::Whole(segment) => segment,
        };
        self.heard_at[side] = self.now;
        match &mut self.ends[side] {
            Some(end) if end.state() != State::Closed => end.handle_segment(self.now, segment),
            slot => {
                let is_syn = segment.flags.has(Flags::SYN) && !segment.flags.has(Flags::ACK);
                if side == 1 && self.is_listening && is_syn {
                    *slot = Some(Connection::accept(self.now, self.configs[1].clone(), segment, 99_000).unwrap());
                } else if let Some(reset) = segment.refusal(64) {
                    self.send(side, reset);
                }
            }
        }
        // Segments leave within the call that permits them.
        self.flush_one(side);
    }

    /// Runs until `end`. If nothing happens before, only the time advances.
    pub(crate) fn run_until(&mut self, end: Instant) {
        while self.next_at().is_some_and(|at| at <= end) {
            self.step();
        }
        self.now = self.now.max(end);
    }

    /// Runs until both programs have read all octets of the other one. Panics if that takes longer than `limit`.
    pub(crate) fn run_to_the_last_octet(&mut self, limit: Duration) {
        let end = self.now + limit;
        while !self.is_all_read() {
            assert!(self.now <= end, "not all was read within {limit:?}: {self:?}");
            assert!(self.step(), "nothing will happen: {self:?}");
        }
    }

    fn is_all_read(&self) -> bool {
        self.programs[0].read >= self.programs[1].to_write && self.programs[1].read >= self.programs[0].to_write
    }

    /// Returns the instants at which `side` sent the segments for which `which` is true. The world must be logged.
    pub(crate) fn left(&self, side: usize, which: impl Fn(&Segment<'static>) -> bool) -> Vec<Instant> {
        self.log.iter().flatten().filter(|left| left.from == side && which(&left.segment)).map(|left| left.at).collect()
    }
}

impl std::fmt::Debug for World {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        writeln!(f, "at {}", self.now)?;
        for (end, program) in self.ends.iter().zip(&self.programs) {
            writeln!(f, "{program:?}\n{:#?}", end.as_ref().map(Connection::info))?;
        }
        Ok(())
    }
}

pub(crate) const fn millis(milliseconds: u64) -> Instant {
    Instant::from_nanos(milliseconds * 1_000_000)
}
