//! Deadlines: the timer of the sending half, delayed acknowledgements, keep-alive probes, and the end of a closed connection.

use core::time::Duration;

use cohaptic_units::Instant;

use super::{Connection, Probe};
use crate::config::{Keepalive, TcpConfig};
use crate::error::Error;
use crate::info::CaState;
use crate::info::State;
use crate::rtt::{doubled, nanos};

/// Purpose of the timer of the sending half. As in Linux, the sending half has one timer.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Timer {
    /// Waits for an acknowledgement of the first segment (RFC 6298).
    Retransmission,
    /// Waits for an acknowledgement of the last flight (RFC 8985, section 7).
    TailProbe,
    /// Waits for segments that may only be late (RFC 8985, section 6).
    Reordering,
    /// Waits for the peer's window to open (RFC 9293, section 3.8.6.1).
    WindowProbe,
}

/// Shortest time of a timer: two of Linux's ticks (`TCP_TIMEOUT_MIN`). Also the margin above two round trips before a tail probe.
pub(super) const TWO_TICKS: Duration = Duration::from_millis(2);

/// First timeout in the limit for unanswered data: Linux counts `retries` with its least timeout, whatever the round trip.
const RETRY_BASE: Duration = Duration::from_millis(200);

impl Connection {
    /// Returns the instant at which [`handle_timeout`](Self::handle_timeout) must be called if no other call comes before. Returns `None` if the connection
    /// waits for nothing.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        let earlier = |one: Option<Instant>, other: Option<Instant>| match (one, other) {
            (Some(one), Some(other)) => Some(one.min(other)),
            (one, other) => one.or(other),
        };
        let timer = self.timer.map(|(at, _)| at);
        // Every segment asks for the deadline, so that the four deadlines are compared one by one, without an iterator.
        earlier(earlier(timer, self.receive.ack_at), earlier(self.keepalive_at, self.linger_until))
    }

    /// Handles all deadlines up to `now`. Does nothing before the instant of [`poll_timeout`](Self::poll_timeout).
    pub fn handle_timeout(&mut self, now: Instant) {
        let is_due = |at: Option<Instant>| at.is_some_and(|at| at <= now);
        if is_due(self.linger_until) {
            self.die(None);
            return;
        }
        if is_due(self.receive.ack_at) {
            self.receive.ack_at = None;
            self.receive.ack_now = true;
            // No data came for the acknowledgement to travel with, so the next acknowledgements need not wait for data.
            self.receive.is_interactive = false;
        }
        if is_due(self.keepalive_at) {
            self.keep_alive(now);
        }
        if let Some((_, timer)) = self.timer.filter(|(at, _)| *at <= now) {
            // The timer is cleared first, because each branch may set another timer.
            self.timer = None;
            match timer {
                Timer::Retransmission => self.time_out(now),
                Timer::TailProbe => self.probe_tail(now),
                Timer::Reordering => self.reordering_is_over(now),
                Timer::WindowProbe => self.probe_window(now),
            }
        }
    }

    /// Sets the timer after an acknowledgement that has advanced: for a tail probe, or otherwise for a retransmission.
    pub(super) fn set_timer(&mut self, now: Instant) {
        if !self.set_tail_timer(now, true) {
            self.set_retransmission_timer(now, false);
        }
    }

    /// Sets the retransmission timer, or removes the timer if nothing is on the way. If the timer takes the place of a tail or reordering timer, the time is
    /// counted from the transmission of the first segment, unless `anew` is set. In all other cases the time is counted from `now`.
    pub(super) fn set_retransmission_timer(&mut self, now: Instant, anew: bool) {
        let Some(first) = self.send.board.first() else {
            self.timer = None;
            return;
        };
        let timeout = self.borne_timeout(now);
        let stood_behind = matches!(self.timer, Some((_, Timer::TailProbe | Timer::Reordering)));
        let at = if stood_behind && !anew { first.at.saturating_add(timeout).max(now) } else { now.saturating_add(timeout) };
        self.timer = Some((at, Timer::Retransmission));
    }

    /// Sets the timer for a tail probe if a probe is useful (RFC 8985, section 7.2). Returns whether the timer was set. `has_advanced` says that the
    /// retransmission timer would begin anew at `now`.
    pub(super) fn set_tail_timer(&mut self, now: Instant, has_advanced: bool) -> bool {
        let board = &self.send.board;
        let is_wanted = self.config.tail_loss_probe && self.receive.has_sack && matches!(self.recovery.phase, CaState::Open | CaState::Cwr);
        let Some(first) = board.first().filter(|_| is_wanted && self.state.may_send()) else { return false };
        // In whole nanoseconds, because every segment sets this timer, and sums of `Duration`s carry between seconds and nanoseconds.
        let mut wait = match self.round_trips.srtt_nanos() {
            // The peer may delay the acknowledgement of a single segment.
            Some(srtt) => 2 * srtt + if board.packets_out() == 1 { nanos(self.config.least_variance.max(TWO_TICKS)) } else { nanos(TWO_TICKS) },
            None => nanos(self.config.initial_timeout),
        };
        // The probe must not come later than the retransmission timer would.
        let from = if has_advanced { now } else { first.at };
        let left = from.saturating_add_nanos(self.round_trips.timeout_nanos()).as_nanos().saturating_sub(now.as_nanos());
        if left > 0 {
            wait = wait.min(left);
        }
        self.timer = Some((now.saturating_add_nanos(wait), Timer::TailProbe));
        true
    }

    /// Handles the end of the tail timer: sends a probe, unless a probe is on the way.
    fn probe_tail(&mut self, now: Instant) {
        if self.send.board.is_empty() {
            return;
        }
        if self.tail.end.is_none() {
            self.probe = Some(Probe::Tail);
            self.set_retransmission_timer(now, true);
        } else {
            // As in Linux, data that was sent while a probe was on the way does not put off the timeout of the first segment (`tcp_send_loss_probe`).
            self.timer = Some((now, Timer::TailProbe));
            self.set_retransmission_timer(now, false);
        }
    }

    /// Handles the end of the retransmission timer: repeats the SYN, ends the connection, or enters the phase Loss.
    fn time_out(&mut self, now: Instant) {
        if self.send.board.is_empty() {
            return;
        }
        if matches!(self.state, State::SynSent | State::SynReceived) {
            self.repeat_handshake(now);
            return;
        }
        if self.is_given_up(now, self.counters.stalled_since) {
            self.die(Some(Error::TimedOut));
            return;
        }
        self.enter_loss(now);
        self.counters.retries += 1;
        self.counters.stalled_since.get_or_insert(now);
        self.round_trips.backoff += 1;
        self.set_retransmission_timer(now, true);
    }

    /// Returns the retransmission timeout, shortened so that the timer runs out when the user timeout ends, but at least 1 ms.
    fn borne_timeout(&self, now: Instant) -> Duration {
        let timeout = self.round_trips.timeout();
        match (self.config.user_timeout, self.counters.stalled_since) {
            (Some(limit), Some(since)) => timeout.min(limit.saturating_sub(now.saturating_duration_since(since)).max(Duration::from_millis(1))),
            _ => timeout,
        }
    }

    /// Repeats the SYN, or ends the connection after the last repetition.
    fn repeat_handshake(&mut self, now: Instant) {
        let is_client = self.state == State::SynSent;
        let is_over = if is_client { self.is_syn_given_up(now) } else { self.counters.retries >= self.config.syn_ack_retries };
        if is_over {
            self.die(Some(Error::TimedOut));
            return;
        }
        self.counters.retries += 1;
        self.counters.stalled_since.get_or_insert(self.send.last_data_at);
        self.counters.retransmissions += 1;
        // The first repetitions of a client's SYN may come at equal distance.
        if !is_client || self.counters.retries > self.config.linear_syn_retries {
            self.round_trips.backoff += 1;
        }
        self.send.board.sent_again(self.send.first, now, false);
        self.timer = Some((now.saturating_add(self.borne_timeout(now)), Timer::Retransmission));
        let syn = self.build_syn(now);
        self.replies.push_back(syn);
    }

    /// Returns whether the SYN is not repeated any more: all repetitions are spent, or the time is over that the repetitions at growing distance take
    /// (`tcp_write_timeout`).
    fn is_syn_given_up(&self, now: Instant) -> bool {
        let TcpConfig { syn_retries, linear_syn_retries, initial_timeout, user_timeout, .. } = self.config;
        let limit = user_timeout.unwrap_or_else(|| (0..=syn_retries).map(|times| doubled(initial_timeout, times, &self.config)).sum());
        self.counters.retries >= syn_retries.saturating_add(linear_syn_retries) || now.saturating_duration_since(self.send.last_data_at) >= limit
    }

    /// Returns whether the time since `since` has reached the limit for unanswered data. Returns `false` if `since` is `None`.
    fn is_given_up(&self, now: Instant, since: Option<Instant>) -> bool {
        let Some(since) = since else { return false };
        let retries = if self.is_orphan { self.config.orphan_retries.min(self.config.retries) } else { self.config.retries };
        let limit = self.config.user_timeout.unwrap_or_else(|| (0..=retries).map(|times| doubled(RETRY_BASE, times, &self.config)).sum());
        now.saturating_duration_since(since) >= limit
    }

    /// Returns the time to the next probe of a closed window.
    pub(super) fn probe_distance(&self) -> Duration {
        let base = Duration::from_nanos(self.round_trips.base_timeout()).max(self.config.least_variance);
        doubled(base, self.counters.probe_backoff, &self.config)
    }

    /// Handles the end of the timer of a closed window: sends a probe (RFC 9293, section 3.8.6.1), or ends the connection after too many unanswered probes.
    fn probe_window(&mut self, now: Instant) {
        if !self.send.board.is_empty() || !self.send.has_new() {
            (self.counters.probes, self.counters.probe_backoff) = (0, 0);
            return;
        }
        // A peer may keep its window closed for ever and answer every probe. Nobody waits for the data of an orphan, so the number of probes is limited also
        // if the peer answers.
        let is_too_long = self.is_orphan && self.counters.probe_backoff >= self.config.orphan_retries;
        let stalled = self.counters.stalled_since.filter(|_| self.config.user_timeout.is_some() && self.counters.probes > 0);
        if is_too_long || self.counters.probes >= self.config.retries || self.is_given_up(now, stalled) {
            self.die(Some(Error::TimedOut));
            return;
        }
        if self.counters.probes == 0 {
            self.counters.stalled_since = Some(now);
        }
        self.counters.probes += 1;
        self.counters.window_probes += 1;
        self.counters.probe_backoff = (self.counters.probe_backoff + 1).min(self.config.retries);
        self.probe = Some(Probe::Window);
        self.timer = Some((now.saturating_add(self.probe_distance()), Timer::WindowProbe));
    }

    /// Begins the idle time before the first keep-alive probe anew. Removes the deadline without keep-alive, or outside of the synchronised states.
    pub(super) fn restart_keepalive(&mut self, now: Instant) {
        let idle = self.config.keepalive.filter(|_| self.state.is_synchronised()).map(|keepalive| keepalive.idle);
        self.keepalive_at = idle.map(|idle| now.saturating_add(idle));
    }

    /// Handles the deadline of keep-alive: sends a probe, or ends the connection after too many unanswered probes.
    fn keep_alive(&mut self, now: Instant) {
        let Some(Keepalive { idle, interval, probes }) = self.config.keepalive.filter(|_| self.state.is_synchronised()) else {
            self.keepalive_at = None;
            return;
        };
        if !self.send.board.is_empty() || self.send.has_new() {
            // Data waits for an acknowledgement, so that the timers of the sending half notice a silent peer.
            self.keepalive_at = Some(now.saturating_add(idle));
            return;
        }
        let silent = now.saturating_duration_since(self.receive.last_heard);
        let is_over = match self.config.user_timeout {
            Some(limit) => silent >= limit && self.counters.probes > 0,
            None => self.counters.probes >= probes,
        };
        if is_over {
            // If the peer is alive after all, the reset tells the peer that this end has given the connection up.
            self.is_reset_due = true;
            self.die(Some(Error::TimedOut));
            return;
        }
        self.counters.probes += 1;
        self.probe = Some(Probe::Window);
        self.keepalive_at = Some(now.saturating_add(interval));
    }
}
