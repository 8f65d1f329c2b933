//! Window that this end offers, and the receive buffer behind the window.

use super::Connection;
use crate::config::TcpConfig;
use crate::segment::TIMESTAMPS_LENGTH;
use crate::tuning::{Tuning, whole_units};

impl Connection {
    /// Returns the most data per segment that this end accepts \[byte\].
    pub(super) fn advertised_mss(&self) -> usize {
        self.config.segment_room(self.local.is_ipv4()) - if self.receive.has_timestamps { TIMESTAMPS_LENGTH } else { 0 }
    }

    /// Returns the window to offer as the header has it, in units of the window scale, and moves the edge of the window. The window is the free part of the
    /// buffer, but never a small window (RFC 9293, section 3.8.6.2.2), and never moves the edge back.
    pub(super) fn offer_window(&mut self) -> u16 {
        let unit = 1u64 << self.receive.scale;
        let most = 65_535u64 << self.receive.scale;
        let current = self.receive.window();
        let (free, is_little) = self.free_window();
        if is_little {
            self.receive.quick = 0;
        }
        let window = free.max(current);
        // An unchanged window is rounded up to whole units, because rounding down would move its edge back.
        let window = whole_units(window, unit).min(most);
        self.receive.edge = self.receive.next + window;
        u16::try_from(window >> self.receive.scale).unwrap_or(u16::MAX)
    }

    /// Returns the window for which the receive buffer has room, and whether acknowledgements should wait because little room is left. The window is zero if
    /// less than half of the buffer is free, and the free part is below a sixteenth of the buffer or below a segment.
    pub(super) fn free_window(&self) -> (u64, bool) {
        let unit = 1 << self.receive.scale;
        match (&self.receive.tuning, self.config.receive_buffer) {
            (Some(tuning), _) => tuning.window(self.receive.assembler.memory(), unit, self.receive.segment, self.receive.offered()),
            (None, capacity) => {
                let capacity = capacity.unwrap_or(0);
                let free = capacity.saturating_sub(self.receive.assembler.unread());
                let is_little = free < capacity / 2 && (free < capacity / 16 || free < self.receive.segment);
                (if is_little { 0 } else { free as u64 & !(unit - 1) }, false)
            }
        }
    }
}

/// Returns the buffer that grows, unless the configuration fixes the receive buffer.
pub(super) fn tuning(config: &TcpConfig) -> Option<Tuning> {
    config.receive_buffer.is_none().then(|| Tuning::new(config.least_receive_buffer, config.greatest_receive_buffer))
}

/// Returns the window that a SYN offers, if segments have `mss` octets of data. The window of a SYN is never scaled (RFC 7323, section 2.2).
pub(super) fn first_window(config: &TcpConfig, mss: usize) -> u16 {
    let fixed = || u16::try_from(config.receive_buffer.unwrap_or(usize::MAX)).unwrap_or(u16::MAX);
    tuning(config).map_or_else(fixed, |tuning| tuning.first_window(mss))
}
