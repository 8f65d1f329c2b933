//! One end of a connection.

mod acknowledge;
mod build;
mod close;
mod data;
mod inspect;
mod loss;
mod open;
mod parts;
mod program;
mod receive;
mod recovery;
mod timers;
mod transmit;
mod undo;

use alloc::collections::VecDeque;
use alloc::vec::Vec;
use core::net::SocketAddr;

use cohaptic_units::Instant;

use crate::config::TcpConfig;
use crate::congestion::Congestion;
use crate::error::Error;
use crate::info::State;
use crate::rtt::RoundTrips;
use crate::segment::Segment;
use parts::{Counters, Rack, Receive, Recovery, Send, TailProbe};
use timers::Timer;

/// One end of a TCP connection: a state machine that is told the time.
///
/// After each call, [`poll_transmit`](Self::poll_transmit) is to be called until it returns `None`, and [`handle_timeout`](Self::handle_timeout) at the instant
/// that [`poll_timeout`](Self::poll_timeout) says. Instants must not go back.
#[derive(Clone, Debug)]
pub struct Connection {
    config: TcpConfig,
    local: SocketAddr,
    remote: SocketAddr,
    state: State,
    /// What the next call is told, once.
    error: Option<Error>,
    /// The program has dropped it.
    is_orphan: bool,
    send: Send,
    receive: Receive,
    round_trips: RoundTrips,
    congestion: Congestion,
    recovery: Recovery,
    rack: Rack,
    tail: TailProbe,
    timer: Option<(Instant, Timer)>,
    keepalive_at: Option<Instant>,
    /// When TIME-WAIT, or FIN-WAIT-2 of an orphan, is over.
    linger_until: Option<Instant>,
    /// A segment that is sent whatever the windows say.
    probe: Option<Probe>,
    replies: VecDeque<Segment<'static>>,
    counters: Counters,
}

/// Why a segment is forced.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Probe {
    /// The last flight is unanswered (RFC 8985, section 7).
    Tail,
    /// The peer's window is closed, or the connection idle.
    Window,
}

impl Connection {
    /// The state.
    #[must_use]
    pub const fn state(&self) -> State {
        self.state
    }

    /// The address of this end.
    #[must_use]
    pub const fn local_addr(&self) -> SocketAddr {
        self.local
    }

    /// The address of the other end.
    #[must_use]
    pub const fn peer_addr(&self) -> SocketAddr {
        self.remote
    }

    /// Whether the connection is over, has nothing to send, and its owner may forget it once the program has dropped it.
    #[must_use]
    pub fn is_finished(&self) -> bool {
        self.state == State::Closed && self.replies.is_empty()
    }

    /// The connection is over, and the program hears of it once.
    fn die(&mut self, error: Option<Error>) {
        self.state = State::Closed;
        self.error = error;
        self.send.buffer.clear();
        self.send.board = Default::default();
        self.receive.assembler.forget_gaps();
        self.receive.ack_now = false;
        self.receive.ack_at = None;
        (self.timer, self.keepalive_at, self.linger_until, self.probe) = (None, None, None, None);
        if self.is_orphan {
            self.receive.assembler = Default::default();
        }
    }

    /// The clock of timestamps.
    fn ticks(now: Instant) -> u32 {
        // One tick of the timestamps clock is a millisecond, as in Linux; the count wraps after 49 days.
        u32::try_from(now.as_nanos() / 1_000_000 % (1 << 32)).unwrap_or(0)
    }

    /// Octets that a segment may carry, apart from selective acknowledgements.
    fn segment_size(&self) -> usize {
        // Half the peer's largest window at most, so that a small window is not one segment (RFC 9293, section 3.8.6.2.1).
        let window = usize::try_from(self.send.max_window).unwrap_or(usize::MAX);
        let most = if window > 536 { window / 2 } else { window };
        self.send.mss.min(most.max(48))
    }

    fn blocks(&self) -> Vec<(u64, u64)> {
        self.receive.duplicate.into_iter().chain(self.receive.assembler.blocks()).collect()
    }
}
