//! One end of a connection: the state machine and its public calls. Segments and instants come in, segments and deadlines go out.

mod acknowledge;
mod build;
mod burst;
mod close;
mod data;
mod inspect;
mod loss;
mod open;
mod parts;
mod program;
mod push;
mod receive;
mod recovery;
mod timers;
mod transmit;
mod undo;
mod window;

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

/// One end of a TCP connection: a state machine without a clock, which receives the time with each call.
///
/// After each call, the owner calls [`poll_transmit`](Self::poll_transmit) until `poll_transmit` returns `None`, and later
/// [`handle_timeout`](Self::handle_timeout) at the instant that [`poll_timeout`](Self::poll_timeout) returns. The instants of the calls must not decrease.
#[derive(Clone, Debug)]
pub struct Connection {
    config: TcpConfig,
    local: SocketAddr,
    remote: SocketAddr,
    state: State,
    /// Reason for the end of the connection, until a call of the program has returned the reason once.
    error: Option<Error>,
    /// The program has closed the connection: nobody will read data any more.
    is_orphan: bool,
    send: Send,
    receive: Receive,
    round_trips: RoundTrips,
    congestion: Congestion,
    recovery: Recovery,
    rack: Rack,
    tail: TailProbe,
    /// Deadline of the sending half, and its purpose.
    timer: Option<(Instant, Timer)>,
    keepalive_at: Option<Instant>,
    /// End of TIME-WAIT, or of FIN-WAIT-2 of an orphan.
    linger_until: Option<Instant>,
    /// Purpose of the next segment sent regardless of the congestion window.
    probe: Option<Probe>,
    /// SYNs, and answers to refused segments. These segments leave before all data.
    replies: VecDeque<Segment<'static>>,
    /// A reset is due, which tells the peer that this end has given the connection up.
    is_reset_due: bool,
    counters: Counters,
    /// Calls of the program since `poll_transmit` was last called.
    calls: Calls,
}

/// Calls of the program with effects that need the time. The calls have no time of their own, but the owner calls `poll_transmit` after each call.
#[derive(Clone, Copy, Default, Debug)]
struct Calls {
    /// Data was read.
    has_read: bool,
    /// Data was written while no segment was on the way.
    has_written: bool,
}

/// Purpose of a segment sent regardless of the congestion window.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Probe {
    /// The last flight is unanswered, and an answer to one more segment would show a loss at its end (RFC 8985, section 7).
    Tail,
    /// The peer's window is closed, or the connection is idle, and the peer should answer.
    Window,
}

impl Connection {
    /// Returns the state.
    #[must_use]
    pub const fn state(&self) -> State {
        self.state
    }

    /// Returns the address of this end.
    #[must_use]
    pub const fn local_addr(&self) -> SocketAddr {
        self.local
    }

    /// Returns the address of the other end.
    #[must_use]
    pub const fn peer_addr(&self) -> SocketAddr {
        self.remote
    }

    /// Returns whether the connection has ended and has nothing to send. The owner may then drop the connection, once the program has closed its end.
    #[must_use]
    pub fn is_finished(&self) -> bool {
        self.state == State::Closed && self.replies.is_empty() && !self.is_reset_due
    }

    /// Ends the connection. The next call of the program returns `error`, once. Data that has arrived in order stays readable, unless the connection is an
    /// orphan.
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

    /// Returns the value of the timestamps clock at `now` \[ticks\].
    fn ticks(now: Instant) -> u32 {
        // A tick of the timestamps clock is a millisecond, as in Linux. The count wraps after 49 days.
        u32::try_from(now.as_nanos() / 1_000_000 % (1 << 32)).unwrap_or(0)
    }

    /// Returns the most octets of data in a segment without selective acknowledgements, at least 48 unless the MSS is smaller.
    fn segment_size(&self) -> usize {
        self.send.mss.min(usize::try_from(self.half_window()).unwrap_or(usize::MAX).max(48))
    }

    /// Returns half of the peer's largest window, so that a small window takes two segments (RFC 9293, section 3.8.6.2.1), or a tiny window as a whole.
    fn half_window(&self) -> u64 {
        let window = self.send.max_window;
        if window > 536 { window / 2 } else { window }
    }

    /// Returns the blocks for a selective acknowledgement: first the duplicate, if there is one, because RFC 2883 gives the first place a meaning.
    fn blocks(&self) -> Vec<(u64, u64)> {
        self.receive.duplicate.into_iter().chain(self.receive.assembler.blocks()).collect()
    }
}
