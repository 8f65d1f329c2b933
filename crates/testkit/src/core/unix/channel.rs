//! Direction of a Unix stream, or a pipe: the written and unread bytes, and the waiting tasks at both ends.
//!
//! The limits are those of Linux 6.18, measured by writing pieces of one size until the system refuses. A stream counts the memory of each piece
//! (`unix_stream_sendmsg`, `SKB_TRUESIZE`), so that many small writes fill a stream with fewer bytes than few large writes. A pipe counts pages (`pipe_write`).

use std::collections::VecDeque;
use std::io::{IoSlice, IoSliceMut};

use crate::core::waking::{Waiters, Woken};

/// Memory that the sender of a Unix socket may occupy \[byte\]: `net.core.wmem_default`.
pub(super) const SEND_BUFFER: usize = 212_992;

/// Largest piece of a stream \[byte\]: a head of one page, and 32 KiB in pages.
const PIECE: usize = HEAD + 32_768;

/// Bytes that fit into the first page of a piece beside the structures of the kernel \[byte\].
const HEAD: usize = PAGE - 320;

const PAGE: usize = 4096;

/// Pages of a pipe: `PIPE_DEF_BUFFERS`.
const PAGES: usize = 16;

/// Kind of a channel, which decides how many bytes the channel holds.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub(super) enum Law {
    Stream,
    Pipe,
}

/// Bytes of a single write. In a pipe, bytes on a page.
#[derive(Debug)]
struct Piece {
    bytes: Vec<u8>,
    /// Number of bytes at the beginning that were read.
    read: usize,
    /// Memory of the piece \[byte\]; for a pipe, one page.
    cost: usize,
}

#[derive(Debug)]
pub(super) struct Channel {
    law: Law,
    pieces: VecDeque<Piece>,
    /// Sum of the costs of all pieces.
    held: usize,
    /// Whether a write was refused for lack of room. As the edge of `epoll`, room for a quarter of the bytes does not end this state: see [`Channel::release`].
    is_blocked: bool,
    /// Number of ends that use this channel.
    pub(super) users: u8,
    /// `true` if nothing more is written: the writer has shut down or is gone.
    pub(super) is_ended: bool,
    /// `true` if the writer is gone without having read everything: the reader gets `ECONNRESET` once, after the bytes.
    pub(super) is_reset: bool,
    /// `true` if nobody reads any more.
    pub(super) is_unread: bool,
    pub(super) readers: Waiters,
    pub(super) writers: Waiters,
}

impl Channel {
    pub(super) fn new(law: Law) -> Self {
        Self {
            law,
            pieces: VecDeque::new(),
            held: 0,
            is_blocked: false,
            users: 2,
            is_ended: false,
            is_reset: false,
            is_unread: false,
            readers: Waiters::default(),
            writers: Waiters::default(),
        }
    }

    pub(super) fn is_empty(&self) -> bool {
        self.pieces.is_empty()
    }

    /// Returns whether a read returns at once.
    pub(super) fn is_readable(&self) -> bool {
        !self.is_empty() || self.is_ended || self.is_reset
    }

    /// Returns whether a write returns at once.
    pub(super) const fn is_writable(&self) -> bool {
        !self.is_blocked || self.is_ended || self.is_unread
    }

    /// Takes bytes out, and returns their number.
    pub(super) fn take(&mut self, buffers: &mut [IoSliceMut<'_>], woken: &mut Woken) -> usize {
        let mut count = 0;
        for buffer in buffers {
            let mut free = &mut buffer[..];
            while let Some(piece) = self.pieces.front_mut().filter(|_| !free.is_empty()) {
                let bytes = &piece.bytes[piece.read..];
                let taken = bytes.len().min(free.len());
                free[..taken].copy_from_slice(&bytes[..taken]);
                free = &mut free[taken..];
                piece.read += taken;
                count += taken;
                // The memory of a piece is free when all of the piece has been read.
                if piece.read == piece.bytes.len() {
                    self.held -= piece.cost;
                    self.pieces.pop_front();
                }
            }
        }
        self.release(woken);
        count
    }

    /// Drops all bytes.
    pub(super) fn clear(&mut self) {
        self.pieces.clear();
        self.held = 0;
    }

    /// Wakes the writers when there is room again: a free page, or three quarters of the memory (`unix_writable`).
    fn release(&mut self, woken: &mut Woken) {
        let has_room = match self.law {
            Law::Stream => self.held * 4 <= SEND_BUFFER,
            Law::Pipe => self.held < PAGES,
        };
        if self.is_blocked && has_room {
            self.is_blocked = false;
            self.writers.wake(woken);
        }
    }

    /// Takes as many of the bytes as there is room for, and returns their number; `None` if there is no room at all.
    pub(super) fn put(&mut self, buffers: &[IoSlice<'_>], woken: &mut Woken) -> Option<usize> {
        let joined;
        let bytes = match buffers {
            // A single buffer needs no copy. Several buffers are joined, because the pieces of a write do not depend on its division into buffers.
            [one] => &one[..],
            more => {
                joined = more.iter().flat_map(|buffer| buffer.iter().copied()).collect::<Vec<u8>>();
                &joined
            }
        };
        // As with Linux, an empty write to a stream or a pipe does nothing.
        if bytes.is_empty() {
            return Some(0);
        }
        // As with the edges of `epoll`, a refused writer stays refused until `release` has found enough room.
        if self.is_blocked {
            return None;
        }
        let count = match self.law {
            Law::Stream => self.put_pieces(bytes),
            Law::Pipe => self.put_pages(bytes),
        };
        if count == 0 {
            self.is_blocked = true;
            return None;
        }
        self.readers.wake(woken);
        Some(count)
    }

    fn put_pieces(&mut self, bytes: &[u8]) -> usize {
        let mut count = 0;
        for piece in bytes.chunks(PIECE) {
            // Linux compares before a piece is added, and so the last piece may exceed the buffer.
            if self.held >= SEND_BUFFER {
                break;
            }
            self.push(piece, piece_cost(piece.len()));
            count += piece.len();
        }
        count
    }

    fn put_pages(&mut self, bytes: &[u8]) -> usize {
        // The bytes beyond whole pages join the last page, if all of these bytes fit there.
        let rest = bytes.len() % PAGE;
        let mut count = 0;
        if rest > 0
            && let Some(last) = self.pieces.back_mut()
            && last.bytes.len() + rest <= PAGE
        {
            last.bytes.extend_from_slice(&bytes[..rest]);
            count = rest;
        }
        for page in bytes[count..].chunks(PAGE) {
            if self.held == PAGES {
                break;
            }
            self.push(page, 1);
            count += page.len();
        }
        count
    }

    fn push(&mut self, bytes: &[u8], cost: usize) {
        self.held += cost;
        self.pieces.push_back(Piece { bytes: bytes.to_vec(), read: 0, cost });
    }
}

/// Returns the memory of a piece of a stream \[byte\]: bytes beyond the head lie in whole pages, and the head shrinks by the rest of the last page.
fn piece_cost(len: usize) -> usize {
    let pages = pages_of(len.saturating_sub(HEAD));
    buffer_cost(len - pages.min(len)) + pages
}

/// Returns the size of the whole pages for `bytes` \[byte\].
pub(super) const fn pages_of(bytes: usize) -> usize {
    bytes.next_multiple_of(PAGE)
}

/// Returns the memory of a buffer of `bytes` in one block \[byte\]: 256 for the description, and the next power of two for the bytes and 320 more.
pub(super) fn buffer_cost(bytes: usize) -> usize {
    256 + (bytes + 320).next_power_of_two()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Writes pieces of `len` bytes until there is no room. Returns the bytes written, and the bytes that were read, 512 at a time, until there is room.
    fn fill(law: Law, len: usize) -> (usize, usize) {
        let (mut channel, mut woken) = (Channel::new(law), Woken::default());
        let piece = vec![7; len];
        let mut written = 0;
        while let Some(count) = channel.put(&[IoSlice::new(&piece)], &mut woken) {
            written += count;
        }
        let mut read = 0;
        while !channel.is_writable() {
            read += channel.take(&mut [IoSliceMut::new(&mut [0; 512])], &mut woken);
        }
        (written, read)
    }

    /// Measured on Linux 6.18 with a pair of sockets that do not block.
    #[test]
    fn a_stream_holds_as_much_as_linux() {
        for (len, expected) in [
            (1, 278),
            (100, 27_800),
            (256, 42_752),
            (700, 116_900),
            (1000, 93_000),
            (1728, 160_704),
            (1729, 84_721),
            (3776, 185_024),
            (3777, 166_188),
            (4096, 180_224),
            (8192, 196_608),
            (16_384, 212_992),
            (36_544, 219_264),
            (36_545, 219_269),
            (65_536, 233_152),
            (100_000, 236_544),
            (1_000_000, 219_264),
        ] {
            assert_eq!(fill(Law::Stream, len).0, expected, "{len}");
        }
        // The system says that there is room when three quarters of the memory are free.
        for (len, expected) in [(512, 64_512), (4096, 139_264), (16_384, 163_840)] {
            assert_eq!(fill(Law::Stream, len).1, expected, "{len}");
        }
    }

    #[test]
    fn a_pipe_holds_as_much_as_linux() {
        for (len, expected) in [(1, 65_536), (4096, 65_536), (4097, 45_066), (5000, 54_096), (10_000, 64_096), (100_000, 65_536)] {
            assert_eq!(fill(Law::Pipe, len), (expected, 4096), "{len}");
        }
        // A page has room for 40 of these, and is free when all of it has been read.
        assert_eq!(fill(Law::Pipe, 100), (64_000, 4096));
    }
}
