//! What a connection remembers, by concern.

use core::time::Duration;

use cohaptic_units::Instant;

use crate::assembler::Assembler;
use crate::congestion::Reduction;
use crate::scoreboard::{Scoreboard, SentAt};
use crate::send_buffer::SendBuffer;
use crate::sequence::Position;

/// The sending half.
#[derive(Clone, Debug)]
pub(super) struct Send {
    /// The position of the SYN.
    pub(super) first: Position,
    /// The first position that is not acknowledged.
    pub(super) una: Position,
    /// The first one that was never sent.
    pub(super) next: Position,
    /// The peer's window \[byte\], the largest so far, and the sequence number that it came with.
    pub(super) window: u64,
    pub(super) max_window: u64,
    pub(super) window_from: Position,
    pub(super) scale: u8,
    pub(super) buffer: SendBuffer,
    pub(super) board: Scoreboard,
    /// Octets that a segment may carry beside timestamps.
    pub(super) mss: usize,
    /// The end of the last segment that was not full (Minshall's form of Nagle's algorithm).
    pub(super) small_end: Position,
    /// The program has shut this half: a FIN follows the data.
    pub(super) is_shut: bool,
    pub(super) last_data_at: Instant,
    pub(super) delivered: u64,
    /// Explicit congestion notification: agreed upon, the peer is to be told of a mark, of a reduction.
    pub(super) has_ecn: bool,
    pub(super) tells_mark: bool,
    pub(super) tells_reduction: bool,
}

impl Send {
    /// The position behind the last octet to send, the FIN included.
    pub(super) fn end(&self) -> Position {
        self.buffer.end() + u64::from(self.is_shut)
    }

    /// Whether something was never sent.
    pub(super) fn has_new(&self) -> bool {
        self.next < self.end()
    }

    /// Whether the FIN is acknowledged.
    pub(super) fn is_all_acked(&self) -> bool {
        self.is_shut && self.una == self.end()
    }

    pub(super) fn window_end(&self) -> Position {
        self.una + self.window
    }
}

/// The receiving half.
#[derive(Clone, Debug)]
pub(super) struct Receive {
    /// The number of the peer's SYN, once it has come.
    pub(super) first: Option<u32>,
    /// The next position that is expected.
    pub(super) next: Position,
    /// The end of the window that was offered.
    pub(super) edge: Position,
    /// What was expected when the last acknowledgement left.
    pub(super) acked: Position,
    pub(super) scale: u8,
    pub(super) has_sack: bool,
    pub(super) has_timestamps: bool,
    /// The timestamp to echo, and when it came.
    pub(super) recent: Option<(u32, Instant)>,
    pub(super) assembler: Assembler,
    /// Where the peer's FIN is, and whether all before it has come.
    pub(super) fin: Option<Position>,
    pub(super) is_ended: bool,
    /// A duplicate to tell of (RFC 2883).
    pub(super) duplicate: Option<(Position, Position)>,
    /// The largest segment so far, at least a guess.
    pub(super) segment: usize,
    pub(super) ack_now: bool,
    /// A window has been offered after the smaller one of the SYN.
    pub(super) has_offered: bool,
    /// When a delayed acknowledgement is due.
    pub(super) ack_at: Option<Instant>,
    /// How many more acknowledgements do not wait.
    pub(super) quick: u32,
    /// Data flows both ways in turn: acknowledgements wait for data to travel with.
    pub(super) is_interactive: bool,
    /// A segment that was not full has come, or two, since the last acknowledgement.
    pub(super) pushed: u8,
    pub(super) last_data_at: Option<Instant>,
    pub(super) last_heard: Instant,
    /// When a segment out of window was answered last.
    pub(super) challenged_at: Option<Instant>,
}

impl Receive {
    pub(super) const fn window(&self) -> u64 {
        self.edge.saturating_sub(self.next)
    }
}

/// How the sender reacts to losses (RFC 5681, 6582, 6675; the names of Linux in brackets).
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Default)]
pub(super) enum Phase {
    #[default]
    Open,
    /// Something arrived out of order (Disorder).
    Disorder,
    /// The window shrinks because of a mark (CWR).
    Reduced,
    /// Lost segments are sent again (Recovery).
    Recovery,
    /// The timer has run out (Loss).
    Loss,
}

#[derive(Clone, Default, Debug)]
pub(super) struct Recovery {
    pub(super) phase: Phase,
    /// What was sent when the phase began: it ends when this is acknowledged.
    pub(super) high: Position,
    pub(super) reduction: Reduction,
    /// The threshold and the window before, in case nothing was lost.
    pub(super) prior_threshold: Option<u32>,
    pub(super) prior_window: u32,
    /// Where the phase began, and how many that were sent again have not been reported as duplicates; `None` before any.
    pub(super) undo_from: Option<Position>,
    pub(super) undo_left: Option<u32>,
    /// When the first segment of the phase was sent again.
    pub(super) again_at: Option<Instant>,
}

/// Loss detection by time (RFC 8985).
#[derive(Clone, Default, Debug)]
pub(super) struct Rack {
    /// The latest transmission that has arrived, and its round trip.
    pub(super) delivered: Option<SentAt>,
    pub(super) rtt: Duration,
    pub(super) has_reordering: bool,
    /// By how many segments at most.
    pub(super) degree: u32,
    /// The reordering window in quarters of the least round trip, and for how many recoveries it stays.
    pub(super) quarters: u32,
    pub(super) persists: u32,
    /// What was delivered when the window grew last.
    pub(super) grown_at: u64,
    pub(super) saw_duplicate: bool,
}

/// The tail loss probe on the way.
#[derive(Clone, Default, Debug)]
pub(super) struct TailProbe {
    pub(super) end: Option<Position>,
    pub(super) is_again: bool,
}

#[derive(Clone, Default, Debug)]
pub(super) struct Counters {
    /// Timeouts in a row, and when the first of them was.
    pub(super) retries: u32,
    pub(super) stalled_since: Option<Instant>,
    /// Probes of a closed window, or of an idle peer, without an answer; how often their distance was doubled.
    pub(super) probes: u32,
    pub(super) probe_backoff: u32,
    pub(super) window_probes: u32,
    pub(super) retransmissions: u64,
    pub(super) timeouts: u64,
    pub(super) recoveries: u64,
    pub(super) undone: u64,
}
