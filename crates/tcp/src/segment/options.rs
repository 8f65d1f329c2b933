//! Options of the TCP header: values, length, and octets.

use alloc::vec::Vec;

/// Options that this crate reads and writes. [`Segment::parse`](crate::Segment::parse) skips all other options.
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug)]
pub struct Options {
    /// Maximum segment size: most data per segment that the sender accepts \[byte\], without headers (RFC 9293, section 3.7.1). Only on a SYN.
    pub mss: Option<u16>,
    /// Number of bits by which the sender's windows are shifted (RFC 7323, section 2). Only on a SYN.
    pub window_scale: Option<u8>,
    /// `true` if the sender understands selective acknowledgements (RFC 2018). Only on a SYN.
    pub sack_permitted: bool,
    /// Value and echo of the timestamps option (RFC 7323, section 3) \[ticks\].
    pub timestamps: Option<(u32, u32)>,
    /// Blocks that have arrived out of order (RFC 2018). If a duplicate arrived, the first block is the duplicate (RFC 2883).
    pub sack: SackBlocks,
}

/// At most four blocks of sequence numbers, each from its start to its end (exclusive).
#[derive(Clone, Copy, PartialEq, Eq, Default, Debug)]
pub struct SackBlocks {
    /// Blocks in the first `count` entries. All other entries are `(0, 0)`, so that the derived equality compares only blocks.
    blocks: [(u32, u32); 4],
    count: u8,
}

impl SackBlocks {
    /// Appends a block. Does nothing if there are four blocks already.
    pub fn push(&mut self, start: u32, end: u32) {
        if let Some(block) = self.blocks.get_mut(usize::from(self.count)) {
            *block = (start, end);
            self.count += 1;
        }
    }

    /// Returns the blocks in the order in which they were added.
    #[must_use]
    pub fn as_slice(&self) -> &[(u32, u32)] {
        &self.blocks[..usize::from(self.count)]
    }

    /// Removes blocks from the end until at most `count` are left.
    pub fn truncate(&mut self, count: usize) {
        self.count = self.count.min(u8::try_from(count).unwrap_or(u8::MAX));
        self.blocks[usize::from(self.count)..].fill((0, 0));
    }
}

/// Length of the timestamps option with two octets of padding \[byte\].
pub(crate) const TIMESTAMPS_LENGTH: usize = 12;

/// Room for options in the TCP header \[byte\]: at most 15 words of four octets, of which the fixed header takes five.
const ROOM: usize = 40;

impl Options {
    /// Returns the length of the options in the header \[byte\], a multiple of four.
    pub(crate) fn length(&self) -> usize {
        match self.blocks_that_fit() {
            0 => self.fixed_length(),
            blocks => self.fixed_length() + 4 + 8 * blocks,
        }
    }

    /// Returns the length of all options but the blocks \[byte\].
    fn fixed_length(&self) -> usize {
        // `write` puts the two octets of SACK-permitted into the place of the padding of the timestamps, so that both options take the length of one.
        let timestamps_or_sack = match (self.timestamps, self.sack_permitted) {
            (Some(_), _) => TIMESTAMPS_LENGTH,
            (None, is_permitted) => 4 * usize::from(is_permitted),
        };
        4 * usize::from(self.mss.is_some()) + timestamps_or_sack + 4 * usize::from(self.window_scale.is_some())
    }

    /// Returns the number of blocks that fit into the header: four, or three beside timestamps.
    fn blocks_that_fit(&self) -> usize {
        // Two octets of padding, kind and length take four octets. Each block takes eight.
        self.sack.as_slice().len().min((ROOM - self.fixed_length()).saturating_sub(4) / 8)
    }

    /// Appends the octets of the options to `to`, in the order of Linux. The number of octets is that of [`length`](Self::length).
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

    /// Reads the option part of a header. A malformed option ends the list, as in Linux. An option that occurs twice has its last value.
    pub(crate) fn read(mut bytes: &[u8]) -> Self {
        let mut options = Self::default();
        while let [kind, rest @ ..] = bytes {
            match kind {
                // Kind 0 ends the list. Kind 1 is padding and has no length octet.
                0 => break,
                1 => bytes = rest,
                _ => {
                    // The length counts the octets of kind and length as well, so that a length below 2 is malformed and would never advance.
                    let Some(length) = rest.first().map(|length| usize::from(*length)).filter(|length| *length >= 2) else { break };
                    let Some(value) = bytes.get(2..length) else { break };
                    options.read_one(*kind, value);
                    bytes = &bytes[length..];
                }
            }
        }
        options
    }

    /// Takes over one option. An unknown kind, or a known kind with a wrong length, changes nothing.
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
