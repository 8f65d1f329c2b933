//! Construction of segments: flags, options, and the window to offer.

use cohaptic_units::Instant;

use super::Connection;
use crate::config::EcnFallback;
use crate::flight::Flight;
use crate::info::State;
use crate::segment::{Ecn, Flags, Options, Payload, SackBlocks, Segment, TIMESTAMPS_LENGTH};
use crate::sequence::{Position, on_wire};

/// Content of a segment: positions from `start` to `end` (exclusive), possibly with the FIN, and flags beside those that follow from the connection.
#[derive(Clone, Copy, Debug)]
pub(super) struct Content {
    pub(super) start: Position,
    pub(super) end: Position,
    pub(super) flags: Flags,
    pub(super) ecn: Ecn,
}

impl Connection {
    /// Returns this end's SYN. In SYN-RECEIVED, the SYN has an ACK.
    pub(super) fn build_syn(&self, now: Instant) -> Segment<'static> {
        let has_come = self.state == State::SynReceived;
        let room = self.config.segment_room(self.local.is_ipv4());
        let options = Options {
            mss: Some(u16::try_from(room).unwrap_or(u16::MAX)),
            // An answer may have a window scale only if the peer's SYN has one. `learn_syn` sets the receive scale to zero otherwise.
            window_scale: (!has_come || self.receive.scale > 0 || self.send.scale > 0).then_some(self.receive.scale),
            sack_permitted: self.receive.has_sack,
            timestamps: self.timestamps(now),
            sack: SackBlocks::default(),
        };
        let flags = if has_come {
            (Flags::SYN | Flags::ACK).with_if(Flags::ECE, self.send.has_ecn)
        } else {
            Flags::SYN.with_if(Flags::ECE | Flags::CWR, self.asks_for_ecn())
        };
        let acknowledgement = if has_come { on_wire(self.receive.next) } else { 0 };
        let syn = Segment { sequence: on_wire(self.send.first), acknowledgement, window: self.receive.first_window, options, ..self.empty(flags) };
        // A SYN without ECN, after a lost SYN, has no codepoint either.
        if flags.has(Flags::ECE) { syn } else { Segment { ecn: Ecn::NotCapable, ..syn } }
    }

    /// Returns whether the next SYN asks for ECN. If the next SYN does not ask but the answer grants ECN, the answer belongs to an earlier SYN. The connection
    /// then uses ECN, as in Linux.
    pub(super) fn asks_for_ecn(&self) -> bool {
        self.send.has_ecn && (self.counters.retries == 0 || self.config.ecn_fallback == EcnFallback::Never)
    }

    /// Returns whether this end answers to the share of marked segments, and reports the mark of each segment.
    pub(super) const fn is_scalable(&self) -> bool {
        self.send.has_ecn && self.congestion.is_scalable()
    }

    /// Returns the ECN codepoint of segments without new data.
    pub(super) const fn codepoint(&self) -> Ecn {
        if self.is_scalable() { Ecn::Capable1 } else { Ecn::NotCapable }
    }

    /// Returns a segment at the next position without data and options, and with a window of zero.
    fn empty(&self, flags: Flags) -> Segment<'static> {
        Segment {
            source: self.local,
            destination: self.remote,
            sequence: on_wire(self.send.next),
            acknowledgement: on_wire(self.receive.next),
            flags,
            window: 0,
            options: Options::default(),
            ecn: self.codepoint(),
            ttl: self.config.ttl,
            payload: Payload::default(),
        }
    }

    /// Returns a reset at the next position, with the window and the timestamps of other segments, as Linux sends.
    pub(super) fn build_reset(&mut self, now: Instant) -> Segment<'static> {
        let segment = self.build_acknowledgement(now);
        Segment { flags: Flags::RST | Flags::ACK, ..segment }
    }

    /// Returns an acknowledgement without data at the next position.
    pub(super) fn build_acknowledgement(&mut self, now: Instant) -> Segment<'static> {
        self.build(now, self.acknowledgement())
    }

    /// Returns the content of an acknowledgement without data at the next position.
    pub(super) const fn acknowledgement(&self) -> Content {
        Content { start: self.send.next, end: self.send.next, flags: Flags::NONE, ecn: self.codepoint() }
    }

    /// Returns a segment with this content.
    pub(super) fn build(&mut self, now: Instant, content: Content) -> Segment<'static> {
        let mut segment = self.empty(Flags::NONE);
        let window = self.offer_window();
        self.write_segment(now, content, window, &mut segment);
        segment
    }

    /// Appends a segment with this content, which offers `window`, to `flight`.
    pub(super) fn append(&mut self, now: Instant, content: Content, window: u16, flight: &mut Flight) {
        if let Some(run) = flight.last()
            && self.is_alike(now, &content, window, &run.segment)
        {
            let size = usize::try_from(content.end - content.start).unwrap_or(usize::MAX);
            if run.may_append(on_wire(content.start), size) {
                run.append(size, content.flags.has(Flags::PSH));
                return self.has_acknowledged();
            }
        }
        let run = flight.begin();
        self.write_segment(now, content, window, &mut run.segment);
        run.begin();
    }

    /// Returns whether a segment with this content has the same header as the segment before, but for the sequence number and PSH.
    fn is_alike(&self, now: Instant, content: &Content, window: u16, before: &Segment<'_>) -> bool {
        let is_plain = content.flags.without(Flags::PSH) == Flags::NONE && before.flags.without(Flags::PSH) == Flags::ACK;
        let tells_nothing = !self.send.tells_mark && !self.send.tells_reduction && !self.has_blocks() && before.options.sack.as_slice().is_empty();
        is_plain
            && tells_nothing
            && before.acknowledgement == on_wire(self.receive.next)
            && before.window == window
            && before.options.timestamps == self.timestamps(now)
            && (before.ecn, before.ttl) == (content.ecn, self.config.ttl)
    }

    /// Writes a segment with this content over `segment`. The memory of the data goes on if the send buffer has further octets there. The segment acknowledges
    /// all octets that have arrived in order, so that no further acknowledgement is due afterwards.
    fn write_segment(&mut self, now: Instant, Content { start, end, flags, ecn }: Content, window: u16, segment: &mut Segment<'static>) {
        // The FIN has the position after the last octet, so a position beyond the buffer is the FIN.
        let data_end = end.min(self.send.buffer.end()).max(start);
        let (memory, length) = self.send.buffer.slice(start, data_end);
        let has_fin = end > data_end;
        segment.flags = (Flags::ACK | flags)
            .with_if(Flags::FIN, has_fin)
            .with_if(Flags::ECE, self.send.tells_mark)
            .with_if(Flags::CWR, self.send.tells_reduction && length > 0);
        // CWR travels once, with data (RFC 3168, section 6.1.2).
        if length > 0 {
            self.send.tells_reduction = false;
        }
        segment.options = self.options(now, length);
        segment.window = window;
        self.has_acknowledged();
        // Field by field, because a segment that is built elsewhere and moved takes longer than the rest of this function.
        (segment.source, segment.destination) = (self.local, self.remote);
        (segment.sequence, segment.acknowledgement) = (on_wire(start), on_wire(self.receive.next));
        (segment.ecn, segment.ttl) = (ecn, self.config.ttl);
        segment.payload = Payload::first_of(memory, length);
    }

    /// Returns the timestamps of the segments that leave at `now`.
    fn timestamps(&self, now: Instant) -> Option<(u32, u32)> {
        self.receive.has_timestamps.then(|| (Self::ticks(now), self.receive.recent.map_or(0, |(value, _)| value)))
    }

    /// Returns whether the next segment has selective acknowledgements, if there is room.
    fn has_blocks(&self) -> bool {
        self.receive.has_sack && (self.receive.duplicate.is_some() || self.receive.assembler.has_gaps())
    }

    /// Returns timestamps, and as many selective acknowledgements as fit beside `payload` octets of data.
    fn options(&mut self, now: Instant, payload: usize) -> Options {
        let timestamps = self.timestamps(now);
        let mut sack = SackBlocks::default();
        if self.has_blocks() {
            let taken = payload + if timestamps.is_some() { TIMESTAMPS_LENGTH } else { 0 };
            let room = self.config.segment_room(self.local.is_ipv4()).saturating_sub(taken);
            for (start, end) in self.blocks() {
                sack.push(on_wire(start), on_wire(end));
            }
            sack.truncate((room.saturating_sub(4) / 8).min(if timestamps.is_some() { 3 } else { 4 }));
            // A duplicate is reported once (RFC 2883, section 4).
            self.receive.duplicate = None;
        }
        Options { timestamps, sack, ..Options::default() }
    }

    /// Returns the length of the selective acknowledgements of the next segment \[byte\].
    pub(super) fn sack_length(&self) -> usize {
        if !self.has_blocks() {
            return 0;
        }
        let blocks = usize::from(self.receive.duplicate.is_some())
            + if self.receive.assembler.has_gaps() { self.receive.assembler.blocks().count() } else { 0 };
        if blocks == 0 { 0 } else { 4 + 8 * blocks.min(if self.receive.has_timestamps { 3 } else { 4 }) }
    }

    /// Notes that an acknowledgement of all octets in order has left.
    fn has_acknowledged(&mut self) {
        self.receive.acked = self.receive.next;
        self.receive.has_offered = true;
        (self.receive.ack_now, self.receive.ack_at, self.receive.pushed) = (false, None, 0);
        self.receive.quick = self.receive.quick.saturating_sub(1);
    }
}
