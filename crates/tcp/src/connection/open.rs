//! Handshake: construction of a connection, SYN-SENT, and the passage to ESTABLISHED.

use core::net::SocketAddr;
use core::time::Duration;

use cohaptic_units::Instant;

use super::parts::{Receive, Send};
use super::push::Pushes;
use super::{Connection, Timer};
use crate::config::{ConfigError, EcnFallback, TcpConfig};
use crate::congestion::Congestion;
use crate::connection::timers::TWO_TICKS;
use crate::connection::window::{first_window, tuning};
use crate::error::Error;
use crate::info::State;
use crate::rtt::RoundTrips;
use crate::scoreboard::{Ending, News, Scoreboard};
use crate::segment::{Flags, Options, Segment, TIMESTAMPS_LENGTH};
use crate::send_buffer::SendBuffer;
use crate::sequence::{extend, first};

/// Maximum segment size of a peer whose SYN has no MSS option \[byte\] (RFC 9293, section 3.7.1).
const DEFAULT_MSS: usize = 536;

impl Connection {
    /// Returns an end that opens the connection, in SYN-SENT. Its SYN is the first segment to send. `initial_sequence` is the sequence number of the SYN,
    /// unless the configuration has one.
    ///
    /// # Errors
    ///
    /// If [`TcpConfig::check`] refuses the configuration.
    pub fn connect(now: Instant, config: TcpConfig, local: SocketAddr, remote: SocketAddr, initial_sequence: u32) -> Result<Self, ConfigError> {
        let mut connection = Self::new(now, config, local, remote, initial_sequence)?;
        connection.send_syn(now);
        Ok(connection)
    }

    /// Returns an end that answers the SYN `syn`, in SYN-RECEIVED. Its SYN with ACK is the first segment to send. If `syn` is not a SYN, returns a closed
    /// connection whose only segment is the reset in answer.
    ///
    /// # Errors
    ///
    /// If [`TcpConfig::check`] refuses the configuration.
    pub fn accept(now: Instant, config: TcpConfig, syn: &Segment<'_>, initial_sequence: u32) -> Result<Self, ConfigError> {
        let mut connection = Self::new(now, config, syn.destination, syn.source, initial_sequence)?;
        if syn.flags.has(Flags::SYN) && !syn.flags.has(Flags::ACK) && !syn.flags.has(Flags::RST) {
            connection.learn_syn(now, syn);
            // Now it is known whether segments have timestamps.
            connection.receive.first_window = first_window(&connection.config, connection.advertised_mss());
            connection.receive.edge = connection.receive.next + u64::from(connection.receive.first_window);
            connection.send.window = u64::from(syn.window);
            // As in Linux, the largest window counts from the segment that establishes the connection.
            connection.state = State::SynReceived;
            connection.send_syn(now);
        } else {
            connection.state = State::Closed;
            connection.replies.extend(syn.refusal(connection.config.ttl));
        }
        Ok(connection)
    }

    /// Returns an end in SYN-SENT, before its SYN is sent.
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
            capacity: 0,
            board: Scoreboard::default(),
            mss: DEFAULT_MSS,
            small_end: first,
            pushes: Pushes::new(first + 1),
            burst: Default::default(),
            repetition: Default::default(),
            is_shut: false,
            last_data_at: now,
            delivered: 0,
            has_ecn: config.wants_ecn(),
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
            tuning: tuning(&config),
            first_window: first_window(&config, config.segment_room(local.is_ipv4())),
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
        let (congestion, round_trips) = (Congestion::new(&config), RoundTrips::new(&config));
        Ok(Self {
            config,
            local,
            remote,
            state: State::SynSent,
            error: None,
            is_orphan: false,
            send,
            receive,
            round_trips,
            congestion,
            recovery: Default::default(),
            rack: Default::default(),
            tail: Default::default(),
            timer: None,
            keepalive_at: None,
            linger_until: None,
            probe: None,
            replies: Default::default(),
            is_reset_due: false,
            counters: Default::default(),
            calls: Default::default(),
        })
    }

    /// Sends the SYN, or the SYN with ACK, for the first time.
    fn send_syn(&mut self, now: Instant) {
        self.send.next = self.send.first + 1;
        self.send.board.push(self.send.first, self.send.next, now, Ending::default());
        self.timer = Some((now.saturating_add(self.config.initial_timeout), Timer::Retransmission));
        let syn = self.build_syn(now);
        self.replies.push_back(syn);
    }

    /// Takes over the options, the ECN flags and the sequence number of the peer's SYN.
    fn learn_syn(&mut self, now: Instant, syn: &Segment<'_>) {
        let Options { mss, window_scale, sack_permitted, timestamps, .. } = syn.options;
        self.receive.has_sack &= sack_permitted;
        self.receive.has_timestamps &= timestamps.is_some();
        self.receive.recent = timestamps.filter(|_| self.receive.has_timestamps).map(|(value, _)| (value, now));
        match window_scale {
            // RFC 7323, section 2.3: a shift above 14 counts as 14. If one SYN has no scale, neither end may scale its windows.
            Some(scale) => self.send.scale = scale.min(14),
            None => self.receive.scale = 0,
        }
        let room = self.config.segment_room(self.local.is_ipv4());
        let options = if self.receive.has_timestamps { TIMESTAMPS_LENGTH } else { 0 };
        // The MSS counts neither headers nor options, so the timestamps of each segment take their octets from the data (RFC 9293, section 3.7.1).
        self.send.mss = mss.map_or(DEFAULT_MSS, usize::from).max(64).min(room) - options;
        // A SYN asks for ECN with ECE and CWR. A SYN with ACK grants ECN with ECE.
        let asked = Flags::ECE.with_if(Flags::CWR, !syn.flags.has(Flags::ACK));
        self.send.has_ecn &= syn.flags.has(asked);
        self.receive.first = Some(syn.sequence);
        self.receive.next = first(syn.sequence) + 1;
        self.receive.acked = self.receive.next;
        // The window on this end's SYN has 16 bits and is not scaled.
        self.receive.edge = self.receive.next + u64::from(self.receive.first_window);
        self.receive.segment = self.receive.segment.min(self.send.mss);
        self.receive.last_heard = now;
        self.send.window_from = self.receive.next - 1;
    }

    /// Handles a segment that arrives in SYN-SENT (RFC 9293, section 3.10.7.3).
    pub(super) fn handle_in_syn_sent(&mut self, now: Instant, segment: &mut Segment<'_>) {
        let has_ack = segment.flags.has(Flags::ACK);
        // An acknowledgement of anything but the SYN belongs to an older connection. This check comes first, so a reset of this kind has no effect.
        if has_ack && extend(segment.acknowledgement, self.send.una) != self.send.next {
            self.replies.extend(segment.refusal(self.config.ttl));
            // The reset ends the older connection of the peer's, so that the SYN finds the listener. As in Linux, the SYN is repeated soon, once.
            if self.counters.retries == 0 {
                self.timer = Some((now.saturating_add(TWO_TICKS), Timer::Retransmission));
            }
            return;
        }
        if segment.flags.has(Flags::RST) {
            // A reset without ACK is ignored, because nothing shows that the sender of the reset has seen the SYN.
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
            // The answer to a SYN may carry data.
            self.accept_data(now, segment, self.receive.next);
        } else {
            // Both ends have opened at once. This end's SYN is sent again, with ACK.
            self.state = State::SynReceived;
            let answer = self.build_syn(now);
            self.replies.push_back(answer);
        }
    }

    /// Ends the handshake, because this end's SYN is acknowledged. The SYN gives the first sample of the round trip.
    pub(super) fn establish(&mut self, now: Instant, segment: &Segment<'_>) {
        let mut news = News::default();
        let ack = self.send.first + 1;
        self.send.board.acknowledge(ack, ack, &mut news);
        self.send.una = ack;
        if let Some(round_trip) = news.round_trip(now).or_else(|| self.echoed(now, segment)) {
            self.round_trips.sample(now, round_trip);
        }
        if self.counters.retries > 1 {
            // RFC 5681, section 3.1, asks for a window of one segment after a loss of the SYN. Linux does so after the second timeout.
            self.congestion.window = 1;
        }
        (self.counters.retries, self.counters.stalled_since) = (0, None);
        self.state = if self.send.is_shut { State::FinWait1 } else { State::Established };
        self.timer = None;
        self.send.last_data_at = now;
        self.expand_send_buffer();
        let (window, mss, next) = (self.receive.offered(), self.advertised_mss(), self.receive.next);
        if let Some(tuning) = &mut self.receive.tuning {
            tuning.begin(now, window, mss, next);
        }
        self.restart_keepalive(now);
    }

    /// Returns the round trip since the timestamp that `segment` echoes, at least 1 ms. Returns `None` without a usable echo.
    pub(super) fn echoed(&self, now: Instant, segment: &Segment<'_>) -> Option<Duration> {
        let (_, echo) = segment.options.timestamps.filter(|(_, echo)| self.receive.has_timestamps && *echo != 0)?;
        let ticks = Self::ticks(now).wrapping_sub(echo);
        // The difference wraps: half of the range or more means an echo from the future, so this end never sent the timestamp.
        (ticks < 1 << 31).then_some(Duration::from_millis(u64::from(ticks.max(1))))
    }
}
