//! Run of a script: one end, the time, and the segments that have left and that no step has expected yet.

use std::collections::VecDeque;
use std::time::Duration;

use cohaptic_tcp::{Connection, Flags, Segment, TcpConfig};
use cohaptic_units::Instant;

use crate::packet::{Offsets, Packet, octet};
use crate::parse::{Action, Script, When};

/// Beginning of a script. Not zero, because a timestamp of zero is no timestamp.
const BEGIN: Instant = Instant::from_nanos(1_000_000_000);

/// Initial sequence number of the end that is tested: soon after the first octets, the numbers wrap.
pub(crate) const INITIAL_SEQUENCE: u32 = 0xffff_f000;

/// Time for which a step of the time `*` waits at most.
const LONGEST: Duration = Duration::from_secs(3600);

pub(crate) struct Stage {
    pub(crate) config: TcpConfig,
    pub(crate) now: Instant,
    pub(crate) end: Option<Connection>,
    /// Sequence number of the peer's SYN.
    first: u32,
    pub(crate) offsets: Offsets,
    /// Segments that have left.
    sent: VecDeque<(Instant, Segment<'static>)>,
    pub(crate) files: Files,
    /// Octets that the program has written and read.
    pub(crate) written: u32,
    pub(crate) read: u32,
}

/// File descriptors of the script.
#[derive(Default)]
pub(crate) struct Files {
    /// Socket that was made and neither listens nor connects yet.
    pub(crate) fresh: Option<u64>,
    pub(crate) listener: Option<u64>,
    pub(crate) connection: Option<u64>,
    pub(crate) resets_on_close: bool,
}

impl Stage {
    /// Runs a script. The error has the line of the step that fails.
    pub(crate) fn run(script: &Script) -> Result<(), (usize, String)> {
        let mut stage = Self {
            config: TcpConfig::default(),
            now: BEGIN,
            end: None,
            first: 0,
            offsets: Offsets { sequence: 0, stamp: None },
            sent: VecDeque::new(),
            files: Files::default(),
            written: 0,
            read: 0,
        };
        for (line, name, value) in &script.settings {
            stage.set(name, value).ok_or_else(|| (*line, format!("the setting {name}={value} is unknown")))?;
        }
        for step in &script.steps {
            stage.take(step.when, &step.action).map_err(|text| (step.line, text))?;
        }
        let line = script.steps.last().map_or(1, |step| step.line);
        match stage.sent.front() {
            Some((at, segment)) => Err((line, format!("the script ends, and nothing expects {}", stage.describe(*at, segment)))),
            None => Ok(()),
        }
    }

    fn take(&mut self, when: When, action: &Action) -> Result<(), String> {
        let (from, to) = match when {
            When::Any => (self.now, self.now + LONGEST),
            When::Within { is_relative, from, to } => {
                let base = if is_relative { self.now } else { BEGIN };
                (base + Duration::from_nanos(from), base + Duration::from_nanos(to))
            }
        };
        if let Action::Leaves(packet) = action {
            return self.expect(from, to, packet);
        }
        self.advance(from, false);
        if let Some((at, segment)) = self.sent.front().filter(|(at, _)| *at < from) {
            return Err(format!("nothing expects {}", self.describe(*at, segment)));
        }
        match action {
            Action::Arrives(packet) => self.arrive(packet),
            Action::Calls(call) => self.call(call)?,
            Action::Checks(checks) => {
                let info = self.end.as_ref().ok_or("there is no connection")?.info();
                checks.iter().find_map(|check| check.failure(&info)).map_or(Ok(()), Err)?;
            }
            Action::Leaves(_) => unreachable!("handled above"),
        }
        Ok(())
    }

    fn describe(&self, at: Instant, segment: &Segment<'_>) -> String {
        format!("`{}`, which left at {} s", Packet::of(segment, self.offsets), (at - BEGIN).as_secs_f64())
    }

    /// Lets time go on to `to`, or until a segment leaves if `until_sent` is set.
    fn advance(&mut self, to: Instant, until_sent: bool) {
        self.flush();
        while let Some(at) = self.end.as_ref().and_then(Connection::poll_timeout).filter(|at| *at <= to) {
            if until_sent && !self.sent.is_empty() {
                return;
            }
            self.now = self.now.max(at);
            self.end.as_mut().unwrap().handle_timeout(self.now);
            self.flush();
        }
        if !until_sent || self.sent.is_empty() {
            self.now = self.now.max(to);
        }
    }

    /// Takes what leaves at present.
    pub(crate) fn flush(&mut self) {
        while let Some(segment) = self.end.as_mut().and_then(|end| end.poll_transmit(self.now)) {
            self.sent.push_back((self.now, segment));
        }
    }

    /// Expects that `packet` leaves next, from `from` to `to`.
    fn expect(&mut self, from: Instant, to: Instant, packet: &Packet) -> Result<(), String> {
        let begin = self.now;
        self.advance(to, true);
        let Some((at, segment)) = self.sent.pop_front() else { return Err(format!("`{packet}` does not leave")) };
        if self.offsets.stamp.is_none()
            && let (Some(Some((wanted, _))), Some((value, _))) = (packet.options.map(|options| options.timestamps), segment.options.timestamps)
        {
            self.offsets.stamp = Some(value.wrapping_sub(wanted));
        }
        let seen = Packet::of(&segment, self.offsets);
        if !packet.fits(&seen) {
            return Err(format!("expected `{packet}`, but {}", self.describe(at, &segment)));
        }
        if at < from || at > to {
            let after = |at: Instant| at.saturating_duration_since(begin).as_secs_f64();
            return Err(format!("{} (+{} s), was expected at +{} s", self.describe(at, &segment), after(at), after(from)));
        }
        let position = seen.sequence.wrapping_sub(1);
        let is_right = segment.payload.iter().zip(0u32..).all(|(seen, k)| *seen == octet(position.wrapping_add(k)));
        if !is_right || (seen.length > 0 && position + seen.length > self.written) {
            return Err(format!("`{seen}` has octets that were never written"));
        }
        Ok(())
    }

    fn arrive(&mut self, packet: &Packet) {
        if packet.flags.has(Flags::SYN) {
            self.first = packet.sequence;
        }
        let (us, them) = ("10.0.0.1:8080".parse().unwrap(), "10.0.0.2:40000".parse().unwrap());
        let segment = packet.to_segment([them, us], self.offsets, self.first);
        let is_syn = segment.flags.has(Flags::SYN) && !segment.flags.has(Flags::ACK) && !segment.flags.has(Flags::RST);
        let is_listening = self.files.listener.is_some() && is_syn;
        match &mut self.end {
            Some(end) if end.state() != cohaptic_tcp::State::Closed && !(is_listening && end.gives_way_to(&segment)) => {
                end.handle_segment(self.now, &segment);
            }
            slot if is_listening => {
                *slot = Some(Connection::accept(self.now, self.config.clone(), &segment, INITIAL_SEQUENCE).unwrap());
                self.offsets.sequence = INITIAL_SEQUENCE;
                (self.written, self.read) = (0, 0);
            }
            _ => self.sent.extend(segment.refusal(64).map(|reset| (self.now, reset))),
        }
        self.flush();
    }

    /// Opens the connection of the program.
    pub(crate) fn connect(&mut self) {
        let (us, them) = ("10.0.0.1:40000".parse().unwrap(), "10.0.0.2:8080".parse().unwrap());
        self.end = Some(Connection::connect(self.now, self.config.clone(), us, them, INITIAL_SEQUENCE).unwrap());
        self.offsets.sequence = INITIAL_SEQUENCE;
    }

    /// Sets a constant by its name in Linux's `net.ipv4`.
    fn set(&mut self, name: &str, value: &str) -> Option<()> {
        let number: u32 = value.parse().unwrap_or(0);
        let config = &mut self.config;
        match (name, value) {
            ("tcp_congestion_control", "cubic") => config.congestion = cohaptic_tcp::CongestionControl::Cubic,
            ("tcp_congestion_control", "dctcp") => config.congestion = cohaptic_tcp::CongestionControl::Dctcp,
            ("tcp_congestion_control", "reno") => config.congestion = cohaptic_tcp::CongestionControl::Reno,
            _ if value.parse::<u32>().is_err() => return None,
            ("tcp_sack", _) => config.sack = number > 0,
            ("tcp_timestamps", _) => config.timestamps = number > 0,
            ("tcp_ecn", _) => config.ecn = number == 1,
            ("tcp_early_retrans", _) => config.tail_loss_probe = number > 0,
            ("tcp_slow_start_after_idle", _) => config.slow_start_after_idle = number > 0,
            ("tcp_syn_retries", _) => config.syn_retries = number,
            ("tcp_syn_linear_timeouts", _) => config.linear_syn_retries = number,
            ("tcp_synack_retries", _) => config.syn_ack_retries = number,
            ("tcp_retries2", _) => config.retries = number,
            ("tcp_orphan_retries", _) => config.orphan_retries = number,
            ("tcp_fin_timeout", _) => config.time_wait = Duration::from_secs(number.into()),
            _ => return None,
        }
        Some(())
    }
}
