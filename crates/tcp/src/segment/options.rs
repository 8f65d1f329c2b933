//! The options of the TCP header.

use alloc::vec::Vec;

/// The options that this crate reads and writes. Others are skipped.
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug)]
pub struct Options {
    /// The largest segment that the sender takes \[byte\], without headers (RFC 9293, section 3.7.1). On a SYN alone.
    pub mss: Option<u16>,
    /// By how many bits windows are shifted (RFC 7323, section 2). On a SYN alone.
    pub window_scale: Option<u8>,
    /// Whether the sender takes selective acknowledgements (RFC 2018). On a SYN alone.
    pub sack_permitted: bool,
    /// The value and the echo of the timestamps option (RFC 7323, section 3) \[ticks\].
    pub timestamps: Option<(u32, u32)>,
    /// Blocks that have arrived out of order (RFC 2018), or the duplicate before them (RFC 2883).
    pub sack: SackBlocks,
}

/// Up to four blocks of sequence numbers, each from its start to its end (exclusive).
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug)]
pub struct SackBlocks {
    blocks: [(u32, u32); 4],
    count: u8,
}

impl SackBlocks {
    /// Adds a block; a fifth is left out.
    pub fn push(&mut self, start: u32, end: u32) {
        if let Some(block) = self.blocks.get_mut(usize::from(self.count)) {
            *block = (start, end);
            self.count += 1;
        }
    }

    /// The blocks.
    #[must_use]
    pub fn as_slice(&self) -> &[(u32, u32)] {
        &self.blocks[..usize::from(self.count)]
    }

    /// Leaves at most `count` blocks.
    pub fn truncate(&mut self, count: usize) {
        self.count = self.count.min(u8::try_from(count).unwrap_or(u8::MAX));
        self.blocks[usize::from(self.count)..].fill((0, 0));
    }
}

/// What the timestamps option takes, with its padding \[byte\].
pub(crate) const TIMESTAMPS_LENGTH: usize = 12;

/// The room for options in the header \[byte\].
const ROOM: usize = 40;

impl Options {
    /// What the options take in the header \[byte\], a multiple of four.
    pub(crate) fn length(&self) -> usize {
        match self.blocks_that_fit() {
            0 => self.fixed_length(),
            blocks => self.fixed_length() + 4 + 8 * blocks,
        }
    }

    /// What all but the blocks take \[byte\].
    fn fixed_length(&self) -> usize {
        let timestamps_or_sack = match (self.timestamps, self.sack_permitted) {
            (Some(_), _) => TIMESTAMPS_LENGTH,
            (None, is_permitted) => 4 * usize::from(is_permitted),
        };
        4 * usize::from(self.mss.is_some()) + timestamps_or_sack + 4 * usize::from(self.window_scale.is_some())
    }

    /// How many of the blocks are written: three at most beside timestamps.
    fn blocks_that_fit(&self) -> usize {
        self.sack.as_slice().len().min((ROOM - self.fixed_length()).saturating_sub(4) / 8)
    }

    /// Writes the options in the order in which Linux does.
    pub(crate) fn write(&self, to: &mut Vec<u8>) {
        if let Some(mss) = self.mss {
            to.extend([2, 4]);
            to.extend(mss.to_be_bytes());
        }
        if self.sack_permitted {
            to.extend([4, 2]);
            if self.timestamps.is_none() {
                to.extend([1, 1]);
            }
        }
        if let Some((value, echo)) = self.timestamps {
            if !self.sack_permitted {
                to.extend([1, 1]);
            }
            to.extend([8, 10]);
            to.extend(value.to_be_bytes());
            to.extend(echo.to_be_bytes());
        }
        if let Some(scale) = self.window_scale {
            to.extend([1, 3, 3, scale]);
        }
        let blocks = &self.sack.as_slice()[..self.blocks_that_fit()];
        if let Ok(count @ 1..) = u8::try_from(blocks.len()) {
            to.extend([1, 1, 5, 2 + 8 * count]);
            for (start, end) in blocks {
                to.extend(start.to_be_bytes());
                to.extend(end.to_be_bytes());
            }
        }
    }

    /// Reads options. A malformed one ends the list, as in Linux.
    pub(crate) fn read(mut bytes: &[u8]) -> Self {
        let mut options = Self::default();
        while let [kind, rest @ ..] = bytes {
            match kind {
                0 => break,
                1 => bytes = rest,
                _ => {
                    let Some(length) = rest.first().map(|length| usize::from(*length)).filter(|length| *length >= 2) else { break };
                    let Some(value) = bytes.get(2..length) else { break };
                    options.read_one(*kind, value);
                    bytes = &bytes[length..];
                }
            }
        }
        options
    }

    fn read_one(&mut self, kind: u8, value: &[u8]) {
        match (kind, value) {
            (2, &[high, low]) => self.mss = Some(u16::from_be_bytes([high, low])),
            (3, &[scale]) => self.window_scale = Some(scale),
            (4, []) => self.sack_permitted = true,
            (5, blocks) => {
                for block in blocks.chunks_exact(8) {
                    if let [a, b, c, d, e, f, g, h] = *block {
                        self.sack.push(u32::from_be_bytes([a, b, c, d]), u32::from_be_bytes([e, f, g, h]));
                    }
                }
            }
            (8, &[a, b, c, d, e, f, g, h]) => self.timestamps = Some((u32::from_be_bytes([a, b, c, d]), u32::from_be_bytes([e, f, g, h]))),
            _ => {}
        }
    }
}
