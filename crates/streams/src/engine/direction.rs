//! One direction of a connection: the held bytes, and the faults of holding and cutting bytes.

use std::collections::VecDeque;

use cohaptic_linkfile::stream::Slice;
use cohaptic_units::Instant;
use cohaptic_wan::random::{Purpose, Stream};

use super::End;

/// Bytes of a connection on their way from one end to the other, in order.
#[derive(Debug)]
pub(super) struct Direction {
    /// Held bytes: first `ready` bytes for the receiver, then `stalled` bytes, then bytes on the line.
    bytes: VecDeque<u8>,
    /// Bytes for the receiver now.
    ready: usize,
    /// Bytes that left the line during a stall.
    stalled: usize,
    /// Largest number of held bytes.
    window: usize,
    /// `true` after the sender has ended: no bytes come any more.
    pub(super) has_ended: bool,
    /// End of the stream after it has left the line.
    pub(super) end: Option<End>,
    /// `true` while a stall holds whatever leaves the line.
    pub(super) is_stalled: bool,
    /// Bytes that still reach the receiver before the cut; `None` without the fault.
    left: Option<u64>,
    slices: Option<Slices>,
    /// Instant at which the first held bytes became writable; `None` after [`Direction::take_due`].
    due: Option<Instant>,
}

/// Slicer of a direction.
#[derive(Debug)]
struct Slices {
    law: Slice,
    draws: Stream,
    /// Number of pieces drawn so far.
    drawn: u64,
    /// Size of the present piece \[bytes\]; 0 before the size of the next piece is drawn.
    present: usize,
    /// Instant before which no piece may be written.
    not_before: Instant,
}

/// Result of a write.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Wrote {
    /// More bytes can be written now.
    Now,
    /// The next piece can be written at this instant.
    At(Instant),
    /// Nothing can be written.
    Nothing,
}

impl Direction {
    /// `cut` is the number of bytes before the cut. `slices` is the law of pieces with the random stream of the sizes.
    pub(super) fn new(window: u64, cut: Option<u64>, slices: Option<(Slice, Stream)>) -> Self {
        let slices = slices.map(|(law, draws)| Slices { law, draws, drawn: 0, present: 0, not_before: Instant::ZERO });
        Self {
            bytes: VecDeque::new(),
            ready: 0,
            stalled: 0,
            window: usize::try_from(window).unwrap_or(usize::MAX),
            has_ended: false,
            end: None,
            is_stalled: false,
            left: cut,
            slices,
            due: None,
        }
    }

    /// Changes the largest number of held bytes. Bytes beyond a smaller number stay held.
    pub(super) fn set_window(&mut self, window: u64) {
        self.window = usize::try_from(window).unwrap_or(usize::MAX);
    }

    /// Returns the number of held bytes.
    pub(super) fn held(&self) -> usize {
        self.bytes.len()
    }

    /// Returns the number of bytes that may still come. After the end the sender may be read without bound, because only a reset can come.
    pub(super) fn room(&self) -> usize {
        if self.has_ended { usize::MAX } else { self.window.saturating_sub(self.bytes.len()) }
    }

    /// Takes bytes of the sender for the line.
    pub(super) fn push(&mut self, bytes: &[u8]) {
        self.bytes.extend(bytes);
    }

    /// Takes note that `count` bytes have left the line at the instant `at`.
    pub(super) fn arrive(&mut self, at: Instant, count: usize) {
        if self.is_stalled {
            self.stalled += count;
        } else {
            self.make_ready(at, count);
        }
    }

    fn make_ready(&mut self, at: Instant, count: usize) {
        let before = self.left.map_or(count, |left| count.min(usize::try_from(left).unwrap_or(usize::MAX)));
        if let Some(left) = &mut self.left {
            *left -= before as u64;
        }
        // Bytes beyond the cut stay held until the close, where held bytes are counted as lost.
        self.ready += before;
        if self.ready > 0 && self.due.is_none() {
            // Bytes that come during the gap between two pieces are due at the end of the gap.
            let gap = self.slices.as_ref().filter(|slices| slices.present == 0).map_or(at, |slices| slices.not_before);
            self.due = Some(at.max(gap));
        }
    }

    /// Ends a stall at the instant `at`: the waiting bytes can reach the receiver.
    pub(super) fn resume(&mut self, at: Instant) {
        self.is_stalled = false;
        let count = std::mem::take(&mut self.stalled);
        self.make_ready(at, count);
    }

    /// Returns whether no byte is in front of the end of the stream.
    pub(super) fn is_drained(&self) -> bool {
        self.ready == 0 && self.stalled == 0
    }

    /// Returns whether the cut has come, and the receiver has all bytes before the cut.
    pub(super) fn is_cut(&self) -> bool {
        self.left == Some(0) && self.ready == 0
    }

    /// Returns the bytes for one write now, or `None` if nothing may be written.
    pub(super) fn writable(&mut self, now: Instant) -> Option<&[u8]> {
        if self.ready == 0 {
            return None;
        }
        let most = match &mut self.slices {
            None => self.ready,
            Some(slices) => slices.piece(now, self.ready)?,
        };
        let front = self.bytes.as_slices().0;
        // The bytes lie in up to two parts of memory. A piece across both parts is put into one part, because a piece is one write.
        if self.slices.is_some() && front.len() < most {
            self.bytes.make_contiguous();
        }
        let front = self.bytes.as_slices().0;
        Some(&front[..front.len().min(most)])
    }

    /// Takes note that the first `count` bytes are written.
    pub(super) fn wrote(&mut self, now: Instant, count: usize) -> Wrote {
        self.bytes.drain(..count);
        self.ready -= count;
        let Some(slices) = &mut self.slices else { return if self.ready > 0 { Wrote::Now } else { Wrote::Nothing } };
        slices.present -= count.min(slices.present);
        if slices.present == 0 {
            slices.not_before = now.saturating_add(slices.law.gap);
        }
        match (self.ready, slices.not_before) {
            (0, _) => Wrote::Nothing,
            (_, at) if at > now && slices.present == 0 => {
                // The lateness of the next write counts from the end of the gap, not from the arrival of the bytes.
                self.due = Some(at);
                Wrote::At(at)
            }
            _ => Wrote::Now,
        }
    }

    /// Returns and forgets the instant at which the first held bytes became writable.
    pub(super) fn take_due(&mut self) -> Option<Instant> {
        self.due.take()
    }

    /// Returns the instant at which the next piece may be written, if bytes wait for the gap between two pieces.
    pub(super) fn waits_for_gap(&self, now: Instant) -> Option<Instant> {
        let slices = self.slices.as_ref()?;
        (self.ready > 0 && slices.present == 0 && slices.not_before > now).then_some(slices.not_before)
    }
}

impl Slices {
    /// Returns the size of the present piece, or `None` before the end of the gap. At most `ready` bytes.
    fn piece(&mut self, now: Instant, ready: usize) -> Option<usize> {
        if self.present == 0 {
            if now < self.not_before {
                return None;
            }
            let drawn = self.draw();
            self.present = usize::try_from(drawn).unwrap_or(usize::MAX).min(ready);
        }
        Some(self.present)
    }

    /// Draws the size of a piece, uniformly in `size` ± `variation`.
    fn draw(&mut self) -> u64 {
        let Slice { size, variation, .. } = self.law;
        let word = self.draws.packet(self.drawn).first(Purpose::Jitter);
        self.drawn += 1;
        // The upper half of the product of a uniform word and a width is uniform below the width (Lemire 2019), except for a bias of at most width·2⁻⁶⁴.
        let width = u128::from(variation) * 2 + 1;
        let offset = u64::try_from((u128::from(word) * width) >> 64).unwrap_or(u64::MAX);
        size.get() - variation + offset
    }
}
