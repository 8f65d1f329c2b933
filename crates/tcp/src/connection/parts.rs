//! State of a connection, one type per concern.

use core::time::Duration;

use cohaptic_units::Instant;

use super::burst::Burst;
use super::push::Pushes;
use crate::assembler::Assembler;
use crate::congestion::Reduction;
use crate::info::CaState;
use crate::scoreboard::{Scoreboard, SentAt};
use crate::send_buffer::SendBuffer;
use crate::sequence::Position;
use crate::tuning::Tuning;

/// State of the sending half.
#[derive(Clone, Debug)]
pub(super) struct Send {
    /// Position of the SYN.
    pub(super) first: Position,
    /// First unacknowledged position.
    pub(super) una: Position,
    /// First position that was never sent.
    pub(super) next: Position,
    /// Peer's window, counted from `una` \[byte\].
    pub(super) window: u64,
    /// Largest window that the peer has offered so far \[byte\].
    pub(super) max_window: u64,
    /// Peer's position of the segment that set `window`. Segments from before this position were overtaken and must not set `window`.
    pub(super) window_from: Position,
    /// Number of bits by which the peer's windows are shifted.
    pub(super) scale: u8,
    pub(super) buffer: SendBuffer,
    /// Size of the buffer \[byte\]. Never shrinks.
    pub(super) capacity: usize,
    pub(super) board: Scoreboard,
    /// Greatest number of octets of data that a segment may carry beside timestamps.
    pub(super) mss: usize,
    /// End of the last segment below the full size (for Minshall's form of Nagle's algorithm).
    pub(super) small_end: Position,
    /// Marks of the flag PSH in the data that waits.
    pub(super) pushes: Pushes,
    /// Burst of new segments that is leaving.
    pub(super) burst: Burst,
    /// Burst of lost segments that is leaving again.
    pub(super) repetition: Burst,
    /// The program has shut this half, so that a FIN follows the data.
    pub(super) is_shut: bool,
    /// Instant at which data, or the SYN, was sent last.
    pub(super) last_data_at: Instant,
    /// Number of segments known to have arrived at the peer.
    pub(super) delivered: u64,
    /// Both ends use explicit congestion notification. Until the peer's SYN has arrived, this end asks for ECN.
    pub(super) has_ecn: bool,
    /// Segments carry ECE, because a packet with a mark has arrived and the peer has not answered with CWR.
    pub(super) tells_mark: bool,
    /// The next segment with data carries CWR, because this end has reduced its window.
    pub(super) tells_reduction: bool,
}

impl Send {
    /// Returns the position after the last octet to send, or after the FIN if this half is shut.
    pub(super) fn end(&self) -> Position {
        self.buffer.end() + u64::from(self.is_shut)
    }

    /// Returns whether an octet or the FIN was never sent.
    pub(super) fn has_new(&self) -> bool {
        self.next < self.end()
    }

    /// Returns whether the FIN is acknowledged.
    pub(super) fn is_all_acked(&self) -> bool {
        self.is_shut && self.una == self.end()
    }

    /// Returns the end (exclusive) of the peer's window.
    pub(super) fn window_end(&self) -> Position {
        self.una + self.window
    }
}

/// State of the receiving half.
#[derive(Clone, Debug)]
pub(super) struct Receive {
    /// Sequence number of the peer's SYN. `None` until the SYN has arrived.
    pub(super) first: Option<u32>,
    /// Position of the first missing octet.
    pub(super) next: Position,
    /// Window that this end's SYN offers \[byte\].
    pub(super) first_window: u16,
    /// End (exclusive) of the offered window.
    pub(super) edge: Position,
    /// Value of `next` when the last acknowledgement left.
    pub(super) acked: Position,
    /// Number of bits by which the offered windows are shifted.
    pub(super) scale: u8,
    /// Both ends use selective acknowledgements. Until the peer's SYN has arrived, this end offers SACK.
    pub(super) has_sack: bool,
    /// Both ends use timestamps. Until the peer's SYN has arrived, this end offers timestamps.
    pub(super) has_timestamps: bool,
    /// Timestamp to echo, and the instant of its arrival.
    pub(super) recent: Option<(u32, Instant)>,
    pub(super) assembler: Assembler,
    /// Buffer and window that grow. `None` with a fixed receive buffer.
    pub(super) tuning: Option<Tuning>,
    /// Position of the peer's FIN, once the FIN has arrived, also out of order.
    pub(super) fin: Option<Position>,
    /// The peer's FIN and all octets before the FIN have arrived.
    pub(super) is_ended: bool,
    /// Positions of a duplicate that the next acknowledgement reports (RFC 2883).
    pub(super) duplicate: Option<(Position, Position)>,
    /// Estimate of the peer's full segment: the largest data so far, but at least the first guess \[byte\].
    pub(super) segment: usize,
    /// An acknowledgement is due at once.
    pub(super) ack_now: bool,
    /// A segment after the SYN has offered a window, perhaps a larger window than the SYN.
    pub(super) has_offered: bool,
    /// Instant at which a delayed acknowledgement is due.
    pub(super) ack_at: Option<Instant>,
    /// Number of further acknowledgements that leave without delay.
    pub(super) quick: u32,
    /// Both ends send data in turn. Acknowledgements then wait for data to travel with.
    pub(super) is_interactive: bool,
    /// Number of segments below the full size since the last acknowledgement, at most 2.
    pub(super) pushed: u8,
    /// Instant at which data in the window arrived last.
    pub(super) last_data_at: Option<Instant>,
    /// Instant at which a valid segment arrived last.
    pub(super) last_heard: Instant,
    /// Instant of the last rate-limited answer: to a segment out of window, or a challenge.
    pub(super) challenged_at: Option<Instant>,
}

impl Receive {
    /// Returns the unfilled part of the offered window \[byte\].
    pub(super) const fn window(&self) -> u64 {
        self.edge.saturating_sub(self.next)
    }

    /// Returns the window that was offered last \[byte\].
    pub(super) const fn offered(&self) -> u64 {
        self.edge.saturating_sub(self.acked)
    }
}

/// State of loss recovery.
#[derive(Clone, Default, Debug)]
pub(super) struct Recovery {
    pub(super) phase: CaState,
    /// End of the data sent when the phase began. The phase ends when this position is acknowledged.
    pub(super) high: Position,
    /// Progress of the window from its value before the phase to the threshold.
    pub(super) reduction: Reduction,
    /// Threshold before the phase, to return to if nothing was lost. `None` if the reduction must stay, as after a mark.
    pub(super) prior_threshold: Option<u32>,
    /// Window before the phase \[segments\], to return to if nothing was lost.
    pub(super) prior_window: u32,
    /// First unacknowledged position when the phase began. `None` if no reduction can be taken back.
    pub(super) undo_from: Option<Position>,
    /// Number of segments sent again in the phase and not reported as duplicates by the peer. `None` before a segment was sent again.
    pub(super) undo_left: Option<u32>,
    /// Instant at which a segment of the phase was sent again for the first time.
    pub(super) again_at: Option<Instant>,
}

/// State of loss detection by time (RFC 8985).
#[derive(Clone, Default, Debug)]
pub(super) struct Rack {
    /// Latest transmission that has arrived.
    pub(super) delivered: Option<SentAt>,
    /// Round trip of the transmission that arrived last.
    pub(super) rtt: Duration,
    /// The network has reordered segments at least once.
    pub(super) has_reordering: bool,
    /// Largest extent of a reordering so far \[segments\].
    pub(super) degree: u32,
    /// Reordering window in quarters of the least round trip. Zero counts as one.
    pub(super) quarters: u32,
    /// Number of recoveries after which `quarters` returns to one.
    pub(super) persists: u32,
    /// Value of `Send::next` when the reordering window grew last. The window grows again once this position is acknowledged: at most once per round trip.
    pub(super) grown_at: u64,
    /// The present acknowledgement reports a duplicate: a loss was declared too early.
    pub(super) saw_duplicate: bool,
}

/// Tail loss probe on the way.
#[derive(Clone, Default, Debug)]
pub(super) struct TailProbe {
    /// Value of `Send::next` after the probe was sent. `None` if no probe is on the way.
    pub(super) end: Option<Position>,
    /// The probe repeats the last segment and carries no new data.
    pub(super) is_again: bool,
}

/// Counters of events, for decisions and for [`Info`](crate::Info).
#[derive(Clone, Default, Debug)]
pub(super) struct Counters {
    /// Number of timeouts since the last progress.
    pub(super) retries: u32,
    /// Instant of the first timeout, or of the first probe of a closed window, since the last progress.
    pub(super) stalled_since: Option<Instant>,
    /// Number of unanswered probes of a closed window or of an idle peer.
    pub(super) probes: u32,
    /// Number of doublings of the distance between probes of a closed window.
    pub(super) probe_backoff: u32,
    /// Number of probes since an acknowledgement last opened the window.
    pub(super) window_probes: u32,
    pub(super) retransmissions: u64,
    /// Number of segments that the peer has reported as duplicates.
    pub(super) duplicates: u64,
    pub(super) timeouts: u64,
    pub(super) recoveries: u64,
    pub(super) undone: u64,
}
