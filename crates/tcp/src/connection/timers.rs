//! Deadlines.

use core::time::Duration;

use cohaptic_units::Instant;

use super::{Connection, Probe};
use crate::config::Keepalive;
use crate::connection::parts::Phase;
use crate::error::Error;
use crate::info::State;
use crate::rtt::doubled;

/// What the timer of the sending half waits for. There is one, as in Linux.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Timer {
    /// An answer (RFC 6298).
    Retransmission,
    /// An answer to the last flight (RFC 8985, section 7).
    TailProbe,
    /// Segments that may only be late (RFC 8985, section 6).
    Reordering,
    /// A window that is closed (RFC 9293, section 3.8.6.1).
    WindowProbe,
}

/// The least time before a tail probe where others are on the way, two of Linux's ticks.
const LEAST_TAIL: Duration = Duration::from_millis(2);

/// What Linux counts `retries` with: the least timeout.
const RETRY_BASE: Duration = Duration::from_millis(200);

impl Connection {
    /// When [`handle_timeout`](Self::handle_timeout) must be called, if nothing arrives before.
    #[must_use]
    pub fn poll_timeout(&self) -> Option<Instant> {
        let timer = self.timer.map(|(at, _)| at);
        [timer, self.receive.ack_at, self.keepalive_at, self.linger_until].into_iter().flatten().min()
    }

    /// Lets time pass until `now`. Earlier than [`poll_timeout`](Self::poll_timeout) it does nothing.
    pub fn handle_timeout(&mut self, now: Instant) {
        let is_due = |at: Option<Instant>| at.is_some_and(|at| at <= now);
        if is_due(self.linger_until) {
            self.die(None);
            return;
        }
        if is_due(self.receive.ack_at) {
            self.receive.ack_at = None;
            self.receive.ack_now = true;
            self.receive.is_interactive = false;
        }
        if is_due(self.keepalive_at) {
            self.keep_alive(now);
        }
        if let Some((_, timer)) = self.timer.filter(|(at, _)| *at <= now) {
            self.timer = None;
            match timer {
                Timer::Retransmission => self.time_out(now),
                Timer::TailProbe => self.probe_tail(now),
                Timer::Reordering => self.reordering_is_over(now),
                Timer::WindowProbe => self.probe_window(now),
            }
        }
    }

    /// After an acknowledgement that moved on: a probe of the tail, or the retransmission timer.
    pub(super) fn set_timer(&mut self, now: Instant) {
        if !self.set_tail_timer(now, true) {
            self.set_retransmission_timer(now, false);
        }
    }

    /// Sets the retransmission timer. `anew`: counted from now, also if it stood behind another one.
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

    /// Whether a tail probe is to come (RFC 8985, section 7.2). `has_advanced`: the retransmission timer would begin anew.
    pub(super) fn set_tail_timer(&mut self, now: Instant, has_advanced: bool) -> bool {
        let board = &self.send.board;
        let is_wanted = self.config.tail_loss_probe && self.receive.has_sack && matches!(self.recovery.phase, Phase::Open | Phase::Reduced);
        let Some(first) = board.first().filter(|_| is_wanted && self.state.may_send() && self.tail.end.is_none()) else { return false };
        let mut wait = match self.round_trips.srtt() {
            // A single segment may wait for a delayed acknowledgement.
            Some(srtt) => 2 * srtt + if board.packets_out() == 1 { self.config.least_variance.max(LEAST_TAIL) } else { LEAST_TAIL },
            None => self.config.initial_timeout,
        };
        let timeout = self.round_trips.timeout(&self.config);
        let from = if has_advanced { now } else { first.at };
        let left = from.saturating_add(timeout).saturating_duration_since(now);
        if !left.is_zero() {
            wait = wait.min(left);
        }
        self.timer = Some((now.saturating_add(wait), Timer::TailProbe));
        true
    }

    fn probe_tail(&mut self, now: Instant) {
        if self.send.board.is_empty() {
            return;
        }
        if self.tail.end.is_none() {
            self.probe = Some(Probe::Tail);
        }
        self.set_retransmission_timer(now, true);
    }

    /// The timer has run out: everything may be lost.
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

    /// The timeout, cut to what the program bears.
    fn borne_timeout(&self, now: Instant) -> Duration {
        let timeout = self.round_trips.timeout(&self.config);
        match (self.config.user_timeout, self.counters.stalled_since) {
            (Some(limit), Some(since)) => timeout.min(limit.saturating_sub(now.saturating_duration_since(since)).max(Duration::from_millis(1))),
            _ => timeout,
        }
    }

    fn repeat_handshake(&mut self, now: Instant) {
        let is_client = self.state == State::SynSent;
        let retries = if is_client { self.config.syn_retries } else { self.config.syn_ack_retries };
        if self.counters.retries >= retries {
            self.die(Some(Error::TimedOut));
            return;
        }
        self.counters.retries += 1;
        self.counters.retransmissions += 1;
        if !is_client || self.counters.retries > self.config.linear_syn_retries {
            self.round_trips.backoff += 1;
        }
        self.send.board.sent_again(self.send.first, now, false);
        self.timer = Some((now.saturating_add(self.round_trips.timeout(&self.config)), Timer::Retransmission));
        let syn = self.build_syn(now);
        self.replies.push_back(syn);
    }

    /// Whether nothing was answered for as long as is borne.
    fn is_given_up(&self, now: Instant, since: Option<Instant>) -> bool {
        let Some(since) = since else { return false };
        let retries = if self.is_orphan { self.config.orphan_retries.min(self.config.retries) } else { self.config.retries };
        let limit = self.config.user_timeout.unwrap_or_else(|| (0..=retries).map(|times| doubled(RETRY_BASE, times, &self.config)).sum());
        now.saturating_duration_since(since) >= limit
    }

    /// The time to the next probe of a closed window.
    pub(super) fn probe_distance(&self) -> Duration {
        doubled(self.round_trips.base_timeout(&self.config).max(self.config.least_variance), self.counters.probe_backoff, &self.config)
    }

    /// A closed window is asked for (RFC 9293, section 3.8.6.1).
    fn probe_window(&mut self, now: Instant) {
        if !self.send.board.is_empty() || !self.send.has_new() {
            (self.counters.probes, self.counters.probe_backoff) = (0, 0);
            return;
        }
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

    pub(super) fn restart_keepalive(&mut self, now: Instant) {
        let idle = self.config.keepalive.filter(|_| self.state.is_synchronised()).map(|keepalive| keepalive.idle);
        self.keepalive_at = idle.map(|idle| now.saturating_add(idle));
    }

    fn keep_alive(&mut self, now: Instant) {
        let Some(Keepalive { idle, interval, probes }) = self.config.keepalive.filter(|_| self.state.is_synchronised()) else {
            self.keepalive_at = None;
            return;
        };
        if !self.send.board.is_empty() || self.send.has_new() {
            // The other timers watch.
            self.keepalive_at = Some(now.saturating_add(idle));
            return;
        }
        let silent = now.saturating_duration_since(self.receive.last_heard);
        let is_over = match self.config.user_timeout {
            Some(limit) => silent >= limit && self.counters.probes > 0,
            None => self.counters.probes >= probes,
        };
        if is_over {
            let reset = self.build_reset();
            self.die(Some(Error::TimedOut));
            self.replies.push_back(reset);
            return;
        }
        self.counters.probes += 1;
        self.probe = Some(Probe::Window);
        self.keepalive_at = Some(now.saturating_add(interval));
    }
}
