//! Where datagrams are put when they are read, many at a time.

use core::fmt;
use std::io::IoSliceMut;

use quinn_udp::{BATCH_SIZE, RecvMeta};

/// Room for one batch, to be shared by all sockets of a thread: 2 MB, of which the kernel gives the touched pages.
pub struct ReceiveBuffers {
    bytes: Vec<u8>,
    pub(super) told: [RecvMeta; BATCH_SIZE],
}

/// No datagram is longer than 65,527 bytes (that is IPv6), nor are segments that the kernel has put together: nothing is ever cut off. Not a power of two,
/// so that the beginnings of all datagrams of a batch do not share one set of the processor's cache.
const ROOM: usize = 65_536 + 256;

impl Default for ReceiveBuffers {
    fn default() -> Self {
        Self::new()
    }
}

impl ReceiveBuffers {
    /// Empty ones.
    #[must_use]
    pub fn new() -> Self {
        Self { bytes: vec![0; ROOM * BATCH_SIZE], told: [RecvMeta::default(); BATCH_SIZE] }
    }

    /// The rooms, one for each datagram, and what will be told of each.
    pub(super) fn rooms(&mut self) -> ([IoSliceMut<'_>; BATCH_SIZE], &mut [RecvMeta; BATCH_SIZE]) {
        let mut rooms = self.bytes.chunks_exact_mut(ROOM);
        (core::array::from_fn(|_| IoSliceMut::new(rooms.next().unwrap_or_default())), &mut self.told)
    }

    /// What was read into that room.
    pub(super) fn room(&self, place: usize, len: usize) -> &[u8] {
        let start = place * ROOM;
        self.bytes.get(start..start + len.min(ROOM)).unwrap_or_default()
    }
}

impl fmt::Debug for ReceiveBuffers {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.debug_struct("ReceiveBuffers").finish_non_exhaustive()
    }
}
