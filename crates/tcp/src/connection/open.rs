//! The handshake.

use core::net::SocketAddr;
use core::time::Duration;

use cohaptic_units::Instant;

use super::parts::{Receive, Send};
use super::{Connection, Timer};
use crate::config::{ConfigError, EcnFallback, TcpConfig};
use crate::congestion::Congestion;
use crate::error::Error;
use crate::info::State;
use crate::scoreboard::{News, Scoreboard};
use crate::segment::{Flags, Options, Segment, TIMESTAMPS_LENGTH};
use crate::send_buffer::SendBuffer;
use crate::sequence::{extend, first};

/// What a peer takes that does not say how much (RFC 9293, section 3.7.1).
const DEFAULT_MSS: usize = 536;

impl Connection {
    /// An end that opens the connection: its SYN is the first segment to send. `initial_sequence` counts unless the configuration has one.
    ///
    /// # Errors
    ///
    /// If the configuration cannot be.
    pub fn connect(now: Instant, config: TcpConfig, local: SocketAddr, remote: SocketAddr, initial_sequence: u32) -> Result<Self, ConfigError> {
        let mut connection = Self::new(now, config, local, remote, initial_sequence)?;
        connection.send_syn(now);
        Ok(connection)
    }

    /// An end that answers a SYN: its own SYN with ACK is the first segment to send. A segment that is no SYN makes a connection that is closed at once, and
    /// refuses it.
    ///
    /// # Errors
    ///
    /// If the configuration cannot be.
    pub fn accept(now: Instant, config: TcpConfig, syn: &Segment<'_>, initial_sequence: u32) -> Result<Self, ConfigError> {
        let mut connection = Self::new(now, config, syn.destination, syn.source, initial_sequence)?;
        if syn.flags.has(Flags::SYN) && !syn.flags.has(Flags::ACK) && !syn.flags.has(Flags::RST) {
            connection.learn_syn(now, syn);
            connection.send.window = u64::from(syn.window);
            connection.send.max_window = connection.send.window;
            connection.state = State::SynReceived;
            connection.send_syn(now);
        } else {
            connection.state = State::Closed;
            connection.replies.extend(syn.refusal(connection.config.ttl));
        }
        Ok(connection)
    }

    fn new(now: Instant, config: TcpConfig, local: SocketAddr, remote: SocketAddr, initial_sequence: u32) -> Result<Self, ConfigError> {
        config.check()?;
        let first = first(config.initial_sequence.unwrap_or(initial_sequence));
        let send = Send {
            first,
            una: first,
            next: first,
            window: 0,
            max_window: 0,
            window_from: 0,
            scale: 0,
            buffer: SendBuffer::new(first + 1),
            board: Scoreboard::default(),
            mss: DEFAULT_MSS,
            small_end: first,
            is_shut: false,
            last_data_at: now,
            delivered: 0,
            has_ecn: config.ecn,
            tells_mark: false,
            tells_reduction: false,
        };
        let receive = Receive {
            first: None,
            next: 0,
            edge: 0,
            acked: 0,
            scale: config.window_scale(),
            has_sack: config.sack,
            has_timestamps: config.timestamps,
            recent: None,
            assembler: Default::default(),
            fin: None,
            is_ended: false,
            duplicate: None,
            segment: DEFAULT_MSS,
            ack_now: false,
            has_offered: false,
            ack_at: None,
            quick: 0,
            is_interactive: false,
            pushed: 0,
            last_data_at: None,
            last_heard: now,
            challenged_at: None,
        };
        let congestion = Congestion::new(&config);
        Ok(Self {
            config,
            local,
            remote,
            state: State::SynSent,
            error: None,
            is_orphan: false,
            send,
            receive,
            round_trips: Default::default(),
            congestion,
            recovery: Default::default(),
            rack: Default::default(),
            tail: Default::default(),
            timer: None,
            keepalive_at: None,
            linger_until: None,
            probe: None,
            replies: Default::default(),
            counters: Default::default(),
        })
    }

    /// Sends the SYN for the first time.
    fn send_syn(&mut self, now: Instant) {
        self.send.next = self.send.first + 1;
        self.send.board.push(self.send.first, self.send.next, now);
        self.timer = Some((now.saturating_add(self.config.initial_timeout), Timer::Retransmission));
        let syn = self.build_syn(now);
        self.replies.push_back(syn);
    }

    /// Takes over what a SYN says.
    fn learn_syn(&mut self, now: Instant, syn: &Segment<'_>) {
        let Options { mss, window_scale, sack_permitted, timestamps, .. } = syn.options;
        self.receive.has_sack &= sack_permitted;
        self.receive.has_timestamps &= timestamps.is_some();
        self.receive.recent = timestamps.filter(|_| self.receive.has_timestamps).map(|(value, _)| (value, now));
        match window_scale {
            Some(scale) => self.send.scale = scale.min(14),
            None => self.receive.scale = 0,
        }
        let room = self.config.segment_room(self.local.is_ipv4());
        let options = if self.receive.has_timestamps { TIMESTAMPS_LENGTH } else { 0 };
        self.send.mss = mss.map_or(DEFAULT_MSS, usize::from).max(64).min(room) - options;
        let asked = Flags::ECE.with_if(Flags::CWR, !syn.flags.has(Flags::ACK));
        self.send.has_ecn &= syn.flags.has(asked);
        self.receive.first = Some(syn.sequence);
        self.receive.next = first(syn.sequence) + 1;
        self.receive.acked = self.receive.next;
        self.receive.edge = self.receive.next + self.config.receive_buffer.min(65_535) as u64;
        self.receive.segment = self.receive.segment.min(self.send.mss);
        self.receive.last_heard = now;
        self.send.window_from = self.receive.next - 1;
    }

    /// A segment in SYN-SENT (RFC 9293, section 3.10.7.3).
    pub(super) fn handle_in_syn_sent(&mut self, now: Instant, segment: &Segment<'_>) {
        let has_ack = segment.flags.has(Flags::ACK);
        if has_ack && extend(segment.acknowledgement, self.send.una) != self.send.next {
            self.replies.extend(segment.refusal(self.config.ttl));
            return;
        }
        if segment.flags.has(Flags::RST) {
            if has_ack && self.asks_for_ecn() && self.config.ecn_fallback == EcnFallback::LostOrReset {
                self.send.has_ecn = false;
                self.send.board.sent_again(self.send.first, now, false);
                self.timer = Some((now.saturating_add(self.config.initial_timeout), Timer::Retransmission));
                self.repeat_syn(now);
            } else if has_ack {
                self.die(Some(Error::ConnectionRefused));
            }
            return;
        }
        if !segment.flags.has(Flags::SYN) {
            return;
        }
        self.learn_syn(now, segment);
        self.send.window = u64::from(segment.window);
        self.send.max_window = self.send.window;
        if has_ack {
            self.establish(now, segment);
            self.receive.ack_now = true;
            self.accept_data(now, segment, self.receive.next);
        } else {
            // Both have begun at once: the SYN is sent again, with ACK.
            self.state = State::SynReceived;
            let answer = self.build_syn(now);
            self.replies.push_back(answer);
        }
    }

    /// The handshake is over: the SYN is acknowledged.
    pub(super) fn establish(&mut self, now: Instant, segment: &Segment<'_>) {
        let mut news = News::default();
        let ack = self.send.first + 1;
        self.send.board.acknowledge(ack, ack, &mut news);
        self.send.una = ack;
        if let Some(round_trip) = news.round_trip(now).or_else(|| self.echoed(now, segment)) {
            self.round_trips.sample(now, round_trip);
        }
        if self.counters.retries > 1 {
            // RFC 5681, section 3.1: a SYN that was lost twice tells of a full path.
            self.congestion.window = 1;
        }
        (self.counters.retries, self.counters.stalled_since) = (0, None);
        self.state = if self.send.is_shut { State::FinWait1 } else { State::Established };
        self.timer = None;
        self.send.last_data_at = now;
        self.restart_keepalive(now);
    }

    /// The round trip by the timestamp that came back.
    pub(super) fn echoed(&self, now: Instant, segment: &Segment<'_>) -> Option<Duration> {
        let (_, echo) = segment.options.timestamps.filter(|(_, echo)| self.receive.has_timestamps && *echo != 0)?;
        let ticks = Self::ticks(now).wrapping_sub(echo);
        (ticks < 1 << 31).then_some(Duration::from_millis(u64::from(ticks.max(1))))
    }
}
